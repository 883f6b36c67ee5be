// SPDX-License-Identifier: GPL-3.0-or-later
// Deformed surfaces and volumes of a session, as files for other programs.
#pragma once

#include <filesystem>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

// Writes the present surfaces of all objects as one mesh in the scene's frame. The ending selects the format:
// .stl and .obj in millimeters, as scenes read them; any other is PLY in meters, with that unit in its
// header. Throws std::runtime_error in words.
void save_surfaces(const std::filesystem::path& file, const BuiltScene& built);

// Writes two volumes for each soft object: the displacement field and the moved labels (millimeters). Their
// frame is that of the volume from which the object was read, before the scene's position and rotation. So
// they lie on that volume. With one soft object the field is written to `file`. With several, the object's
// name stands before the ending. The name of the labels' file has "-labels" there. Returns the files that
// were written. Throws std::runtime_error in words: no soft object, an ending that is no volume's, a file
// that cannot be written.
std::vector<std::filesystem::path> save_volumes(const std::filesystem::path& file, const Scene& scene,
                                                const BuiltScene& built);
// The names of the files that save_volumes() would write. Throws as save_volumes() does.
std::vector<std::filesystem::path> saved_volume_names(const std::filesystem::path& file, const Scene& scene);

}  // namespace hybrid
