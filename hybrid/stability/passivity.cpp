// SPDX-License-Identifier: GPL-3.0-or-later
// Measures passivity: the wall is driven by sinusoids, and the energy that it gives out is summed.
#include <algorithm>
#include <cmath>
#include <deque>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "hybrid/base/find_threshold.h"
#include "hybrid/stability/pressed_loop.h"

namespace hybrid {
namespace {

constexpr double kSoftest_N_per_m = 1.0, kStiffest_N_per_m = 1e7;  // range of the search
constexpr double kPassiveStep = 1e-3;  // relative step of the stiffness at which the bisection ends
constexpr int kRateMemory = 24;        // ticks; more than the 16 depths of the velocity's estimate

}  // namespace

CycleEnergy drive(PressedScene& scene, const LoopSetting& setting, const DrivenMotion& motion) {
  const double dt = setting.period_s(), step = setting.encoder_m();
  const auto depth_at = [&](int tick) {
    const int in_period = (tick * motion.cycles) % motion.ticks;
    return motion.centre_m + motion.amplitude_m * std::sin(2.0 * std::numbers::pi * in_period / motion.ticks +
                                                           motion.phase_rad);
  };
  const auto force_at = [&](double depth) {
    const double seen = step > 0.0 ? std::round(depth / step) * step : depth;
    return glm::dot(scene.tick({.position_m = scene.at_depth(seen)}, dt).force_N, scene.normal());
  };
  // The wall remembers past ticks: in the estimate of the velocity, or in the account of its damping. This
  // memory must first reach its steady state.
  const int settle =
      setting.delay_ticks +
      (setting.damping_account ? static_cast<int>(std::ceil(10.0 * kDampingMemory_s / dt)) : kRateMemory);
  std::deque<double> on_the_way(static_cast<std::size_t>(setting.delay_ticks), 0.0);
  CycleEnergy energy;
  for (int n = 0; n < settle + motion.ticks; ++n) {
    on_the_way.push_back(force_at(depth_at(n)));
    const double held = on_the_way.front();
    on_the_way.pop_front();
    if (n < settle) continue;
    const double out = depth_at(n) - depth_at(n + 1);  // motion along the normal
    energy.from_wall_J += held * out;
    energy.dissipated_J +=
        setting.mechanism.viscous_N_s_per_m * out * out / dt + setting.friction_N() * std::fabs(out);
  }
  return energy;
}

namespace {

// A grid of motions that may draw energy out of the wall.
std::vector<DrivenMotion> motions(const PressedScene& scene, const LoopSetting& setting, double stiffness) {
  constexpr double kDeepestPress_m = 1e-3;  // depth of the presses, at most
  const double step = setting.encoder_m();
  const double deep = std::min(kDeepestPress_m, scene.press_N() / stiffness);
  std::vector<DrivenMotion> all;
  if (!(step > 0.0)) {
    // The amplitude is small beside the depth, so that damping never pulls and is not cut. In a linear loop
    // the phase matters only at Nyquist's frequency, at which a sine of phase 0 would stand still.
    for (int cycles = 1; cycles <= 64; ++cycles)
      all.push_back({.cycles = cycles, .centre_m = deep, .amplitude_m = 0.01 * deep, .phase_rad = 1.0});
    return all;
  }
  for (const double in_steps : {1.0 / 64, 1.0 / 8, 0.5, 0.75, 1.0, 1.5, 2.0, 4.0, 8.0, 16.0, 64.0}) {
    const double amplitude = in_steps * step;
    if (amplitude > 0.9 * deep && !all.empty()) break;
    // Places in encoder steps: where the depth rounds to a step, and between two steps.
    for (const double place : {0.0, 0.25, 0.5}) {
      const double centre = (std::floor(deep / step) + place) * step;
      for (const int cycles : {1, 2, 3, 4, 5, 6, 7, 8}) {
        for (const double phase : {0.3, 1.0})
          all.push_back({.cycles = cycles,
                         .ticks = 16,
                         .centre_m = centre,
                         .amplitude_m = amplitude,
                         .phase_rad = phase});
      }
      all.push_back({.cycles = 1, .ticks = 128, .centre_m = centre, .amplitude_m = amplitude});
    }
  }
  return all;
}

}  // namespace

std::optional<double> measured_passive_stiffness(PressedScene& scene, const LoopSetting& setting) {
  std::size_t worst = 0;  // the motion that drew energy at the last stiffness is tried first
  const auto passive = [&](double stiffness) {
    const std::vector<DrivenMotion> all = motions(scene, setting, stiffness);
    scene.restart(setting, stiffness);
    for (std::size_t n = 0; n < all.size(); ++n) {
      const std::size_t which = (worst + n) % all.size();
      const CycleEnergy energy = drive(scene, setting, all[which]);
      if (energy.from_wall_J <= energy.dissipated_J + 1e-9 * std::fabs(energy.from_wall_J)) continue;
      worst = which;
      return false;
    }
    return true;
  };
  return find_threshold(kSoftest_N_per_m, kStiffest_N_per_m, 2.0, kPassiveStep, passive);
}

}  // namespace hybrid
