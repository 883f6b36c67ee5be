// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh files in and out. The only part of the project that knows OpenMesh.
#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// A file that cannot be used: what() says what is wrong, where, and what to do next.
class MeshError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct MeshFileOptions {
  double scale = 1.0;                                   // file unit to meter, e.g. 0.001 for mm
  std::uint64_t max_bytes = 4ULL * 1024 * 1024 * 1024;  // refused above, with the numbers, before allocation
};

struct MeshFile {
  TriangleMesh mesh;              // meters; unusable elements left out, each kind reported below
  std::vector<Finding> findings;  // what the file had that could not be kept as it was, never silent
};

// OBJ, PLY, STL and OFF, each also as .gz; extension case-insensitive. Non-manifold faces are kept (the mesh
// is a soup). Elements that cannot be kept (vertices not finite, indices out of range) are left out and
// reported. Throws MeshError: missing, unreadable, unknown kind, truncated, no triangle left, larger than
// max_bytes.
MeshFile load_mesh(const std::filesystem::path& file, const MeshFileOptions& options = {});

// Writes PLY, binary, coordinates in meters. Throws MeshError.
void save_ply(const std::filesystem::path& file, const TriangleMesh& mesh);

}  // namespace polygon
