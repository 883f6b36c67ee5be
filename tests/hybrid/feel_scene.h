// SPDX-License-Identifier: GPL-3.0-or-later
// What the tests of surface feel share: rough objects, closed ways over them, and what the hand gains on
// those.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <string>
#include <vector>

#include "polygon/primitives.h"
#include "rigid_scene.h"

namespace tests {

using glm::dvec3;
using hybrid::RigidDescription;
using hybrid::TickResult;

inline constexpr double kRadius = 2e-3, kStatic = 0.5, kDynamic = 0.3;
inline constexpr double kBall = 0.05;  // radius of the icosphere

inline RigidDescription rough(RigidDescription object) {
  object.feel.static_friction = kStatic;
  object.feel.dynamic_friction = kDynamic;
  return object;
}

class Feel : public RigidScene {
 protected:
  RigidDescription plane() const { return rigid("plane", hybrid::PlanePrimitive{0.2}); }
  RigidDescription box() const {
    return mesh("box", polygon::make_box_mesh({0.03, 0.03, 0.02}, 8), {0, 0, -0.02});
  }
  RigidDescription ball(int subdivisions = 3) const {
    return mesh("ball", polygon::make_ball_mesh(kBall, subdivisions));
  }
};

struct Gain {
  double work_J = 0.0, most_N = 0.0;
  int stuck = 0, sliding = 0;  // ticks
};

// From free space round a closed way and back to free space: what the hand has gained then came out of
// nothing. Steps of `step_m` at most; the way is given by its phase, 0 to 1, and repeated.
inline Gain closed_way(Touch& touch, const dvec3& above, const std::function<dvec3(double)>& way, int repeats,
                       double step_m) {
  double length = 0.0;
  for (int n = 0; n < 1000; ++n) length += glm::length(way((n + 1) * 1e-3) - way(n * 1e-3));
  const int ticks = static_cast<int>(length / step_m) + 1;
  Gain gain;
  Work work;
  const auto look = [&](const TickResult& felt) {
    work.add(felt);
    gain.most_N = std::max(gain.most_N, glm::length(felt.force_N));
    gain.stuck += touch.state().stuck ? 1 : 0;
    gain.sliding += touch.state().sliding ? 1 : 0;
  };
  touch.go(above, 1e-3);
  look(touch.at(above));
  touch.go(way(0.0), step_m, 0, look);
  for (int n = 1; n <= ticks * repeats; ++n)
    look(touch.at(way(std::fmod(static_cast<double>(n) / ticks, 1.0))));
  touch.go(above, step_m, 0, look);
  EXPECT_EQ(touch.state().active_count, 0U) << "the way ends in free space";
  EXPECT_EQ(touch.state().faults, 0U);
  gain.work_J = work.gained_J();
  return gain;
}

inline void expect_no_gain(const std::string& name, const Gain& gain) {
  std::printf("energy, %s: the hand gains %+.4g mJ; at most %.2f N, %d ticks stuck, %d sliding\n",
              name.c_str(), 1e3 * gain.work_J, gain.most_N, gain.stuck, gain.sliding);
  EXPECT_LE(gain.work_J, 1e-12 * gain.most_N);
  EXPECT_GT(gain.most_N, 1.0);
}

inline double wave(double phase, double times = 1.0) {
  return std::sin(2.0 * glm::pi<double>() * times * phase);
}
inline double cowave(double phase) {
  return std::cos(2.0 * glm::pi<double>() * phase);
}

struct Way {
  const char* name;
  std::function<dvec3(double)> at;
};

// To and fro and round; also deeper in one direction than in the other, and within the cone.
inline std::vector<Way> ways_on_the_flat() {
  const double deep = kRadius - 3e-3;
  return {
      {"to and fro", [=](double p) { return dvec3(4e-3 * wave(p), 1e-3 * wave(p), deep); }},
      {"a circle", [=](double p) { return dvec3(4e-3 * cowave(p), 4e-3 * wave(p), deep); }},
      {"deeper on the way back", [=](double p) { return dvec3(4e-3 * cowave(p), 0, deep + 2e-3 * wave(p)); }},
      {"deeper on the way out", [=](double p) { return dvec3(4e-3 * cowave(p), 0, deep - 2e-3 * wave(p)); }},
      {"within the cone", [=](double p) { return dvec3(1e-3 * cowave(p), 5e-4 * wave(p), deep); }},
      {"lifted off on the way back",
       [=](double p) { return dvec3(4e-3 * cowave(p), 3e-3 * wave(p, 2.0), deep + 5e-3 * wave(p)); }}};
}

}  // namespace tests
