// SPDX-License-Identifier: GPL-3.0-or-later
// Decides which soft objects need voxels. A proxy on the surface takes a thousandth of the time. If coupling
// or device are so soft that a hand could not tell tissue from a rigid surface, the proxy is enough.
#pragma once

#include "hybrid/scene/scene.h"

namespace hybrid {

// A rigid object with the shape of the soft one.
[[nodiscard]] RigidDescription as_rigid(const SoftDescription& soft);

// Secant stiffness F/d of a half-space under a tool with `force_N` (N/m). Ball: Hertz, F = 4/3 E* √R d^(3/2).
// Flat punch: F = 2 a E* d. E* = E/(1 − ν²) (Johnson, Contact Mechanics, 4.2 and 3.3). Tissue that is thin
// relative to the contact and fixed below is stiffer.
[[nodiscard]] double secant_stiffness_N_per_m(const Material& material, const Tool& tool, double force_N);

// Replaces soft objects by rigid ones if their model is `proxy`, or if it is `automatic` and voxels are not
// needed. Notes the result and its reason for each object whose model is not `voxels` (Scene::model_notes).
void choose_models(Scene& scene);

// Greatest force that a tick of the scene may give (N). `max_force` never raises it above the device's own
// limit. A device without a limit (ideal) gets that of ForceLimits.
[[nodiscard]] double greatest_force_N(const Scene& scene) noexcept;

}  // namespace hybrid
