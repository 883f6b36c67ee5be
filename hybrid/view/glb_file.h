// SPDX-License-Identifier: GPL-3.0-or-later
// The surfaces of a scene as binary glTF 2.0, for graphics engines and viewers.
#pragma once

#include <filesystem>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Writes the surfaces of all objects as they are at the snapshot, one mesh and node for each object with its
// name, in meters. Positions, normals and colours are those of pictures. In glTF y is up, so the root node
// turns the scene's z to y. Below this node everything is in the scene's frame. `now` is filled by
// fill_moved(). Throws std::runtime_error in words: no surface, more than 4 GB, a file that cannot be
// written.
void save_glb(const std::filesystem::path& file, const DrawnScene& scene, const Snapshot& now);

}  // namespace hybrid
