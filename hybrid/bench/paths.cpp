// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

namespace hybrid::bench {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFirstPolar = 0.3, kLastPolar = kPi - 0.3;  // rad
constexpr double kSpiral_s = 20.0;                           // duration of the spiral over the sphere
constexpr double kStep_m = 1e-4;                             // step along polylines: 0.1 m/s
constexpr int kPressTicks = 200;                             // ticks of a press from its start to its depth
constexpr double kPressFrom_m = 0.010;  // height above the sphere at which a press starts
constexpr int kTapTicks = 20;           // ticks of the way in, and of the way out
constexpr double kTapReach_m = 0.02;    // reach of a tap above and below the surface
constexpr double kTapTurn = 0.3;        // tilt of a tap from the normal
// Distance from the tool at which even the largest body is clear of it.
constexpr double kSweep_m = 0.095;
constexpr double kMiss_m = 0.03;  // greatest distance at which the body's middle passes the tool

// Adds goals from the path's end to `to`, in steps of at most kStep_m. The last goal is exactly `to`.
void add_leg(std::vector<glm::dvec3>& goals, const glm::dvec3& to) {
  const glm::dvec3 from = goals.back();
  const int n = static_cast<int>(std::ceil(glm::length(to - from) / kStep_m));
  for (int j = 1; j < n; ++j) goals.push_back(from + (static_cast<double>(j) / n) * (to - from));
  goals.push_back(to);
}

glm::dvec3 on_top(const glm::dvec3& g, double least) {
  return {g.x, g.y, std::max(g.z, least)};
}
glm::dvec3 on_side(const glm::dvec3& g, double least) {
  return {std::max(g.x, least), g.y, g.z};
}

void add_sphere_reference(GoalPath& path, double tool_radius_m) {
  path.reference.reserve(path.goals.size());
  for (const glm::dvec3& g : path.goals) path.reference.push_back(sphere_reference(g, tool_radius_m));
}

void add_corner_reference(GoalPath& path, double tool_radius_m) {
  path.reference.reserve(path.goals.size());
  for (const glm::dvec3& g : path.goals) path.reference.push_back(glm::max(g, glm::dvec3(tool_radius_m)));
}

}  // namespace

std::uint64_t SplitMix64::next() noexcept {
  state_ += 0x9E3779B97F4A7C15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31U);
}

double SplitMix64::unit() noexcept {
  return static_cast<double>(next() >> 11U) * 0x1p-53;
}

glm::dvec3 SplitMix64::direction() noexcept {
  const double c = 2.0 * unit() - 1.0;
  const double f = 2.0 * kPi * unit();
  const double s = std::sqrt(1.0 - c * c);
  return {s * std::cos(f), s * std::sin(f), c};
}

double least_spiral_speed_m_s() {
  return kSphereRadius_m * (kLastPolar - kFirstPolar) / kSpiral_s;
}

glm::dvec3 spiral_direction(double t_s, double speed_m_s) {
  const double polar_rate = (kLastPolar - kFirstPolar) / kSpiral_s;
  const double down = least_spiral_speed_m_s();
  const double around = std::sqrt(std::max(0.0, speed_m_s * speed_m_s - down * down));
  const double th = kFirstPolar + polar_rate * t_s;
  // ∫ dθ / sin θ = ln tan(θ/2). The azimuth turns faster near the poles, where its circles are small.
  const double phi = around / down * (std::log(std::tan(0.5 * th)) - std::log(std::tan(0.5 * kFirstPolar)));
  return {std::sin(th) * std::cos(phi), std::sin(th) * std::sin(phi), std::cos(th)};
}

glm::dvec3 sphere_reference(const glm::dvec3& goal, double tool_radius_m) {
  const double r = glm::length(goal), least = kSphereRadius_m + tool_radius_m;
  return r >= least || r == 0.0 ? goal : goal * (least / r);
}

GoalPath far_path(int ticks) {
  GoalPath path;
  path.starts = {0};
  for (int k = 0; k < ticks; ++k) {
    const double t = k * kTick_s;
    path.goals.emplace_back(0.3 + 0.02 * std::cos(5.0 * t), 0.02 * std::sin(5.0 * t), 0.0);
  }
  path.reference = path.goals;
  return path;
}

GoalPath hover_path(double tool_radius_m, double speed_m_s, int ticks) {
  GoalPath path;
  path.starts = {0};
  const double r = kSphereRadius_m + tool_radius_m + kHoverGap_m;
  for (int k = 0; k < ticks; ++k) path.goals.push_back(r * spiral_direction(k * kTick_s, speed_m_s));
  path.reference = path.goals;
  return path;
}

GoalPath slide_path(double tool_radius_m, double speed_m_s, int ticks) {
  GoalPath path;
  path.starts = {0};
  path.counted_from = kPressTicks;
  const double above = kSphereRadius_m + tool_radius_m + kPressFrom_m,
               below = kSphereRadius_m - kSlideDepth_m;
  const glm::dvec3 down = spiral_direction(0.0, speed_m_s);
  for (int k = 0; k < kPressTicks; ++k)
    path.goals.push_back((above + (static_cast<double>(k) / (kPressTicks - 1)) * (below - above)) * down);
  for (int k = 0; k < ticks; ++k)
    path.goals.push_back(below * spiral_direction((k + 1) * kTick_s, speed_m_s));
  add_sphere_reference(path, tool_radius_m);
  return path;
}

GoalPath tap_path(double tool_radius_m, int taps) {
  GoalPath path;
  SplitMix64 random(12345);
  for (int n = 0; n < taps; ++n) {
    const glm::dvec3 d = random.direction();
    const glm::dvec3 e = random.direction();
    const glm::dvec3 d2 = glm::normalize(d + kTapTurn * e);
    const glm::dvec3 a = (kSphereRadius_m + kTapReach_m) * d, b = (kSphereRadius_m - kTapReach_m) * d2;
    const glm::dvec3 a2 = (kSphereRadius_m + kTapReach_m) * d2;
    path.starts.push_back(static_cast<std::uint32_t>(path.goals.size()));
    for (int j = 0; j <= kTapTicks; ++j)
      path.goals.push_back(a + (static_cast<double>(j) / kTapTicks) * (b - a));
    for (int j = 1; j <= kTapTicks; ++j)
      path.goals.push_back(b + (static_cast<double>(j) / kTapTicks) * (a2 - b));
  }
  add_sphere_reference(path, tool_radius_m);
  return path;
}

GoalPath drape_path(double tool_radius_m, double speed_m_s, int ticks,
                    const std::function<std::optional<double>(const glm::dvec3&)>& surface_m) {
  GoalPath path;
  path.starts = {0};
  path.counted_from = kPressTicks;
  double surface = kSphereRadius_m;
  const auto below = [&](const glm::dvec3& direction) {
    surface = surface_m(direction).value_or(surface);
    return surface - kSlideDepth_m;
  };
  const glm::dvec3 down = spiral_direction(0.0, speed_m_s);
  const double from = kSphereRadius_m + tool_radius_m + kPressFrom_m, to = below(down);
  for (int k = 0; k < kPressTicks; ++k)
    path.goals.push_back((from + (static_cast<double>(k) / (kPressTicks - 1)) * (to - from)) * down);
  for (int k = 0; k < ticks; ++k) {
    const glm::dvec3 direction = spiral_direction((k + 1) * kTick_s, speed_m_s);
    path.goals.push_back(below(direction) * direction);
  }
  return path;
}

GoalPath edge_path(double tool_radius_m, int laps) {
  // corners (m)
  static constexpr std::array<glm::dvec3, 9> kWay{{{-0.03, -0.02, 0.06},
                                                   {-0.03, -0.02, 0.045},
                                                   {0.045, 0.013, 0.045},
                                                   {0.06, 0.015, 0.045},
                                                   {0.06, 0.017, 0.03},
                                                   {0.045, 0.019, 0.03},
                                                   {0.045, 0.02, -0.03},
                                                   {0.06, 0.02, -0.03},
                                                   {0.06, 0.02, 0.06}}};
  const double least = kCubeHalf_m + tool_radius_m;
  GoalPath path;
  path.starts = {0};
  path.goals.push_back(kWay[0]);
  path.reference.push_back(on_top(kWay[0], least));
  for (int lap = 0; lap < laps; ++lap) {
    for (std::size_t leg = 0; leg < kWay.size(); ++leg) {
      const std::size_t first = path.goals.size();
      add_leg(path.goals, kWay[(leg + 1) % kWay.size()]);
      for (std::size_t i = first; i < path.goals.size(); ++i) {
        const glm::dvec3& g = path.goals[i];
        // Past the edge the ball falls off the top face at once, so the ideal proxy jumps.
        const bool top = leg < 2 || leg == 8 || (leg == 2 && g.x <= kCubeHalf_m);
        path.reference.push_back(top ? on_top(g, least) : on_side(g, least));
      }
    }
  }
  return path;
}

GoalPath corner_path(double tool_radius_m, bool symmetric, int laps) {
  constexpr int kHold = 500, kWiggle = 3000;  // ticks in the corner; ticks of small motions there
  // corners (m)
  static constexpr std::array<glm::dvec3, 4> kPlain{
      {{0.04, 0.0512, 0.02}, {0.04, 0.0512, -0.0053}, {-0.005, 0.0512, -0.0053}, {-0.005, -0.0047, -0.0053}}};
  // corners (m); the way lies in planes of mesh edges, so rays from the goal to the proxy meet edges exactly
  static constexpr std::array<glm::dvec3, 4> kSymmetric{
      {{0.04, 0.05, 0.02}, {0.04, 0.05, -0.005}, {-0.005, 0.05, -0.005}, {-0.005, -0.005, -0.005}}};
  const auto& c = symmetric ? kSymmetric : kPlain;
  GoalPath path;
  path.starts = {0};
  path.goals.push_back(c[0]);
  for (int lap = 0; lap < laps; ++lap) {
    for (std::size_t i = 1; i < c.size(); ++i) add_leg(path.goals, c[i]);
    path.goals.insert(path.goals.end(), kHold, c[3]);
    for (int j = 1; j <= kWiggle; ++j) {
      const double t = j * kTick_s;
      path.goals.push_back(c[3] + 0.003 * glm::dvec3(std::sin(2.0 * kPi * t), std::sin(2.6 * kPi * t),
                                                     std::sin(3.4 * kPi * t)));
    }
    for (std::size_t i = c.size(); i-- > 0;) add_leg(path.goals, c[i]);
  }
  add_corner_reference(path, tool_radius_m);
  return path;
}

GoalPath cornerfast_path(double tool_radius_m, int ticks) {
  GoalPath path;
  path.starts = {0};
  for (int k = 0; k < ticks; ++k) {
    const double turn = 2.0 * kPi * (k * kTick_s);
    path.goals.push_back(0.01 + 0.02 * glm::dvec3(std::sin(3.0 * turn + 1.6), std::sin(4.3 * turn + 1.5),
                                                  std::sin(5.9 * turn + 1.4)));
  }
  add_corner_reference(path, tool_radius_m);
  return path;
}

GoalPath moving_path(double speed_m_s, int laps) {
  GoalPath path;
  SplitMix64 random(12345);
  for (int lap = 0; lap < laps; ++lap) {
    const glm::dvec3 along = random.direction();
    const glm::dvec3 across = random.direction();
    const double aside = kMiss_m * random.unit();
    const glm::dvec3 square = glm::cross(along, across);
    const double length = glm::length(square);
    const glm::dvec3 middle = length > 1e-6 ? square * (aside / length) : glm::dvec3(0.0);
    path.starts.push_back(static_cast<std::uint32_t>(path.goals.size()));
    const double step = speed_m_s * kTick_s;
    const int n = static_cast<int>(std::ceil(4.0 * kSweep_m / step));
    for (int k = 0; k <= n; ++k) {
      // Distance travelled, folded: to the middle, back, and then all the way through.
      const double way = 4.0 * kSweep_m * k / n;
      const double s = way <= kSweep_m         ? way - kSweep_m
                       : way <= 2.0 * kSweep_m ? kSweep_m - way
                                               : way - 3.0 * kSweep_m;
      path.goals.emplace_back(0.0);
      path.body_m.push_back(middle + s * along);
    }
  }
  return path;
}

int moving_laps(double speed_m_s) {
  const double ticks = 4.0 * kSweep_m / (speed_m_s * kTick_s);
  return std::max(1, static_cast<int>(std::lround(20000.0 / ticks)));
}

}  // namespace hybrid::bench
