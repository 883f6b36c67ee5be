// SPDX-License-Identifier: GPL-3.0-or-later
// From a scene that is built to what graphics may know of it.
#pragma once

#include <string>

#include "hybrid/build/build_world.h"
#include "hybrid/scene/scene.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Surfaces at rest, with the materials beneath those of soft objects. The labels are read from the lattices:
// a scene that is not drawn carries nothing for it, and one that is drawn a byte a vertex of an object that
// shows several materials. `built` must be of `scene`.
DrawnScene drawn_scene(const Scene& scene, const BuiltScene& built, const std::string& title);

}  // namespace hybrid
