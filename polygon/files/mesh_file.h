// SPDX-License-Identifier: GPL-3.0-or-later
// Reads mesh files, and writes PLY files. write_mesh.h writes other formats, and writes to streams. This is
// the only part of the project that knows OpenMesh. Every file is prescanned first (prescan.h). Everything
// that is left out is reported.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// A file that cannot be used. what() says what is wrong, where, and what to do.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct MeshFileOptions {
  double scale = 1.0;  // meters per file unit, e.g. 0.001 for mm
  // Larger files are refused before memory is taken for them.
  std::uint64_t max_bytes = 4ULL * 1024 * 1024 * 1024;
};

struct MeshFile {
  TriangleMesh mesh;              // meters; unusable elements are left out and reported below
  std::vector<Finding> findings;  // everything that could not be kept as it was in the file
};

// OBJ, PLY, STL and OFF, each also as .gz; the extension is case-insensitive. Non-manifold faces are kept.
// Elements that cannot be kept (vertices that are not finite, indices out of range) are left out and
// reported. Throws MeshError if the file is missing, unreadable, of unknown format, truncated or larger than
// max_bytes, or if no triangle is left.
MeshFile load_mesh(const std::filesystem::path& file, const MeshFileOptions& options = {});

// Writes binary PLY, with coordinates in meters. The file is written under a temporary name beside `file` and
// then renamed, so `file` is never incomplete. Throws MeshError.
void save_ply(const std::filesystem::path& file, const TriangleMesh& mesh);

}  // namespace polygon
