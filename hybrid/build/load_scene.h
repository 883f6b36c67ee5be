// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a scene file and decides the model of each object.
#pragma once

#include <filesystem>

#include "hybrid/scene/scene.h"

namespace hybrid {

// read_scene(), then choose_models(). Throws SceneError.
[[nodiscard]] Scene load_scene(const std::filesystem::path& file);

}  // namespace hybrid
