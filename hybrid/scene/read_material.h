// SPDX-License-Identifier: GPL-3.0-or-later
// The materials of a scene: [material.NAME].
#pragma once

#include <string>

#include "hybrid/scene/table_reader.h"

namespace hybrid {

// Adds every material to the scene.
void read_materials(const TableReader& table, Scene& scene);

// Refuses a material that the scene does not have. An empty name means the default material.
void check_material(const SceneSource& source, const Scene& scene, const SoftDescription& soft,
                    const std::string& name, SourcePlace place);

}  // namespace hybrid
