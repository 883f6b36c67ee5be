// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/watched_numbers.h"

#include <algorithm>
#include <bit>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

std::vector<WatchedNumber> all_numbers() {
  std::vector<WatchedNumber> all;
  const auto add = [&](std::string name, const char* unit, std::function<double(const TickSample&)> of) {
    all.push_back({std::move(name), unit, std::move(of)});
  };
  for (int d = 0; d < 3; ++d) {
    const std::string axis(1, "xyz"[d]);
    add("force " + axis, "N", [d](const TickSample& s) { return static_cast<double>(s.force_N[d]); });
    add("device " + axis, "mm", [d](const TickSample& s) { return 1e3 * s.device_m[d]; });
    add("proxy " + axis, "mm", [d](const TickSample& s) { return 1e3 * s.proxy_m[d]; });
  }
  add("device to proxy", "mm",
      [](const TickSample& s) { return 1e3 * glm::distance(s.device_m, s.proxy_m); });
  const auto add_force = [&](const char* name, float TickSample::*force) {
    add(name, "N", [force](const TickSample& s) { return static_cast<double>(s.*force); });
  };
  add_force("force", &TickSample::total_N);
  add_force("rigid", &TickSample::rigid_N);
  add_force("soft", &TickSample::soft_N);
  add_force("friction", &TickSample::friction_N);
  add_force("damping, texture", &TickSample::damping_N);
  add_force("limits", &TickSample::limits_N);
  add_force("passivity", &TickSample::passivity_N);
  add("objects in contact", "",
      [](const TickSample& s) { return static_cast<double>(std::popcount(s.contacts)); });
  add("tick", "µs", [](const TickSample& s) { return static_cast<double>(s.tick_us); });
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    std::string name = std::string("stage: ") + kStageNames[stage];
    std::replace(name.begin(), name.end(), '_', ' ');
    add(name, "µs", [stage](const TickSample& s) { return static_cast<double>(s.stage_us[stage]); });
  }
  std::ranges::sort(all, {}, &WatchedNumber::name);
  return all;
}

}  // namespace

const std::vector<WatchedNumber>& watched_numbers() {
  static const std::vector<WatchedNumber> all = all_numbers();
  return all;
}

const WatchedNumber* watched_number_named(std::string_view name) {
  const auto& all = watched_numbers();
  const auto at = std::ranges::find(all, name, &WatchedNumber::name);
  return at == all.end() ? nullptr : &*at;
}

}  // namespace hybrid
