// SPDX-License-Identifier: GPL-3.0-or-later
// The goals along which `hybrid bench rigid` drives the proxy. They are closed formulas, so anyone can replay
// them exactly with another renderer. A goal is the device's position in one tick of 1 ms.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

namespace hybrid::bench {

inline constexpr double kTick_s = 1e-3;
inline constexpr double kSphereRadius_m = 0.05;  // radius of the ball for the sphere paths
inline constexpr double kCubeHalf_m = 0.05;      // half edge of the cube for the edge path
inline constexpr double kCornerSize_m = 0.1;     // edge of the three quarter planes for the corner paths
inline constexpr double kSlideDepth_m = 0.005;   // depth of the goal below the sphere
inline constexpr double kHoverGap_m = 0.001;     // gap between tool and sphere

struct GoalPath {
  std::vector<glm::dvec3> goals;  // [tick]; scene's frame (m)
  // Before these ticks the proxy is placed at the goal; ascending, 0 first.
  std::vector<std::uint32_t> starts;
  std::uint32_t counted_from = 0;  // earlier ticks only lead in, and do not count
  // [tick]; position of the ideal proxy (m). Empty: there is no closed form.
  std::vector<glm::dvec3> reference;
  // [tick]; position of the body's origin; empty: it stays at the scene's origin.
  std::vector<glm::dvec3> body_m;
};

// SplitMix64 (Steele, Lea & Flood 2014). Unlike <random>'s distributions it draws the same numbers on every
// machine.
class SplitMix64 {
 public:
  explicit SplitMix64(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() noexcept;
  double unit() noexcept;           // in [0, 1)
  glm::dvec3 direction() noexcept;  // unit vector; takes two draws

 private:
  std::uint64_t state_;
};

// A spiral over the unit sphere, from near one pole to near the other in 20 s. A point at kSphereRadius_m
// moves at exactly `speed_m_s`. The least speed is 6.4 mm/s: the motion from pole to pole alone.
glm::dvec3 spiral_direction(double t_s, double speed_m_s);
double least_spiral_speed_m_s();

// Position of the ideal proxy for a goal near the sphere: on the sphere if the goal is inside, otherwise at
// the goal.
glm::dvec3 sphere_reference(const glm::dvec3& goal, double tool_radius_m);

// Paths at the sphere.
// far: a circle 0.3 m away.
// hover: 1 mm above the sphere.
// slide: the goal is pressed 5 mm deep and then drawn over the sphere. The press leads in and does not count.
// tap: the goal is tapped into the sphere at 2 m/s. Each tap starts anew (GoalPath::starts).
GoalPath far_path(int ticks = 5000);
GoalPath hover_path(double tool_radius_m, double speed_m_s, int ticks = 20000);
GoalPath slide_path(double tool_radius_m, double speed_m_s, int ticks = 20000);
GoalPath tap_path(double tool_radius_m, int taps = 5000);

// Like slide_path(), on the mesh of a file whose vertices are within kSphereRadius_m of the origin. The goal
// is kSlideDepth_m below the surface that a ray to the origin meets first. `surface_m` gives the distance of
// that surface from the origin in a direction; if it is empty, the last distance is kept. A point at
// kSphereRadius_m moves at `speed_m_s`. There is no closed form.
GoalPath drape_path(double tool_radius_m, double speed_m_s, int ticks,
                    const std::function<std::optional<double>(const glm::dvec3&)>& surface_m);

// Cube: over a face, off its edge, along the next face and back to the start, in steps of 0.1 mm.
GoalPath edge_path(double tool_radius_m, int laps = 10);

// Corner: along one plane into the second and the third, then a pause, a wiggle, and the way back.
// `symmetric`: the goal moves in the plane of mesh edges, where a ray between goal and proxy meets the edges
// exactly.
GoalPath corner_path(double tool_radius_m, bool symmetric, int laps = 10);
// Corner: a motion of three sines through the corner, at about 1 m/s.
GoalPath cornerfast_path(double tool_radius_m, int ticks = 20000);

// The tool rests and the body moves. Each lap has another direction, and another distance at which the body
// passes the tool. In each lap the body moves halfway over the tool, back, and then all the way over the
// tool. There is no closed form, because the shape of the body determines the proxy's way round the body.
GoalPath moving_path(double speed_m_s, int laps);
int moving_laps(double speed_m_s);  // about 20,000 ticks in all

}  // namespace hybrid::bench
