// SPDX-License-Identifier: GPL-3.0-or-later
// Finds keys of a scene file that are valid by themselves but have no effect with the other keys.
#pragma once

#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {

// Lists these keys in Scene::unused_keys, each with the reason. `root` is the whole file, from which `scene`
// was read without an error.
void note_unused_keys(const TableReader& root, Scene& scene);

}  // namespace hybrid
