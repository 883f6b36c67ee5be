// SPDX-License-Identifier: GPL-3.0-or-later
// A scene that a test touches tick by tick, with the tool exactly where the test says: no device, no hand.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "hybrid/build.h"
#include "hybrid/denormals.h"
#include "hybrid/session.h"
#include "hybrid/tick.h"
#include "scene_file_fixture.h"

namespace tests {

// The tool goes where the path says, and what is felt is not limited.
inline const std::string unlimited =
    "[device]\nmodel = \"ideal\"\n[safety]\nmax_force = 10000\nmax_slew = 1e9\nsoft_start = 0\n";
// Where a scene needs a path that the test does not follow.
inline const std::string some_path = "[path]\nkind = \"press\"\nfrom = [0, 0, 200]\nto = [0, 0, 190]\n";

class Touch {
 public:
  Touch(const hybrid::Scene& scene, const glm::dvec3& start_m, bool relaxed_apart = false)
      : built(hybrid::build_scene(scene)) {
    hybrid::flush_denormals();
    hybrid::begin_session(scene, world(), state(), start_m);
    if (relaxed_apart) hybrid::relax_apart(state(), hybrid::Arrival::counted);
  }

  hybrid::TickResult at(const glm::dvec3& device_m, double dt_s = 1e-3) {
    return hybrid::haptic_tick(world(), state(), {.position_m = device_m}, dt_s);
  }
  // Straight from where the device is, one tick each `step_m`, then `hold` ticks there. `look` sees every
  // tick.
  template <class Look>
  hybrid::TickResult go(const glm::dvec3& to_m, double step_m, int hold, Look&& look) {
    const glm::dvec3 from = state().device_m;
    const int steps = std::max(1, static_cast<int>(std::ceil(glm::length(to_m - from) / step_m)));
    hybrid::TickResult last;
    for (int n = 1; n <= steps + hold; ++n) {
      last = at(n < steps ? from + (to_m - from) * (static_cast<double>(n) / steps) : to_m);
      look(std::as_const(last));
    }
    return last;
  }
  hybrid::TickResult go(const glm::dvec3& to_m, double step_m, int hold = 0) {
    return go(to_m, step_m, hold, [](const hybrid::TickResult&) {});
  }
  [[nodiscard]] const hybrid::World& world() const { return *built.world; }
  [[nodiscard]] hybrid::WorldState& state() { return *built.state; }

  hybrid::BuiltScene built;
};

// What the coupling asks for before the limits.
inline glm::dvec3 coupling(const hybrid::TickResult& tick) {
  return tick.rigid_N + tick.soft_N;
}

// Evenly; the same with every library, where its own distributions are not.
inline double between(std::mt19937& engine, double low, double high) {
  return low + (high - low) * (static_cast<double>(engine()) / 4294967296.0);
}

inline bool finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace tests
