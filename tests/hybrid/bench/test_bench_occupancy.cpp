// SPDX-License-Identifier: GPL-3.0-or-later
// Results of `hybrid bench occupancy`: every answer of the map equals those of the tree and of brute force.
// Times are not tested here.
#include "hybrid/bench/occupancy.h"

#include <gtest/gtest.h>

#include <set>

namespace {

using hybrid::bench::OccupancyPattern;
using hybrid::bench::OccupancyRow;
using hybrid::bench::OccupancyWhat;

TEST(BenchOccupancy, NoAnswerIsMissedAndOfVoxelsNoneIsTooMany) {
  std::size_t told = 0;
  hybrid::bench::OccupancyBenchOptions options;
  options.quick = true;
  options.cells = {3000};
  options.on_row = [&told](const OccupancyRow&) { ++told; };
  const std::vector<OccupancyRow> rows = hybrid::bench::bench_occupancy(options);
  EXPECT_EQ(told, rows.size());
  std::set<std::string> ops, engines;
  for (const OccupancyRow& row : rows) {
    SCOPED_TRACE(hybrid::bench::occupancy_table_line(row));
    ops.insert(row.op);
    engines.insert(engine_name(row.engine));
    EXPECT_GT(row.cells, 0U);
    EXPECT_GT(row.p50_ns, 0.0);
    EXPECT_LE(row.p50_ns, row.p99_ns);
    EXPECT_EQ(row.missed, 0U);
    if (row.op != "lookup") continue;
    EXPECT_GT(row.checked, 0U);
    EXPECT_NE(row.reference, engine_name(row.engine));
    if (row.what != OccupancyWhat::triangles) {
      EXPECT_EQ(row.extra, 0U);
    }
    EXPECT_EQ(row.found_mean > 0.0, row.pattern != OccupancyPattern::empty);
  }
  EXPECT_EQ(ops.size(), 3U);
  EXPECT_EQ(engines.size(), 3U);
}

}  // namespace
