// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/thesis/thesis_study.h"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "device/loop/stop_signal.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/thread_time.h"
#include "hybrid/bench/thesis/thesis_threads.h"
#include "hybrid/build/build_objects.h"
#include "hybrid/compare/compare.h"
#include "hybrid/compare/compare_scenes.h"
#include "hybrid/compare/thesis_rendering.h"
#include "hybrid/session/session.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "voxel/baseline/thesis_chainmail.h"

namespace hybrid::bench {
namespace {

constexpr double kSpacing_m = 1e-3, kToolRadius_m = 4e-3;
// Slack of the links, as a share of their rest length: in the tissue, and in the core.
constexpr double kSlack = 0.1, kCoreSlack = 0.05;
constexpr double kYoung_Pa = 1e4, kCoreYoung_Pa = 1e5;
constexpr double kCore = 0.4;  // edge of the core, as a share of the cube's
// Greatest depth, as a share of the depth at which chains from top to bottom are at their limits.
constexpr double kMostOfLimit = 0.6;
constexpr int kPairEdge = 29;  // 24,389 voxels
constexpr std::size_t kPairTriangles = 11'200;
constexpr double kSeconds = 2.0, kQuickSeconds = 0.3;
// Edges of the cubes (voxels). Each cube has about twice as many voxels as the one before.
constexpr std::array kEdges{8, 10, 13, 16, 20, 25, 32, 40, 50, 64, 80, 100, 128};
constexpr int kQuickMostEdge = 64;

// A path that presses the top of a cube of this edge again and again, each time at another place.
device::WaypointPath pressing_path(int edge, const Vigour& vigour, double seconds) {
  const double size = edge * kSpacing_m, top = 0.5 * size + kToolRadius_m;
  const double depth = std::min(1e-3 * vigour.depth_mm, kMostOfLimit * kSlack * size);
  const double above = top + 0.25 * depth, low = top - depth, aside = 0.5 * depth;
  device::WaypointPath path{.points = {}, .speed_m_per_s = 1e-3 * vigour.speed_mm_per_s};
  const std::array<glm::dvec2, 4> places{glm::dvec2(0.0), glm::dvec2(aside, 0.0), glm::dvec2(aside, aside),
                                         glm::dvec2(-aside, 0.5 * aside)};
  double way = 0.0;
  for (std::size_t n = 0; way < seconds * path.speed_m_per_s || n < 2; ++n) {
    const glm::dvec2 at = places[n % places.size()], next = places[(n + 1) % places.size()];
    for (const double height : {above, low, above}) path.points.push_back({{at, height}, 0.0});
    way += 2.0 * (above - low) + glm::length(next - at);
  }
  return path;
}

Scene study_scene(int edge, const Vigour& vigour, double seconds) {
  Scene scene = on_ideal_device({});
  scene.file = fmt::format("cube of {} voxels an edge", edge);
  scene.tool.radius_m = kToolRadius_m;
  scene.path = pressing_path(edge, vigour, seconds);
  return scene;
}

StudyTicks ticks_of(std::vector<double> times_us, std::uint64_t in_contact) {
  StudyTicks ticks{.ticks = times_us.size(), .tick_us = {}};
  const auto late = std::ranges::count_if(times_us, [](double us) { return us > kStudyPeriod_us; });
  ticks.late_share =
      static_cast<double>(late) / static_cast<double>(std::max<std::size_t>(1, times_us.size()));
  ticks.contact_share =
      static_cast<double>(in_contact) / static_cast<double>(std::max<std::size_t>(1, times_us.size()));
  ticks.tick_us = percentiles(times_us);
  return ticks;
}

struct PlayedCube {
  StudyTicks ticks;
  std::optional<double> error_jnd;
  std::uint64_t memory_bytes = 0;
  double load_s = 0.0;
  std::size_t surface_voxels = 0;
};

PlayedCube play_hybrid(const Scene& scene, double seconds, bool with_error) {
  BuiltScene built = build_scene(scene);
  PlayedCube played;
  played.memory_bytes = size_of(built).memory_bytes;
  played.load_s = built.seconds;
  for (const auto& object : built.state->soft) played.surface_voxels += object->lattice().surface().size();
  const SessionResult result = run_session(scene, built,
                                           {.seconds = seconds,
                                            .keep_recording = false,
                                            .measure_error = with_error,
                                            .progress = {},
                                            .async_relaxation = true});
  device::stop_if_asked();
  std::vector<double> times;
  for (const TraceRow& row : result.rows) times.push_back(row.tick_us);
  played.ticks = ticks_of(std::move(times), result.contact_ticks);
  if (with_error && result.error.all.samples > 0) played.error_jnd = result.error.p99_jnd;
  return played;
}

class Study {
 public:
  explicit Study(const ThesisOptions& options)
      : options_(options), seconds_(options.quick ? kQuickSeconds : kSeconds) {
    for (const int edge : kEdges) {
      if (!options.quick || edge <= kQuickMostEdge) study_.edges.push_back(edge);
    }
  }

  ThesisStudy run() {
    for (const SoftEngine engine : {SoftEngine::classic, SoftEngine::hybrid}) {
      for (const Vigour& vigour : vigours()) {
        if (!options_.quick || !vigour.name.empty()) study_.cubes.push_back(largest(engine, vigour));
      }
    }
    for (const Vigour& vigour : vigours()) {
      if (!vigour.name.empty()) add_pair(vigour);
    }
    say("the threads");
    study_.threads = thread_shares(study_cube(kPairEdge, normal(), seconds_), seconds_, study_.no_graphics);
    return std::move(study_);
  }

 private:
  void say(const std::string& what) const {
    device::stop_if_asked();
    if (options_.progress) options_.progress(what);
  }
  static const Vigour& normal() { return *std::ranges::find(vigours(), "normal", &Vigour::name); }

  // A late session is played once more, because another program may have used the processor.
  template <class Play>
  StudyTicks played_until_in_time(const Play& play) const {
    const StudyTicks first = play();
    if (first.in_time()) return first;
    const StudyTicks second = play();
    return second.late_share < first.late_share ? second : first;
  }

  LargestCube largest(SoftEngine engine, const Vigour& vigour) {
    std::map<int, StudyTicks> played;
    const auto in_time = [&](int edge) {
      say(fmt::format("{}, {:.0f} mm at {:.0f} mm/s, {} voxels an edge", engine_name(engine), vigour.depth_mm,
                      vigour.speed_mm_per_s, edge));
      const Scene scene = study_cube(edge, vigour, seconds_);
      played[edge] = played_until_in_time([&] {
        return engine == SoftEngine::classic ? play_classic(scene, seconds_)
                                             : play_hybrid(scene, seconds_, false).ticks;
      });
      return played[edge].in_time();
    };
    LargestCube row{.engine = engine, .vigour = vigour, .of_largest = {}, .error_jnd = {}};
    const auto found = largest_in_time(study_.edges, in_time);
    if (found) {
      row.edge = study_.edges[*found];
      row.voxels = static_cast<std::size_t>(row.edge) * static_cast<std::size_t>(row.edge) *
                   static_cast<std::size_t>(row.edge);
      row.of_largest = played[row.edge];
      if (engine == SoftEngine::hybrid)
        row.error_jnd = play_hybrid(study_cube(row.edge, vigour, seconds_), seconds_, true).error_jnd;
    }
    const std::size_t next = found ? *found + 1 : 0;
    if (next < study_.edges.size()) row.late_edge = study_.edges[next];
    return row;
  }

  void add_pair(const Vigour& vigour) {
    say("the pair, " + vigour.name);
    const Scene cube = study_cube(kPairEdge, vigour, seconds_);
    const CubeMeshFile mesh(kPairEdge, kPairTriangles);
    const std::size_t voxels = std::size_t{kPairEdge} * kPairEdge * kPairEdge;
    const auto add = [&](const char* model, std::size_t elements, const PlayedCube& played) {
      study_.pair.push_back({.model = model,
                             .vigour = vigour,
                             .elements = elements,
                             .session = played.ticks,
                             .memory_bytes = played.memory_bytes,
                             .load_s = played.load_s,
                             .error_jnd = played.error_jnd});
    };
    const PlayedCube soft = play_hybrid(cube, seconds_, true);
    study_.surface_voxels = soft.surface_voxels;
    add("voxels", voxels, soft);
    PlayedCube classic;
    classic.ticks = play_classic(cube, seconds_);
    add("voxels, classic", voxels, classic);
    add("mesh, proxy", mesh.triangles(),
        play_hybrid(study_mesh(mesh, kPairEdge, vigour, seconds_), seconds_, false));
  }

  const ThesisOptions& options_;
  double seconds_;
  ThesisStudy study_;
};

}  // namespace

const std::vector<Vigour>& vigours() {
  static const std::vector<Vigour> kVigours{{"", 1.0, 25.0},   {"gentle", 2.0, 50.0},
                                            {"", 4.0, 100.0},  {"normal", 8.0, 200.0},
                                            {"", 12.0, 300.0}, {"vigorous", 20.0, 500.0}};
  return kVigours;
}

Scene study_cube(int edge, const Vigour& vigour, double seconds) {
  Scene scene = study_scene(edge, vigour, seconds);
  const auto material = [](double young_Pa, double slack) {
    return Material{.young_Pa = young_Pa,
                    .stretch_min = 1.0 - slack,
                    .stretch_max = 1.0 + slack,
                    .shear = slack,
                    .place = {}};
  };
  scene.materials["tissue"] = material(kYoung_Pa, kSlack);
  scene.materials["core"] = material(kCoreYoung_Pa, kCoreSlack);
  voxel::Formula cube{.size_m = glm::dvec3(edge * kSpacing_m),
                      .spacing_m = glm::dvec3(kSpacing_m),
                      .layers = {},
                      .inclusions = {}};
  cube.inclusions.push_back({.size_m = glm::dvec3(kCore * edge * kSpacing_m)});
  scene.soft.push_back({.name = "cube",
                        .source = std::move(cube),
                        .pose = {},
                        .materials = {{std::uint8_t{2}, "core"}},
                        .material = "tissue",
                        .anchors = {},
                        .place = {},
                        .source_place = {}});
  return scene;
}

CubeMeshFile::CubeMeshFile(int edge, std::size_t triangles)
    : file_(std::filesystem::temp_directory_path() / fmt::format("hybrid-cube-{}-{}.ply", edge, getpid())) {
  const int parts = static_cast<int>(std::lround(std::sqrt(static_cast<double>(triangles) / 12.0)));
  const auto mesh = polygon::make_box_mesh(glm::dvec3(0.5 * edge * kSpacing_m), std::max(1, parts));
  triangles_ = mesh.triangles.size();
  polygon::save_ply(file_, mesh);
}
CubeMeshFile::~CubeMeshFile() {
  std::error_code ignored;
  std::filesystem::remove(file_, ignored);
}

Scene study_mesh(const CubeMeshFile& mesh, int edge, const Vigour& vigour, double seconds) {
  Scene scene = study_scene(edge, vigour, seconds);
  RigidDescription cube;
  cube.name = "cube";
  cube.source = MeshSource{.file = mesh.file()};
  scene.rigid.push_back(std::move(cube));
  return scene;
}

StudyTicks play_classic(const Scene& scene, double seconds) {
  const SoftDescription& soft = scene.soft.front();
  std::vector<BuildNote> notes;
  const voxel::LabelVolume volume = build_volume(soft, notes);
  voxel::ThesisChainMail object(volume, lattice_options(scene, soft), {.damping = kThesisDamping});
  const auto path = scene_path(scene);
  const ScopedFlushToZero flushed;
  object.touch(glm::dvec3(1e9), 0.0);  // touches nothing; builds the map before the first timed tick
  const double dt_s = 1.0 / scene.rate_hz;
  const auto ticks = static_cast<std::uint64_t>(std::llround(seconds * scene.rate_hz));
  const auto most_late = static_cast<std::size_t>(kMostLate * static_cast<double>(ticks));
  std::vector<double> times;
  std::size_t late = 0, in_contact = 0;
  for (std::uint64_t t = 0; t < ticks; ++t) {
    device::stop_if_asked();
    const glm::dvec3 at_m = path->position(static_cast<double>(t) * dt_s) - volume.origin_m;
    const double start = thread_time_s();
    const bool contact = object.touch(at_m, scene.tool.radius_m).contact;
    times.push_back(1e6 * (thread_time_s() - start));
    in_contact += contact ? 1 : 0;
    late += times.back() > kStudyPeriod_us ? 1 : 0;
    if (late > 20 * most_late + 20) break;  // late beyond doubt
    object.relax_in_turn(soft.budget);
  }
  return ticks_of(std::move(times), in_contact);
}

std::optional<std::size_t> largest_in_time(const std::vector<int>& edges,
                                           const std::function<bool(int)>& in_time) {
  if (edges.empty()) return std::nullopt;
  if (in_time(edges.back())) return edges.size() - 1;
  std::size_t late = edges.size() - 1, good = 0;
  if (late == 0 || !in_time(edges.front())) return std::nullopt;
  while (late - good > 1) {
    const std::size_t middle = (good + late) / 2;
    (in_time(edges[middle]) ? good : late) = middle;
  }
  return good;
}

ThesisStudy study_thesis(const ThesisOptions& options) {
  return Study(options).run();
}

}  // namespace hybrid::bench
