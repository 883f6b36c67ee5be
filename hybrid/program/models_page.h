// SPDX-License-Identifier: GPL-3.0-or-later
// The page of `hybrid compare SCENE --models --report DIR`.
#pragma once

#include <string>

#include "hybrid/models/models_in_scene.h"
#include "hybrid/page/page.h"

namespace hybrid {

Page models_in_scene_page(const ModelsInScene& models, const std::string& title);

}  // namespace hybrid
