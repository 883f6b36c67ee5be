// SPDX-License-Identifier: GPL-3.0-or-later
// Which soft objects are worth their voxels: where the coupling or the device is so soft that a hand could
// not tell tissue from rigid, a proxy on its surface feels the same at a thousandth of the cost.
#pragma once

#include "hybrid/scene/scene.h"

namespace hybrid {

// A soft object as the rigid one of the same shape.
[[nodiscard]] RigidDescription as_rigid(const SoftDescription& soft);

// Secant stiffness F/d of a half-space that a tool presses with `force_N` (N/m): a ball, Hertz's
// F = 4/3 E* √R d^(3/2); a flat punch, F = 2 a E* d; with E* = E/(1 − ν²) (Johnson, Contact Mechanics, 4.2
// and 3.3). Tissue that is thin for the contact, and held below, is stiffer than that.
[[nodiscard]] double secant_stiffness_N_per_m(const Material& material, const Tool& tool, double force_N);

// Turns every soft object that asks to be one, or that asks for what is enough and needs no voxels, into a
// rigid one, and notes for each object with `model` what it became and why (Scene::model_notes).
void choose_models(Scene& scene);

}  // namespace hybrid
