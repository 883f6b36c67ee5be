// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace {

using hybrid::Axis;
using hybrid::Scale;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(NiceTicks, AreRoundEvenlySpacedAndInside) {
  for (const double size : {1e-9, 3.7e-4, 1.0, 42.0, 9.99e8}) {
    for (const double from : {-0.3 * size, 0.0, 17.0 * size}) {
      const auto ticks = hybrid::nice_ticks(from, from + size, 8);
      ASSERT_GE(ticks.size(), 3U) << size;
      ASSERT_LE(ticks.size(), 12U);
      const double step = ticks[1] - ticks[0];
      const double mantissa = step / std::pow(10.0, std::floor(std::log10(step * (1.0 + 1e-9))));
      EXPECT_TRUE(std::abs(mantissa - 1.0) < 1e-6 || std::abs(mantissa - 2.0) < 1e-6 ||
                  std::abs(mantissa - 5.0) < 1e-6)
          << mantissa;
      for (std::size_t i = 0; i < ticks.size(); ++i) {
        EXPECT_GE(ticks[i], from - 1e-6 * step);
        EXPECT_LE(ticks[i], from + size + 1e-6 * step);
        EXPECT_NEAR(ticks[i] / step, std::round(ticks[i] / step), 1e-6);
      }
    }
  }
  EXPECT_TRUE(hybrid::nice_ticks(1.0, 1.0, 5).empty());
  EXPECT_TRUE(hybrid::nice_ticks(nan, 1.0, 5).empty());
}

TEST(TickText, HasTheDecimalsItsStepNeeds) {
  EXPECT_EQ(hybrid::tick_text(0.5, 0.5), "0.5");
  EXPECT_EQ(hybrid::tick_text(2.0, 0.25), "2.00");
  EXPECT_EQ(hybrid::tick_text(40.0, 20.0), "40");
  EXPECT_EQ(hybrid::tick_text(0.1 * 3 - 0.3, 0.1), "0");
  EXPECT_EQ(hybrid::tick_text(-2.0, 1.0), "−2");
  EXPECT_EQ(hybrid::tick_text(1000.0, 1000.0), "1000");
  EXPECT_EQ(hybrid::tick_text(12'000.0, 2000.0), "12,000");
  EXPECT_EQ(hybrid::tick_text(3e6, 1e6), "3,000,000");
  EXPECT_EQ(hybrid::tick_text(-2e-6, 1e-6), "−0.000002");
}

TEST(QuantityText, HasAPrefixAndNoExponent) {
  EXPECT_EQ(hybrid::quantity_text(1e-8, "s"), "10 ns");
  EXPECT_EQ(hybrid::quantity_text(1e-6, "s"), "1 µs");
  EXPECT_EQ(hybrid::quantity_text(1e-3, "s"), "1 ms");
  EXPECT_EQ(hybrid::quantity_text(5e-4, "s"), "500 µs");
  EXPECT_EQ(hybrid::quantity_text(2.0, "s"), "2 s");
  EXPECT_EQ(hybrid::quantity_text(0.0, "N"), "0 N");
  EXPECT_EQ(hybrid::quantity_text(-4e3, "N/m"), "−4 kN/m");
}

TEST(AxisTest, ShowsOneBesideAHundredOnASymmetricScale) {
  const Axis axis(Scale::symmetric, {-100.0, 100.0}, 0.0, 600.0);
  EXPECT_NEAR(axis.page(0.0), 300.0, 1e-9);
  // The intervals 0 to 1, 1 to 10 and 10 to 100 are equally long.
  for (const double side : {-1.0, 1.0}) {
    EXPECT_NEAR(axis.page(side), 300.0 + side * 100.0, 1e-9);
    EXPECT_NEAR(axis.page(side * 10.0), 300.0 + side * 200.0, 1e-9);
    EXPECT_NEAR(axis.page(side * 100.0), 300.0 + side * 300.0, 1e-9);
    EXPECT_NEAR(axis.page(side * 0.5), 300.0 + side * 50.0, 1e-9);
  }
  EXPECT_EQ(axis.ticks(4), (std::vector<double>{-100.0, -10.0, -1.0, 0.0, 1.0, 10.0, 100.0}));
  EXPECT_EQ(Axis(Scale::symmetric, {-0.4, 30.0}, 0.0, 1.0).ticks(4), (std::vector<double>{0.0, 1.0, 10.0}));
}

TEST(AxisTest, HasPowersOfTenOnALogarithmicScale) {
  const Axis axis(Scale::logarithmic, {1e-9, 1e-3}, 60.0, 0.0);
  EXPECT_NEAR(axis.page(1e-9), 60.0, 1e-9);
  EXPECT_NEAR(axis.page(1e-6), 30.0, 1e-9);
  EXPECT_FALSE(std::isfinite(axis.page(0.0)));
  EXPECT_FALSE(std::isfinite(axis.page(-1.0)));
  EXPECT_EQ(axis.ticks(6).size(), 7U);
  // An axis of a single decade has ticks between the powers of ten.
  EXPECT_EQ(Axis(Scale::logarithmic, {1.0, 10.0}, 0.0, 1.0).ticks(5),
            (std::vector<double>{1.0, 2.0, 5.0, 10.0}));
  // One power of ten alone would give no scale.
  for (const auto& [from, to] : {std::pair(0.11, 9.5), {0.03, 0.4}, {2.0, 9.0}, {1.0, 9.9}, {15.0, 950.0}}) {
    for (int wanted = 3; wanted < 10; ++wanted)
      EXPECT_GE(Axis(Scale::logarithmic, {from, to}, 0.0, 1.0).ticks(wanted).size(), 2U) << from << " " << to;
  }
}

TEST(AxisTest, SqueezesIntervalsAndStaysInOrder) {
  // An axis of 10 s. The intervals 2 to 5 s and 6 to 10 s are squeezed, so 3 s share the remaining pixels.
  const Axis axis(Scale::linear, {0.0, 10.0}, 100.0, 300.0, {{2.0, 5.0}, {6.0, 10.0}});
  const double per_s = (200.0 - 2.0 * Axis::kSqueezed_px) / 3.0;
  EXPECT_NEAR(axis.page(0.0), 100.0, 1e-9);
  EXPECT_NEAR(axis.page(1.0), 100.0 + per_s, 1e-9);
  EXPECT_NEAR(axis.page(5.0) - axis.page(2.0), Axis::kSqueezed_px, 1e-9);
  EXPECT_NEAR(axis.page(6.0) - axis.page(5.0), per_s, 1e-9);
  EXPECT_NEAR(axis.page(10.0), 300.0, 1e-9);
  for (double t = 0.0; t < 10.0; t += 0.1) EXPECT_LT(axis.page(t), axis.page(t + 0.1));
  for (const double tick : axis.ticks(8)) {
    EXPECT_FALSE(tick > 2.0 && tick < 5.0) << tick;
    EXPECT_FALSE(tick > 6.0 && tick < 10.0) << tick;
  }
  EXPECT_GE(axis.ticks(8).size(), 4U);
}

}  // namespace
