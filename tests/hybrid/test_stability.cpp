// SPDX-License-Identifier: GPL-3.0-or-later
// The measured boundaries of the haptic loop, against theory, at a handful of settings. `hybrid stability`
// measures them all.
#include <gtest/gtest.h>

#include <cstdio>
#include <chrono>

#include "device/loop_theory.h"
#include "hybrid/scene.h"
#include "hybrid/stability_loop.h"

namespace {

using hybrid::LoopSetting;

hybrid::PressedScene wall() {
  return hybrid::PressedScene(hybrid::load_scene(std::string(HYBRID_SOURCE_DIR) + "/scenes/wall.toml"));
}

TEST(Explore, Buzz) {
  hybrid::PressedScene scene = wall();
  for (const auto model : {device::DeviceModel::premium_1_5, device::DeviceModel::touch})
    for (const auto grip : {device::Grip::loose, device::Grip::medium, device::Grip::firm})
     for (int delay = 0; delay <= 1; ++delay) {
      LoopSetting s;
      s.mechanism = device::mechanism(model);
      s.hand = device::hand_of(grip);
      s.delay_ticks = delay;
      const auto t0 = std::chrono::steady_clock::now();
      const auto b = hybrid::measured_buzz(scene, s);
      const auto t1 = std::chrono::steady_clock::now();
      const auto k = hybrid::measured_stable_stiffness(scene, s);
      const auto t2 = std::chrono::steady_clock::now();
      const auto v = hybrid::pressed_vibration(scene, s, s.mechanism.limits.max_stiffness_N_per_m);
      std::printf("%d grip %d d %d: buzz %.0f at %.1f Hz %.2f um (%.1f s); rest to %.0f (%.1f s), linear %.0f; nominal felt %.3f\n", (int)model, (int)grip, delay, b.begins_N_per_m.value_or(-1), b.vibration.frequency_hz,
        b.vibration.amplitude_m * 1e6, std::chrono::duration<double>(t1 - t0).count(), k.value_or(-1), std::chrono::duration<double>(t2 - t1).count(), device::largest_stable_stiffness(hybrid::held_loop(s)), v.felt);
      std::fflush(stdout);
    }
}

TEST(Explore, Table) {
  hybrid::PressedScene scene = wall();
  for (const double b : {0.5, 2.0, 5.0}) {
   for (const double rate : {1000.0, 5000.0})
    for (const double B : {0.0, 1.0})
    for (int delay = 0; delay <= 2; ++delay) {
      LoopSetting s;
      s.rate_hz = rate;
      s.mechanism.viscous_N_s_per_m = b;
      s.hand = {0.006, 0.0, 0.0};
      s.delay_ticks = delay;
      s.wall_damping_N_s_per_m = B;
      auto loop = hybrid::held_loop(s);
      const auto t0 = std::chrono::steady_clock::now();
      const double k = hybrid::measured_stable_stiffness(scene, s).value_or(-1);
      const auto t1 = std::chrono::steady_clock::now();
      const double p = hybrid::measured_passive_stiffness(scene, s).value_or(-1);
      const auto t2 = std::chrono::steady_clock::now();
      const double kt = device::largest_stable_stiffness(loop), pt = device::largest_passive_stiffness(hybrid::bare_loop(s));
      std::printf("b %.1f rate %.0f B %.1f d %d: stable %.1f / %.1f = %.4f (%.2f s)  passive %.1f / %.1f = %.4f (%.2f s)\n", b, rate, B, delay, k, kt, k / kt,
         std::chrono::duration<double>(t1 - t0).count(), p, pt, p / pt, std::chrono::duration<double>(t2 - t1).count());
      std::fflush(stdout);
    }
  }
}

}  // namespace
