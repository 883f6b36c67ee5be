// SPDX-License-Identifier: GPL-3.0-or-later
// A tick does only a share of its work. The share follows the time that ticks take.
#include "hybrid/tick/tissue/work_budget.h"

#include <gtest/gtest.h>

namespace {

TEST(WorkShare, FollowsWhatTicksTake) {
  hybrid::WorkShare share(1e-3);
  const auto felt = [&share](int ticks, double tick_us, bool pressed) {
    for (int n = 0; n < ticks; ++n) share.observe(tick_us, pressed);
    return static_cast<int>(share.steps());
  };
  EXPECT_EQ(felt(1000, 390.0, true), 0);
  // After a late tick the share falls at once: by one step, or by two if the tick was very late. It never
  // falls below a third.
  EXPECT_EQ(felt(1, 450.0, true), 1);
  EXPECT_EQ(felt(1, 800.0, true), 3);
  EXPECT_EQ(felt(100, 5000.0, true), hybrid::WorkShare::kMostSteps);
  EXPECT_NEAR(hybrid::WorkShare::share(share.steps()), 0.354, 1e-3);
  // The share rises slowly, only while tissue is pressed and only if time allows.
  EXPECT_EQ(felt(10'000, 30.0, false), hybrid::WorkShare::kMostSteps);
  EXPECT_EQ(felt(10'000, 350.0, true), hybrid::WorkShare::kMostSteps);
  EXPECT_EQ(felt(59, 250.0, true), hybrid::WorkShare::kMostSteps);
  EXPECT_EQ(felt(1, 250.0, true), hybrid::WorkShare::kMostSteps - 1);
  EXPECT_EQ(felt(2000, 250.0, true), 0);
}

// The time of a tick grows with its work. The share must not oscillate, so hardly any tick takes longer than
// half a period.
TEST(WorkShare, ComesToRestOnAMachineOfAnySpeed) {
  for (const double slow : {0.5, 1.0, 2.0, 2.5}) {
    hybrid::WorkShare share(1e-3);
    int late = 0;
    for (int n = 0; n < 20'000; ++n) {
      const double tick_us = slow * (100.0 + 250.0 * hybrid::WorkShare::share(share.steps()));
      if (tick_us > 500.0) ++late;
      share.observe(tick_us, true);
    }
    EXPECT_LE(late, 5) << slow;
  }
}

}  // namespace
