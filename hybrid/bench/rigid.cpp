// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/rigid.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/report.h"
#include "hybrid/session/trace_file.h"

namespace hybrid::bench {
namespace {

constexpr double kBall_m = 0.002;  // radius of the ball tool
constexpr double kPoint_m = 0.0;   // radius of the point tool
constexpr std::size_t kMostReferenceTriangles =
    3'000'000;  // a larger mesh has no exact reference, which takes 1 kB a triangle
constexpr std::size_t kLarge = 3'000'000;  // triangles; from here on the paths are shorter
constexpr double kSlowest_m_s = 0.02;      // in a scene of size 1; a lap of `moving` then takes 19 s

// Limits of time: for the steps of a baseline in one pass, and for judging one run.
struct Budget {
  double cgal_s, no_map_s, other_s, judge_s, judge_baseline_s;
};
constexpr Budget kFull{0.7, 0.7, 8.0, 1.0, 0.2};  // s, in the order of Budget's members
constexpr Budget kQuick{0.05, 0.1, 1.0, 0.05, 0.02};

// Paths are made in a scene of size 1 and then scaled. A named mesh is scaled too. A mesh from a file keeps
// its size, and the paths are scaled to that size.
struct Case {
  std::string path, mesh;
  double radius_m = 0.0, speed_m_s = 0.0;  // in a scene of size 1
  double scale = 1.0, offset_m = 0.0;
  std::shared_ptr<const BenchMesh> file;  // null: a mesh by name
  std::size_t triangles = 0;

  [[nodiscard]] double tool_m() const { return radius_m * scale; }
  [[nodiscard]] double speed() const { return speed_m_s * scale; }
  [[nodiscard]] double scene_scale() const { return file ? 1.0 : scale; }
};

// ---- choice of the runs ----

bool wanted(const std::vector<std::string>& list, const std::string& name) {
  return list.empty() || std::find(list.begin(), list.end(), name) != list.end();
}

std::vector<std::string> default_meshes(bool quick) {
  if (quick) return {"ico3", "ico5", "cube1", "corner1"};
  return {"ico3", "ico5", "ico6", "ico7", "ico8", "geo707", "cube1", "cube64", "corner1", "corner64"};
}

class Plan {
 public:
  explicit Plan(const RigidBenchOptions& options) : options_(options) {
    const bool chosen = !options.meshes.empty();
    for (const std::string& mesh : chosen ? options.meshes : default_meshes(options.quick)) {
      if (is_bench_mesh_file(mesh)) {
        add_file(mesh);
        continue;
      }
      switch (bench_mesh_shape(mesh)) {
        case BenchShape::sphere:
          add_sphere(mesh);
          break;
        case BenchShape::cube:
          add("edge", mesh, {0.1});
          break;
        case BenchShape::corner:
          add("corner", mesh, {0.1});
          add("corner_sym", mesh, {0.1});
          add("cornerfast", mesh, {1.0});
          break;
        case BenchShape::from_file:
          break;
      }
      if (bench_mesh_shape(mesh) != BenchShape::corner) add("moving", mesh, moving_speeds(mesh, chosen));
      if (!options.quick) add_elsewhere(mesh);
    }
  }
  std::vector<Case> take() { return std::move(cases_); }

 private:
  void add(const std::string& path, const std::string& mesh, const std::vector<double>& speeds,
           double scale = 1.0, double offset_m = 0.0) {
    if (!wanted(options_.paths, path)) return;
    for (const double radius : {kPoint_m, kBall_m}) {
      for (const double speed : speeds)
        cases_.push_back({path, mesh, radius, speed, scale, offset_m, nullptr, bench_mesh_triangles(mesh)});
    }
  }

  void add_file(const std::string& name) {
    std::vector<std::string> notes;
    const auto mesh = std::make_shared<const BenchMesh>(load_bench_mesh(name, options_.mesh_unit_m, notes));
    for (const std::string& note : notes) {
      if (options_.on_note) options_.on_note(note);
    }
    const double scale = mesh->reach_m / kSphereRadius_m;
    // For a large mesh the ball is 2 mm as elsewhere; for a small mesh it shrinks with the scale.
    const double ball = kBall_m / std::max(1.0, scale);
    const auto add_path = [&](const char* path, const std::vector<double>& speeds) {
      if (!wanted(options_.paths, path)) return;
      for (const double radius : {kPoint_m, ball}) {
        for (const double speed : speeds)
          cases_.push_back({path, name, radius, std::max(kSlowest_m_s, speed / scale), scale, 0.0, mesh,
                            mesh->mesh.triangles.size()});
      }
    };
    using Speeds = std::vector<double>;
    add_path("far", {0.1});
    add_path("slide", options_.quick ? Speeds{0.1} : Speeds{0.1, 1.0});
    add_path("tap", {2.0 * scale});  // each tap takes 41 ticks for any size of the mesh
    add_path("moving", options_.quick ? Speeds{0.1} : Speeds{0.02, 0.1, 1.0});
  }

  [[nodiscard]] std::vector<double> moving_speeds(const std::string& mesh, bool chosen) const {
    if (options_.quick) return {0.1};
    if (chosen || mesh == "ico5" || mesh == "cube1") return {0.02, 0.1, 1.0};
    return {1.0};
  }

  void add_sphere(const std::string& mesh) {
    const std::vector<double> speeds =
        options_.quick ? std::vector<double>{0.1} : std::vector<double>{0.1, 1.0};
    add("far", mesh, {0.1});
    add("hover", mesh, speeds);
    add("slide", mesh, speeds);
    add("tap", mesh, {2.0});
  }

  // Adds runs in scenes of another size, and far from the origin.
  void add_elsewhere(const std::string& mesh) {
    struct Place {
      double scale, offset_m;
    };
    for (const Place place : {Place{1.0, 1e6}, Place{1e-3, 0.0}, Place{1e3, 0.0}}) {
      if (mesh == "ico5") add("tap", mesh, {2.0}, place.scale, place.offset_m);
      if (mesh == "corner64") {
        add("corner_sym", mesh, {0.1}, place.scale, place.offset_m);
        add("cornerfast", mesh, {1.0}, place.scale, place.offset_m);
      }
    }
  }

  const RigidBenchOptions& options_;
  std::vector<Case> cases_;
};

// Distance from the origin to the first surface that a ray from outside to the origin meets, in a scene of
// size 1. Each step along the ray is as long as the distance to the surface (sphere tracing).
std::optional<double> first_surface(const polygon::RigidSurface& surface, const glm::dvec3& direction,
                                    double scale) {
  constexpr double kMet = 1e-9;    // distance at which the ray has met the surface (unit: `scale`)
  constexpr int kMostSteps = 500;  // along a grazed surface the steps are short
  double at = 1.1 * kSphereRadius_m * scale;
  for (int n = 0; n < kMostSteps && at > 0.0; ++n) {
    polygon::NearPoint near;
    if (!surface.nearest(at * direction, 4.0 * kSphereRadius_m * scale, near)) return std::nullopt;
    if (near.distance <= kMet * scale) return at / scale;
    at -= near.distance;
  }
  return std::nullopt;
}

GoalPath make_path(const Case& c, bool quick, bool large, const polygon::RigidSurface* surface) {
  const int ticks = quick ? 1000 : 20000;
  if (c.path == "far") return far_path(quick ? 1000 : 5000);
  if (c.path == "hover") return hover_path(c.radius_m, c.speed_m_s, ticks);
  if (c.path == "slide" && c.file != nullptr) {
    return drape_path(c.radius_m, c.speed_m_s, ticks, [&](const glm::dvec3& direction) {
      return first_surface(*surface, direction, c.scale);
    });
  }
  if (c.path == "slide") return slide_path(c.radius_m, c.speed_m_s, ticks);
  if (c.path == "tap") return tap_path(c.radius_m, quick ? 50 : (large ? 500 : 5000));
  if (c.path == "edge") return edge_path(c.radius_m, quick ? 1 : 10);
  if (c.path == "corner") return corner_path(c.radius_m, false, quick ? 1 : 10);
  if (c.path == "corner_sym") return corner_path(c.radius_m, true, quick ? 1 : 10);
  if (c.path == "cornerfast") return cornerfast_path(c.radius_m, ticks);
  return moving_path(c.speed_m_s, quick ? 1 : moving_laps(c.speed_m_s));
}

std::string tool_text(double radius_m) {
  return radius_m > 0.0 ? fmt::format("{:g} mm ball", 1e3 * radius_m) : "point";
}

// ---- one mesh, and the structures that its runs share ----

class Workshop {
 public:
  Workshop(const RigidBenchOptions& options, const Case& first)
      : options_(options),
        scale_(first.scale),
        kept_(first.file ? first.file
                         : std::make_shared<const BenchMesh>(make_bench_mesh(first.mesh, first.scale))),
        mesh_(*kept_) {
    if (mesh_.mesh.triangles.size() <= kMostReferenceTriangles) {
      say("building the exact reference");
      reference_ = std::make_unique<polygon::OptimalityReference>(mesh_.mesh);
    }
    for (const Engine engine : kEngines) {
      const bool too_large = engine != Engine::hybrid && engine != Engine::no_map &&
                             mesh_.mesh.triangles.size() > kMostBaselineTriangles;
      if (options.engines.empty() ? too_large
                                  : std::count(options.engines.begin(), options.engines.end(), engine) == 0)
        continue;
      engines_.push_back(engine);
    }
  }

  [[nodiscard]] bool serves(const Case& c) const { return c.mesh == mesh_.name && c.scale == scale_; }

  std::vector<RigidRow> run(const Case& c, const TickTimer& timer) {
    const glm::dvec3 offset(c.offset_m);
    const bool large = mesh_.mesh.triangles.size() > kLarge;
    const polygon::RigidSurface* surface = c.file ? surface_of(Engine::hybrid).surface.get() : nullptr;
    const GoalPath path = placed(make_path(c, options_.quick, large, surface), c.scale, offset);
    const double radius = c.radius_m * c.scale;
    const Budget& budget = options_.quick ? kQuick : kFull;
    std::vector<TouchWorld*> worlds;
    std::vector<double> limits;
    for (const Engine engine : engines_) {
      TouchWorld& world = world_of(engine, radius, offset, !path.body_m.empty());
      world.state().faults = 0;
      worlds.push_back(&world);
      limits.push_back(engine == Engine::hybrid      ? 0.0
                       : engine == Engine::cgal_aabb ? budget.cgal_s
                       : engine == Engine::no_map    ? budget.no_map_s
                                                     : budget.other_s);
    }
    const std::vector<TouchRun> runs = run_engines(path, engines_, worlds, limits, offset, timer);
    Judge judge(mesh_, path, offset, radius, c.scale, reference_.get());
    std::vector<RigidRow> rows;
    for (std::size_t e = 0; e < runs.size(); ++e) {
      say(fmt::format("judging {}", engine_name(runs[e].engine)));
      RigidRow row = measured(c, path, runs[e], *worlds[e], timer);
      const bool first = runs[e].engine == Engine::hybrid;
      const double seconds = options_.every_tick ? -1.0 : first ? budget.judge_s : budget.judge_baseline_s;
      row.judged = judge.judge(runs[e], seconds);
      if (!options_.trace.empty()) save(c, path, runs[e]);
      rows.push_back(std::move(row));
    }
    return rows;
  }

 private:
  void say(const std::string& what) const {
    if (options_.progress) options_.progress(fmt::format("{}: {}", mesh_.name, what));
  }

  const TimedSurface& surface_of(Engine engine) {
    TimedSurface& surface = engine == Engine::cgal_aabb ? cgal_ : is_finger(engine) ? finger_ : own_;
    if (!surface.surface && !surface.tree) {
      say(engine == Engine::cgal_aabb ? "building CGAL's tree" : "building the surface");
      surface = make_surface(mesh_, engine);
    }
    return surface;
  }

  TouchWorld& world_of(Engine engine, double radius, const glm::dvec3& offset, bool moves) {
    std::unique_ptr<TouchWorld>& world = worlds_[{engine, radius, offset.x, moves}];
    if (!world) {
      const TimedSurface& surface = surface_of(engine);
      say("filling the occupancy map");
      world = std::make_unique<TouchWorld>(mesh_, surface, engine, radius, offset, moves);
    }
    return *world;
  }

  RigidRow measured(const Case& c, const GoalPath& path, const TouchRun& run, const TouchWorld& world,
                    const TickTimer& timer) const {
    RigidRow row{.path = c.path,
                 .mesh = c.mesh,
                 .triangles = mesh_.mesh.triangles.size(),
                 .radius_m = c.radius_m * c.scale,
                 .speed_m_s = c.speed_m_s * c.scale,
                 .scale = c.scene_scale(),
                 .offset_m = glm::dvec3(c.offset_m),
                 .engine = run.engine,
                 .tick_us = {},
                 .least_us = {},
                 .pose_us = {},
                 .faults = fault_texts(world.state().faults),
                 .judged = {}};
    row.ticks = run.ticks - std::min<std::size_t>(run.ticks, path.counted_from);
    row.path_ticks = path.goals.size() - path.counted_from;
    const auto of_counted = [&](const std::vector<float>& all) {
      std::vector<double> values(all.begin() + static_cast<std::ptrdiff_t>(run.ticks - row.ticks),
                                 all.begin() + static_cast<std::ptrdiff_t>(run.ticks));
      return percentiles(values);
    };
    row.tick_us = of_counted(run.tick_us);
    if (!run.pose_us.empty()) row.pose_us = of_counted(run.pose_us);
    row.least_us = of_counted(run.least_us);
    row.timer_overhead_us = timer.overhead_us();
    const auto all = static_cast<double>(std::max<std::size_t>(1, run.ticks));
    row.steps_mean = static_cast<double>(run.steps) / all;
    row.steps_max = run.most_steps;
    row.surveys_per_tick = static_cast<double>(run.surveys) / all;
    row.truncated_ticks = run.truncated_ticks;
    row.surface_build_ms = world.build_ms() - world.map_ms();
    row.map_build_ms = world.map_ms();
    row.build_ms = world.build_ms();
    row.bytes = world.bytes();
    return row;
  }

  void save(const Case& c, const GoalPath& path, const TouchRun& run) const {
    const double own =
        c.scale / c.scene_scale();  // a name has the figures of a scene of size 1, or of the file's scene
    std::string name =
        fmt::format("{}-{}-{}-{:g}mps-{}", c.path, std::filesystem::path(c.mesh).filename().string(),
                    c.radius_m > 0.0 ? fmt::format("{:g}mm", 1e3 * own * c.radius_m) : "point",
                    own * c.speed_m_s, engine_name(run.engine));
    if (c.scene_scale() != 1.0) name += fmt::format("-x{:g}", c.scale);
    if (c.offset_m != 0.0) name += fmt::format("-at{:g}m", c.offset_m);
    std::vector<TraceRow> rows(run.ticks);
    for (std::size_t k = 0; k < run.ticks; ++k) {
      const double force = glm::length(run.force_N[k]);
      rows[k] = {.t_s = static_cast<double>(k) * kTick_s,
                 .device_m = path.goals[k],
                 .proxy_m = run.proxy_m[k],
                 .force_N = run.force_N[k],
                 .rigid_N = force,
                 .contacts = force > 0.0 ? 1U : 0U,
                 .tick_us = run.tick_us[k]};
    }
    save_trace(options_.trace / (name + ".csv"), rows);
  }

  const RigidBenchOptions& options_;
  double scale_;
  std::shared_ptr<const BenchMesh> kept_;
  const BenchMesh& mesh_;
  std::vector<Engine> engines_;
  std::unique_ptr<polygon::OptimalityReference> reference_;
  TimedSurface own_, cgal_, finger_;
  std::map<std::tuple<Engine, double, double, bool>, std::unique_ptr<TouchWorld>> worlds_;
};

}  // namespace

const std::vector<std::string>& rigid_paths() {
  static const std::vector<std::string> kPaths{"far",    "hover",      "slide",      "tap",   "edge",
                                               "corner", "corner_sym", "cornerfast", "moving"};
  return kPaths;
}

std::vector<RigidRow> bench_rigid(const RigidBenchOptions& options) {
  set_flush_to_zero();
  std::vector<Case> cases = Plan(options).take();
  if (cases.empty()) {
    throw std::invalid_argument(
        "none of the chosen meshes has one of the chosen paths: far, hover, slide, tap are for ico and geo, "
        "edge for cube, corner, corner_sym, cornerfast for corner, moving for all but corner; far, slide, "
        "tap "
        "and moving for files");
  }
  // Cases with the same mesh follow one another. Otherwise the order of the plan stays.
  std::stable_sort(cases.begin(), cases.end(), [](const Case& a, const Case& b) {
    const auto key = [](const Case& c) {
      return std::tuple(c.scene_scale() != 1.0, c.triangles, c.mesh, c.scale);
    };
    return key(a) < key(b);
  });
  if (!options.trace.empty()) std::filesystem::create_directories(options.trace);
  const TickTimer timer;
  std::vector<RigidRow> rows;
  std::unique_ptr<Workshop> workshop;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Case& c = cases[i];
    if (options.progress) {
      options.progress(fmt::format("{} of {}: {} on {}, {}, {:g} m/s", i + 1, cases.size(), c.path, c.mesh,
                                   tool_text(c.tool_m() / c.scene_scale()), c.speed() / c.scene_scale()));
    }
    if (!workshop || !workshop->serves(c)) {
      workshop.reset();  // first, because two meshes at once may not fit into memory
      workshop = std::make_unique<Workshop>(options, c);
    }
    for (RigidRow& row : workshop->run(c, timer)) {
      if (options.on_row) options.on_row(row);
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

}  // namespace hybrid::bench
