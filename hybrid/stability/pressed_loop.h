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

// The parameters of a loop that is measured, without its stiffness. The scene's own device and hand do not
// count.
struct LoopSetting {
  device::Mechanism mechanism = linear_mechanism();
  device::HandModel hand{};
  double rate_hz = 1000.0;
  int delay_ticks = 0;                  // from sample to force, in ticks
  double wall_damping_N_s_per_m = 0.0;  // B; of every rigid surface
  // World::damping_account, which keeps B passive. The theory has B without this account.
  bool damping_account = false;

  // If `hand` has no spring, the tool is pressed by a spring of this stiffness.
  static constexpr double kNoHand_N_per_m = 1.0;
  // Mass of the Premium; no friction, no encoder step, no force limit. Theory covers this mechanism.
  static device::Mechanism linear_mechanism();
  [[nodiscard]] double period_s() const { return 1.0 / rate_hz; }
  [[nodiscard]] double friction_N() const { return mechanism.limits.friction_N; }
  [[nodiscard]] double encoder_m() const { return mechanism.limits.resolution_m; }
  [[nodiscard]] bool linear() const { return friction_N() == 0.0 && encoder_m() == 0.0; }
};

// The loop of theory for this setting. For stability it includes the hand (held_loop), for passivity it does
// not (bare_loop).
device::SampledLoop held_loop(const LoopSetting& setting);
device::SampledLoop bare_loop(const LoopSetting& setting);

// A scene that is built once and touched again and again from the same state.
class PressedScene {
 public:
  // Throws SceneError if build_scene() refuses the scene, or if the path touches nothing.
  explicit PressedScene(const Scene& scene, const Progress& progress = {});

  // Returns to the start, with the tool above the place and a coupling of this stiffness.
  void restart(const LoopSetting& setting, double stiffness_N_per_m);
  TickResult tick(const device::DeviceState& input, double dt_s) noexcept {
    return haptic_tick(world_, *state_, input, dt_s);
  }

  // The position `depth_m` below the surface, along its normal.
  [[nodiscard]] glm::dvec3 at_depth(double depth_m) const { return touch_m_ - depth_m * normal_; }
  [[nodiscard]] double depth_of(const glm::dvec3& point_m) const;
  [[nodiscard]] const glm::dvec3& normal() const { return normal_; }
  [[nodiscard]] const World& world() const { return world_; }
  // Force with which the measurements press (N): well within the scene's limit.
  [[nodiscard]] double press_N() const { return press_N_; }

 private:
  BuiltScene built_;
  World world_;
  std::unique_ptr<WorldState> begin_, state_;
  glm::dvec3 touch_m_{0.0}, normal_{0.0, 0.0, 1.0}, free_m_{0.0};
  double press_N_ = 2.0;
};

// ---- passivity --------------------------------------------------------------------------------------------

// A motion that no hand makes. At the ticks it is a sinusoid about a depth, and between them it is linear. Of
// all motions through the same samples, the mechanism's damping dissipates least on the linear one.
struct DrivenMotion {
  int cycles = 1, ticks = 128;  // `cycles` whole cycles take `ticks` ticks
  double centre_m = 1e-3;       // depth
  double amplitude_m = 1e-5;    // less than centre_m
  double phase_rad = 0.0;
};

struct CycleEnergy {          // of one period of the motion in its steady state (J)
  double from_wall_J = 0.0;   // Σ F(k)·(x(k+1) − x(k)); the motors hold F(k) from tick k to k + 1
  double dissipated_J = 0.0;  // by the mechanism: b·Δx²/T + f·|Δx| in each tick
};
// Continues from the scene's state. The scene must have been restarted with this setting.
CycleEnergy drive(PressedScene& scene, const LoopSetting& setting, const DrivenMotion& motion);

// The largest stiffness of the coupling (N/m) at which no motion of a fine grid gets more energy out of the
// wall than the mechanism dissipates. Found by bisection to 0.1 %. The grid has all frequencies up to the
// Nyquist frequency. With an encoder step it also has amplitudes from 1/64 of the step on, and several places
// within the step. The result is 0 if even 1 N/m is not passive, and empty if all stiffnesses up to 10 MN/m
// are passive.
std::optional<double> measured_passive_stiffness(PressedScene& scene, const LoopSetting& setting);

// ---- stability --------------------------------------------------------------------------------------------

// A simulated device in a simulated hand. The hand presses it into the place, slowly and smoothly, and then
// holds still.
class HeldLoop {
 public:
  // `press_N` is the wall's force at rest. A hand without a spring presses by a spring of 1 N/m.
  HeldLoop(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m, double press_N);

  // Does one tick. `extra_N` is an external force in addition to the motors' (N, out of the surface). Returns
  // the tool's true depth (m), not that of the encoders.
  double step(double extra_N = 0.0);
  [[nodiscard]] double rest_depth_m() const { return rest_m_; }
  // Runs until the hand has arrived, and a while longer.
  void settle();
  // Knocks the tool: a short force, no larger than the press, that causes an oscillation of about
  // `amplitude_m`.
  void knock(double amplitude_m);

 private:
  PressedScene& scene_;
  const LoopSetting setting_;
  double stiffness_, rest_m_;
  std::unique_ptr<device::HapticDevice> device_;
};

// The largest stiffness of the coupling (N/m) at which a knock dies out. The result is 0 if even the softest
// stiffness is not stable, and empty if all stiffnesses up to 10 MN/m are stable.
//   Linear loop (no friction, no encoder): the sign of the growth rate of the envelope decides, far from all
//   limits. The bisection ends at 0.1 %. The softest stiffness is 20 N/m.
//   Other loops: the tool must come to rest after the knock, at several presses within one encoder step.
//   Stiffnesses are raised by factors of 1.3 until the tool does not; then a bisection ends at 0.5 %. At the
//   softest stiffness, at least 20 N/m, ten times the friction presses at most 2 mm deep.
std::optional<double> measured_stable_stiffness(PressedScene& scene, const LoopSetting& setting);

// Growth rate (1/s) of a knock's envelope in a linear loop. +infinity if it left the linear range, −infinity
// if the oscillation has vanished.
double envelope_growth(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m);

// ---- buzz -------------------------------------------------------------------------------------------------

// The vibration of the tool that is felt most. It is recorded for half a second, from one second after a
// knock on a steady press. The result is the worst of several presses within one encoder step.
Vibration pressed_vibration(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m);

// The stiffness of the coupling at which a steady press begins to buzz, that is to vibrate so that a hand
// feels it. Stiffnesses are tried from 100 N/m on, 1.15 apart (on tissue 1.6), up to the first that buzzes.
// Then a bisection ends at 1 %. None of the lower stiffnesses that were tried buzzes.
struct Buzz {
  std::optional<double> begins_N_per_m;  // empty: nowhere up to stiffest_N_per_m
  double stiffest_N_per_m = 0.0;
  Vibration vibration;  // at begins_N_per_m
};
Buzz measured_buzz(PressedScene& scene, const LoopSetting& setting);

}  // namespace hybrid
