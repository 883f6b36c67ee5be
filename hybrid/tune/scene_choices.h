// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of a scene while it is felt: those that its objects allow, and the scene's text after a change.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "hybrid/scene/scene.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// The choices of each drawn object and of the tool. None is open if a rigid object moves, or with a real
// device, whose hand would not stand still meanwhile. `as_read`: from read_scene(), with models as written.
// Reads the headers of volumes. Throws SceneError, std::exception.
void add_choices(const Scene& as_read, DrawnScene& drawn);

// The scene's text after the changes; comments stay. Throws SceneError if `text` is no scene, and
// std::runtime_error that says why a change cannot be made: no such object or material, or the text cannot be
// edited safely.
[[nodiscard]] std::string changed_text(const std::string& text, const std::filesystem::path& file,
                                       std::span<const SceneChange> changes);

// The scene's text with a further rigid object: the mesh of this file, at its own coordinates, in the scene's
// unit. The object has the name of the file, with a number if the scene has that name.
[[nodiscard]] std::string text_with_mesh(const std::string& text, const std::filesystem::path& file,
                                         const std::filesystem::path& mesh);

// A change in words: "block: as rigid", "fat: 3 kPa".
[[nodiscard]] std::string in_words(const SceneChange& change);

}  // namespace hybrid
