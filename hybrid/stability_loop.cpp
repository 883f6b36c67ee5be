// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stability_loop.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "hybrid/rigid_sweep.h"
#include "hybrid/session.h"

namespace hybrid {
namespace {

constexpr double kSoftest_N_per_m = 0.1, kStiffest_N_per_m = 1e7;
constexpr double kPassiveStep = 1e-3;  // of the stiffness, where the bisection ends

// The path as the hand would walk it, with the tool exactly there: where is something felt first?
struct FirstTouch {
  glm::dvec3 free_m{0.0}, touch_m{0.0}, normal{0.0};
};

FirstTouch find_touch(const Scene& scene, BuiltScene& built) {
  const std::shared_ptr<const device::Path> path = scene_path(scene);
  begin_session(scene, *built.world, *built.state, path->position(0.0));
  const double dt = 1.0 / scene.rate_hz;
  FirstTouch first;
  first.free_m = path->position(0.0);
  for (double t = 0.0; t <= path->duration_s() + dt; t += dt) {
    const glm::dvec3 device = path->position(t);
    const TickResult felt = haptic_tick(*built.world, *built.state, {.position_m = device}, dt);
    const glm::dvec3 out = felt.proxy_m - device;
    if (felt.contacts == 0 || !(glm::length(out) > 0.0)) {
      first.free_m = device;
      continue;
    }
    first.touch_m = felt.proxy_m;
    first.normal = glm::normalize(out);
    return first;
  }
  throw SceneError(scene.file, scene.path_place,
                   "the path touches nothing, and stability is measured where it first does; lead it into an "
                   "object");
}

bool stands_still(const World& world) {
  return world.soft.empty() && std::all_of(world.rigid.begin(), world.rigid.end(), [](const RigidObject& o) {
           return o.motion.kind() == RigidMotion::Kind::fixed;
         });
}

}  // namespace

device::SampledLoop bare_loop(const LoopSetting& setting) {
  return {.mass_kg = setting.mass_kg,
          .damping_N_s_per_m = setting.viscous_N_s_per_m,
          .wall_damping_N_s_per_m = setting.wall_damping_N_s_per_m,
          .period_s = setting.period_s(),
          .delay_ticks = setting.delay_ticks};
}

device::SampledLoop held_loop(const LoopSetting& setting) {
  device::SampledLoop loop = bare_loop(setting);
  loop.mass_kg += setting.hand.mass_kg;
  loop.damping_N_s_per_m += setting.hand.damping_N_s_per_m;
  loop.hand_stiffness_N_per_m = setting.hand.stiffness_N_per_m;
  return loop;
}

PressedScene::PressedScene(const Scene& scene, const Progress& progress)
    : built_(build_scene(scene, progress)), world_(*built_.world) {
  flush_denormals();
  const std::unique_ptr<WorldState> rest = copy_state(world_, *built_.state);
  const FirstTouch first = find_touch(scene, built_);
  touch_m_ = first.touch_m;
  normal_ = first.normal;
  free_m_ = first.free_m;
  built_.state.reset();
  begin_ = copy_state(world_, *rest);
  begin_session(scene, world_, *begin_, free_m_);
  state_ = copy_state(world_, *begin_);
  press_N_ = std::min(press_N_, 0.4 * world_.limits.max_force_N);
}

double PressedScene::depth_of(const glm::dvec3& point_m) const {
  return glm::dot(touch_m_ - point_m, normal_);
}

void PressedScene::restart(const LoopSetting& setting, double stiffness_N_per_m) {
  world_.tool.stiffness_N_per_m = stiffness_N_per_m;
  world_.encoder_m = setting.quantisation_m;
  world_.damping_account = setting.damping_account;
  for (RigidObject& object : world_.rigid) object.feel.damping_N_s_per_m = setting.wall_damping_N_s_per_m;
  if (stands_still(world_)) {
    static_cast<CarriedState&>(*state_) = static_cast<const CarriedState&>(*begin_);
  } else {
    state_ = copy_state(world_, *begin_);
  }
}

CycleEnergy drive(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m,
                  const DrivenMotion& motion) {
  scene.restart(setting, stiffness_N_per_m);
  const double dt = setting.period_s(), step = setting.quantisation_m;
  const auto depth_at = [&](int tick) {
    const int in_period = (tick * motion.cycles) % motion.ticks;
    return motion.centre_m +
           motion.amplitude_m * std::sin(2.0 * std::numbers::pi * in_period / motion.ticks + motion.phase_rad);
  };
  const auto force_at = [&](double depth) {
    const double seen = step > 0.0 ? std::round(depth / step) * step : depth;
    return glm::dot(scene.tick({.position_m = scene.at_depth(seen)}, dt).force_N, scene.normal());
  };
  // The wall's memory (soft start, damping) first comes to what it is in the long run.
  const int settle = std::max(static_cast<int>(std::ceil((setting.damping_account ? 0.5 : 0.06) / dt)), 8);
  std::deque<double> on_the_way(static_cast<std::size_t>(setting.delay_ticks), 0.0);
  for (int n = 0; n < settle; ++n) force_at(depth_at(0));
  const int settled = setting.damping_account ? settle - settle % motion.ticks + motion.ticks : motion.ticks;
  CycleEnergy energy;
  for (int n = 0; n < settled + motion.ticks; ++n) {
    on_the_way.push_back(force_at(depth_at(n)));
    const double held = on_the_way.front();
    on_the_way.pop_front();
    if (n < settled) continue;
    const double out = depth_at(n) - depth_at(n + 1);  // along the normal
    energy.from_wall_J += held * out;
    energy.dissipated_J += setting.viscous_N_s_per_m * out * out / dt + setting.friction_N * std::fabs(out);
  }
  return energy;
}

namespace {

// A grid of everything that could draw energy out.
std::vector<DrivenMotion> motions(const PressedScene& scene, const LoopSetting& setting, double stiffness) {
  constexpr double kDeepest_m = 1e-3;
  const double step = setting.quantisation_m;
  const double deep = std::min(kDeepest_m, scene.press_N() / stiffness);
  std::vector<DrivenMotion> all;
  if (!(step > 0.0)) {
    // Small beside the depth, so that damping is not cut where it would pull. In a linear loop the phase
    // counts only at Nyquist's frequency, where a sine of phase 0 stands still.
    for (int cycles = 1; cycles <= 64; ++cycles)
      all.push_back({.cycles = cycles, .centre_m = deep, .amplitude_m = 0.01 * deep, .phase_rad = 1.0});
    return all;
  }
  for (const double in_steps : {1.0 / 64, 1.0 / 8, 0.5, 0.75, 1.0, 1.5, 2.0, 4.0, 8.0, 16.0, 64.0}) {
    const double amplitude = in_steps * step;
    if (amplitude > 0.9 * deep && !all.empty()) break;
    for (const double place : {0.0, 0.25, 0.5}) {  // between two edges of the encoder, and on one
      const double centre = (std::floor(deep / step) + place) * step;
      for (const int cycles : {1, 2, 3, 4, 5, 6, 7, 8}) {
        for (const double phase : {0.3, 1.0})
          all.push_back(
              {.cycles = cycles, .ticks = 16, .centre_m = centre, .amplitude_m = amplitude, .phase_rad = phase});
      }
      all.push_back({.cycles = 1, .ticks = 128, .centre_m = centre, .amplitude_m = amplitude});
    }
  }
  return all;
}

}  // namespace

double measured_passive_stiffness(PressedScene& scene, const LoopSetting& setting) {
  std::size_t worst = 0;  // what was active at the last stiffness most likely is at this one
  const auto passive = [&](double stiffness) {
    const std::vector<DrivenMotion> all = motions(scene, setting, stiffness);
    for (std::size_t n = 0; n < all.size(); ++n) {
      const std::size_t which = (worst + n) % all.size();
      const CycleEnergy energy = drive(scene, setting, stiffness, all[which]);
      if (energy.from_wall_J <= energy.dissipated_J + 1e-9 * std::fabs(energy.from_wall_J)) continue;
      worst = which;
      return false;
    }
    return true;
  };
  double low = kSoftest_N_per_m, high = 2.0 * low;
  if (!passive(low)) return 0.0;
  while (high < kStiffest_N_per_m && passive(high)) {
    low = high;
    high *= 2.0;
  }
  if (high >= kStiffest_N_per_m) return high;
  while (high - low > kPassiveStep * high) {
    const double middle = 0.5 * (low + high);
    (passive(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace hybrid
