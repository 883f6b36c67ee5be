// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/linear_flow.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace {

using device::linear_flow;
using device::LinearFlow;

using Matrix = std::array<std::array<long double, 3>, 3>;

Matrix product(const Matrix& a, const Matrix& b) {
  Matrix c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k) c[i][j] += a[i][k] * b[k][j];
    }
  }
  return c;
}

// An independent computation of the exponential of [[0 1 0] [−q −p 1] [0 0 0]]·t, by scaling and squaring.
// Long double has 11 more bits.
Matrix by_squaring(long double p, long double q, long double t) {
  int halvings = 0;
  while ((p + std::sqrt(q) + 1.0L) * t > 0.01L) {
    t *= 0.5L;
    ++halvings;
  }
  const Matrix a{{{0, t, 0}, {-q * t, -p * t, t}, {0, 0, 0}}};
  Matrix sum{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, term = sum;
  for (int n = 1; n < 30; ++n) {
    term = product(term, a);
    for (auto& row : term) {
      for (auto& x : row) x /= n;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) sum[i][j] += term[i][j];
    }
  }
  for (; halvings > 0; --halvings) sum = product(sum, sum);
  return sum;
}

TEST(LinearFlow, IsTheMatrixExponential) {
  // The cases cover every branch: short times, oscillation, near-critical damping (13.94 N·s/m at 0.081 kg
  // and 600 N/m), and overdamping.
  for (const double mass : {0.02, 0.081, 5.0}) {
    for (const double stiffness : {0.0, 1e-6, 1.0, 255.0, 600.0, 25e3, 1e6}) {
      const double critical = 2.0 * std::sqrt(mass * stiffness);
      for (const double damping :
           {0.0, 0.005, 5.0, 7.4, 40.0, 0.999 * critical, critical, 1.001 * critical}) {
        for (const double time : {1e-9, 2e-5, 1e-4, 1e-3, 3e-3, 1e-2, 0.03, 0.1}) {
          const LinearFlow flow = linear_flow(mass, damping, stiffness, time);
          const Matrix exact = by_squaring(damping / mass, stiffness / mass, time);
          // The last two coefficients pass through zero, so their errors are compared with the largest size
          // that they may have.
          const double sum_error = std::abs(static_cast<double>(flow.from_acceleration_s2 - exact[0][2]));
          const double speed_error = std::abs(static_cast<double>(flow.from_velocity_s - exact[0][1]));
          const double keep_error = std::abs(static_cast<double>(flow.velocity_factor - exact[1][1]));
          ASSERT_LE(sum_error, 1e-12 * std::abs(static_cast<double>(exact[0][2])))
              << mass << ' ' << stiffness << ' ' << damping << ' ' << time;
          ASSERT_LE(speed_error, 1e-12 * time) << mass << ' ' << stiffness << ' ' << damping << ' ' << time;
          ASSERT_LE(keep_error, 1e-12) << mass << ' ' << stiffness << ' ' << damping << ' ' << time;
        }
      }
    }
  }
}

TEST(LinearFlow, TheExtremesAreFinite) {
  for (const double stiffness : {0.0, 1e-300, 1e300}) {
    for (const double damping : {0.0, 1e-300, 1e150}) {
      for (const double time : {1e-300, 1e-3, 1e12}) {
        const LinearFlow flow = linear_flow(0.08, damping, stiffness, time);
        EXPECT_TRUE(std::isfinite(flow.from_velocity_s) && std::isfinite(flow.velocity_factor))
            << stiffness << ' ' << damping << ' ' << time;
        EXPECT_LE(std::abs(flow.velocity_factor), 1.0 + 1e-9);
      }
    }
  }
  const LinearFlow none = linear_flow(0.08, 5.0, 600.0, 0.0);
  EXPECT_EQ(none.velocity_factor, 1.0);
  EXPECT_EQ(none.from_velocity_s, 0.0);
}

}  // namespace
