// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/build/load_scene.h"

#include "hybrid/build/choose_model.h"

namespace hybrid {

Scene load_scene(const std::filesystem::path& file) {
  Scene scene = read_scene(file);
  choose_models(scene);
  return scene;
}

}  // namespace hybrid
