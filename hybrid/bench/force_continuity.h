// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothness of the tissue's force along a stroke. The step of a tick's force is compared with that of the
// equilibrium at the same places of the tool. The work of the tissue over a closed path is measured too.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "hybrid/scene/scene.h"

namespace hybrid::bench {

enum class Smooth : std::uint8_t { homogeneous, layered, oblique };
const char* smooth_name(Smooth block);

// The tool is a ball. It strokes the top of a block of 1 mm voxels, or the side of a ball of such voxels. On
// the ball no layer of voxels lies along the surface.
struct StrokeCase {
  Smooth block = Smooth::homogeneous;
  double radius_spacings = 4.0;
  double depth_spacings = 2.0;
  double speed_m_per_s = 0.03;
  double slide_spacings = 0.0;  // length of the slide at full depth; 0: only pressed and lifted
};

// The scene of a stroke, without a path.
Scene stroke_scene(const StrokeCase& stroke);
// Corners of the device's path in the scene's frame (m). The first and the last are in free space.
std::vector<glm::dvec3> stroke_corners(const StrokeCase& stroke);

struct StrokeResult {
  std::uint64_t ticks = 0;  // in contact
  // Excess: length of the step of the tick's force minus that of the equilibrium's force; 0 if negative.
  // Unit: JND of the equilibrium's force, or N.
  double excess_p50_jnd = 0.0, excess_p99_jnd = 0.0, excess_max_jnd = 0.0, excess_max_N = 0.0;
  double excess_at_tick = 0.0;  // tick with the largest excess
  double error_max_jnd = 0.0;   // error of the force itself
  double force_max_N = 0.0;
  double unsettled_share = 0.0;  // share of the equilibria that were not within the tolerance
};

// Plays ticks along straight lines through `corners`. For each tick a copy of the object is brought to rest,
// with the tool at the proxy's place.
StrokeResult measure_stroke(const Scene& scene, const std::vector<glm::dvec3>& corners, double speed_m_per_s);

// Work of the force on the device along the path (J), by the trapezoidal rule. No reference is computed. The
// rule excludes the work of sampling: a force that is held for a tick while the hand moves on gives out
// ½·K·v²·T per second (device/README.md).
double work_of_stroke(const Scene& scene, const std::vector<glm::dvec3>& corners, double speed_m_per_s);

}  // namespace hybrid::bench
