// SPDX-License-Identifier: GPL-3.0-or-later
// Closed forms of the force on the hand, in series with the coupling. They are references for `compare` and
// for tests.
#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>

#include "hybrid/scene/scene.h"

namespace hybrid {

// Depth of the device point in a shape grown by the tool's radius, and the direction of the way out. A punch
// does not grow the shape. Negative: outside.
struct Depth {
  double depth_m = 0.0;
  glm::dvec3 out{0.0, 0.0, 1.0};  // unit vector, scene's frame
};

// A shape for which the force has a closed form. `young_Pa` 0: rigid. closed_form_of() returns none for other
// shapes.
struct ClosedForm {
  enum class Shape : std::uint8_t { ball, box } shape = Shape::ball;
  Pose pose;
  glm::dvec3 half_size_m{0.0};  // of the box; for a ball, x is the radius
  double young_Pa = 0.0, poisson = 0.3;
  std::string caveat;  // simplifications of the closed form, in words
};
std::optional<ClosedForm> closed_form_of(const RigidDescription& rigid);
std::optional<ClosedForm> closed_form_of(const Scene& scene, const SoftDescription& soft);

Depth depth_in(const ClosedForm& form, const Tool& tool, const glm::dvec3& device_m);

// Force on the hand at a depth of the device (N). Rigid: K·d. Ball tool on tissue: Hertz, F = 4/3·E*·√R·δ^1.5
// with 1/R = 1/R_tool + 1/R_object. Flat punch on tissue: F = 2·a·E*·δ. Tissue and coupling are in series, so
// the indentation δ solves K(d − δ) = F(δ).
double force_at(const ClosedForm& form, const Tool& tool, double depth_m);
const char* law_of(const ClosedForm& form, const Tool& tool);

}  // namespace hybrid
