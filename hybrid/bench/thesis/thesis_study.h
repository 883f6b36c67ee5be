// SPDX-License-Identifier: GPL-3.0-or-later
// The study of the thesis (chapter V), repeated in one run for its own algorithm (`classic`) and for the
// product. Its parts are the largest cube that is served at 1 kHz under a gentle to vigorous hand, the pair
// of 24,000 voxels and 11,200 triangles, and the shares of the threads (Table 5).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/base/histogram.h"
#include "hybrid/bench/soft_table.h"
#include "hybrid/build/build_world.h"
#include "hybrid/page/page.h"

namespace hybrid::bench {

inline constexpr double kStudyPeriod_us = 1000.0;  // of the servo loop: 1 kHz, as in the thesis
// A cube is in time if at most this share of its ticks takes longer than the period.
inline constexpr double kMostLate = 1e-3;

// How a hand presses a cube again and again. A more vigorous hand presses deeper and faster.
struct Vigour {
  std::string name;  // "gentle", "normal", "vigorous"; empty: a step between them
  double depth_mm = 0.0, speed_mm_per_s = 0.0;
};
const std::vector<Vigour>& vigours();

// Times of the ticks of one session. A tick of classic is its six-direction check, its chain and its force.
// The relaxation of classic does not count, because the thesis ran it on its own thread. A tick of the
// product is the whole tick.
struct StudyTicks {
  std::uint64_t ticks = 0;
  Percentiles tick_us;
  double late_share = 0.0;  // share of the ticks that are longer than the period
  double contact_share =
      0.0;  // share of the ticks in contact: an engine that loses its contact has less to do
  [[nodiscard]] bool in_time() const { return late_share <= kMostLate; }
};

// The largest cube of those tried that is in time.
struct LargestCube {
  SoftEngine engine = SoftEngine::hybrid;
  Vigour vigour;
  int edge = 0;  // voxels; 0: not even the smallest cube is in time
  std::size_t voxels = 0;
  int late_edge = 0;      // edge of the next larger cube, which is late; 0: no larger one was tried
  StudyTicks of_largest;  // empty if edge is 0
  // Only for the product: p99 of the force's error in that cube, against the same session played slowly.
  std::optional<double> error_jnd;
};

// A row of the pair: one block, rendered in one way.
struct PairRow {
  std::string model;  // "voxels", "voxels, classic", "mesh, proxy"
  Vigour vigour;
  std::size_t elements = 0;  // voxels or triangles
  StudyTicks session;
  std::uint64_t memory_bytes = 0;
  double load_s = 0.0;
  std::optional<double> error_jnd;  // as in LargestCube
};

// Processor time of one thread for each second of a session. Empty: it was not measured.
struct ThreadShare {
  std::string name;
  double thesis_percent = 0.0;  // Table 5
  std::optional<double> ms_per_s, ms_per_s_voxel_by_voxel;
};

struct ThesisStudy {
  std::vector<LargestCube> cubes;  // by engine, then by rising vigour
  std::vector<PairRow> pair;
  std::size_t surface_voxels = 0;  // of the pair's block
  std::vector<ThreadShare> threads;
  std::string no_graphics;  // why frames were not drawn; empty if they were
  std::vector<int> edges;   // cubes that were tried, by rising size
};

struct ThesisOptions {
  bool quick = false;  // smaller cubes, shorter sessions
  Progress progress;
};

// Throws device::StopAsked after a signal.
ThesisStudy study_thesis(const ThesisOptions& options);

// ---- its parts ----
// Cube of `edge` voxels of 1 mm, with a stiffer core. It is pressed for `seconds`. Small cubes are pressed
// less deep, so that the hand feels the tissue and not its anchors.
Scene study_cube(int edge, const Vigour& vigour, double seconds);
// The same cube as a closed mesh of about `triangles` triangles, in a temporary file that lives as long as
// this object. study_mesh(): the scene in which the mesh is felt through the proxy.
class CubeMeshFile {
 public:
  CubeMeshFile(int edge, std::size_t triangles);
  CubeMeshFile(const CubeMeshFile&) = delete;
  CubeMeshFile& operator=(const CubeMeshFile&) = delete;
  CubeMeshFile(CubeMeshFile&&) = delete;
  CubeMeshFile& operator=(CubeMeshFile&&) = delete;
  ~CubeMeshFile();
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] std::size_t triangles() const { return triangles_; }

 private:
  std::filesystem::path file_;
  std::size_t triangles_;
};
Scene study_mesh(const CubeMeshFile& mesh, int edge, const Vigour& vigour, double seconds);
StudyTicks play_classic(const Scene& scene, double seconds);
// The largest of `edges` (by rising size) that `in_time` accepts, by bisection: if a cube is late, larger
// ones are not tried. Empty: none is in time.
std::optional<std::size_t> largest_in_time(const std::vector<int>& edges,
                                           const std::function<bool(int)>& in_time);

// ---- its report ----
std::string thesis_verdict(const ThesisStudy& study);
std::string thesis_table(const ThesisStudy& study);
nlohmann::ordered_json to_json(const LargestCube& row);
nlohmann::ordered_json to_json(const PairRow& row);
nlohmann::ordered_json to_json(const ThreadShare& row);
Page thesis_page(const ThesisStudy& study);

}  // namespace hybrid::bench
