// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/rigid.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <stdexcept>
#include <tuple>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/report.h"
#include "hybrid/session/trace_file.h"

namespace hybrid::bench {
namespace {

constexpr double kBall_m = 0.002;
constexpr double kPoint_m = 0.0;
constexpr std::size_t kMostReferenceTriangles =
    3'000'000;                             // of the exact reference, which takes 1 kB a triangle
constexpr std::size_t kLarge = 3'000'000;  // triangles: a shorter table

// Seconds a baseline may spend in steps of one run, and what judging one run may take.
struct Budget {
  double cgal_s, no_map_s, judge_s, judge_baseline_s;
};
constexpr Budget kFull{1.5, 2.0, 1.0, 0.2};
constexpr Budget kQuick{0.1, 0.2, 0.05, 0.02};

struct Case {
  std::string path, mesh;
  double radius_m = 0.0, speed_m_s = 0.0, scale = 1.0, offset_m = 0.0;
};

// ---- which runs ----

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
      }
      if (bench_mesh_shape(mesh) != BenchShape::corner && (chosen || mesh == "ico5" || mesh == "cube1")) {
        if (options.quick) {
          add("moving", mesh, {0.1});
        } else {
          add("moving", mesh, {0.02, 0.1, 1.0});
        }
      }
      if (!options.quick) add_elsewhere(mesh);
    }
  }
  std::vector<Case> take() { return std::move(cases_); }

 private:
  void add(const std::string& path, const std::string& mesh, const std::vector<double>& speeds,
           double scale = 1.0, double offset_m = 0.0) {
    if (!wanted(options_.paths, path)) return;
    for (const double radius : {kPoint_m, kBall_m}) {
      for (const double speed : speeds) cases_.push_back({path, mesh, radius, speed, scale, offset_m});
    }
  }

  void add_sphere(const std::string& mesh) {
    const std::vector<double> speeds =
        options_.quick ? std::vector<double>{0.1} : std::vector<double>{0.1, 1.0};
    add("far", mesh, {0.1});
    add("hover", mesh, speeds);
    add("slide", mesh, speeds);
    add("tap", mesh, {2.0});
  }

  // The same in scenes of another size, and far from the origin.
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

GoalPath make_path(const Case& c, bool quick, bool large) {
  const int ticks = quick ? 1000 : 20000;
  if (c.path == "far") return far_path(quick ? 1000 : 5000);
  if (c.path == "hover") return hover_path(c.radius_m, c.speed_m_s, ticks);
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

// ---- one mesh, and everything that is built of it once ----

class Workshop {
 public:
  Workshop(const RigidBenchOptions& options, const Case& first)
      : options_(options), scale_(first.scale), mesh_(make_bench_mesh(first.mesh, first.scale)) {
    if (mesh_.mesh.triangles.size() <= kMostReferenceTriangles) {
      say("building the exact reference");
      reference_ = std::make_unique<polygon::OptimalityReference>(mesh_.mesh);
    }
    for (const Engine engine : kEngines) {
      const bool too_large =
          engine == Engine::cgal_aabb && mesh_.mesh.triangles.size() > kMostBaselineTriangles;
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
    const GoalPath path = placed(make_path(c, options_.quick, large), c.scale, offset);
    const double radius = c.radius_m * c.scale;
    const Budget& budget = options_.quick ? kQuick : kFull;
    std::vector<TouchWorld*> worlds;
    std::vector<double> limits;
    for (const Engine engine : engines_) {
      TouchWorld& world = world_of(engine, radius, offset, !path.body_m.empty());
      world.state().faults = 0;
      world.state().truncated_ticks = 0;
      worlds.push_back(&world);
      limits.push_back(engine == Engine::hybrid      ? 0.0
                       : engine == Engine::cgal_aabb ? budget.cgal_s
                                                     : budget.no_map_s);
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
    TimedSurface& surface = engine == Engine::cgal_aabb ? cgal_ : own_;
    if (!surface.surface) {
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
                 .scale = c.scale,
                 .offset_m = glm::dvec3(c.offset_m),
                 .engine = run.engine,
                 .tick_us = {},
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
    row.timer_overhead_us = timer.overhead_us();
    const auto all = static_cast<double>(std::max<std::size_t>(1, run.ticks));
    row.steps_mean = static_cast<double>(run.steps) / all;
    row.steps_max = run.most_steps;
    row.surveys_per_tick = static_cast<double>(run.surveys) / all;
    row.truncated_ticks = world.state().truncated_ticks;
    row.surface_build_ms = world.build_ms() - world.map_ms();
    row.map_build_ms = world.map_ms();
    row.build_ms = world.build_ms();
    row.bytes = world.bytes();
    return row;
  }

  void save(const Case& c, const GoalPath& path, const TouchRun& run) const {
    std::string name = fmt::format("{}-{}-{}-{:g}mps-{}", c.path, c.mesh,
                                   c.radius_m > 0.0 ? fmt::format("{:g}mm", 1e3 * c.radius_m) : "point",
                                   c.speed_m_s, engine_name(run.engine));
    if (c.scale != 1.0) name += fmt::format("-x{:g}", c.scale);
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
  BenchMesh mesh_;
  std::vector<Engine> engines_;
  std::unique_ptr<polygon::OptimalityReference> reference_;
  TimedSurface own_, cgal_;
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
        "edge for cube, corner, corner_sym, cornerfast for corner, moving for all but corner");
  }
  // What shares a mesh comes together; else in the order of the plan.
  std::stable_sort(cases.begin(), cases.end(), [](const Case& a, const Case& b) {
    const auto key = [](const Case& c) {
      return std::tuple(c.scale != 1.0, bench_mesh_triangles(c.mesh), c.mesh, c.scale);
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
                                   tool_text(c.radius_m), c.speed_m_s));
    }
    if (!workshop || !workshop->serves(c)) {
      workshop.reset();  // before the next is built: both need not fit
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
