// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/passivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <string>

#include "device/loop/force_limit.h"
#include "device/simulated/simulated.h"

namespace {

using device::DeviceModel;
using device::keep_passive;
using device::PassivityOptions;
using device::PassivityState;

constexpr double kTick_s = 1e-3;
constexpr double kSpare_J = 1e-7;  // tolerance that the header guarantees

// An independent account of the energy given to the hand, and of its excess over the largest work of one
// tick.
class Ledger {
 public:
  void tick(const glm::dvec3& position_m, const glm::dvec3& force_N) {
    if (started_) {
      const double work = glm::dot(last_N_, position_m - last_m_);
      given_J_ += work;
      worst_tick_J_ = std::max(worst_tick_J_, std::abs(work));
      beyond_J_ = std::max(beyond_J_, given_J_ - worst_tick_J_);
      most_given_J_ = std::max(most_given_J_, given_J_);
    }
    started_ = true;
    last_m_ = position_m;
    last_N_ = force_N;
  }
  [[nodiscard]] double beyond_J() const { return beyond_J_; }
  [[nodiscard]] double most_given_J() const { return most_given_J_; }
  [[nodiscard]] double worst_tick_J() const { return worst_tick_J_; }

 private:
  bool started_ = false;
  glm::dvec3 last_m_{0.0}, last_N_{0.0};
  double given_J_ = 0.0, worst_tick_J_ = 0.0, beyond_J_ = 0.0, most_given_J_ = 0.0;
};

TEST(Passivity, RandomForcesOnRandomMotionsNeverGiveMoreThanOneTicksWorst) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(-1.0, 1.0), size(-7.0, -2.4);
  for (int run = 0; run < 300; ++run) {
    const double way_m = std::pow(10.0, size(random));  // 0.1 µm to 4 mm per tick
    const double force_N = std::pow(10.0, 3.0 * unit(random));
    const double dt_s = run % 3 == 0 ? 1e-4 : run % 3 == 1 ? 1e-3 : 1e-2;
    const bool chasing = run % 2 == 0;  // the worst case: the tool moves along with the force
    const double step_m = run % 5 == 0 ? 0.03e-3 : 0.0;
    if (way_m > 2.0 * dt_s) continue;  // faster than any tool
    PassivityState state;
    Ledger ledger;
    glm::dvec3 position(0.0), force(0.0);
    for (int tick = 0; tick < 2000; ++tick) {
      glm::dvec3 way = way_m * glm::dvec3(unit(random), unit(random), unit(random)) / std::sqrt(3.0);
      if (chasing && tick % 3 != 0 && glm::dot(way, force) < 0.0) way = -way;
      position += way;
      const glm::dvec3 told = step_m > 0.0 ? glm::round(position / step_m) * step_m : position;
      const glm::dvec3 asked = force_N * glm::dvec3(unit(random), unit(random), unit(random));
      force = keep_passive({.resolution_m = step_m}, state, asked, told, dt_s);
      ASSERT_LE(glm::length(force), glm::length(asked) * (1.0 + 1e-15));
      ASSERT_GE(glm::dot(force, asked), 0.0);
      ledger.tick(told, force);
      ASSERT_LE(ledger.beyond_J(), kSpare_J + 1e-12) << "run " << run << " tick " << tick;
    }
    ASSERT_EQ(state.jumps, 0U) << run;
    ASSERT_GE(state.most_given_J + 1e-15, ledger.most_given_J()) << "the observer never tells too little";
  }
}

TEST(Passivity, JumpsAreCountedAndNothingButFiniteForcesComeOut) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  PassivityState state;
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL, 0.0, -1.0};
  for (int tick = 0; tick < 20'000; ++tick) {
    glm::dvec3 position(1e-4 * unit(random), 0, 0), asked(unit(random), unit(random), 0);
    double dt_s = kTick_s;
    if (tick % 97 == 0) position.x = 1.0;
    if (tick % 31 == 0) position.y = bad[tick % 4];
    if (tick % 29 == 0) asked.z = bad[tick % 4];
    if (tick % 23 == 0) dt_s = bad[tick % 4];
    const glm::dvec3 force = keep_passive({}, state, asked, position, dt_s);
    ASSERT_TRUE(std::isfinite(glm::length(force)));
    if (std::isfinite(glm::length(asked))) {
      ASSERT_LE(glm::length(force), glm::length(asked) * (1.0 + 1e-15));
    }
  }
  EXPECT_GT(state.jumps, 0U);
  EXPECT_TRUE(std::isfinite(state.given_J) && std::isfinite(state.worst_tick_J));
}

struct Press {
  double beyond_J = 0.0, most_given_J = 0.0, taken_rms_N = 0.0, most_taken_N = 0.0, sway_m = 0.0,
         mean_N = 0.0;
  std::uint64_t jumps = 0;
};

// Presses 8 mm into a wall at 50 mm/s and holds. Does this twice.
Press press(DeviceModel model, device::Grip grip, double stiffness, int delay_ticks, bool control) {
  device::SimulatedDeviceOptions options;
  options.mechanism = device::mechanism(model);
  options.hand = device::hand_of(grip);
  options.delay_ticks = delay_ticks;
  const auto tool = make_simulated_device(options, device::make_path(device::PressPath{.from_m = {0, 0, 0.01},
                                                                                       .to_m = {0, 0, -0.008},
                                                                                       .speed_m_per_s = 0.05,
                                                                                       .hold_s = 1.5,
                                                                                       .repeat = 2}));
  device::ForceLimitState limit;
  const device::ForceLimits limits{.max_force_N = options.mechanism.limits.max_force_N};
  PassivityState state;
  Ledger ledger;
  Press out;
  double low = 1.0, high = -1.0;
  for (int tick = 0; tick < 5000; ++tick) {
    const device::DeviceState read = tool->read();
    const double z = read.position_m.z;
    glm::dvec3 force = limit_force(limits, limit, {0, 0, z < 0.0 ? -stiffness * z : 0.0}, read, kTick_s);
    if (control) {
      force = keep_passive({.resolution_m = options.mechanism.limits.resolution_m}, state, force,
                           read.position_m, kTick_s);
    }
    ledger.tick(read.position_m, force);
    tool->write(force, kTick_s);
    if (tick < 1300 || tick >= 1800) continue;
    low = std::min(low, z);
    high = std::max(high, z);
    out.mean_N += force.z / 500.0;
  }
  out.beyond_J = ledger.beyond_J();
  out.most_given_J = ledger.most_given_J();
  out.taken_rms_N = std::sqrt(state.taken_sum_N2 / std::max<double>(1.0, static_cast<double>(state.felt)));
  out.most_taken_N = state.most_taken_N;
  out.sway_m = high - low;
  out.jumps = state.jumps;
  return out;
}

TEST(Passivity, WallsFarBeyondTheBoundaryWithAnyDelayGiveNoMoreThanOneTicksWorst) {
  for (const DeviceModel model : {DeviceModel::premium_1_5, DeviceModel::touch}) {
    for (const device::Grip grip : {device::Grip::loose, device::Grip::medium, device::Grip::firm}) {
      for (const int delay_ticks : {0, 1, 2, 8}) {
        for (const double stiffness : {300.0, 2500.0, 5e3, 30e3, 1e6}) {
          const Press held = press(model, grip, stiffness, delay_ticks, true);
          EXPECT_LE(held.beyond_J, 0.0) << stiffness << " N/m, " << delay_ticks << " ticks";
          EXPECT_EQ(held.jumps, 0U);
        }
      }
    }
  }
}

TEST(Passivity, AWallThatBuzzesIsHeldAsASofterOne) {
  for (const int delay_ticks : {0, 1}) {
    for (const double stiffness : {30e3, 100e3, 1e6}) {
      const Press buzzing =
          press(DeviceModel::premium_1_5, device::Grip::medium, stiffness, delay_ticks, false);
      const Press held = press(DeviceModel::premium_1_5, device::Grip::medium, stiffness, delay_ticks, true);
      EXPECT_GT(buzzing.sway_m, 1e-3);
      EXPECT_GT(buzzing.most_given_J, 0.1);
      EXPECT_LE(held.sway_m, 0.03e-3) << "an encoder step";
      EXPECT_GT(held.mean_N, 3.0) << "the hand presses with 4.8 N at most";
    }
  }
}

TEST(Passivity, WhereTheLoopIsPassiveItCostsLittle) {
  // The controller must take less than a just noticeable difference, which is 7 % of the pressing force of 3
  // N.
  for (const DeviceModel model : {DeviceModel::premium_1_5, DeviceModel::touch}) {
    for (const device::Grip grip : {device::Grip::loose, device::Grip::medium, device::Grip::firm}) {
      for (const double stiffness : {100.0, 300.0, 1000.0}) {
        const Press held = press(model, grip, stiffness, 0, true);
        EXPECT_LT(held.most_taken_N, 0.08) << stiffness;
        EXPECT_LT(held.taken_rms_N, 0.04) << stiffness;
        RecordProperty("rms_mN_" + std::to_string(static_cast<int>(stiffness)),
                       std::to_string(1e3 * held.taken_rms_N));
      }
    }
  }
}

TEST(Passivity, AForceThatIsPressedInAndHandedBackPassesUnchangedWhereNothingIsLostToSampling) {
  // Pure friction opposes every motion, so the controller must remove nothing.
  PassivityState state;
  double x = 0.0;
  for (int tick = 0; tick < 3000; ++tick) {
    const double before = x;
    x = 0.01 * std::sin(0.005 * (tick + 1));
    const glm::dvec3 asked(x > before ? -0.3 : 0.3, 0, 0);
    const glm::dvec3 force = keep_passive({}, state, asked, {x, 0, 0}, kTick_s);
    if (tick > 5 && std::abs(std::cos(0.005 * tick)) > 0.05) {
      ASSERT_EQ(force, asked) << tick;
    }
  }
}

TEST(Passivity, AForceThatLostItsFirstTickComesBackWithinThreeMillimetres) {
  // At the start, the tool is pushed back by one encoder step. Then it is pressed in.
  PassivityState state;
  const auto wall = [](double x) { return glm::dvec3(x < 0.0 ? -1000.0 * x : 0.0, 0, 0); };
  const PassivityOptions options{.resolution_m = 0.03e-3};
  for (int tick = 0; tick < 2000; ++tick) keep_passive(options, state, {0, 0, 0}, {0, 0, 0}, kTick_s);
  keep_passive(options, state, wall(-0.03e-3), {-0.03e-3, 0, 0}, kTick_s);
  keep_passive(options, state, wall(0.0), {0, 0, 0}, kTick_s);
  EXPECT_GT(state.given_J, 0.0);
  double x = 0.0;
  while (x > -4e-3) {
    x -= 0.03e-3;
    keep_passive(options, state, wall(x), {x, 0, 0}, kTick_s);
    if (state.given_J < 0.0) break;
  }
  EXPECT_GT(x, -3e-3);
}

}  // namespace
