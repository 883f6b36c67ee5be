// SPDX-License-Identifier: GPL-3.0-or-later
// Deep pushes into large objects, solved on nested patches (FAC, the fast adaptive composite grid method:
// McCormick 1989). The work of a cycle is bounded.
//
// A push moves voxels up to a distance of depth / slack. A push of 20 spacings at slack 0.1 moves 10^7
// voxels, and writing them takes milliseconds. But displacements get smoother with the distance from the
// contact. So level 0 is a patch of voxels round the contact. Level l is a patch of about as many nodes,
// which are 2^l voxels apart. One of the levels covers the whole object. Nodes outside the finer patch are
// unknowns. Nodes under the finer patch hold its displacements, in the full approximation scheme (FAS). All
// other voxels are interpolated on request. Work and memory grow with the logarithm of the object's size, not
// with the depth.
//
// Shape. The stiffness of a link between two nodes follows from the tissue round it (coarse_material.h): on
// level 0 it is that of the lattice, on coarser levels a mean. No link crosses a gap. Anchors hold nodes by
// springs. Where a whole side is anchored, the distance to the anchor gives the spring. Elsewhere the spring
// includes the constriction of the load that spreads from the anchors (scattered_anchors.cpp). A coarse level
// may resist a correction less than the finer level does. Its corrections would then be too large, so there
// springs shorten them (correction_springs.cpp). Tissues may differ in stiffness and in limits, but not in
// Poisson's ratio.
//
// Limits. In a convex body of one tissue the equilibrium within the chain limits solves an obstacle problem:
// each node v lies between L = max(u(s) − dist(v→s)) and U = min(u(s) + dist(s→v)) over the pressed voxels s,
// with dist along existing links (wave.h). The solution keeps the limits of all links. This follows if one
// compares the solution with itself, shifted by a voxel (Brezis & Sibony 1971, for plastic torsion). So each
// node has bounds of its own (node_bounds.cpp). With limits of links, projected multigrid stalls where the
// chain is at its limits. Near a notch or the edge of an anchored region links may exceed their limits
// (worst_violation()). Where tissues differ, links also have multipliers of their own (link_limits.cpp).
//
// Rigid surfaces that stand still bound the nodes beside them (rigid_contacts.cpp). The accurate energy is a
// load of the nodes (brick_loads.cpp).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "voxel/composite/anchor_chains.h"
#include "voxel/composite/brick_forces.h"
#include "voxel/composite/coarse_material.h"
#include "voxel/composite/level.h"
#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"

namespace voxel {
namespace composite {
struct LimitOfLinks;
struct LinkMultiplier;
struct ProlongArgs;
struct LevelView;
}  // namespace composite

class CompositeGrid {
 public:
  struct Suitability {
    std::string reason;  // why contacts of an object cannot be solved on a CompositeGrid; empty: they can
    double force_error = 0.0;  // largest relative force error in trials, against patches twice as wide
  };
  // Allocates.
  static Suitability suitability(const Lattice& lattice);
  // kRefineAll: see the constructor. Half widths of patches (voxels): the least and the greatest of level 0,
  // and that of all patches of a reference.
  static constexpr int kRefineAll = -1, kHalfWidth = 6, kMaxHalfWidth = 14, kReferenceHalfWidth = 24;
  // `half_width`: half width of level 0's patch (voxels). `coarse_half_width`: that of the other patches
  // (nodes). Both are rounded up to even numbers >= kHalfWidth. kRefineAll: level 0 covers the whole object,
  // for references. Allocates.
  CompositeGrid(const Lattice& lattice, int half_width, int coarse_half_width = kHalfWidth);
  // Call it before contacts. If anchors are scattered or limits differ, it finds the extension of the chains
  // from each surface voxel to the anchors, for clamp_to_supports(). Allocates.
  void find_chains_to_anchors();
  // Call it after a copy. A copied list has only as much capacity as it has elements, and some lists are cut
  // short at their capacity. So without this call the copy would work on other patches. Allocates.
  void reserve_like(const CompositeGrid& original);
  // Takes the displacements of another grid of the same object, interpolated.
  void interpolate_from(const CompositeGrid& other) noexcept;

  // ---- none of these allocates, locks or throws ----
  using Index3 = composite::Index3;  // voxel (i, j, k), node or cube
  // Call it once a tick before a contact. It sets one level to rest and builds one level for a contact at
  // `centre`, so that begin() has less to do.
  void prepare(const Index3& centre) noexcept;
  // Begins a contact at voxel `centre`, with all displacements 0. Patches stay where they are if the voxel is
  // near the middle of level 0's patch.
  void begin(const Index3& centre) noexcept;
  // Call it once a tick. It moves one patch so that it follows the contact. It moves more patches if the
  // contact is too far from the middle of level 0, or if a finer patch would no longer be nested. True if the
  // patch of level 0 moved.
  bool centre_on(const Index3& centre) noexcept;
  // Box of the voxels of level 0's patch that may be moved; `low` and `high` are included.
  void fine_patch(Index3& low, Index3& high) const noexcept;
  // Is the voxel an unknown of level 0?
  [[nodiscard]] bool in_fine_patch(const Index3& voxel) const noexcept;

  // For a voxel in level 0's patch. fine_at(): its displacement (m). unconstrained_minimum(): the
  // displacement at which its energy is least if it has no bounds and its neighbours do not move (m).
  // compliance(): its motion by a force of 1 N on each axis if its neighbours do not move (m/N).
  [[nodiscard]] glm::dvec3 fine_at(const Index3& voxel) const noexcept;
  [[nodiscard]] glm::dvec3 unconstrained_minimum(const Index3& voxel) const noexcept;
  [[nodiscard]] glm::dvec3 compliance(const Index3& voxel) const noexcept;
  void set_fine(const Index3& voxel, const glm::dvec3& u) noexcept;
  // `u` (m) clamped to the displacements that chains of links allow the surface voxel. The chains start at
  // anchors and at nodes near rigid surfaces.
  [[nodiscard]] glm::dvec3 clamp_to_supports(const Index3& voxel, const glm::dvec3& u) const noexcept {
    return clamp_to_obstacles(voxel, clamp_to_anchors(voxel, u));
  }

  // The axis of the largest component by size; the later axis if two are equal.
  [[nodiscard]] static int largest_axis(const glm::dvec3& v) noexcept {
    const glm::dvec3 size = glm::abs(v);
    return size.z >= size.x && size.z >= size.y ? 2 : size.y >= size.x ? 1 : 0;
  }

  // ---- rigid surfaces that stand still (rigid_contacts.cpp) ----
  // Allocates. `obstacles`: by surface number; they outlive the grid. Call it again when they have moved.
  void watch_obstacles(std::span<const Obstacle> obstacles);
  // Call it when a surface voxel gets an obstacle.
  void add_obstacle(std::uint32_t surface_number) noexcept;
  // Call it before a cycle and before press(). It sets the bounds of all nodes beside rigid surfaces.
  void press_on_obstacles() noexcept;
  // Call it after a cycle and after set_fine(). It moves nodes out of their obstacles.
  void settle_on_obstacles() noexcept;
  // Forces of rigid surfaces in the last cycle, by surface number.
  struct ObstacleForce {
    std::uint32_t surface_number;
    glm::dvec3 on_object_N;
  };
  [[nodiscard]] std::vector<ObstacleForce> obstacle_forces() const;

  // Call it before a cycle if the contact has moved. Each displacement along `axis` grows by `share` times
  // itself, but by at most `most_m` (m).
  void extrapolate(std::size_t axis, double share, double most_m) noexcept;
  // Call both before a cycle. clear_pressed() removes the constraints of the tool, which has moved by
  // `moved_m` since the last cycle. press() adds that of one voxel of level 0. Where a component of `normal`
  // (unit vector, into the tissue) exceeds kAlong, the voxel may not move back beyond `u` (m).
  void clear_pressed(double moved_m = 0.0) noexcept;
  void press(const Index3& voxel, const glm::dvec3& u, const glm::dvec3& normal) noexcept;
  // One FAC cycle over all levels, on these axes.
  void cycle(const std::array<bool, 3>& axes = {true, true, true}) noexcept;
  // Force on the anchors and force on the tool (N), by balance (pressing_force.cpp).
  [[nodiscard]] glm::dvec3 force_on_anchors_N() const noexcept;
  [[nodiscard]] glm::dvec3 force_on_tool_N() const noexcept;
  // Largest excess of a link of level 0 over its limits (m).
  [[nodiscard]] double worst_violation() const noexcept;
  // Energy of all springs (J). Multipliers do not count.
  [[nodiscard]] double energy_J() const noexcept;

  // Displacement (m) of any point, given in units of voxels, and of any voxel.
  [[nodiscard]] glm::dvec3 at_point(const std::array<double, 3>& point) const noexcept;
  [[nodiscard]] glm::dvec3 at(const Index3& voxel) const noexcept;
  // The nodes of a patch, for drawing; patch 0 is the finest.
  struct Nodes {
    Index3 first{}, count{};                      // the voxel of node (0, 0, 0); nodes along each axis
    int step = 1;                                 // voxels between two nodes
    std::array<bool, 3> open_low{}, open_high{};  // the object continues beyond this side
    std::size_t stride = 0, plane = 0;
    std::array<const float*, 3> u{};  // [axis][k · plane + j · stride + i] (m)
  };
  [[nodiscard]] std::size_t patch_count() const noexcept { return covering_level_ + 1; }
  [[nodiscard]] Nodes nodes_of(std::size_t patch) const noexcept;
  // Number of vectors of 8 nodes that the last cycle smoothed.
  [[nodiscard]] std::size_t work_of_cycle() const noexcept { return work_; }
  [[nodiscard]] std::size_t memory_bytes() const;
  template <class Visit>
  void for_values(const Visit& visit) const {
    for (const Level& level : levels_) {
      for (const auto& axis : level.u) {
        for (const float u : axis) visit(u);
      }
    }
  }

 private:
  static constexpr std::size_t kPad = composite::kPad;
  static constexpr int kOutside = composite::kOutside;
  using Floats = composite::Floats;
  using AxisNodes = composite::AxisNodes;
  using AnchorFaces = composite::AnchorFaces;
  using CorrectionSpring = composite::CorrectionSpring;
  using Ghost = composite::Ghost;
  using GhostNeighbour = composite::GridLevel::GhostNeighbour;
  using ObstacleNode = composite::ObstacleNode;
  using Level = composite::GridLevel;
  // A surface voxel beside a rigid surface, and its surface number.
  struct BesideRigid {
    Index3 voxel;
    std::uint32_t surface;
  };
  // Force of an obstacle along its normal (N), and the level of the node that it bounds. In each cycle
  // along_normal_N covers half of its difference from the force that the bound has. The loads of the obstacle
  // on the axes other than that of its bound follow from along_normal_N.
  struct ObstacleLoad {
    float along_normal_N = 0.0F;
    std::uint32_t level = 0;
  };
  // Bound of a node on one axis: sign · u(node) >= sign · `u`. `force_N`: its force on the object along the
  // axis in the last cycle.
  struct ObstacleBound {
    std::uint32_t level;
    ObstacleNode node;
    std::size_t axis;
    float sign, u, force_N = 0.0F;
  };
  struct Pressed {
    Index3 node;
    glm::vec3 u, normal;
  };

  // A contact of the tool bounds its node on the axes on which the normal's component exceeds this. With a
  // larger value, voxels that a ball presses only slightly aside could move back, and the contact would
  // oscillate.
  static constexpr float kAlong = 0.02F;

  // ---- suitability.cpp ----
  [[nodiscard]] Suitability try_contacts();
  [[nodiscard]] bool converges_at(const Index3& place, float most_m) noexcept;
  [[nodiscard]] double settled_press(const Index3& place, const glm::dvec3& push_m) noexcept;
  // Half width of a level's patch (nodes). The patch contains the finer one wherever the contact lies between
  // two nodes.
  [[nodiscard]] int half_width_of(std::size_t level) const {
    int half = half_width_;
    for (std::size_t l = 0; l < level; ++l) half = std::max(coarse_half_width_, (half + 7) / 4 * 2);
    return half;
  }
  [[nodiscard]] bool can_cover(std::size_t level) const;  // grid.cpp
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
  // Coordinates of a patch's first and last node along one axis. open_low, open_high: the object continues
  // beyond that end.
  struct NodeRange {
    int low, high;
    bool open_low, open_high;
    [[nodiscard]] int count(int step) const { return (high - low) / step + 1; }
  };
  [[nodiscard]] NodeRange whole_range(int step, std::size_t d) const noexcept;
  [[nodiscard]] NodeRange node_range(std::size_t l, std::size_t d, int centre) const noexcept;
  void place_nodes(Level& level, std::size_t l, const Index3& centre) const noexcept;
  void assemble(Level& level) noexcept;
  // `near`: there may be anchors in or beside the patch.
  void find_anchor_weights(Level& level, bool near) noexcept;
  void find_diagonal(Level& level, bool near) noexcept;
  [[nodiscard]] bool gathers_anchors(const Level& level) const {
    return level.step > 1 && material_.has_scattered_anchors();
  }
  void gather_anchors(Level& level) noexcept;
  [[nodiscard]] static bool nodes_of_face(const Level& level, const CoarseMaterial::AnchorFace& face,
                                          std::size_t& held, std::size_t& nearest, int& distance) noexcept;
  [[nodiscard]] float constriction_of_face(const Level& level, std::size_t cell) const noexcept;
  [[nodiscard]] const std::array<Floats, 3>& shape_weights(const Level& level) const {
    return material_.is_heterogeneous() ? level.shape_weight : level.weight;
  }
  [[nodiscard]] static float weight_of_faces(const AnchorFaces& faces, std::size_t node,
                                             float square) noexcept;
  [[nodiscard]] float stiffness_at(const Level& level, std::size_t node) const noexcept;
  [[nodiscard]] static bool is_linked(const Level& level, const Index3& node) noexcept;
  [[nodiscard]] static bool nearest_node(const Level& level, const Index3& at, bool unknown,
                                         Index3& node) noexcept;
  [[nodiscard]] bool row_near_anchors(const Level& level, int j, int k) const noexcept;
  void mark_tissue_nodes(const Level& level, bool near) noexcept;
  void find_ghosts(Level& level, bool near) noexcept;
  static void weigh_ghost(Level& level, std::size_t first) noexcept;
  void set_up_transfer(Level& fine, Level& coarse) const noexcept;
  void find_correction_springs(const Level& fine, Level& coarse) const noexcept;
  // Interpolation weights of a coarse node at the fine nodes round it: the fine node at offset (i, j, k),
  // each −2 … 2, has number (i + 2) + 5 (j + 2) + 25 (k + 2). Those at ±2 are 0.
  using NodeWeights = std::array<float, 125>;
  [[nodiscard]] NodeWeights weights_of_node(const Level& fine, const Index3& node) const noexcept;
  [[nodiscard]] static float prolonged_weight(const Level& fine, std::size_t middle, std::size_t d,
                                              const NodeWeights& of_node) noexcept;
  void fill_ghosts(const Level& level, float* values) const noexcept;
  void distribute_ghost_loads(const Level& level, float* loads) const noexcept;
  // ---- patch_stiffness.cpp ----
  void weigh(Level& level) noexcept;
  void weigh_shape(const Level& level, std::array<Floats, 3>& weight) noexcept;
  void weigh_box(const Level& level, std::array<Floats, 3>& weight) noexcept;
  void weigh_cells(const Level& level, std::array<Floats, 3>& weight, bool all_alike) noexcept;
  void weigh_thin_links(const Level& level, std::array<Floats, 3>& weight, bool all_alike) const noexcept;
  void weigh_halves(const Level& level, std::array<Floats, 3>& weight) noexcept;
  void weigh_tissues(Level& level) noexcept;
  void find_node_limits(Level& level) noexcept;
  void find_coarse_limits(Level& level) noexcept;
  [[nodiscard]] static int half_cube(const Level& level) noexcept;
  // ---- node_bounds.cpp ----
  void find_bounds(std::size_t axis) noexcept;
  struct NodeBox {
    Index3 low{}, high{};  // both included
    [[nodiscard]] bool is_empty() const { return low[0] > high[0] || low[1] > high[1] || low[2] > high[2]; }
  };
  [[nodiscard]] float largest_displacement(std::size_t axis) const noexcept;
  [[nodiscard]] NodeBox reach_of_bounds(const Level& level, std::size_t axis, std::size_t kind,
                                        const NodeBox& pressed, float fall_m) const noexcept;
  void hand_on_bounds(std::size_t l, std::size_t kind, const NodeBox& reach) noexcept;
  void propagate_bounds(Level& level, std::size_t axis, std::size_t kind, const NodeBox& box) const noexcept;
  // ---- rigid_contacts.cpp ----
  [[nodiscard]] float obstacle_gap(const Level& level, const ObstacleNode& node) const noexcept;
  void offer_obstacle(std::size_t l, const BesideRigid& beside) noexcept;
  void list_obstacle_nodes(std::size_t l) noexcept;
  [[nodiscard]] bool is_covered(std::size_t l, const Index3& node) const noexcept;
  void bound_by_obstacle(std::size_t l, const ObstacleNode& node, float gap) noexcept;
  void add_obstacle_bounds(std::size_t axis) noexcept;
  void add_obstacle_loads(std::size_t l, std::size_t axis) noexcept;
  void measure_obstacle_forces(std::size_t axis) noexcept;
  [[nodiscard]] float step_m(const Level& level) const noexcept;
  [[nodiscard]] bool holds(const ObstacleBound& b) const noexcept;
  [[nodiscard]] glm::vec3 load_of(const ObstacleBound& b) const noexcept;
  [[nodiscard]] glm::dvec3 force_of(const ObstacleBound& b) const noexcept;
  [[nodiscard]] double fall_from(const Index3& at, std::size_t axis, std::size_t kind, const Index3& low,
                                 const Index3& high, int beyond) const noexcept;
  [[nodiscard]] glm::dvec3 clamp_to_obstacles(const Index3& voxel, const glm::dvec3& u) const noexcept;
  // ---- fac_cycle.cpp ----
  [[nodiscard]] composite::LevelView view(std::size_t l, std::size_t axis) noexcept;
  void inject_from_finer(std::size_t l, std::size_t axis) noexcept;
  void put_loads(std::size_t l, std::size_t axis) noexcept;
  void restrict_residual(std::size_t l, std::size_t axis) noexcept;
  void restrict_values(Level& coarse, const Level& fine, std::size_t axis, const float* from,
                       float* to) const noexcept;
  void add_active_stiffness(std::size_t l, std::size_t axis) noexcept;
  void prolong(std::size_t l, std::size_t axis) noexcept;
  void prolong_row(Level& fine, const Level& coarse, std::size_t axis, const float* from, int j, int k,
                   bool adds) const noexcept;
  // ---- pressing_force.cpp ----
  void measure_pressing_force(std::size_t axis) noexcept;
  [[nodiscard]] double force_of_tool_bounds(std::size_t l, std::size_t axis) noexcept;
  [[nodiscard]] double force_on_patch(std::size_t l, std::size_t axis) noexcept;
  void fit_far_field(std::size_t axis) noexcept;  // far_field.cpp
  // ---- operator_interpolation.cpp ----
  [[nodiscard]] std::array<const float*, 2> weights_beside(const Level& level, std::size_t axis,
                                                           std::size_t d, int j, int k) const noexcept;
  void prolong_row_by_links(const composite::ProlongArgs& args, const Level& fine, const Level& coarse,
                            std::size_t axis, const float* from, int j, int k) const noexcept;
  [[nodiscard]] float prolonged_by_links(const Level& fine, const Level& coarse, std::size_t axis,
                                         const float* from, int i, int j, int k) const noexcept;
  void restrict_by_links(Level& coarse, const Level& fine, std::size_t axis, const float* from,
                         float* to) const noexcept;
  // ---- link_limits.cpp ----
  void update_multipliers(std::size_t axis) noexcept;
  void drop_multipliers_at_sides(Level& level, std::size_t axis) noexcept;
  float update_anchor_multipliers(Level& level, std::size_t axis, std::size_t d) noexcept;
  template <class Visit>
  void for_anchor_ratios(const Level& level, std::size_t axis, std::size_t d, const Visit& visit) const;
  [[nodiscard]] float largest_anchor_ratio(const Level& level, std::size_t axis, std::size_t d) const;
  void restrict_multipliers(std::size_t l, std::size_t axis) noexcept;
  void update_diagonal(Level& level, std::size_t axis) const noexcept;
  void release_multipliers() noexcept;
  void save_multipliers(const Level& level) noexcept;
  void restore_multipliers(Level& level, const Index3& by) noexcept;
  // Limit of the links along d for differences of the displacements on `axis`; side 0: shorter, 1: longer.
  // The result's at_node begins at the level's first row.
  [[nodiscard]] composite::LimitOfLinks limit_of_links(const Level& level, std::size_t axis, std::size_t d,
                                                       std::size_t side) const noexcept;
  [[nodiscard]] composite::LinkMultiplier link_multiplier(const Level& level, std::size_t axis,
                                                          std::size_t d) const noexcept;
  [[nodiscard]] const std::array<Floats, 3>& weights_on(const Level& level, std::size_t axis) const {
    return multipliers_active_[axis] ? level.limited_weight[axis] : level.weight;
  }
  [[nodiscard]] const std::array<Floats, 3>& anchor_weights_on(const Level& level, std::size_t axis) const {
    return multipliers_active_[axis] ? level.limited_anchor_weight[axis] : level.anchor_weight;
  }
  // ---- brick_loads.cpp ----
  void use_bricks();
  void find_brick_moduli(Level& level) noexcept;
  [[nodiscard]] composite::BrickView brick_view(std::size_t l) const noexcept;
  void renew_brick_loads() noexcept;
  void save_brick_strains(const Level& level, std::size_t floats) noexcept;
  void restore_brick_strains(std::size_t l, const Index3& by) noexcept;
  [[nodiscard]] double brick_energy_J() const noexcept;
  // ---- queries.cpp ----
  [[nodiscard]] glm::dvec3 interpolate(const Level& level, const std::array<double, 3>& place) const noexcept;
  [[nodiscard]] static glm::vec3 interpolate_at(const Level& level, const Index3& at) noexcept;
  [[nodiscard]] Index3 shifted(const Index3& voxel) const {
    return {voxel[0] + material_.offset()[0], voxel[1] + material_.offset()[1],
            voxel[2] + material_.offset()[2]};
  }
  [[nodiscard]] std::size_t fine_node(const Index3& voxel) const;  // grid.cpp
  [[nodiscard]] glm::dvec3 clamp_to_chains(const Index3& voxel, const glm::dvec3& u) const noexcept;
  [[nodiscard]] glm::dvec3 clamp_to_anchors(const Index3& voxel, const glm::dvec3& u) const noexcept;
  // A node's displacement of least energy without bounds, with its neighbours fixed (m).
  [[nodiscard]] glm::dvec3 minimum_at(const Level& level, std::size_t node) const noexcept;  // grid.cpp
  [[nodiscard]] static double inside_share(const Level& level, std::size_t d, int i) noexcept;
  [[nodiscard]] double covered_share(std::size_t l, std::size_t d, int i) const noexcept;
  [[nodiscard]] bool counts_anchors(std::size_t l, std::size_t number) const noexcept;
  [[nodiscard]] double link_share(std::size_t l, std::size_t number, std::size_t d) const noexcept;

  const Lattice& lattice_;
  CoarseMaterial material_;
  std::array<std::array<float, 3>, 3> spring_N_per_m_{};  // [d][axis] of a link between two voxels
  // Limits of links between two voxels (m), >= 0, in the tissue of the tightest and of the widest limit.
  struct LimitRange {
    float tightest, widest;
  };
  std::array<std::array<std::array<LimitRange, 2>, 3>, 3> limit_m_{};  // [d][axis][0: shorter, 1: longer]
  std::vector<ChainExtension> chains_;  // [surface number]; empty: all anchors are whole sides, limits alike
  int half_width_, coarse_half_width_;
  Index3 centre_{};
  std::vector<Level> levels_;
  Level before_move_;               // the moving level's state before the move
  std::size_t covering_level_ = 0;  // the first level that covers the whole object
  std::vector<Pressed> pressed_;
  float recedes_m_ = 0.0F;                     // a bound that recedes further is that of another contact
  std::span<const Obstacle> obstacles_;        // [surface number]; empty: no rigid surface is near
  std::vector<BesideRigid> beside_rigid_;      // surface voxels that have, or had, an obstacle
  std::vector<std::uint8_t> is_beside_rigid_;  // [surface number] 1: in beside_rigid_
  std::vector<ObstacleLoad> obstacle_loads_;   // [surface number]
  std::vector<ObstacleBound> obstacle_bounds_;
  // Summary of the supporting_bounds_ of one axis and one kind (0: least u, 1: least −u), for a quick test in
  // clamp_to_obstacles(). low, high: box around their voxels (coordinates). most: their greatest bound (m).
  // beyond: half of the widest distance between nodes of their levels (voxels).
  struct SupportBox {
    Index3 low{}, high{};
    float most = 0.0F;
    int beyond = 0;
    bool any = false;
  };
  std::array<std::array<SupportBox, 2>, 3> supports_{};
  std::vector<std::uint32_t> supporting_bounds_;  // indices into obstacle_bounds_: nodes near their planes
  std::size_t obstacle_cursor_ = 0;               // index into beside_rigid_: the voxel offered last
  bool patch_moved_ = false;                      // a patch moved since the last cycle
  std::array<bool, 3> multipliers_active_{};      // [axis] some link has a multiplier
  // Force of tool and rigid surfaces on the nodes of one level's patch (N), and that level by axis.
  glm::dvec3 pressing_force_N_{0.0};
  std::array<std::size_t, 3> pressed_level_{};
  std::size_t work_ = 0;
  // A half cell is a cube half as long as a link of the level (half_cube()). For one plane of half cells: the
  // number of tissue cells in each, and this number times their stiffness along each axis.
  struct HalfCells {
    Floats cells;
    std::array<Floats, 3> stiffness;
  };
  std::array<HalfCells, 2> half_cells_;  // scratch of weigh()
  Floats faces_of_cell_;                 // [nearest node] faces, scratch of gather_anchors()
  std::array<std::array<AnchorFaces, 2>, 3> anchor_faces_;  // [d][0: of anchors above, 1: below], scratch
  composite::Bricks bricks_;
  bool has_bricks_ = false;                   // the accurate energy
  std::vector<std::uint8_t> is_tissue_node_;  // scratch of find_ghosts(), with a border of one node
};

}  // namespace voxel
