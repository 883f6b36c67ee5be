// SPDX-License-Identifier: GPL-3.0-or-later
// Makes the fixed parts of a built scene for graphics.
#pragma once

#include <string>

#include "hybrid/build/build_world.h"
#include "hybrid/scene/scene.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Returns the surfaces at rest. Those of soft objects also have the materials beneath them. Labels are read
// from the lattices, so a scene that is not drawn stores nothing for drawing. A drawn scene stores a byte per
// vertex of each object with several visible materials. `built` must have been built from `scene`.
DrawnScene drawn_scene(const Scene& scene, const BuiltScene& built, const std::string& title);

}  // namespace hybrid
