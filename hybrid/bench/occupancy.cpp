// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/occupancy.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "hybrid/bench/paths.h"
#include "hybrid/bench/timer.h"
#include "hybrid/map/occupancy_map.h"
#include "polygon/reference/cgal_surface.h"

namespace hybrid::bench {
namespace {

// kBatch: queries that are timed together. kRounds: rounds in which the engines run in turns.
constexpr std::size_t kBatch = 64, kRounds = 3;
constexpr std::size_t kMostFound = 4096;  // elements that a query may return
// Brute force, and the tree of all voxels, are measured with at most twice this many elements.
constexpr std::size_t kMostBrute = 1'000'000, kMostTreeOfAll = 1'000'000;
constexpr std::array<OccupancyPattern, 3> kPatterns{OccupancyPattern::empty, OccupancyPattern::coherent,
                                                    OccupancyPattern::random};
constexpr std::array<int, 2> kBoxes{1, 5};  // cells along an edge: one cell, or a tool's box

struct QueryBox {
  glm::dvec3 low, high;
  // The box that is looked up in the map. For voxels and a box of one cell, both corners are one point in
  // that cell. The answer is the same.
  glm::dvec3 map_low, map_high;
};
using Found = std::array<std::uint32_t, kMostFound>;

// Samples of one operation. Each is the mean over a batch.
struct Samples {
  std::vector<double> ns;
  std::size_t batch = kBatch;
};

double share_of(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const auto at = static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)));
  return values[std::min(at, values.size() - 1)];
}

// Measures one ball with all engines.
class OccupancyBench {
 public:
  OccupancyBench(const OccupancyBenchOptions& options, OccupancyBall ball)
      : options_(options), ball_(std::move(ball)), index_(ball_.cell_m, glm::dvec3(0.0)) {}

  void run(const std::function<void(OccupancyRow)>& add);

 private:
  [[nodiscard]] bool voxels() const { return ball_.what != OccupancyWhat::triangles; }
  [[nodiscard]] std::size_t elements() const {
    return voxels() ? ball_.points.size() : ball_.mesh.triangles.size();
  }
  [[nodiscard]] bool wanted(const char* op) const {
    return options_.cases.empty() ||
           std::find(options_.cases.begin(), options_.cases.end(), op) != options_.cases.end();
  }
  [[nodiscard]] bool wanted(OccupancyEngine engine) const {
    return options_.engines.empty() ||
           std::find(options_.engines.begin(), options_.engines.end(), engine) != options_.engines.end();
  }
  [[nodiscard]] OccupancyRow row(const char* op, OccupancyEngine engine, OccupancyPattern pattern,
                                 Samples samples) const;
  [[nodiscard]] std::unique_ptr<OccupancyMap> built_map() const;
  [[nodiscard]] std::unique_ptr<polygon::BoxSearch> built_tree() const;
  void build(const std::function<void(OccupancyRow)>& add);
  void look_up(OccupancyPattern pattern, int box_cells, const std::function<void(OccupancyRow)>& add);
  void check(OccupancyRow& row, std::span<const QueryBox> boxes) const;
  void update_voxels(const std::function<void(OccupancyRow)>& add);
  void update_body(const std::function<void(OccupancyRow)>& add);

  // A box of whole cells about a place, so that it contains the same points for every engine.
  [[nodiscard]] QueryBox box_about(const glm::dvec3& p, int box_cells) const;
  [[nodiscard]] std::size_t ask(OccupancyEngine engine, const QueryBox& box, Found& out) const;
  [[nodiscard]] std::size_t ask_brute(const QueryBox& box, Found& out) const;

  const OccupancyBenchOptions& options_;
  OccupancyBall ball_;
  BrickGrid index_;  // rounds positions to cells
  TickTimer timer_;
  std::unique_ptr<OccupancyMap> map_;
  // Kept from look-up to look-up, as in a tick; answers do not depend on it.
  mutable OccupancyMap::Trail trail_;
  std::unique_ptr<polygon::BoxSearch> tree_;
  std::size_t cells_ = 0;
  Samples tree_build_;
};

OccupancyRow OccupancyBench::row(const char* op, OccupancyEngine engine, OccupancyPattern pattern,
                                 Samples samples) const {
  OccupancyRow r;
  r.op = op;
  r.engine = engine;
  r.pattern = pattern;
  r.what = ball_.what;
  r.cells = cells_;
  r.elements = elements();
  r.object_voxels = ball_.object_voxels;
  r.batch = samples.batch;
  r.batches = samples.ns.size();
  r.p50_ns = share_of(samples.ns, 0.5);
  r.p99_ns = share_of(samples.ns, 0.99);
  const std::size_t bytes = engine == OccupancyEngine::map                             ? map_->memory_bytes()
                            : engine == OccupancyEngine::cgal_aabb && tree_ != nullptr ? tree_->memory_bytes()
                                                                                       : 0;
  r.bytes_per_cell = static_cast<double>(bytes) / static_cast<double>(std::max<std::size_t>(1, cells_));
  return r;
}

std::unique_ptr<OccupancyMap> OccupancyBench::built_map() const {
  auto map = std::make_unique<OccupancyMap>(ball_.cell_m, glm::dvec3(0.0));
  if (voxels()) {
    map->add_soft(static_cast<std::uint32_t>(ball_.points.size()));
    for (std::uint32_t n = 0; n < ball_.points.size(); ++n) map->place(n, ball_.points[n]);
  } else {
    for (const auto& t : ball_.mesh.triangles)
      map->add_triangle(0, ball_.mesh.vertices[t[0]], ball_.mesh.vertices[t[1]], ball_.mesh.vertices[t[2]]);
  }
  map->reserve_bricks(voxels() ? 2048 : 0);
  return map;
}

std::unique_ptr<polygon::BoxSearch> OccupancyBench::built_tree() const {
  return voxels() ? polygon::make_cgal_search(ball_.points) : polygon::make_cgal_search(ball_.mesh);
}

void OccupancyBench::build(const std::function<void(OccupancyRow)>& add) {
  const std::size_t repeats = options_.quick ? 2 : elements() > 2'000'000 ? 1 : elements() > 200'000 ? 3 : 9;
  Samples map_build{{}, 1};
  tree_build_ = {{}, 1};
  const bool tree = wanted(OccupancyEngine::cgal_aabb) &&
                    (ball_.what != OccupancyWhat::voxels_all || elements() <= 2 * kMostTreeOfAll);
  for (std::size_t n = 0; n < repeats; ++n) {
    map_.reset();
    std::uint64_t begin = TickTimer::begin();
    map_ = built_map();
    map_build.ns.push_back(1e3 * timer_.us(TickTimer::end() - begin));
    if (!tree) continue;
    tree_.reset();
    begin = TickTimer::begin();
    tree_ = built_tree();
    tree_build_.ns.push_back(1e3 * timer_.us(TickTimer::end() - begin));
  }
  cells_ = map_->occupied_cells();
  if (!wanted("rebuild")) return;
  if (wanted(OccupancyEngine::map))
    add(row("rebuild", OccupancyEngine::map, OccupancyPattern::coherent, map_build));
  if (tree) add(row("rebuild", OccupancyEngine::cgal_aabb, OccupancyPattern::coherent, tree_build_));
}

QueryBox OccupancyBench::box_about(const glm::dvec3& p, int box_cells) const {
  const CellCoordinates c = index_.cell_of(p);
  const double reach = 0.5 * (box_cells - 1);
  // The faces of the box lie just inside faces of cells. No voxel is near a face of a cell.
  const glm::dvec3 middle = ball_.cell_m * (glm::dvec3(c[0], c[1], c[2]) + 0.5),
                   half(ball_.cell_m * (reach + 0.5 - 1e-3));
  const QueryBox box{middle - half, middle + half, middle - half, middle + half};
  return box_cells == 1 && voxels() ? QueryBox{box.low, box.high, middle, middle} : box;
}

std::size_t OccupancyBench::ask_brute(const QueryBox& box, Found& out) const {
  std::size_t count = 0;
  for (std::uint32_t n = 0; n < ball_.points.size(); ++n) {
    const glm::dvec3& p = ball_.points[n];
    if (p.x < box.low.x || p.x > box.high.x || p.y < box.low.y || p.y > box.high.y || p.z < box.low.z ||
        p.z > box.high.z || count == out.size())
      continue;
    out[count++] = n;
  }
  return count;
}

std::size_t OccupancyBench::ask(OccupancyEngine engine, const QueryBox& box, Found& out) const {
  if (engine == OccupancyEngine::brute) return ask_brute(box, out);
  // The map only says whether a box has triangles. So the tree stops at its first triangle.
  if (!voxels()) {
    if (engine == OccupancyEngine::map) return map_->rigid_in(box.map_low, box.map_high, trail_) != 0 ? 1 : 0;
    return tree_->in(box.low, box.high, std::span(out).first(1));
  }
  return engine == OccupancyEngine::map ? map_->soft_in(box.map_low, box.map_high, out, trail_)
                                        : tree_->in(box.low, box.high, out);
}

void OccupancyBench::check(OccupancyRow& r, std::span<const QueryBox> boxes) const {
  const bool by_tree = tree_ != nullptr && r.engine != OccupancyEngine::cgal_aabb;
  const bool by_map = !by_tree && r.engine != OccupancyEngine::map;
  const OccupancyEngine other = by_tree  ? OccupancyEngine::cgal_aabb
                                : by_map ? OccupancyEngine::map
                                         : OccupancyEngine::brute;
  if (other == OccupancyEngine::brute && !voxels()) return;  // no tree to compare the map with
  r.reference = engine_name(other);
  const std::size_t most = other == OccupancyEngine::brute ? 10 : options_.quick ? 200 : 2000;
  static thread_local Found mine, theirs;
  std::size_t found = 0;
  const std::size_t step = std::max<std::size_t>(1, boxes.size() / most);
  for (std::size_t n = 0; n < boxes.size(); n += step) {
    const std::span a(mine.data(), ask(r.engine, boxes[n], mine));
    const std::span b(theirs.data(), ask(other, boxes[n], theirs));
    ++r.checked;
    found += a.size();
    if (!voxels()) {  // the map also reports triangles within a cell of the box
      const bool of_map = r.engine == OccupancyEngine::map ? !a.empty() : !b.empty();
      const bool of_tree = r.engine == OccupancyEngine::map ? !b.empty() : !a.empty();
      r.missed += of_tree && !of_map ? 1 : 0;
      r.extra += of_map && !of_tree ? 1 : 0;
      continue;
    }
    std::sort(a.begin(), a.end());
    std::sort(b.begin(), b.end());
    std::vector<std::uint32_t> only;
    std::set_difference(b.begin(), b.end(), a.begin(), a.end(), std::back_inserter(only));
    r.missed += only.size();
    only.clear();
    std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(only));
    r.extra += only.size();
  }
  r.found_mean = static_cast<double>(found) / static_cast<double>(std::max<std::size_t>(1, r.checked));
}

void OccupancyBench::look_up(OccupancyPattern pattern, int box_cells,
                             const std::function<void(OccupancyRow)>& add) {
  std::vector<QueryBox> boxes;
  for (const glm::dvec3& p : places(ball_, pattern, kBatch * (options_.quick ? 50 : 1500)))
    boxes.push_back(box_about(p, box_cells));
  std::array<Samples, kOccupancyEngines.size()> samples;
  std::array<std::size_t, kOccupancyEngines.size()> at{};
  static thread_local Found out;
  std::array<QueryBox, kBatch> asked{};
  volatile std::size_t keep = 0;
  // Engines run in turns, so that other load of the machine affects all alike.
  for (std::size_t round = 0; round < kRounds; ++round) {
    for (const OccupancyEngine engine : kOccupancyEngines) {
      const auto e = static_cast<std::size_t>(engine);
      if (!wanted(engine) || (engine == OccupancyEngine::cgal_aabb && tree_ == nullptr)) continue;
      if (engine == OccupancyEngine::brute && (!voxels() || elements() > 2 * kMostBrute)) continue;
      samples[e].batch = engine == OccupancyEngine::brute ? 1 : kBatch;
      const auto start = std::chrono::steady_clock::now();
      const std::chrono::duration<double> limit(options_.quick ? 0.005 : 0.15);
      for (std::size_t n = 0; n < boxes.size() / kBatch; ++n) {
        // Continues where the last round ended. The first batch of a round is a warm-up.
        const std::size_t first = at[e], count = samples[e].batch;
        at[e] = (first + count) % boxes.size();
        // The boxes are copied first, because a caller has its box in the cache. A box read from a list of
        // ten megabytes costs 3 to 5 ns if another engine used the caches in between.
        std::copy_n(boxes.begin() + static_cast<std::ptrdiff_t>(first), count, asked.begin());
        const std::span questions(asked.data(), count);
        std::size_t found = 0;
        const std::uint64_t begin = TickTimer::begin();
        switch (engine) {  // each engine has its own loop, so none pays for the switch
          case OccupancyEngine::map:
            for (const QueryBox& box : questions) found += ask(OccupancyEngine::map, box, out);
            break;
          case OccupancyEngine::cgal_aabb:
            for (const QueryBox& box : questions) found += ask(OccupancyEngine::cgal_aabb, box, out);
            break;
          case OccupancyEngine::brute:
            for (const QueryBox& box : questions) found += ask_brute(box, out);
            break;
        }
        const double ns = 1e3 * timer_.us(TickTimer::end() - begin) / static_cast<double>(count);
        keep = keep + found;
        if (n > 0) samples[e].ns.push_back(ns);
        if (n >= 5 && std::chrono::steady_clock::now() - start > limit) break;
      }
    }
  }
  for (const OccupancyEngine engine : kOccupancyEngines) {
    Samples& s = samples[static_cast<std::size_t>(engine)];
    if (s.ns.empty()) continue;
    OccupancyRow r = row("lookup", engine, pattern, std::move(s));
    r.box_cells = box_cells;
    const std::size_t most = engine == OccupancyEngine::brute ? 20 : boxes.size();
    check(r, std::span(boxes).first(std::min(most, boxes.size())));
    add(r);
  }
}

// Moves voxels to the next cell outwards and back, one after another: in the lattice's order, or at random.
void OccupancyBench::update_voxels(const std::function<void(OccupancyRow)>& add) {
  std::vector<glm::dvec3> moved = ball_.points;  // brute force has nothing else to update
  SplitMix64 random(3);
  for (const OccupancyPattern pattern : {OccupancyPattern::coherent, OccupancyPattern::random}) {
    Samples map{{}, kBatch}, brute{{}, kBatch};
    const std::size_t batches = options_.quick ? 50 : 1500;
    std::array<std::uint32_t, kBatch> who{};
    for (std::size_t b = 0; b < batches; ++b) {
      for (std::size_t i = 0; i < kBatch; ++i) {
        who[i] = static_cast<std::uint32_t>(
            (pattern == OccupancyPattern::random ? random.next() : b * kBatch + i) % elements());
      }
      for (const double way : {1.0, 0.0}) {
        std::array<glm::dvec3, kBatch> to{};
        for (std::size_t i = 0; i < kBatch; ++i) {
          const glm::dvec3& p = ball_.points[who[i]];
          to[i] = p + way * ball_.cell_m * glm::sign(p) * glm::dvec3(1.0, 0.0, 0.0);
        }
        std::uint64_t begin = TickTimer::begin();
        for (std::size_t i = 0; i < kBatch; ++i) map_->move(who[i], to[i]);
        const double map_ns = 1e3 * timer_.us(TickTimer::end() - begin) / kBatch;
        begin = TickTimer::begin();
        for (std::size_t i = 0; i < kBatch; ++i) moved[who[i]] = to[i];
        const double brute_ns = 1e3 * timer_.us(TickTimer::end() - begin) / kBatch;
        if (b == 0) continue;
        map.ns.push_back(map_ns);
        brute.ns.push_back(brute_ns);
      }
    }
    if (wanted(OccupancyEngine::map)) {
      OccupancyRow r = row("update", OccupancyEngine::map, pattern, std::move(map));
      r.reference = "a map built from scratch";
      r.checked = map_->validate() && map_->overflows() == 0 && map_->occupied_cells() == cells_ ? 1 : 0;
      r.missed = 1 - r.checked;
      add(r);
    }
    if (tree_ != nullptr) {
      OccupancyRow r = row("update", OccupancyEngine::cgal_aabb, pattern, tree_build_);
      r.note = "the tree has no update: built anew";
      add(r);
    }
    if (wanted(OccupancyEngine::brute) && elements() <= 2 * kMostBrute)
      add(row("update", OccupancyEngine::brute, pattern, std::move(brute)));
  }
}

// Moves the whole ball: by a fifth of a cell each time, or to random places.
void OccupancyBench::update_body(const std::function<void(OccupancyRow)>& add) {
  auto cells = std::make_shared<SurfaceCells>(ball_.cell_m, glm::dvec3(0.0));
  for (const auto& t : ball_.mesh.triangles)
    cells->add_triangle(1, ball_.mesh.vertices[t[0]], ball_.mesh.vertices[t[1]], ball_.mesh.vertices[t[2]]);
  cells->seal();
  OccupancyMap map(ball_.cell_m, glm::dvec3(0.0));
  map.add_moving(0, cells, glm::dvec3(0.0), glm::dquat(1.0, 0.0, 0.0, 0.0));
  map.reserve_bricks(0);
  SplitMix64 random(4);
  glm::dvec3 at(0.0);
  for (const OccupancyPattern pattern : {OccupancyPattern::coherent, OccupancyPattern::random}) {
    Samples samples{{}, kBatch};
    for (std::size_t b = 0; b < (options_.quick ? 50U : 1500U); ++b) {
      std::array<glm::dvec3, kBatch> to{};
      for (glm::dvec3& p : to) {
        at = pattern == OccupancyPattern::random ? 10.0 * ball_.radius_m * random.direction()
                                                 : at + glm::dvec3(0.2 * ball_.cell_m, 0.0, 0.0);
        p = at;
      }
      const std::uint64_t begin = TickTimer::begin();
      for (const glm::dvec3& p : to) map.move_body(0, p, glm::dquat(1.0, 0.0, 0.0, 0.0));
      const double ns = 1e3 * timer_.us(TickTimer::end() - begin) / kBatch;
      if (b > 0) samples.ns.push_back(ns);
    }
    if (wanted(OccupancyEngine::map)) {
      OccupancyRow r = row("update", OccupancyEngine::map, pattern, std::move(samples));
      r.bytes_per_cell = static_cast<double>(map.memory_bytes()) / static_cast<double>(cells_);
      r.note = "a body moves";
      r.reference = "the fixed map of the ball";
      for (const glm::dvec3& p : places(ball_, OccupancyPattern::random, 200)) {
        const QueryBox box = box_about(p, 5);
        ++r.checked;
        const bool fixed = map_->rigid_in(box.low, box.high) != 0,
                   moving = map.rigid_in(at + box.low, at + box.high) != 0;
        r.missed += fixed && !moving ? 1 : 0;
        r.extra += moving && !fixed ? 1 : 0;
      }
      add(r);
    }
    if (tree_ != nullptr) {
      OccupancyRow r = row("update", OccupancyEngine::cgal_aabb, pattern, tree_build_);
      r.note = "built anew; asked in the body's frame, as the map is, it would cost as little";
      add(r);
    }
  }
}

void OccupancyBench::run(const std::function<void(OccupancyRow)>& add) {
  build(add);
  if (wanted("lookup")) {
    for (const OccupancyPattern pattern : kPatterns) {
      for (const int box_cells : kBoxes) look_up(pattern, box_cells, add);
    }
  }
  if (!wanted("update")) return;
  if (voxels()) {
    update_voxels(add);
  } else {
    update_body(add);
  }
}

}  // namespace

const char* engine_name(OccupancyEngine engine) {
  switch (engine) {
    case OccupancyEngine::map:
      return "map";
    case OccupancyEngine::cgal_aabb:
      return "cgal-aabb";
    case OccupancyEngine::brute:
      break;
  }
  return "brute";
}

const std::vector<std::string>& occupancy_cases() {
  static const std::vector<std::string> kCases{"lookup", "update", "rebuild"};
  return kCases;
}

std::vector<OccupancyRow> bench_occupancy(const OccupancyBenchOptions& options) {
  std::vector<std::size_t> sizes = options.cells;
  if (sizes.empty()) {
    sizes = {1'000, 10'000};
    if (!options.quick) sizes.insert(sizes.end(), {100'000, 1'000'000, 10'000'000});
  }
  std::vector<OccupancyRow> rows;
  const auto add = [&](OccupancyRow row) {
    if (options.on_row) options.on_row(row);
    rows.push_back(std::move(row));
  };
  const auto say = [&options](const char* what, std::size_t count) {
    if (options.progress) options.progress(fmt::format("{} {}", count, what));
  };
  for (const std::size_t count : sizes) {
    for (const OccupancyWhat what :
         {OccupancyWhat::voxels_surface, OccupancyWhat::triangles, OccupancyWhat::voxels_all}) {
      say(what_name(what), count);
      OccupancyBench(options, make_ball(what, count)).run(add);
    }
    // For comparison with the ball of all voxels: the same ball with only its surface in the map, as in a
    // session.
    say("voxels, of which the surface", count);
    OccupancyBench(options, make_ball_surface_of(count)).run(add);
  }
  return rows;
}

}  // namespace hybrid::bench
