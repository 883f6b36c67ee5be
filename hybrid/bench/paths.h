// SPDX-License-Identifier: GPL-3.0-or-later
// The goals that `hybrid bench rigid` drives the proxy along: closed formulas, so that anyone can replay them
// to the digit against another renderer. A goal is where the device is in one tick of 1 ms.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

namespace hybrid::bench {

inline constexpr double kTick_s = 1e-3;
inline constexpr double kSphereRadius_m = 0.05;  // of the ball the sphere paths are made for
inline constexpr double kCubeHalf_m = 0.05;      // of the cube the edge path is made for
inline constexpr double kCornerSize_m = 0.1;     // edge of the three quarter planes of the corner paths
inline constexpr double kSlideDepth_m = 0.005;   // goal below the sphere
inline constexpr double kHoverGap_m = 0.001;     // tool above the sphere

struct GoalPath {
  std::vector<glm::dvec3> goals;      // [tick], scene frame (unit: meter)
  std::vector<std::uint32_t> starts;  // ticks before which the proxy is put at the goal; ascending, 0 first
  std::uint32_t counted_from = 0;     // ticks before this lead in and are not counted
  // [tick] where the ideal proxy is (unit: meter); empty: no closed form
  std::vector<glm::dvec3> reference;
  std::vector<glm::dvec3> body_m;  // [tick] where the body's origin is; empty: it rests at the scene's
};

// SplitMix64 (Steele, Lea & Flood 2014): the same draws on every machine, unlike <random>'s distributions.
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() noexcept;
  double unit() noexcept;           // in [0, 1)
  glm::dvec3 direction() noexcept;  // two draws

 private:
  std::uint64_t state_;
};

// The spiral over the unit sphere from near one pole to near the other in 20 s, such that a point at
// kSphereRadius_m moves at exactly `speed_m_s`. The motion from pole to pole alone is 6.4 mm/s, the least.
glm::dvec3 spiral_direction(double t_s, double speed_m_s);
double least_spiral_speed_m_s();

// Where the ideal proxy is for a goal near the sphere: on it when the goal is inside, at the goal otherwise.
glm::dvec3 sphere_reference(const glm::dvec3& goal, double tool_radius_m);

// Sphere: far off (a circle 0.3 m away), 1 mm above it, pressed and drawn over it 5 mm deep (the press leads
// in), and tapped right into it at 2 m/s, each tap from a fresh start.
GoalPath far_path(int ticks = 5000);
GoalPath hover_path(double tool_radius_m, double speed_m_s, int ticks = 20000);
GoalPath slide_path(double tool_radius_m, double speed_m_s, int ticks = 20000);
GoalPath tap_path(double tool_radius_m, int taps = 5000);

// Mesh of a file whose vertices lie within kSphereRadius_m of the origin: as the slide, but kSlideDepth_m
// below the surface that is met first along the way to the origin. `surface_m` gives its distance from the
// origin by direction; where it is empty, the last distance holds. A point at kSphereRadius_m moves at
// `speed_m_s`. No closed form.
GoalPath drape_path(double tool_radius_m, double speed_m_s, int ticks,
                    const std::function<std::optional<double>(const glm::dvec3&)>& surface_m);

// Cube: over a face, off its edge, along the next face and round again, in steps of 0.1 mm.
GoalPath edge_path(double tool_radius_m, int laps = 10);

// Corner: along one plane into the second and into the third, a pause, a wiggle, and the way back.
// `symmetric`: the goal runs in the plane of mesh edges, where a ray between goal and proxy meets them
// exactly.
GoalPath corner_path(double tool_radius_m, bool symmetric, int laps = 10);
// Corner: three sines through it, at about 1 m/s.
GoalPath cornerfast_path(double tool_radius_m, int ticks = 20000);

// The tool rests and the body moves, each lap along another direction and past the tool's place at another
// distance: halfway over the tool, back, and then right over it. No closed form (the way round is the
// body's).
GoalPath moving_path(double speed_m_s, int laps);
int moving_laps(double speed_m_s);  // about 20,000 ticks' worth

}  // namespace hybrid::bench
