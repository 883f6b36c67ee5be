// SPDX-License-Identifier: GPL-3.0-or-later
// How smooth tissue feels: along a stroke, how much larger a tick's step of force is than that of the
// equilibrium at the same places of the tool, and what work the tissue does over a closed path.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "hybrid/scene/scene.h"

namespace hybrid::bench {

enum class Smooth : std::uint8_t { homogeneous, layered, oblique };
const char* smooth_name(Smooth block);

// A ball on a block of 1 mm voxels, or on the side of a ball of them, where no layer lies along the surface.
struct StrokeCase {
  Smooth block = Smooth::homogeneous;
  double radius_spacings = 4.0;
  double depth_spacings = 2.0;
  double speed_m_per_s = 0.03;
  double slide_spacings = 0.0;  // at full depth; 0: pressed and lifted
};

// The scene of it, without a path.
Scene stroke_scene(const StrokeCase& stroke);
// Where the device goes: corners in scene frame (m), the first and the last in free space.
std::vector<glm::dvec3> stroke_corners(const StrokeCase& stroke);

struct StrokeResult {
  std::uint64_t ticks = 0;  // in contact
  // The steps that a tick's force takes beyond those of the equilibrium, in JND of the equilibrium's force.
  double excess_p50_jnd = 0.0, excess_p99_jnd = 0.0, excess_max_jnd = 0.0, excess_max_N = 0.0;
  double excess_at_tick = 0.0;  // where the largest is
  double error_max_jnd = 0.0;   // of the force itself
  double force_max_N = 0.0;
  double unsettled_share = 0.0;  // of the equilibria, not within the tolerance
};

// Ticks along straight lines through `corners` at a speed; beside them, a copy of the object at equilibrium
// with the tool where the proxy is.
StrokeResult measure_stroke(const Scene& scene, const std::vector<glm::dvec3>& corners, double speed_m_per_s);

// The same without a reference: the work that the force on the device does along the way (J), by the
// trapezoidal rule: the force held for a tick while the hand goes on puts out K·v²·T a second of its own,
// which is the sampling's and not the tissue's (device/README.md).
double work_of_stroke(const Scene& scene, const std::vector<glm::dvec3>& corners, double speed_m_per_s);

}  // namespace hybrid::bench
