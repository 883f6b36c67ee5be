// SPDX-License-Identifier: GPL-3.0-or-later
// The sweep kernel in every register width of this processor, and the set of moved rows.
#include "voxel/chain/sweep_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "voxel/chain/row_set.h"

namespace voxel {
namespace {

// A strip (rows consecutive in y), and the strips before it in z and in x. Each strip has an empty row at
// both ends.
struct Strips {
  static constexpr int kRows = 12;
  static constexpr std::size_t kAll = kRows + 2;

  std::array<std::vector<float>, 3> u;  // the strip itself, the one before it in z, the one before it in x
  std::array<std::vector<std::uint8_t>, 3> labels;
  std::array<std::vector<RowInfo>, 3> info;
  std::vector<std::uint8_t> pending;

  Strips(std::mt19937& random, int materials, bool layers) : pending(kAll) {
    std::uniform_real_distribution<float> displacement(-1.0F, 1.0F);
    std::uniform_int_distribution<int> label(1, materials), any(0, 9);
    for (std::size_t s = 0; s < 3; ++s) {
      u[s].resize(kAll * kRow);
      labels[s].resize(kAll * kRow +
                       kRow);  // room for the kernel, which reads whole registers of labels beyond the end
      info[s].resize(kAll);
      const int of_strip = label(random);
      for (std::size_t row = 1; row <= kRows; ++row) {
        const int of_row = any(random) == 0 ? label(random) : of_strip;
        for (std::size_t i = 0; i < kRow; ++i) {
          u[s][row * kRow + i] = displacement(random);
          labels[s][row * kRow + i] = static_cast<std::uint8_t>(layers             ? of_row
                                                                : any(random) == 0 ? 0
                                                                                   : label(random));
        }
        info[s][row].free = 0xFFFFFFFFU;
        info[s][row].filled = info[s][row].known = true;
        if (layers) info[s][row].label = static_cast<std::uint8_t>(of_row);
      }
    }
    for (std::size_t row = 1; row <= kRows; ++row)
      pending[row] = static_cast<std::uint8_t>(any(random) < 3 ? kFromBelowZ : 0);
    pending[1] = kFromBelowY;
  }
};

// [label] random half limits of labels 1 to 39. All other entries are large, because label 0 has no links and
// labels above 39 do not occur.
std::vector<float> halves(std::mt19937& random) {
  std::uniform_real_distribution<float> limit(0.01F, 0.2F);
  std::vector<float> out(256, 1e30F);
  for (std::size_t n = 1; n < 40; ++n) out[n] = limit(random);
  return out;
}

TEST(SweepKernel, AllWidthsOfRegistersGiveTheSameBits) {
  const auto kernels = sweep_kernels();
  if (kernels.size() < 2) GTEST_SKIP() << "this processor has one width of registers for sweeps";
  std::mt19937 random(5);
  int moved = 0, revisits = 0;
  for (int n = 0; n < 4000; ++n) {
    const bool layers = n % 2 == 0, raise = n % 4 < 2;
    const int registers = n % 3, materials = registers == 1 ? 7 : registers == 2 ? 15 : 30;
    const Strips start(random, materials, layers);
    const std::vector<float> y_in = halves(random), y_back = halves(random), z_in = halves(random),
                             z_back = halves(random), x_in = halves(random), x_back = halves(random);
    const bool has_z = n % 5 != 0, downwards = n % 7 == 0, x_above = n % 11 == 0;
    std::vector<Strips> ends;
    std::vector<std::array<Moved, Strips::kRows>> moves;
    std::vector<SweepResult> done;
    for (const SweepKernels& kernel : kernels) {
      Strips strips = start;
      const std::size_t first = downwards ? Strips::kRows : 1;
      const auto strip = [&](std::size_t s) {
        return RowStrip{strips.u[s].data() + first * kRow, strips.labels[s].data() + first * kRow,
                        strips.info[s].data() + first};
      };
      SweepTask task;
      task.own = strip(0);
      if (has_z) task.z = strip(1);
      task.x = strip(2);
      task.pending = strips.pending.data() + first;
      task.mask = kFromBelowY | kFromBelowX | kFromBelowZ;
      task.step = downwards ? -1 : 1;
      task.count = task.max_rows = Strips::kRows;
      task.along_y = {y_in.data(), y_back.data()};
      task.along_z = {z_in.data(), z_back.data()};
      task.along_x = {x_in.data(), x_back.data()};
      task.up = x_in.data();
      task.down = x_back.data();
      task.registers = registers;
      task.x_above = x_above;
      task.margin = 1e-6F;
      std::array<Moved, Strips::kRows> what{};
      done.push_back((raise ? kernel.raise : kernel.lower)(task, 100, what.data()));
      ends.push_back(std::move(strips));
      moves.push_back(what);
    }
    for (std::size_t k = 1; k < ends.size(); ++k) {
      ASSERT_EQ(ends[k].u, ends[0].u) << n;
      ASSERT_EQ(ends[k].pending, ends[0].pending) << n;
      ASSERT_EQ(moves[k], moves[0]) << n;
      ASSERT_EQ(done[k].end, done[0].end) << n;
      ASSERT_EQ(done[k].visits, done[0].visits) << n;
    }
    for (const Moved m : moves[0]) {
      moved += m != kNothingMoved ? 1 : 0;
      revisits += (m & (kRevisitX | kRevisitY | kRevisitZ)) != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(moved, 4000);
  EXPECT_GT(revisits, 1000);
}

TEST(RowSet, HoldsEachRowOnceInTheOrderInWhichTheyCame) {
  constexpr RowId kRows = 1000;
  std::mt19937 random(9);
  std::uniform_int_distribution<RowId> any(0, kRows - 1), count(1, 200);
  RowSet runs(kRows);
  for (int n = 0; n < 300; ++n) {
    runs.clear();
    EXPECT_TRUE(runs.empty());
    std::vector<RowId> expected;
    std::vector<bool> in(kRows);
    const auto expect = [&](RowId row) {
      if (!in[row]) expected.push_back(row);
      in[row] = true;
    };
    for (int k = 0; k < 20; ++k) {
      const RowId from = any(random);
      if (k % 3 == 0) {
        const RowId rows = std::min(count(random), kRows - from);
        runs.add(from, rows);
        for (RowId row = from; row < from + rows; ++row) expect(row);
      } else {
        runs.add(from);
        expect(from);
      }
    }
    ASSERT_EQ(std::vector<RowId>(runs.begin(), runs.end()), expected);
    EXPECT_EQ(runs.size(), expected.size());
    for (RowId row = 0; row < kRows; ++row) ASSERT_EQ(runs.has(row), in[row]);
  }
}

}  // namespace
}  // namespace voxel
