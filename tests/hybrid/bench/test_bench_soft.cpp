// SPDX-License-Identifier: GPL-3.0-or-later
// Results of `hybrid bench soft`, and tests that its checks detect wrong results. Times are not tested here.
#include "hybrid/bench/soft.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "hybrid/bench/soft_convergence.h"
#include "hybrid/bench/soft_engines.h"

namespace {

using hybrid::bench::look_at;
using hybrid::bench::Push;
using hybrid::bench::SoftBenchOptions;
using hybrid::bench::SoftEngine;
using hybrid::bench::SoftRow;
using hybrid::bench::WaveEngine;
using hybrid::bench::WaveState;

// Number of voxels with |x| + |y| + |z| < ratio at and below the surface.
std::size_t octahedron(double ratio) {
  std::size_t count = 0;
  const int reach = static_cast<int>(std::ceil(ratio));
  for (int z = -reach; z <= 0; ++z)
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x)
        count += std::abs(x) + std::abs(y) + std::abs(z) < ratio - 1e-9 ? 1 : 0;
  return count;
}

TEST(BenchSoft, WavesOfTheProductAreExactAndThoseOfAHomogeneousBlockAreOctahedra) {
  SoftBenchOptions options{.quick = true,
                           .cases = {"wave"},
                           .engines = {},
                           .depths = {1.0},
                           .wave_s = 0.0,
                           .sizes = {},
                           .progress = {},
                           .on_row = {}};
  std::size_t told = 0;
  options.on_row = [&told](const SoftRow&) { ++told; };
  const std::vector<SoftRow> rows = hybrid::bench::bench_soft(options);
  EXPECT_EQ(told, rows.size());
  std::set<std::string> materials;
  for (const SoftRow& row : rows) {
    SCOPED_TRACE(row.material + (row.engine == SoftEngine::classic ? ", classic" : ", hybrid"));
    materials.insert(row.material);
    ASSERT_TRUE(row.moved && row.violated && row.exact && row.time_us && row.depth_spacings && row.slack);
    EXPECT_GT(row.time_us->p50, 0.0);
    EXPECT_LE(row.time_us->p50, row.time_us->max);
    EXPECT_EQ(row.speedup.has_value(), row.engine == SoftEngine::hybrid);
    if (row.engine == SoftEngine::hybrid) {
      EXPECT_EQ(*row.violated, 0U);
      EXPECT_TRUE(*row.exact);
    }
    // Rows with a note are excluded, because their hundred pushes reach the side of the block.
    if (row.material == "homogeneous" && row.note.empty()) {
      EXPECT_EQ(*row.moved, octahedron(*row.depth_spacings / *row.slack));
    }
  }
  EXPECT_EQ(materials.size(), hybrid::bench::wave_materials().size());
  const auto growth = hybrid::bench::growth_of(rows);
  ASSERT_TRUE(growth.has_value());
  EXPECT_GT(growth->moved_exponent, 2.5);  // below 3, because small octahedra have relatively more surface
  EXPECT_LT(growth->moved_exponent, 3.1);
  EXPECT_GT(growth->moved_r2, growth->exponential_r2);
}

TEST(BenchSoft, SessionsAndLoadsSayWhatTheyAre) {
  const std::vector<SoftRow> rows = hybrid::bench::bench_soft({.quick = true,
                                                               .cases = {"session", "load"},
                                                               .engines = {SoftEngine::hybrid},
                                                               .depths = {},
                                                               .sizes = {20},
                                                               .session_s = 0.2,
                                                               .progress = {},
                                                               .on_row = {}});
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].test_case, "load");
  EXPECT_EQ(rows[1].test_case, "session");
  EXPECT_EQ(rows[1].repeats, 200U);
  for (const SoftRow& row : rows) {
    EXPECT_EQ(row.voxels, 8000U);
    ASSERT_TRUE(row.time_us && row.bytes_per_voxel);
    EXPECT_GT(*row.bytes_per_voxel, 0.5);
  }
  EXPECT_TRUE(rows[1].force_error_N && rows[1].force_error_jnd && rows[1].truncated_share);
}

// Thesis, Fig 22. A corner that is moved by each of its two links oscillates for ever. The project's own
// tissue comes to rest at once.
TEST(BenchSoft, ClassicOscillatesForEverAndOursSettles) {
  const auto objects = hybrid::bench::measure_settling(60);
  ASSERT_EQ(objects.size(), 2U);
  for (const auto& object : objects) {
    ASSERT_EQ(object.curves.size(), 3U);
    for (const auto& curve : object.curves) {
      ASSERT_EQ(curve.displacement.size(), 61U);
      EXPECT_EQ(curve.displacement.front(), 1.0);
    }
    EXPECT_LE(std::fabs(object.curves.back().displacement[20]), 1e-3) << object.name;
    EXPECT_LE(std::fabs(object.curves.back().displacement.back()), 1e-4) << object.name;
  }
  for (std::size_t n = 0; n <= 60; ++n)
    EXPECT_EQ(objects[0].curves[0].displacement[n], n % 2 == 0 ? 1.0 : -1.0) << n;
}

TEST(BenchSoft, EveryKeyIsThereAndNullWhereARowHasNoSuchThing) {
  const auto json = hybrid::bench::to_json(SoftRow{.test_case = "load", .moved = std::nullopt});
  for (const char* key : {"case",
                          "engine",
                          "voxels",
                          "material",
                          "depth_spacings",
                          "slack",
                          "axes",
                          "threads",
                          "moved",
                          "violated",
                          "p50_us",
                          "p99_us",
                          "p999_us",
                          "max_us",
                          "speedup",
                          "ns_per_voxel_update",
                          "truncated_share",
                          "force_error_N",
                          "force_error_jnd",
                          "reference",
                          "bytes_per_voxel"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_TRUE(json["moved"].is_null());
  EXPECT_TRUE(json["reference"].is_null());
  EXPECT_TRUE(json["p50_us"].is_null());
}

TEST(BenchSoft, GrowthIsTheSlopeOfTheLogarithms) {
  std::vector<SoftRow> rows;
  EXPECT_FALSE(hybrid::bench::growth_of(rows).has_value());
  for (const double ratio : {5.0, 10.0, 20.0, 40.0}) {
    SoftRow row{.test_case = "wave", .material = "homogeneous", .depth_spacings = 0.1 * ratio, .slack = 0.1};
    row.axes = 1;
    row.moved = static_cast<std::size_t>(2.0 * ratio * ratio * ratio);
    const double us = ratio * ratio;
    row.time_us = hybrid::Percentiles{us, us, us, us};
    rows.push_back(row);
  }
  const auto growth = hybrid::bench::growth_of(rows);
  ASSERT_TRUE(growth.has_value());
  EXPECT_NEAR(growth->moved_exponent, 3.0, 1e-9);
  EXPECT_NEAR(growth->moved_r2, 1.0, 1e-9);
  EXPECT_LT(growth->exponential_r2, 0.95);
  ASSERT_TRUE(growth->hybrid_time_exponent.has_value());
  EXPECT_NEAR(*growth->hybrid_time_exponent, 2.0, 1e-9);
  EXPECT_FALSE(growth->classic_time_exponent.has_value());
}

// A fake engine that gives the closed form of one push down. spoil() adds an error to one voxel.
class Pretended : public WaveEngine {
 public:
  Pretended(double depth, double slack) : depth_(depth), slack_(slack) {}
  void prepare(const voxel::LabelVolume& volume, const voxel::LatticeOptions& /*options*/,
               const Push& push) override {
    dims_ = volume.dims;
    source_ = push.sources.front();
  }
  void rest() override {}
  double run_us() override { return 0.0; }
  void read_plane(int k, std::vector<glm::vec3>& out) const override {
    std::size_t n = 0;
    for (int j = 0; j < dims_[1]; ++j) {
      for (int i = 0; i < dims_[0]; ++i) {
        const int l1 = std::abs(i - source_[0]) + std::abs(j - source_[1]) + std::abs(k - source_[2]);
        double by = std::max(0.0, depth_ - slack_ * l1);
        if (std::array<int, 3>{i, j, k} == wrong_) by += off_;
        out[n++] = glm::vec3(0.0F, 0.0F, static_cast<float>(-1e-3 * by));
      }
    }
  }
  [[nodiscard]] std::uint64_t candidates() const override { return 0; }
  [[nodiscard]] std::size_t bytes() const override { return 0; }
  void spoil(const std::array<int, 3>& at, double off) {
    wrong_ = at;
    off_ = off;
  }

 private:
  double depth_, slack_, off_ = 0.0;
  std::array<int, 3> dims_{}, source_{}, wrong_{-1, -1, -1};
};

TEST(BenchSoft, TheInspectionSeesWhatIsWrong) {
  const double depth = 1.05, slack = 0.1;
  const auto volume = hybrid::bench::wave_volume("homogeneous", {25, 25, 13});
  const auto options = hybrid::bench::wave_options("homogeneous", slack);
  const Push push{.sources = {{12, 12, 12}},
                  .moves = {glm::vec3(0.0F, 0.0F, static_cast<float>(-1e-3 * depth))}};
  Pretended wave(depth, slack);
  wave.prepare(volume, options, push);
  const auto look = [&] { return look_at(wave, volume, options, push, depth / slack); };
  const WaveState right = look();
  EXPECT_TRUE(right.exact());
  EXPECT_EQ(right.moved, octahedron(depth / slack));
  wave.spoil({10, 12, 11}, -0.05);  // the voxel lags behind
  EXPECT_GT(look().violated, 0U);
  wave.spoil({2, 2, 1}, 0.05);  // the voxel moved without cause, but within its limits
  EXPECT_EQ(look().violated, 0U);
  EXPECT_EQ(look().unsupported, 1U);
  EXPECT_EQ(look().moved, right.moved + 1);
  wave.spoil({12, 12, 12}, -0.02);  // the source moved back
  EXPECT_TRUE(look().source_off);
  EXPECT_NEAR(look().source_off_m, 0.02e-3, 1e-9);
  EXPECT_FALSE(look().exact());
}

}  // namespace
