// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of `hybrid bench rigid`: its paths against their definitions, its meshes against counts and
// geometry, and the rows of a short run.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <span>
#include <stdexcept>
#include <utility>

#include "hybrid/bench/meshes.h"
#include "hybrid/bench/paths.h"
#include "hybrid/bench/rigid.h"

namespace {

using glm::dvec3;
using namespace hybrid::bench;  // NOLINT(google-build-using-namespace): the tests use this namespace only

constexpr double kPi = std::numbers::pi;

bool near(const dvec3& a, const dvec3& b, double tolerance) {
  return glm::length(a - b) <= tolerance;
}

// Number of ticks in which the goal is at a place, within rounding.
std::size_t visits(const GoalPath& path, const dvec3& place) {
  std::size_t count = 0;
  for (const dvec3& g : path.goals) count += near(g, place, 1e-15) ? 1 : 0;
  return count;
}

double longest_step(const GoalPath& path) {
  double most = 0.0;
  for (std::size_t k = 1; k < path.goals.size(); ++k)
    most = std::max(most, glm::length(path.goals[k] - path.goals[k - 1]));
  return most;
}

// ---- paths ----

TEST(BenchPaths, SplitMixIsThePublishedGenerator) {
  // The first outputs for seed 1234567, as published with the generator.
  SplitMix64 random(1234567);
  for (const std::uint64_t expected : {6457827717110365317ULL, 3203168211198807973ULL, 9817491932198370423ULL,
                                       4593380528125082431ULL, 16408922859458223821ULL})
    EXPECT_EQ(random.next(), expected);
  SplitMix64 unit(12345);
  for (int n = 0; n < 1000; ++n) {
    const double u = unit.unit();
    EXPECT_TRUE(u >= 0.0 && u < 1.0);
    EXPECT_NEAR(glm::length(unit.direction()), 1.0, 1e-15);
  }
}

TEST(BenchPaths, TheSpiralMovesAtItsSpeed) {
  const double h = 1e-6;
  for (const double v : {0.1, 1.0}) {
    for (int k = 1; k < 20000; k += 499) {
      const double t = k * kTick_s;
      const dvec3 d = spiral_direction(t, v);
      EXPECT_NEAR(glm::length(d), 1.0, 1e-14);
      EXPECT_NEAR(std::acos(d.z), 0.3 + (kPi - 0.6) * t / 20.0, 1e-12);
      const dvec3 rate = (spiral_direction(t + h, v) - spiral_direction(t - h, v)) / (2.0 * h);
      EXPECT_NEAR(kSphereRadius_m * glm::length(rate), v, 1e-7 * v) << "t " << t;
    }
  }
  EXPECT_TRUE(near(spiral_direction(0.0, 0.1), {std::sin(0.3), 0.0, std::cos(0.3)}, 1e-15));
}

TEST(BenchPaths, TheSpherePathsKeepTheirDistance) {
  const double rp = 0.002;
  const GoalPath far = far_path();
  ASSERT_EQ(far.goals.size(), 5000U);
  EXPECT_TRUE(near(far.goals[0], {0.32, 0.0, 0.0}, 1e-15));
  for (const dvec3& g : far.goals) EXPECT_NEAR(glm::length(g - dvec3(0.3, 0.0, 0.0)), 0.02, 1e-14);

  for (const double v : {0.1, 1.0}) {
    const GoalPath hover = hover_path(rp, v);
    ASSERT_EQ(hover.goals.size(), 20000U);
    for (const dvec3& g : hover.goals) EXPECT_NEAR(glm::length(g), 0.053, 1e-14);
    EXPECT_EQ(hover.reference, hover.goals);

    const GoalPath slide = slide_path(rp, v);
    ASSERT_EQ(slide.goals.size(), 20200U);
    EXPECT_EQ(slide.counted_from, 200U);
    EXPECT_NEAR(glm::length(slide.goals[0]), 0.062, 1e-14);
    EXPECT_NEAR(glm::length(slide.goals[199]), 0.045, 1e-14);
    EXPECT_NEAR(longest_step(slide), v * kTick_s * 0.045 / 0.05, 0.02 * v * kTick_s);
    for (std::size_t k = 200; k < slide.goals.size(); k += 97) {
      EXPECT_TRUE(
          near(slide.goals[k], 0.045 * spiral_direction(static_cast<double>(k - 199) * 1e-3, v), 1e-14));
      EXPECT_NEAR(glm::length(slide.reference[k]), 0.052, 1e-14);
      EXPECT_LE(glm::length(glm::cross(slide.reference[k], slide.goals[k])), 1e-16);
    }
  }
}

TEST(BenchPaths, TapsGoInAndOutAtTwoMetersASecond) {
  const GoalPath tap = tap_path(0.0);
  ASSERT_EQ(tap.starts.size(), 5000U);
  ASSERT_EQ(tap.goals.size(), 5000U * 41U);
  // Draws the same random numbers independently.
  SplitMix64 random(12345);
  const auto direction = [&random] {
    const double u1 = random.unit(), u2 = random.unit();
    const double c = 2.0 * u1 - 1.0, s = std::sqrt(1.0 - c * c);
    return dvec3(s * std::cos(2.0 * kPi * u2), s * std::sin(2.0 * kPi * u2), c);
  };
  for (std::size_t n = 0; n < 5000; ++n) {
    const dvec3 d = direction(), e = direction(), d2 = glm::normalize(d + 0.3 * e);
    const std::size_t k = 41 * n;
    ASSERT_EQ(tap.starts[n], k);
    ASSERT_TRUE(near(tap.goals[k], 0.07 * d, 1e-15));
    ASSERT_TRUE(near(tap.goals[k + 20], 0.03 * d2, 1e-15));
    ASSERT_TRUE(near(tap.goals[k + 40], 0.07 * d2, 1e-15));
    ASSERT_NEAR(glm::length(tap.goals[k + 25] - tap.goals[k + 24]), 0.002,
                1e-12);  // the path leaves at 2 m/s
  }
}

TEST(BenchPaths, TheEdgePathHitsItsWaypointsAndItsReferenceStaysOutside) {
  const double h = kCubeHalf_m;
  for (const double rp : {0.0, 0.002}) {
    const GoalPath edge = edge_path(rp);
    EXPECT_EQ(visits(edge, {-0.03, -0.02, 0.06}), 11U);
    for (const dvec3& w : {dvec3(-0.03, -0.02, 0.045), dvec3(0.045, 0.013, 0.045), dvec3(0.06, 0.015, 0.045),
                           dvec3(0.06, 0.017, 0.03), dvec3(0.045, 0.019, 0.03), dvec3(0.045, 0.02, -0.03),
                           dvec3(0.06, 0.02, -0.03), dvec3(0.06, 0.02, 0.06)})
      EXPECT_EQ(visits(edge, w), 10U);
    EXPECT_LE(longest_step(edge), 1e-4 * (1.0 + 1e-9));
    ASSERT_EQ(edge.reference.size(), edge.goals.size());
    for (std::size_t k = 0; k < edge.goals.size(); ++k) {
      const dvec3 outside = glm::max(glm::abs(edge.reference[k]) - h, dvec3(0.0));
      const dvec3 inner = h - glm::abs(edge.reference[k]);
      const bool in = std::min({inner.x, inner.y, inner.z}) > 1e-15;
      EXPECT_FALSE(in);
      EXPECT_GE(glm::length(outside), rp * (1.0 - 1e-9)) << k;
    }
  }
}

TEST(BenchPaths, TheCornerPathsAreAsWritten) {
  struct Kind {
    bool symmetric;
    std::array<dvec3, 4> c;
  };
  for (const Kind& kind : {Kind{false,
                                {{{0.04, 0.0512, 0.02},
                                  {0.04, 0.0512, -0.0053},
                                  {-0.005, 0.0512, -0.0053},
                                  {-0.005, -0.0047, -0.0053}}}},
                           Kind{true,
                                {{{0.04, 0.05, 0.02},
                                  {0.04, 0.05, -0.005},
                                  {-0.005, 0.05, -0.005},
                                  {-0.005, -0.005, -0.005}}}}}) {
    const GoalPath path = corner_path(0.002, kind.symmetric, 3);
    EXPECT_EQ(visits(path, kind.c[0]), 4U);
    EXPECT_EQ(visits(path, kind.c[1]), 6U);
    EXPECT_EQ(visits(path, kind.c[2]), 6U);
    EXPECT_GE(visits(path, kind.c[3]),
              3U * 502U);  // reached, held for 500 ticks, and passed again on the way back
    // Checks the place 500 ticks after the start of the wiggle of the first lap.
    std::size_t hold = 0;
    while (!near(path.goals[hold], kind.c[3], 1e-15)) ++hold;
    const dvec3 wiggle =
        0.003 * dvec3(std::sin(2.0 * kPi * 0.5), std::sin(2.6 * kPi * 0.5), std::sin(3.4 * kPi * 0.5));
    EXPECT_TRUE(near(path.goals[hold + 500 + 500], kind.c[3] + wiggle, 1e-15));
    for (std::size_t k = 0; k < path.goals.size(); ++k)
      ASSERT_EQ(path.reference[k], glm::max(path.goals[k], dvec3(0.002)));
  }
  const GoalPath fast = cornerfast_path(0.0);
  ASSERT_EQ(fast.goals.size(), 20000U);
  EXPECT_TRUE(near(fast.goals[0], 0.01 + 0.02 * dvec3(std::sin(1.6), std::sin(1.5), std::sin(1.4)), 1e-15));
  EXPECT_GT(std::min({fast.goals[0].x, fast.goals[0].y, fast.goals[0].z}), 0.0);
  EXPECT_GT(longest_step(fast), 0.7e-3);
  EXPECT_LT(longest_step(fast), 1.1e-3);
}

TEST(BenchPaths, AMovingBodyStartsClearOfTheToolAndPassesOverIt) {
  for (const double v : {0.02, 0.1, 1.0}) {
    const GoalPath path = moving_path(v, moving_laps(v));
    ASSERT_EQ(path.body_m.size(), path.goals.size());
    EXPECT_NEAR(static_cast<double>(path.goals.size()), 20000.0, 2000.0);
    for (std::size_t lap = 0; lap < path.starts.size(); ++lap) {
      const std::size_t first = path.starts[lap];
      const std::size_t last = lap + 1 < path.starts.size() ? path.starts[lap + 1] : path.goals.size();
      // The body starts so far away that even a cube's corner does not touch the tool's ball.
      EXPECT_GT(glm::length(path.body_m[first]), std::sqrt(3.0) * kCubeHalf_m + 0.002);
      double nearest = 1.0;
      for (std::size_t k = first; k < last; ++k) {
        EXPECT_EQ(path.goals[k], dvec3(0.0));
        nearest = std::min(nearest, glm::length(path.body_m[k]));
        if (k > first) {
          EXPECT_LE(glm::length(path.body_m[k] - path.body_m[k - 1]), v * kTick_s * (1.0 + 1e-9));
        }
      }
      EXPECT_LT(nearest, 0.031);
      EXPECT_LT(glm::dot(path.body_m[first], path.body_m[last - 1]), 0.0) << "it ends on the other side";
    }
  }
}

// ---- meshes ----

// Expects that every edge belongs to two triangles, once in each direction. Returns the number of vertices in
// use.
std::size_t expect_closed(const polygon::TriangleMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  std::set<std::uint32_t> used;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      used.insert(t[i]);
      EXPECT_TRUE(directed.emplace(t[i], t[(i + 1) % 3]).second);
    }
  }
  for (const auto& [a, b] : directed) EXPECT_TRUE(directed.contains({b, a}));
  return used.size();
}

double volume(const polygon::TriangleMesh& mesh) {
  double six = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    six += glm::dot(mesh.vertices[a], glm::cross(mesh.vertices[b], mesh.vertices[c]));
  return six / 6.0;
}

TEST(BenchMeshes, BallsAreClosedAndEveryVertexLiesOnTheSphere) {
  const std::map<std::string, std::size_t> sizes{{"ico0", 20}, {"ico3", 1280}, {"ico5", 20480}, {"geo1", 20},
                                                 {"geo2", 80}, {"geo7", 980},  {"geo32", 20480}};
  for (const auto& [name, triangles] : sizes) {
    for (const double scale : {1.0, 1e-3}) {
      const BenchMesh ball = make_bench_mesh(name, scale);
      EXPECT_EQ(ball.mesh.triangles.size(), triangles) << name;
      EXPECT_EQ(bench_mesh_triangles(name), triangles);
      EXPECT_EQ(ball.mesh.vertices.size(), triangles / 2 + 2) << name;  // Euler's formula
      EXPECT_EQ(expect_closed(ball.mesh), ball.mesh.vertices.size());
      const double radius = kSphereRadius_m * scale;
      for (const dvec3& v : ball.mesh.vertices) EXPECT_NEAR(glm::length(v), radius, 1e-15 * radius);
      EXPECT_GT(volume(ball.mesh), 0.0);
      EXPECT_LE(volume(ball.mesh), 4.0 / 3.0 * kPi * radius * radius * radius);
      for (const auto& [a, b, c] : ball.mesh.triangles) {
        const dvec3 n = glm::cross(ball.mesh.vertices[b] - ball.mesh.vertices[a],
                                   ball.mesh.vertices[c] - ball.mesh.vertices[a]);
        EXPECT_GE(glm::dot(glm::normalize(n), ball.mesh.vertices[a]),
                  ball.inscribed_radius_m * (1.0 - 1e-12));
      }
    }
  }
  EXPECT_EQ(bench_mesh_triangles("geo707"), 9'996'980U);
  EXPECT_EQ(bench_mesh_triangles("ico9"), 5'242'880U);
}

TEST(BenchMeshes, CubeAndCorner) {
  for (const int n : {1, 64}) {
    const BenchMesh cube = make_bench_mesh("cube" + std::to_string(n));
    EXPECT_EQ(cube.mesh.triangles.size(), 12U * n * n);
    expect_closed(cube.mesh);
    EXPECT_NEAR(volume(cube.mesh), 1e-3, 1e-15);
    EXPECT_DOUBLE_EQ(cube.inscribed_radius_m, kCubeHalf_m);
    EXPECT_TRUE(cube.solid);

    const BenchMesh corner = make_bench_mesh("corner" + std::to_string(n));
    EXPECT_FALSE(corner.solid);
    EXPECT_EQ(corner.mesh.triangles.size(), 6U * n * n);
    EXPECT_EQ(corner.mesh.vertices.size(), 3U * n * n + 3U * n + 1U);
    double area = 0.0;
    for (const auto& [a, b, c] : corner.mesh.triangles) {
      const auto& v = corner.mesh.vertices;
      const dvec3 square = glm::cross(v[b] - v[a], v[c] - v[a]);
      EXPECT_GT(glm::dot(square, dvec3(1.0)), 0.0) << "it looks into the corner";
      area += 0.5 * glm::length(square);
    }
    EXPECT_NEAR(area, 0.03, 1e-12);
    for (const dvec3& v : corner.mesh.vertices) EXPECT_EQ(std::min({v.x, v.y, v.z}), 0.0);
  }
}

TEST(BenchMeshes, AWrongNameIsRefusedWithTheRightOnes) {
  for (const char* name :
       {"", "ico", "ico10", "ico-1", "ico3x", "geo0", "geo1025", "cube0", "sphere", "corner1.5"}) {
    try {
      make_bench_mesh(name);
      FAIL() << name;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find("ico0 to ico9"), std::string::npos);
    }
  }
}

// ---- a short run ----

TEST(BenchRigid, AQuickRunSaysWhatItMustAndNothingPopsThrough) {
  RigidBenchOptions options;
  options.quick = true;
  options.meshes = {"ico3", "cube1", "corner1"};
  const std::vector<RigidRow> rows = bench_rigid(options);
  std::map<std::string, std::size_t> of_path;
  for (const RigidRow& row : rows) {
    const std::string name =
        row.path + " on " + row.mesh + ", " + std::to_string(row.radius_m) + " m, " + engine_name(row.engine);
    ++of_path[row.path];
    const nlohmann::ordered_json json = to_json(row);
    for (const char* key :
         {"path", "triangles", "radius_m", "speed_m_s", "engine", "p50_us", "p99_us", "p999_us", "max_us",
          "error_mesh_max_m", "error_sphere_max_m", "error_sphere_rms_m", "optimum_sphere_max_m",
          "force_step_p99_N", "inside_ticks", "pop_throughs", "build_ms", "bytes"})
      EXPECT_TRUE(json.contains(key)) << name << ": " << key;
    for (const double us : {row.tick_us.p50, row.tick_us.p99, row.tick_us.p999, row.tick_us.max})
      EXPECT_TRUE(std::isfinite(us) && us > 0.0) << name;
    EXPECT_LE(row.tick_us.p50, row.tick_us.p99);
    EXPECT_GT(row.least_us.p50, 0.0) << name;
    if (!row.pose_us) {
      EXPECT_LE(row.least_us.max, row.tick_us.max) << name << ": the first pass is one of them";
    }
    EXPECT_GT(row.bytes, 0U) << name;
    EXPECT_GT(row.ticks, 0U) << name;
    // Each figure is present exactly if it is defined for this mesh and path, and it is finite.
    EXPECT_EQ(row.judged.error_sphere_max.has_value(), row.mesh == "ico3" && row.path != "moving") << name;
    EXPECT_EQ(row.judged.optimum_sphere_max.has_value(), row.path == "slide") << name;
    ASSERT_TRUE(row.judged.error_mesh_max.has_value()) << name;
    EXPECT_TRUE(std::isfinite(*row.judged.error_mesh_max)) << name;
    EXPECT_EQ(row.judged.inside_ticks, std::size_t{0}) << name;
    EXPECT_EQ(row.judged.pop_throughs, std::size_t{0}) << name;
    EXPECT_TRUE(row.faults.empty()) << name << ": " << row.faults.front();
    if (row.engine == Engine::hybrid) {
      EXPECT_LE(*row.judged.error_mesh_max, 1e-6) << name;
      EXPECT_EQ(row.ticks, row.path_ticks) << name;
    }
    // Repeated until it stands, the published proxy ends at an optimum of the mesh, kFingerGap above it.
    if (row.engine == Engine::finger_settled) {
      EXPECT_LE(*row.judged.error_mesh_max, 2.0 * polygon::kFingerGap * 0.1) << name;
      EXPECT_EQ(row.truncated_ticks, 0U) << name;
      EXPECT_EQ(row.judged.lost_ticks, 0U) << name;
    }
    // In the whole tick the proxy is as accurate as in the rigid part alone.
    if (row.engine == Engine::whole_tick) {
      EXPECT_LE(*row.judged.error_mesh_max, 1e-6) << name;
    }
  }
  for (const std::string& path : rigid_paths())
    EXPECT_GE(of_path[path], 2 * kEngines.size()) << path;  // two tools
  const std::string ratios = ratio_table(rows);
  for (const Engine engine : kEngines) EXPECT_NE(ratios.find(engine_name(engine)), std::string::npos);
  EXPECT_NE(ratios.find("\nmean "), std::string::npos);
}

// A ball whose survey() is never complete, as if too many triangles lay near the proxy. Then a tick ends
// before the proxy has reached its optimum.
class CrowdedSurface final : public polygon::RigidSurface {
 public:
  explicit CrowdedSurface(std::shared_ptr<const polygon::RigidSurface> ball) : ball_(std::move(ball)) {}
  polygon::GatherResult gather(const dvec3& p, double r,
                               std::span<polygon::NearPoint> out) const noexcept override {
    return ball_->gather(p, r, out);
  }
  bool nearest(const dvec3& p, double r, polygon::NearPoint& out) const noexcept override {
    return ball_->nearest(p, r, out);
  }
  polygon::GatherResult survey(const dvec3& /*centre*/, double /*radius*/, const dvec3& /*view*/,
                               std::span<polygon::ElementPlane> /*out*/) const noexcept override {
    return {.count = 0, .complete = false};
  }
  polygon::NearPoint closest(std::uint32_t e, const dvec3& p) const noexcept override {
    return ball_->closest(e, p);
  }
  dvec3 face_normal(std::uint32_t e) const noexcept override { return ball_->face_normal(e); }
  double support(std::uint32_t e, const dvec3& n) const noexcept override { return ball_->support(e, n); }
  std::array<std::uint32_t, 3> neighbours(std::uint32_t e) const noexcept override {
    return ball_->neighbours(e);
  }
  dvec3 shaded_normal(std::uint32_t e, const dvec3& p, const dvec3& away) const noexcept override {
    return ball_->shaded_normal(e, p, away);
  }
  bool inside(const dvec3& p) const noexcept override { return ball_->inside(p); }
  bool solid() const noexcept override { return ball_->solid(); }
  std::size_t element_count() const noexcept override { return ball_->element_count(); }
  dvec3 lower() const noexcept override { return ball_->lower(); }
  dvec3 upper() const noexcept override { return ball_->upper(); }
  std::size_t memory_bytes() const noexcept override { return ball_->memory_bytes(); }

 private:
  std::shared_ptr<const polygon::RigidSurface> ball_;
};

TEST(BenchRigid, TicksThatEndBeforeTheProxyArrivesAreCounted) {
  const BenchMesh mesh = make_bench_mesh("ico3");
  const TimedSurface plain = make_surface(mesh, Engine::hybrid);
  const TimedSurface crowded{.surface = std::make_shared<const CrowdedSurface>(plain.surface)};
  const TickTimer timer;
  const auto truncated = [&](const TimedSurface& surface, std::uint32_t counted_from) {
    TouchWorld world(mesh, surface, Engine::hybrid, 0.002, dvec3(0.0), false);
    TouchWorld* const worlds[]{&world};
    const GoalPath path{.goals = {{0.0, 0.0, 0.5},
                                  {0.0, 0.0, 0.4},
                                  {0.0, 0.0, 0.045},
                                  {0.01, 0.0, 0.045},
                                  {0.02, 0.0, 0.045}},
                        .starts = {0},
                        .counted_from = counted_from,
                        .reference = {},
                        .body_m = {}};
    const double no_limit[]{0.0};
    const Engine engines[]{Engine::hybrid};
    return run_engines(path, engines, worlds, no_limit, dvec3(0.0), timer).front().truncated_ticks;
  };
  EXPECT_EQ(truncated(plain, 0), 0U);
  EXPECT_EQ(truncated(crowded, 0), 3U) << "the ticks near the ball";
  EXPECT_EQ(truncated(crowded, 3), 2U) << "ticks that lead in do not count";
  RigidRow row;
  row.truncated_ticks = 3;
  EXPECT_EQ(to_json(row)["truncated_ticks"], 3);
  EXPECT_NE(table_line(row).find(" 3 "), std::string::npos);
}

TEST(BenchRigid, WhatDoesNotFitTogetherIsRefused) {
  RigidBenchOptions options;
  options.quick = true;
  options.meshes = {"cube1"};
  options.paths = {"slide"};
  EXPECT_THROW(bench_rigid(options), std::invalid_argument);
  options.meshes = {"cube0"};
  EXPECT_THROW(bench_rigid(options), std::invalid_argument);
}

}  // namespace
