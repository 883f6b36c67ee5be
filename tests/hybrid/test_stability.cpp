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
      const double k = hybrid::measured_stable_stiffness(scene, s);
      const auto t1 = std::chrono::steady_clock::now();
      const double p = hybrid::measured_passive_stiffness(scene, s);
      const auto t2 = std::chrono::steady_clock::now();
      const double kt = device::largest_stable_stiffness(loop), pt = device::largest_passive_stiffness(hybrid::bare_loop(s));
      std::printf("b %.1f rate %.0f B %.1f d %d: stable %.1f / %.1f = %.4f (%.2f s)  passive %.1f / %.1f = %.4f (%.2f s)\n", b, rate, B, delay, k, kt, k / kt,
         std::chrono::duration<double>(t1 - t0).count(), p, pt, p / pt, std::chrono::duration<double>(t2 - t1).count());
      std::fflush(stdout);
    }
  }
}

}  // namespace
