// SPDX-License-Identifier: GPL-3.0-or-later
// What a deep push does to a large object, in bounded work: a composite grid (fast adaptive
// composite: McCormick 1989) of nested boxes round the contact.
//
// A pull reaches depth / slack voxels far, so a push 20 spacings deep at slack 0.1 moves 10^7 of them, and
// writing them takes milliseconds. But far from the contact displacements are smooth at the scale of their
// distance to it. So level 0 is a box of voxels round the contact, level l one of nodes 2^l voxels apart,
// about as many of them, and so on until a box holds the whole object. Outside the finer box a level's nodes
// are the unknowns; under it they follow, in the full approximation scheme. What is left out is interpolated
// where somebody asks. Work and memory go with the logarithm of the object's size, and not with the depth.
//
// Shape. A link between two nodes is worth what of the tissue lies round it (coarse_material.h): on level 0 that
// is what its link is worth in the lattice, on others a mean. There is none across a gap. Anchors hold a node
// at their distance. Tissues may differ in stiffness, but not in limits or Poisson's ratio.
//
// Limits. Where a body of one tissue is convex the equilibrium within chain limits is that of an obstacle
// problem: each node between L = max(u(s) − dist(v→s)) and U = min(u(s) + dist(s→v)) over what is pressed, s
// (see wave.h), dist along the links there are: differences of its solution keep the limits by a
// comparison with itself, shifted by a voxel (Brezis & Sibony 1971, of plastic torsion). So each node has
// bounds of its own, and projected multigrid does not stall where the chain is tight, as it does with limits
// from link to link. Round a notch, or the end of what is anchored, bounds are still right and no longer
// enough: there links may be beyond their limits (see worst_violation()). Where tissues differ they would
// be, and links are held one by one as well (link_limits.cpp).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "voxel/lattice/lattice.h"
#include "voxel/composite/coarse_material.h"

namespace voxel {
namespace composite {
struct LinkMultiplier;
struct ProlongArgs;
struct LevelView;
}  // namespace composite

class CompositeGrid {
 public:
  // Why an object's contacts cannot be on such a grid; empty: they can.
  static std::string reason_unsuitable(const Lattice& lattice);
  static constexpr int kRefineAll = -1, kHalfWidth = 6, kMaxHalfWidth = 14, kReferenceHalfWidth = 24;
  // `half_width`: of level 0, voxels, and of other levels' boxes, nodes; kRefineAll: level 0 is all of the
  // object, for references. Allocates.
  CompositeGrid(const Lattice& lattice, int half_width, int coarse_half_width = kHalfWidth);
  // All nodes go where another grid of the object has them.
  void interpolate_from(const CompositeGrid& other) noexcept;

  // ---- none of these allocates, locks or throws ----
  using Index3 = std::array<int, 3>;
  // Ahead of a contact, once a tick: what begin() does about this voxel, of one level.
  void prepare(const Index3& centre) noexcept;
  // At rest, boxes round voxel (i, j, k); where they have it well inside already, they stay.
  void begin(const Index3& centre) noexcept;
  // Once a tick: boxes go along with the contact, one at a time but where that would be too late.
  // True where the box of level 0 did.
  bool centre_on(const Index3& centre) noexcept;
  // Voxels of it: the first and the last that may be moved.
  void fine_patch(Index3& low, Index3& high) const noexcept;
  // May this voxel's place be found by level 0, and moved there?
  [[nodiscard]] bool in_fine_patch(const Index3& voxel) const noexcept;

  // Of a voxel in level 0: where it is; where its links alone would have it; how far 1 N moves it (m, m/N).
  [[nodiscard]] glm::dvec3 fine_at(const Index3& voxel) const noexcept;
  [[nodiscard]] glm::dvec3 unconstrained_minimum(const Index3& voxel) const noexcept;
  [[nodiscard]] glm::dvec3 compliance(const Index3& voxel) const noexcept;
  void set_fine(const Index3& voxel, const glm::dvec3& u) noexcept;
  // The displacement nearest to `u` that the chain lets a voxel have, anchors standing still (m).
  [[nodiscard]] glm::dvec3 clamp_to_anchors(const Index3& voxel, const glm::dvec3& u) const noexcept;

  // Before a cycle, of a contact that has gone on: displacements along an axis grow by this share of
  // themselves, none by more than the contact did (m).
  void extrapolate(std::size_t axis, double share, double most_m) noexcept;
  // Before a cycle: nothing is pressed; then, each voxel of level 0 that is pressed along `normal`.
  void clear_pressed() noexcept { pressed_.clear(); }
  void press(const Index3& voxel, const glm::dvec3& u, const glm::dvec3& normal) noexcept;
  // One multigrid cycle over all levels, on these axes.
  void cycle(const std::array<bool, 3>& axes = {true, true, true}) noexcept;
  // What the anchors carry (N): what the object does to whatever presses it.
  [[nodiscard]] glm::dvec3 force_on_tool_N() const noexcept;
  // By how much a link of level 0 is beyond its limit at most (m).
  [[nodiscard]] double worst_violation() const noexcept;
  // What the springs store (J).
  [[nodiscard]] double energy_J() const noexcept;

  // Displacement of any voxel, or point in units of voxels (m).
  [[nodiscard]] glm::dvec3 at_point(const std::array<double, 3>& point) const noexcept;
  [[nodiscard]] glm::dvec3 at(const Index3& voxel) const noexcept;
  // For whoever draws: the nodes of its boxes, the finest first.
  struct Nodes {
    Index3 first{}, count{};                       // the voxel at which node (0, 0, 0) is; how many
    int step = 1;                                 // voxels from one to the next
    std::array<bool, 3> open_low{}, open_high{};  // does the object go on beyond it there?
    std::size_t stride = 0, plane = 0;
    std::array<const float*, 3> u{};  // [axis][k · plane + j · stride + i] (m)
  };
  [[nodiscard]] std::size_t boxes() const noexcept { return covering_level_ + 1; }
  [[nodiscard]] Nodes nodes_of(std::size_t box) const noexcept;
  [[nodiscard]] std::size_t work_of_cycle() const noexcept { return work_; }  // octets relaxed
  [[nodiscard]] std::size_t memory_bytes() const;
  template <class Visit>
  void for_values(const Visit& visit) const {
    for (const Level& level : levels_) {
      for (const auto& axis : level.u) {
        for (const float u : axis) visit(u);
      }
    }
  }
  // Is all that is anchored in sides of the object that are anchored as a whole?
  [[nodiscard]] bool anchored_by_sides() const noexcept;
  // Is nothing anchored within some voxels of it, as far as a contact should be from that?
  [[nodiscard]] bool far_from_anchors(const Index3& voxel) const noexcept;
  // How much of what anchors hold, as links count it, coarse levels see: 1 where all.
  [[nodiscard]] double anchor_area_ratio() const noexcept;

 private:
  static constexpr int kOutside = -2;
  // Nodes of a level along one axis.
  struct AxisNodes {
    int count = 0, begin = 0;                  // nodes; coordinate of the first
    int first = 0, last = -1;                  // those within the box, both included
    bool open_low = false, open_high = false;  // the box ends within the object
    // To the next coarser level: the node at or before, and how far towards the one after.
    std::vector<int> coarse;
    std::vector<float> part;
    // The same along x, for whole rows: lane i goes by the coarse lanes from base + (i + odd) / 2 on.
    int base = 0;
    bool odd = false;
    std::vector<float> along;
    // From it, by coarse node: number here, which may be one beyond either end; kOutside beyond that. First
    // and last of those strictly within this box.
    std::vector<int> fine;
    int coarse_first = 0, coarse_last = -1;
    std::vector<float> from_low, from_own, from_high;  // restriction of loads
  };
  using Floats = std::vector<float>;
  struct Ghost {  // no node, with some beside it
    std::uint32_t at, first, count;
  };
  struct Level {
    int step = 1;
    bool is_built = false;   // with the present offset of coordinates
    bool moved = false;  // since it was put to rest
    std::array<AxisNodes, 3> line;
    std::size_t stride = 8, plane = 0;
    std::array<Floats, 3> u, held;       // [axis] held: 1 at its least, −1 at its most
    std::array<Floats, 3> weight, hold;  // [d] of the link up, in those of a link between voxels; of anchors
    std::array<Floats, 3> tissue;        // where tissues differ: the weight, were all of the reference's
    std::array<Floats, 3> reach;         // likewise: voxels to the anchor, behind it < 0
    std::array<std::array<Floats, 3>, 3> link, held_link;  // [axis][d] likewise, at limits: weight and hold
    std::array<Floats, 3> inverse, all;                    // [axis] 1 / Σ springs, 0: does not move; Σ
    Floats f, old, residual, is_free, is_active, active_stiffness, inverse_with_active;  // of the axis that a cycle is on
    std::array<Floats, 2> bound;                               // 0: least u, 1: least −u; likewise
    std::array<bool, 2> bounded{};
    bool has_active_stiffness = false;    // by what is stuck on finer levels; likewise
    double anchored_area = 0.0;  // by anchors (unit: face of a voxel)
    bool holds = false;      // some anchor holds some node
    bool broken = false;     // some link within the box is missing
    std::vector<Ghost> ghosts;
    std::vector<std::uint32_t> beside;  // of ghosts
    [[nodiscard]] std::size_t row(int j, int k) const {
      return plane + stride + kPad + static_cast<std::size_t>(k) * plane +
             static_cast<std::size_t>(j) * stride;
    }
    [[nodiscard]] std::size_t first_row() const { return row(0, 0); }
    [[nodiscard]] std::size_t floats() const { return static_cast<std::size_t>(line[2].count) * plane; }
    [[nodiscard]] std::size_t node(int i, int j, int k) const {
      return row(j, k) + static_cast<std::size_t>(i);
    }
    [[nodiscard]] std::array<int, 3> node_of(std::size_t number) const {  // from the first on
      return {static_cast<int>(number % stride), static_cast<int>(number % plane / stride),
              static_cast<int>(number / plane)};
    }
    // From a node's number to that of the next along d.
    [[nodiscard]] std::size_t by(std::size_t d) const { return d == 0 ? 1 : d == 1 ? stride : plane; }
    [[nodiscard]] int at(std::size_t d, int i) const { return line[d].begin + step * i; }
  };
  static constexpr std::size_t kPad = 8;
  struct Pressed {
    Index3 node;
    glm::vec3 u, normal;
  };

  [[nodiscard]] std::string wrong_somewhere();
  // Wide enough that a level holds the finer one wherever the contact is among their nodes.
  [[nodiscard]] int half_width_of(std::size_t level) const {
    int half = half_width_;
    for (std::size_t l = 0; l < level; ++l) half = std::max(coarse_half_width_, (half + 7) / 4 * 2);
    return half;
  }
  // ---- patch_placement.cpp ----
  [[nodiscard]] bool in_place(std::size_t l) const noexcept;
  [[nodiscard]] bool nested(std::size_t l) const noexcept;
  [[nodiscard]] bool off_centre(const Index3& centre) const noexcept;
  void recentre(const Index3& centre) noexcept;
  void rebuild(std::size_t l) noexcept;
  void put_to_rest(Level& level) noexcept;
  void move_patch(std::size_t l) noexcept;
  // ---- patches.cpp ----
  void allocate(Level& level, std::size_t l) const;
  void allocate_for_moves();
  // The nodes of a level along d, first and last, its box round the coordinate `centre`.
  struct NodeRange {
    int low, high;
    bool open_low, open_high;
    [[nodiscard]] int count(int step) const { return (high - low) / step + 1; }
  };
  [[nodiscard]] NodeRange node_range(std::size_t l, std::size_t d, int centre) const noexcept;
  void place_nodes(Level& level, std::size_t l, const Index3& centre) const noexcept;
  void assemble(Level& level) noexcept;
  // `near`: there may be anchors in it.
  void find_anchor_weights(Level& level, bool near) noexcept;
  void find_diagonal(Level& level, bool near) noexcept;
  [[nodiscard]] bool row_near_anchors(const Level& level, int j, int k) const noexcept;
  void find_ghosts(Level& level) noexcept;
  void set_up_transfer(Level& fine, const Level& coarse) const noexcept;
  void spread_to_ghosts(const Level& level, float* values) const noexcept;
  void gather_from_ghosts(const Level& level, float* loads) const noexcept;
  // ---- patch_stiffness.cpp ----
  void weigh(Level& level) noexcept;
  void weigh_shape(const Level& level, std::array<Floats, 3>& weight) noexcept;
  void weigh_box(const Level& level, std::array<Floats, 3>& weight) noexcept;
  void weigh_cells(const Level& level, std::array<Floats, 3>& weight, bool all_alike) noexcept;
  void weigh_halves(const Level& level, std::array<Floats, 3>& weight) noexcept;
  void weigh_tissues(Level& level) noexcept;
  [[nodiscard]] static int half_cube(const Level& level) noexcept;
  // ---- node_bounds.cpp ----
  void find_bounds(std::size_t axis) noexcept;
  void spread_bounds(Level& level, std::size_t axis, std::size_t kind, const Index3& low,
                     const Index3& high) const noexcept;
  void spread_round_gaps(Level& level, std::size_t axis, std::size_t kind) const noexcept;
  // ---- fac_cycle.cpp ----
  [[nodiscard]] composite::LevelView view(std::size_t l, std::size_t axis) noexcept;
  void inject_from_finer(std::size_t l, std::size_t axis) noexcept;
  void restrict_residual(std::size_t l, std::size_t axis) noexcept;
  void restrict_values(Level& coarse, const Level& fine, std::size_t axis, const float* from,
                   float* to) const noexcept;
  void add_active_stiffness(std::size_t l, std::size_t axis) noexcept;
  void prolong(std::size_t l, std::size_t axis) noexcept;
  void prolong_row(Level& fine, const Level& coarse, std::size_t axis, const float* from, int j, int k,
                bool adds) const noexcept;
  void fit_far_field(std::size_t axis) noexcept;  // far_field.cpp
  // ---- operator_interpolation.cpp ----
  [[nodiscard]] std::array<const float*, 2> weights_beside(const Level& level, std::size_t axis, std::size_t d,
                                                         int j, int k) const noexcept;
  void prolong_row_by_links(const composite::ProlongArgs& args, const Level& fine, const Level& coarse,
                         std::size_t axis, const float* from, int j, int k) const noexcept;
  [[nodiscard]] float prolonged_by_links(const Level& fine, const Level& coarse, std::size_t axis,
                                    const float* from, int i, int j, int k) const noexcept;
  void restrict_by_links(Level& coarse, const Level& fine, std::size_t axis, const float* from,
                         float* to) const noexcept;
  // ---- link_limits.cpp ----
  void update_multipliers(std::size_t axis) noexcept;
  float update_anchor_multipliers(Level& level, std::size_t axis, std::size_t d) noexcept;
  void restrict_multipliers(std::size_t l, std::size_t axis) noexcept;
  void update_diagonal(Level& level, std::size_t axis) const noexcept;
  void release_multipliers() noexcept;
  void save_multipliers(const Level& level) noexcept;
  void restore_multipliers(Level& level, const Index3& by) noexcept;
  [[nodiscard]] composite::LinkMultiplier link_multiplier(const Level& level, std::size_t axis, std::size_t d) const noexcept;
  [[nodiscard]] const std::array<Floats, 3>& weights_on(const Level& level, std::size_t axis) const {
    return multipliers_active_[axis] ? level.link[axis] : level.weight;
  }
  [[nodiscard]] const std::array<Floats, 3>& anchor_weights_on(const Level& level, std::size_t axis) const {
    return multipliers_active_[axis] ? level.held_link[axis] : level.hold;
  }
  [[nodiscard]] glm::dvec3 interpolate(const Level& level, const std::array<double, 3>& place) const noexcept;
  [[nodiscard]] Index3 shifted(const Index3& voxel) const {
    return {voxel[0] + cells_.offset()[0], voxel[1] + cells_.offset()[1], voxel[2] + cells_.offset()[2]};
  }
  [[nodiscard]] std::size_t fine_node(const Index3& voxel) const;
  [[nodiscard]] static double inside_share(const Level& level, std::size_t d, int i) noexcept;
  [[nodiscard]] double covered_share(std::size_t l, std::size_t d, int i) const noexcept;
  [[nodiscard]] double anchor_share(std::size_t l, std::size_t number, std::size_t d) const noexcept;
  [[nodiscard]] double link_share(std::size_t l, std::size_t number, std::size_t d) const noexcept;

  const Lattice& lattice_;
  CoarseMaterial cells_;
  std::array<std::array<float, 3>, 3> spring_N_per_m_{};               // [d][axis] of a link between voxels (N/m)
  std::array<std::array<std::array<float, 2>, 3>, 3> limit_m_{};  // [d][axis][0: shorter, 1: longer] (m), >= 0
  int half_width_, coarse_half_width_;
  Index3 centre_{};
  std::vector<Level> levels_;
  Level before_move_;           // of a level whose box moves
  std::size_t covering_level_ = 0;  // the first level that holds all of the object
  std::vector<Pressed> pressed_;
  bool patch_moved_ = false;           // since the last cycle
  std::array<bool, 3> multipliers_active_{};  // [axis] some links are held to their limits
  std::size_t work_ = 0;
  struct HalfCells {  // cells of a plane of half cells, and these times how stiff they are, by axis
    Floats cells;
    std::array<Floats, 3> stiff;
  };
  std::array<HalfCells, 2> half_cells_;  // scratch of weigh()
};

}  // namespace voxel
