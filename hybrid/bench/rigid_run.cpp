// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/rigid_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <stdexcept>

#include "hybrid/build/build_world.h"
#include "hybrid/tick/bodies/move_bodies.h"
#include "hybrid/tick/proxy/rigid_proxy.h"
#include "hybrid/tick/tick.h"
#include "polygon/reference/cgal_surface.h"
#include "polygon/surface/mesh_surface.h"

namespace hybrid::bench {
namespace {

constexpr std::size_t kBlock = 2000;        // ticks for which one engine has the processor's caches to itself
constexpr std::uint32_t kMostPasses = 100;  // of the published proxy in a tick of `finger_settled`

double ms_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

struct Box {
  glm::dvec3 low, high;
};

// The map as a session fills it. A cell is half as wide as the tool, or wider if the number of cells would
// exceed the map's limit.
OccupancyMap fill_map(const polygon::TriangleMesh& mesh, const Box& box, double tool_radius_m,
                      const glm::dvec3& offset_m, bool moves) {
  const glm::dvec3 size = box.high - box.low;
  const double longest = std::max({size.x, size.y, size.z});
  const double cell = rigid_cell_m(longest, tool_radius_m);
  const glm::dvec3 middle = 0.5 * (box.low + box.high);
  OccupancyMap map(cell, offset_m + middle);
  if (moves) {
    auto cells = std::make_shared<SurfaceCells>(cell, middle);
    for (const auto& [a, b, c] : mesh.triangles)
      cells->add_triangle(OccupancyMap::rigid_bit(0), mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    cells->seal();
    map.add_moving(0, std::move(cells), offset_m, glm::dquat(1.0, 0.0, 0.0, 0.0));
  } else {
    for (const auto& [a, b, c] : mesh.triangles)
      map.add_triangle(0, offset_m + mesh.vertices[a], offset_m + mesh.vertices[b],
                       offset_m + mesh.vertices[c]);
  }
  map.reserve_bricks(0);
  return map;
}

void prepare(TouchRun& run, const GoalPath& path) {
  run.proxy_m.resize(path.goals.size());
  run.force_N.resize(path.goals.size());
  run.tick_us.resize(path.goals.size());
  if (!path.body_m.empty()) run.pose_us.resize(path.goals.size());
}

// Runs ticks first … last − 1 of the path, or fewer if the time limit is reached.
void run_block(const GoalPath& path, std::size_t first, std::size_t last, TouchWorld& touch, double limit_s,
               const glm::dvec3& rest_m, const TickTimer& timer, TouchRun& run) {
  auto start = std::lower_bound(path.starts.begin(), path.starts.end(), first);
  const bool moves = !path.body_m.empty();
  for (std::size_t k = first; k < last; ++k) {
    if (limit_s > 0.0 && run.spent_s > limit_s) return;
    if (start != path.starts.end() && *start == k) {
      touch.start(path.goals[k], moves ? path.body_m[k] : rest_m);
      ++start;
    } else if (moves) {
      const std::uint64_t before = TickTimer::begin();
      touch.move_body(path.body_m[k]);
      run.pose_us[k] = static_cast<float>(timer.us(TickTimer::end() - before));
    }
    const glm::dvec3 goal = path.goals[k];
    const std::uint64_t before = TickTimer::begin();
    const RigidStep step = touch.step(goal);
    const double us = timer.us(TickTimer::end() - before);
    run.proxy_m[k] = step.proxy_m;
    run.force_N[k] = step.force_N;
    run.tick_us[k] = static_cast<float>(us);
    run.steps += step.steps;
    run.surveys += step.surveys;
    run.most_steps = std::max(run.most_steps, step.steps);
    if (!step.arrived && k >= path.counted_from) ++run.truncated_ticks;
    run.spent_s += 1e-6 * us;
    run.ticks = k + 1;
  }
}

}  // namespace

const char* engine_name(Engine engine) {
  switch (engine) {
    case Engine::hybrid:
      return "hybrid";
    case Engine::cgal_aabb:
      return "cgal-aabb";
    case Engine::no_map:
      return "no-map";
    case Engine::finger_proxy:
      return "finger-proxy";
    case Engine::finger_settled:
      return "finger-settled";
    case Engine::whole_tick:
      return "whole-tick";
  }
  return "hybrid";
}

TimedSurface make_surface(const BenchMesh& mesh, Engine engine) {
  const auto start = std::chrono::steady_clock::now();
  TimedSurface made;
  if (is_finger(engine)) {
    made.tree = std::make_shared<const polygon::TriangleTree>(mesh.mesh);
  } else if (engine == Engine::cgal_aabb) {
    made.surface = polygon::make_cgal_surface(mesh.mesh, mesh.solid);
  } else {
    made.surface = polygon::make_mesh_surface(mesh.mesh, mesh.solid);
  }
  made.build_ms = ms_since(start);
  return made;
}

TouchWorld::TouchWorld(const BenchMesh& mesh, const TimedSurface& surface, Engine engine,
                       double tool_radius_m, const glm::dvec3& offset_m, bool moves)
    : engine_(engine), moves_(moves), build_ms_(surface.build_ms), tree_(surface.tree), body_m_(offset_m) {
  finger_ = {.radius_m = tool_radius_m, .passes = engine == Engine::finger_settled ? kMostPasses : 1};
  if (tree_) {
    state_ = std::make_unique<WorldState>(world_, OccupancyMap(1.0, offset_m));
    return;
  }
  const Box box{surface.surface->lower(), surface.surface->upper()};
  const auto start = std::chrono::steady_clock::now();
  OccupancyMap map = engine == Engine::no_map ? OccupancyMap(1.0, offset_m)
                                              : fill_map(mesh.mesh, box, tool_radius_m, offset_m, moves);
  map_ms_ = engine == Engine::no_map ? 0.0 : ms_since(start);
  build_ms_ += map_ms_;
  fill_world(mesh, surface, tool_radius_m, offset_m);
  world_.use_map = engine != Engine::no_map;
  world_.set_scale(offset_m + box.low, offset_m + box.high);
  state_ = std::make_unique<WorldState>(world_, std::move(map));
  state_->prepare(world_);
}

void TouchWorld::fill_world(const BenchMesh& mesh, const TimedSurface& surface, double tool_radius_m,
                            const glm::dvec3& offset_m) {
  world_.rigid.push_back(
      {.name = mesh.name, .surface = surface.surface, .pose = {.position_m = offset_m}, .drawn = {}});
  world_.tool = {
      .shape = Tool::Shape::ball, .radius_m = tool_radius_m, .stiffness_N_per_m = kStiffness_N_per_m};
  world_.limits = {.max_force_N = 1e12, .max_slew_N_per_s = 1e18, .soft_start_s = 0.0};
}

std::size_t TouchWorld::bytes() const {
  if (tree_) return tree_->memory_bytes();
  return world_.rigid.front().surface->memory_bytes() + (world_.use_map ? state_->map.memory_bytes() : 0);
}

void TouchWorld::start(const glm::dvec3& goal_m, const glm::dvec3& body_m) {
  if (moves_) move_body(body_m);
  if (tree_) {
    proxy_in_body_ = goal_m - body_m_;
    return;
  }
  if (!start_proxy(world_, *state_, goal_m)) {
    throw std::runtime_error(
        fmt::format("the path on \"{}\" starts at ({:.6g}, {:.6g}, {:.6g}) m, where the tool is not free",
                    world_.rigid.front().name, goal_m.x, goal_m.y, goal_m.z));
  }
}

void TouchWorld::move_body(const glm::dvec3& body_m) {
  if (tree_) {
    body_m_ = body_m;
  } else {
    set_rigid_pose(world_, *state_, 0, Pose{.position_m = body_m});
  }
}

RigidStep TouchWorld::step(const glm::dvec3& goal_m) noexcept {
  if (tree_) return step_finger(goal_m);
  if (engine_ == Engine::whole_tick) return step_whole(goal_m);
  return step_rigid(world_, *state_, goal_m);
}

// `arrived` is not set: would_go_on() finds out after the run, outside of the timing.
RigidStep TouchWorld::step_finger(const glm::dvec3& goal_m) noexcept {
  const polygon::FingerStep step = polygon::finger_step(*tree_, finger_, proxy_in_body_, goal_m - body_m_);
  proxy_in_body_ = step.point;
  RigidStep out{.proxy_m = body_m_ + step.point, .steps = step.sweeps, .surveys = step.sweeps};
  out.force_N = kStiffness_N_per_m * (out.proxy_m - goal_m);
  return out;
}

RigidStep TouchWorld::step_whole(const glm::dvec3& goal_m) noexcept {
  const std::uint64_t truncated = state_->truncated_ticks;
  const TickResult tick = haptic_tick(world_, *state_, {.position_m = goal_m}, kTick_s);
  return {.proxy_m = tick.proxy_m, .force_N = tick.force_N, .arrived = state_->truncated_ticks == truncated};
}

bool TouchWorld::would_go_on(const glm::dvec3& proxy_m, const glm::dvec3& goal_m,
                             const glm::dvec3& body_m) const {
  if (!tree_) return false;
  const glm::dvec3 at = proxy_m - body_m;
  return !polygon::finger_step(*tree_, {.radius_m = finger_.radius_m, .passes = 1}, at, goal_m - body_m)
              .settled;
}

namespace {

// Runs all engines once along the path. Engine e runs at most `most[e]` ticks.
std::vector<TouchRun> run_pass(const GoalPath& path, std::span<const std::size_t> most,
                               std::span<TouchWorld* const> worlds, std::span<const double> limit_s,
                               const glm::dvec3& offset_m, const TickTimer& timer) {
  std::vector<TouchRun> runs(worlds.size());
  for (TouchRun& run : runs) prepare(run, path);
  for (std::size_t first = 0, turn = 0; first < path.goals.size(); first += kBlock, ++turn) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      const std::size_t e = (i + turn) % runs.size();
      if (runs[e].ticks == first)
        run_block(path, first, std::min(first + kBlock, most[e]), *worlds[e], limit_s[e], offset_m, timer,
                  runs[e]);
    }
  }
  return runs;
}

float touch_us(const TouchRun& run, std::size_t tick) {
  return run.tick_us[tick] + (run.pose_us.empty() ? 0.0F : run.pose_us[tick]);
}

// The published proxy does not report whether it has come to rest, so a further pass is tried in each tick.
void count_unsettled(const GoalPath& path, const TouchWorld& world, const glm::dvec3& offset_m,
                     TouchRun& run) {
  for (std::size_t k = path.counted_from; k < run.ticks; ++k) {
    const glm::dvec3 body = path.body_m.empty() ? offset_m : path.body_m[k];
    if (world.would_go_on(run.proxy_m[k], path.goals[k], body)) ++run.truncated_ticks;
  }
}

}  // namespace

std::vector<TouchRun> run_engines(const GoalPath& path, std::span<const Engine> engines,
                                  std::span<TouchWorld* const> worlds, std::span<const double> limit_s,
                                  const glm::dvec3& offset_m, const TickTimer& timer) {
  std::vector<std::size_t> most(engines.size(), path.goals.size());
  std::vector<TouchRun> runs = run_pass(path, most, worlds, limit_s, offset_m, timer);
  for (std::size_t e = 0; e < engines.size(); ++e) {
    runs[e].engine = engines[e];
    most[e] = runs[e].ticks;
    for (std::size_t k = 0; k < most[e]; ++k) runs[e].least_us.push_back(touch_us(runs[e], k));
  }
  const std::vector<double> no_limit(engines.size(), 0.0);
  for (std::size_t n = 1; n < kPasses; ++n) {
    const std::vector<TouchRun> again = run_pass(path, most, worlds, no_limit, offset_m, timer);
    for (std::size_t e = 0; e < engines.size(); ++e) {
      for (std::size_t k = 0; k < most[e]; ++k)
        runs[e].least_us[k] = std::min(runs[e].least_us[k], touch_us(again[e], k));
    }
  }
  for (std::size_t e = 0; e < engines.size(); ++e) {
    if (is_finger(engines[e])) count_unsettled(path, *worlds[e], offset_m, runs[e]);
  }
  return runs;
}

GoalPath placed(const GoalPath& path, double scale, const glm::dvec3& offset_m) {
  GoalPath there = path;
  for (glm::dvec3& g : there.goals) g = offset_m + scale * g;
  for (glm::dvec3& r : there.reference) r = offset_m + scale * r;
  for (glm::dvec3& b : there.body_m) b = offset_m + scale * b;
  return there;
}

}  // namespace hybrid::bench
