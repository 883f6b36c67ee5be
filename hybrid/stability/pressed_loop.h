// SPDX-License-Identifier: GPL-3.0-or-later
// The program's own haptic loop, pressed on one place of a scene. The measurements of stability and passivity
// drive it. The place is where the scene's path first feels a contact. The tool presses along the line of the
// force there.
#pragma once

#include <glm/vec3.hpp>
#include <memory>
#include <optional>

#include "device/loop/loop_theory.h"
#include "device/simulated/simulated.h"
#include "hybrid/build/build_world.h"
#include "hybrid/stability/vibration_threshold.h"
#include "hybrid/tick/tick.h"

namespace hybrid {

// One loop to be measured, but for the stiffness. The scene's own device and hand do not count.
struct LoopSetting {
  device::Mechanism mechanism = linear_mechanism();
  device::HandModel hand{};
  double rate_hz = 1000.0;
  int delay_ticks = 0;                  // from sample to force
  double wall_damping_N_s_per_m = 0.0;  // B, of every rigid surface
  bool damping_account = false;         // of World: the care that keeps B passive; theory knows B without

  static constexpr double kNoHand_N_per_m = 1.0;  // a hand without a spring presses by one of this
  // The Premium's mass; no friction, no encoder step, no limit: what theory answers.
  static device::Mechanism linear_mechanism();
  [[nodiscard]] double period_s() const { return 1.0 / rate_hz; }
  [[nodiscard]] double friction_N() const { return mechanism.limits.friction_N; }
  [[nodiscard]] double encoder_m() const { return mechanism.limits.resolution_m; }
  [[nodiscard]] bool linear() const { return friction_N() == 0.0 && encoder_m() == 0.0; }
};

// What theory calls the same: with the hand for stability, without it for passivity.
device::SampledLoop held_loop(const LoopSetting& setting);
device::SampledLoop bare_loop(const LoopSetting& setting);

// A scene, built once, touched again and again from the same state.
class PressedScene {
 public:
  // Throws SceneError: what build_scene() refuses, or the path touches nothing.
  explicit PressedScene(const Scene& scene, const Progress& progress = {});

  // Back to the beginning, with the tool above the place, for a coupling of this stiffness.
  void restart(const LoopSetting& setting, double stiffness_N_per_m);
  TickResult tick(const device::DeviceState& input, double dt_s) noexcept {
    return haptic_tick(world_, *state_, input, dt_s);
  }

  // `depth_m` into the surface, along its normal.
  [[nodiscard]] glm::dvec3 at_depth(double depth_m) const { return touch_m_ - depth_m * normal_; }
  [[nodiscard]] double depth_of(const glm::dvec3& point_m) const;
  [[nodiscard]] const glm::dvec3& normal() const { return normal_; }
  [[nodiscard]] const World& world() const { return world_; }
  // How hard the measurements press (N): well within the scene's limit.
  [[nodiscard]] double press_N() const { return press_N_; }

 private:
  BuiltScene built_;
  World world_;
  std::unique_ptr<WorldState> begin_, state_;
  glm::dvec3 touch_m_{0.0}, normal_{0.0, 0.0, 1.0}, free_m_{0.0};
  double press_N_ = 2.0;
};

// ---- passivity --------------------------------------------------------------------------------------------

// A motion that no hand makes: at the ticks a sinusoid about a depth, between them even, because of all
// motions through the same samples that is the one on which the mechanism's damping costs least.
struct DrivenMotion {
  int cycles = 1, ticks = 128;  // so many whole cycles in so many ticks
  double centre_m = 1e-3;       // depth
  double amplitude_m = 1e-5;    // less than the depth
  double phase_rad = 0.0;
};

struct CycleEnergy {          // of one period of the motion, once it repeats (J)
  double from_wall_J = 0.0;   // Σ F(k)·(x(k+1) − x(k)), F what the motors hold from k to k + 1
  double dissipated_J = 0.0;  // by the mechanism: b·Δx²/T + f·|Δx| a tick
};
// Goes on from where the scene is, which was restarted with this setting.
CycleEnergy drive(PressedScene& scene, const LoopSetting& setting, const DrivenMotion& motion);

// The largest stiffness of the coupling (N/m) at which no motion of a fine grid gets more energy out of the
// wall than the mechanism dissipates, by bisection to 0.1 %: all frequencies up to Nyquist's, and with an
// encoder step also amplitudes from 1/64 of it and all places within it. 0: not even the softest (1 N/m);
// empty: at all up to 10 MN/m.
std::optional<double> measured_passive_stiffness(PressedScene& scene, const LoopSetting& setting);

// ---- stability --------------------------------------------------------------------------------------------

// A simulated device in a simulated hand that presses it into the place, slowly and smoothly, and then holds
// still.
class HeldLoop {
 public:
  // `press_N` is what the wall answers with at rest. A hand without a spring presses by a spring of 1 N/m.
  HeldLoop(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m, double press_N);

  // One tick, with a force of somebody else's added to the motors' (N, out of the surface). Returns how deep
  // the tool truly is (m), not as the encoders say.
  double step(double extra_N = 0.0);
  [[nodiscard]] double rest_depth_m() const { return rest_m_; }
  // Until the hand has arrived and a while longer.
  void settle();
  // The tool is knocked: a short force no larger than the press, that makes an oscillation of about
  // `amplitude_m`.
  void knock(double amplitude_m);

 private:
  PressedScene& scene_;
  const LoopSetting setting_;
  double stiffness_, rest_m_;
  std::unique_ptr<device::HapticDevice> device_;
};

// The largest stiffness of the coupling (N/m) at which a knock dies out. In a linear loop (no friction, no
// encoder) by the sign of the rate at which the envelope grows, far from anything that limits it: bisection
// to 0.1 %. Otherwise by whether the tool comes to rest after it, at several presses within one encoder step:
// the first of stiffnesses 1.3 apart at which it does not, then bisection to 0.5 %. 0: not even the softest
// (20 N/m, or pressed 2 mm deep with ten times the friction); empty: at all up to 10 MN/m.
std::optional<double> measured_stable_stiffness(PressedScene& scene, const LoopSetting& setting);

// The rate (1/s) at which the envelope of a knock grows in a linear loop; +infinity where it left the linear
// range, −infinity where nothing is left of it.
double envelope_growth(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m);

// ---- buzz -------------------------------------------------------------------------------------------------

// The most felt vibration of the tool half a second long, a second after a knock on a steady press; the worst
// of several presses within one encoder step.
Vibration pressed_vibration(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m);

// The stiffness of the coupling at which a steady press begins to buzz, that is to vibrate so that a hand
// feels it: the first of a fine row of stiffnesses from 100 N/m (1.15 apart; on tissue 1.6), then bisection
// to 1 %. At none of the row below it does it buzz.
struct Buzz {
  std::optional<double> begins_N_per_m;  // empty: nowhere up to stiffest_N_per_m
  double stiffest_N_per_m = 0.0;
  Vibration vibration;  // where it begins
};
Buzz measured_buzz(PressedScene& scene, const LoopSetting& setting);

}  // namespace hybrid
