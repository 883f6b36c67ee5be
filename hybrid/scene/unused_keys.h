// SPDX-License-Identifier: GPL-3.0-or-later
// Keys of a scene file that are right by themselves and have no effect beside the others.
#pragma once

#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {

// Lists them in Scene::unused_keys, each with the reason. `root` is the whole file, from which `scene` was
// read without an error.
void note_unused_keys(const TableReader& root, Scene& scene);

}  // namespace hybrid
