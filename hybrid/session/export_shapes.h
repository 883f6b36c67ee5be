// SPDX-License-Identifier: GPL-3.0-or-later
// What a session leaves behind for other programs: deformed surfaces and volumes.
#pragma once

#include <filesystem>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

// The surfaces of all objects as they are now, rigid ones where they are, in the scene's frame (meters), as
// one PLY. Replaces the file in whole or not at all. Throws std::runtime_error in words.
void save_surfaces(const std::filesystem::path& file, const BuiltScene& built);

// For each soft object a displacement field and the labels where the tissue is now, in millimeters, in the
// object's own frame: that of the volume it came from, before the scene's position and rotation, so that they
// lie on that volume. With one soft object the field is `file`, with several the object's name is put before
// the ending; the labels' name ends in "-labels" before it. Returns what was written. Throws in words: no
// soft object, an ending that is no volume's, a file that cannot be written.
std::vector<std::filesystem::path> save_volumes(const std::filesystem::path& file, const Scene& scene,
                                                const BuiltScene& built);
// The names that save_volumes() would write to; throws as it does.
std::vector<std::filesystem::path> saved_volume_names(const std::filesystem::path& file, const Scene& scene);

}  // namespace hybrid
