// SPDX-License-Identifier: GPL-3.0-or-later
// What a question to the occupancy map costs: far from everything, near, and on the surface, beside fixed
// meshes of two sizes and moving bodies; what a moving body costs a tick; and what a mesh costs on load. The
// baseline of a move is writing the body's cells anew.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <memory>
#include <random>
#include <vector>

#include "hybrid/map/occupancy_map.h"
#include "polygon/surface/primitives.h"

namespace {

using glm::dquat;
using glm::dvec3;
using hybrid::OccupancyMap;
using hybrid::SurfaceCells;

constexpr double kRadius = 0.05, kCell = 1e-3, kTool = 2e-3;

const polygon::TriangleMesh& ball(int subdivisions) {
  static std::array<polygon::TriangleMesh, 10> meshes;
  auto& mesh = meshes[static_cast<std::size_t>(subdivisions)];
  if (mesh.empty()) mesh = polygon::make_ball_mesh(kRadius, subdivisions);
  return mesh;
}

OccupancyMap fixed_ball(int subdivisions) {
  OccupancyMap map(kCell, dvec3(0.0));
  const auto& mesh = ball(subdivisions);
  for (const auto& t : mesh.triangles)
    map.add_triangle(0, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  map.reserve_bricks(0);
  return map;
}

std::shared_ptr<const SurfaceCells> ball_cells(int subdivisions) {
  auto cells = std::make_shared<SurfaceCells>(kCell, dvec3(0.0));
  const auto& mesh = ball(subdivisions);
  for (const auto& t : mesh.triangles)
    cells->add_triangle(1, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
  cells->seal();
  return cells;
}

// `count` balls in a row along y, 12 cm apart.
OccupancyMap moving_balls(int count) {
  OccupancyMap map(kCell, dvec3(0.0));
  const auto cells = ball_cells(6);
  for (int b = 0; b < count; ++b)
    map.add_moving(static_cast<std::uint32_t>(b), cells, {0.0, 0.12 * b, 0.0}, dquat(1, 0, 0, 0));
  map.reserve_bricks(0);
  return map;
}

// Boxes of a tool of 2 mm and a cell about it, at a distance from the ball's surface.
std::vector<dvec3> places(double away) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> u;
  std::vector<dvec3> out(1024);
  for (dvec3& p : out) p = (kRadius + away) * glm::normalize(dvec3(u(random), u(random), u(random)));
  return out;
}

template <class Ask>
void ask(benchmark::State& state, const OccupancyMap& map, double away, const Ask& question) {
  const std::vector<dvec3> at = places(away);
  const dvec3 half(kTool + kCell);
  std::size_t n = 0;
  for (auto _ : state) {
    const dvec3& p = at[n++ & 1023U];
    benchmark::DoNotOptimize(question(map, p - half, p + half));
  }
  state.counters["bytes"] = static_cast<double>(map.memory_bytes());
}

constexpr std::array<double, 4> kAway{0.3, 0.03, 0.006,
                                      0.0};  // far, in an empty brick, in an occupied one, on it

const auto any_near = [](const OccupancyMap& map, const dvec3& low, const dvec3& high) {
  return map.any_near(low, high);
};
const auto rigid_in = [](const OccupancyMap& map, const dvec3& low, const dvec3& high) {
  return map.rigid_in(low, high);
};

void any_near_fixed(benchmark::State& state) {
  ask(state, fixed_ball(static_cast<int>(state.range(0))), kAway[static_cast<std::size_t>(state.range(1))],
      any_near);
}
void rigid_in_fixed(benchmark::State& state) {
  ask(state, fixed_ball(static_cast<int>(state.range(0))), kAway[static_cast<std::size_t>(state.range(1))],
      rigid_in);
}
void any_near_moving(benchmark::State& state) {
  ask(state, moving_balls(static_cast<int>(state.range(0))), kAway[static_cast<std::size_t>(state.range(1))],
      any_near);
}
void rigid_in_moving(benchmark::State& state) {
  ask(state, moving_balls(static_cast<int>(state.range(0))), kAway[static_cast<std::size_t>(state.range(1))],
      rigid_in);
}
BENCHMARK(any_near_fixed)->ArgsProduct({{3, 8}, {0, 1, 2, 3}})->ArgNames({"subdivisions", "away"});
BENCHMARK(rigid_in_fixed)->ArgsProduct({{3, 8}, {0, 1, 2, 3}})->ArgNames({"subdivisions", "away"});
BENCHMARK(any_near_moving)->ArgsProduct({{1, 4, 50}, {0, 1, 2, 3}})->ArgNames({"bodies", "away"});
BENCHMARK(rigid_in_moving)->ArgsProduct({{1, 4, 50}, {0, 1, 2, 3}})->ArgNames({"bodies", "away"});

void move_body(benchmark::State& state) {
  OccupancyMap map = moving_balls(static_cast<int>(state.range(0)));
  const double step = 1e-6 * static_cast<double>(state.range(1));  // a tick of 1 ms
  double x = 0.0;
  while (state.KeepRunning()) {
    x = std::fmod(x + step, 0.4);
    map.move_body(0, {x, 0.0, 0.0}, dquat(1, 0, 0, 0));
  }
}
BENCHMARK(move_body)->ArgsProduct({{1, 50}, {20, 1000}})->ArgNames({"bodies", "mm_per_s"});

// The baseline: what writing the cells of the moved body anew would take.
void move_by_rasterising(benchmark::State& state) {
  const auto& mesh = ball(static_cast<int>(state.range(0)));
  double x = 0.0;
  while (state.KeepRunning()) {
    x = std::fmod(x + 1e-3, 0.4);
    SurfaceCells cells(kCell, dvec3(0.0));
    for (const auto& t : mesh.triangles) {
      cells.add_triangle(1, mesh.vertices[t[0]] + dvec3(x, 0, 0), mesh.vertices[t[1]] + dvec3(x, 0, 0),
                         mesh.vertices[t[2]] + dvec3(x, 0, 0));
    }
    benchmark::DoNotOptimize(cells.empty());
  }
  state.counters["triangles"] = static_cast<double>(mesh.triangles.size());
}
BENCHMARK(move_by_rasterising)->Arg(3)->Arg(6)->Arg(8)->Unit(benchmark::kMillisecond);

}  // namespace
