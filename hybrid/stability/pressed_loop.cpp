// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stability/pressed_loop.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "device/loop/stop_signal.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/session.h"
#include "hybrid/tick/copy_state.h"
#include "hybrid/tick/proxy/proxy_sweep.h"

namespace hybrid {
namespace {

// The first contact on the scene's path, if the tool follows the path exactly.
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

device::Mechanism LoopSetting::linear_mechanism() {
  device::Mechanism linear = device::mechanism(device::DeviceModel::premium_1_5);
  linear.name = "linear mechanism (simulated)";
  linear.limits.max_force_N = std::numeric_limits<double>::infinity();
  linear.limits.resolution_m = linear.limits.friction_N = 0.0;
  return linear;
}

device::SampledLoop bare_loop(const LoopSetting& setting) {
  return {.mass_kg = setting.mechanism.apparent_mass_kg,
          .damping_N_s_per_m = setting.mechanism.viscous_N_s_per_m,
          .wall_damping_N_s_per_m = setting.wall_damping_N_s_per_m,
          .period_s = setting.period_s(),
          .delay_ticks = setting.delay_ticks};
}

device::SampledLoop held_loop(const LoopSetting& setting) {
  device::SampledLoop loop = bare_loop(setting);
  loop.mass_kg += setting.hand.mass_kg;
  loop.damping_N_s_per_m += setting.hand.damping_N_s_per_m;
  loop.hand_stiffness_N_per_m =
      setting.hand.stiffness_N_per_m > 0.0 ? setting.hand.stiffness_N_per_m : LoopSetting::kNoHand_N_per_m;
  return loop;
}

PressedScene::PressedScene(const Scene& scene, const Progress& progress)
    : built_(build_scene(scene, progress)), world_(*built_.world) {
  set_flush_to_zero();
  const std::unique_ptr<WorldState> rest = copy_state(world_, *built_.state);
  const FirstTouch first = find_touch(scene, built_);
  touch_m_ = first.touch_m;
  normal_ = first.normal;
  free_m_ = first.free_m;
  built_.state.reset();
  begin_ = copy_state(world_, *rest);
  begin_session(scene, world_, *begin_, free_m_);
  begin_->limit.elapsed_s = world_.limits.soft_start_s;  // the soft start is over
  state_ = copy_state(world_, *begin_);
  press_N_ = std::min(press_N_, 0.4 * world_.limits.max_force_N);
}

double PressedScene::depth_of(const glm::dvec3& point_m) const {
  return glm::dot(touch_m_ - point_m, normal_);
}

void PressedScene::restart(const LoopSetting& setting, double stiffness_N_per_m) {
  device::stop_if_asked();
  world_.tool.stiffness_N_per_m = stiffness_N_per_m;
  world_.encoder_m = setting.encoder_m();
  world_.damping_account = setting.damping_account;
  for (RigidObject& object : world_.rigid) object.feel.damping_N_s_per_m = setting.wall_damping_N_s_per_m;
  if (stands_still(world_)) {
    static_cast<CarriedState&>(*state_) = static_cast<const CarriedState&>(*begin_);
  } else {
    state_ = copy_state(world_, *begin_);
  }
}

}  // namespace hybrid
