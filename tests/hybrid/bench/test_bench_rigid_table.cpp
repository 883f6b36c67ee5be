// SPDX-License-Identifier: GPL-3.0-or-later
// The default rows of `hybrid bench rigid`, and its table of ratios.
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "hybrid/bench/rigid.h"

namespace {

using hybrid::bench::bench_rigid;
using hybrid::bench::Engine;
using hybrid::bench::ratio_table;
using hybrid::bench::RigidBenchOptions;
using hybrid::bench::RigidRow;

TEST(BenchRigidTable, MovingIsRunOnMeshesOfAllSizes) {
  RigidBenchOptions options;
  options.quick = true;
  options.paths = {"moving"};
  options.engines = {Engine::hybrid};
  std::set<std::string> meshes;
  for (const RigidRow& row : bench_rigid(options)) meshes.insert(row.mesh);
  EXPECT_EQ(meshes, (std::set<std::string>{"ico3", "ico5", "cube1"}));
}

TEST(BenchRigidTable, ItEndsWithTheGeometricMeansOfTheRatiosOfLeastTimes) {
  // Rows whose ratios are 2 and 8: the geometric mean is 4.
  std::vector<RigidRow> rows(4);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i].path = i < 2 ? "slide" : "tap";
    rows[i].engine = i % 2 == 0 ? Engine::hybrid : Engine::finger_proxy;
    const double us = i % 2 == 0 ? 1.0 : i == 1 ? 2.0 : 8.0;
    rows[i].least_us = {.p50 = us, .p99 = us, .p999 = us, .max = us};
  }
  // A third ratio, of an engine that was stopped early, is marked and not in the mean.
  rows.insert(rows.end(), {rows[0], rows[1]});
  rows[4].path = rows[5].path = "moving";
  rows[4].ticks = 10;
  rows[5].ticks = 9;
  const std::string ratios = ratio_table(rows);
  EXPECT_NE(ratios.find("   2.00*    2.00*\n"), std::string::npos) << ratios;
  EXPECT_NE(ratios.find("    2.00     2.00\n"), std::string::npos) << ratios;
  EXPECT_NE(ratios.find("    8.00     8.00\n"), std::string::npos) << ratios;
  EXPECT_EQ(ratios.substr(ratios.rfind("mean")).find("4.00     4.00"),
            ratios.size() - ratios.rfind("mean") - 14)
      << ratios;
}

}  // namespace
