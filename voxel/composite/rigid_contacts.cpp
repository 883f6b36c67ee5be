// SPDX-License-Identifier: GPL-3.0-or-later
// Contacts of a CompositeGrid with rigid surfaces that stand still.
//
// Each surface voxel beside such a surface has an obstacle: a half-space for its displacement. On level 0 the
// voxel is a node, and the half-space bounds this node. On coarser levels, outside the finer patch, the
// half-space bounds the node nearest to the voxel. If several voxels have the same nearest node, the voxel
// with the least gap counts.
//
// Axes are relaxed one after the other, so a contact is split. On the axis of its normal's largest component
// it is a bound: the height of the plane at the node's place. On the other axes it is a load: the bound's
// force times the slope of the plane. When the cycles have converged, the force is along the normal, so there
// is no friction. A load covers half of its difference from the bound's force in each cycle. Otherwise the
// two would oscillate where a plane rises steeply along a soft axis.
//
// Nodes keep their bounds even if nothing presses them on the plane. SoftObject::press_on_grid gives the
// reason.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

using composite::index;

constexpr float kNearby = 3.0F;        // steps of the level: nodes further from their plane get no bound
constexpr float kSupports = 0.5F;      // steps: nodes nearer to their plane count in clamp_to_supports()
constexpr float kFollows = 0.5F;       // share of the missing force that a load gains in a cycle
constexpr float kHolds = 1e-3F;        // spacings: a node nearer to its bound is held by it
constexpr std::size_t kOffered = 512;  // surface voxels that are offered to their nodes in a cycle

}  // namespace

void CompositeGrid::watch_obstacles(std::span<const Obstacle> obstacles) {
  obstacles_ = obstacles;
  if (is_beside_rigid_.size() == obstacles.size()) return;
  is_beside_rigid_.assign(obstacles.size(), 0);
  obstacle_loads_.assign(obstacles.size(), {});
  beside_rigid_.reserve(obstacles.size());
  std::size_t most = 0;
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    Level& level = levels_[l];
    level.obstacle_of.assign(level.u[0].size(), 0);
    level.obstacle_nodes.reserve(std::min(obstacles.size(), level.u[0].size()));
    most += level.obstacle_nodes.capacity();
  }
  obstacle_bounds_.reserve(most);
  supporting_bounds_.reserve(most);
  for (std::uint32_t s = 0; s < obstacles.size(); ++s) {
    if (obstacles[s].normal != glm::vec3(0.0F)) add_obstacle(s);
  }
}

void CompositeGrid::add_obstacle(std::uint32_t surface_number) noexcept {
  const VoxelId voxel = lattice_.surface()[surface_number];
  if (is_beside_rigid_[surface_number] != 0 || lattice_.anchored(voxel)) return;
  is_beside_rigid_[surface_number] = 1;
  beside_rigid_.push_back({lattice_.coordinates(voxel), surface_number});
  for (std::size_t l = 0; l <= covering_level_; ++l) offer_obstacle(l, beside_rigid_.back());
}

// Gap of a surface voxel to its plane, at its displacement on this level (m).
float CompositeGrid::obstacle_gap(const Level& level, const ObstacleNode& node) const noexcept {
  const Obstacle& o = obstacles_[node.surface];
  const glm::vec3 u =
      level.step == 1 ? glm::vec3(level.u[0][node.number], level.u[1][node.number], level.u[2][node.number])
                      : interpolate_at(level, shifted(node.voxel));
  return glm::dot(o.normal, u) - o.bound;
}

// Offers a surface voxel to its node on level l. Of all voxels offered to a node, the one with the smallest
// gap stands for it. A node is in the list at most once, so lists stay within the capacity that
// watch_obstacles() has reserved.
void CompositeGrid::offer_obstacle(std::size_t l, const BesideRigid& beside) noexcept {
  Level& level = levels_[l];
  Index3 at{};
  if (!level.is_built || !nearest_node(level, shifted(beside.voxel), true, at)) return;
  const ObstacleNode fresh{at, level.node(at[0], at[1], at[2]), beside.voxel, beside.surface};
  std::uint32_t& entry = level.obstacle_of[fresh.number];
  if (entry == 0) {
    level.obstacle_nodes.push_back(fresh);
    entry = static_cast<std::uint32_t>(level.obstacle_nodes.size());
    return;
  }
  ObstacleNode& now = level.obstacle_nodes[entry - 1U];
  const bool gone = obstacles_[now.surface].normal == glm::vec3(0.0F);
  if (gone || obstacle_gap(level, fresh) < obstacle_gap(level, now)) now = fresh;
}

// Lists the obstacle nodes of a level that was placed anew.
void CompositeGrid::list_obstacle_nodes(std::size_t l) noexcept {
  if (obstacles_.empty() || l > covering_level_) return;
  Level& level = levels_[l];
  for (const ObstacleNode& node : level.obstacle_nodes) level.obstacle_of[node.number] = 0;
  level.obstacle_nodes.clear();
  for (const BesideRigid& beside : beside_rigid_) {
    if (obstacles_[beside.surface].normal != glm::vec3(0.0F)) offer_obstacle(l, beside);
  }
}

// Does the finer patch have this node among its unknowns?
bool CompositeGrid::is_covered(std::size_t l, const Index3& node) const noexcept {
  if (l == 0) return false;
  const auto& nodes = levels_[l - 1].nodes;
  for (std::size_t d = 0; d < 3; ++d) {
    if (node[d] < nodes[d].coarse_first || node[d] > nodes[d].coarse_last) return false;
  }
  return true;
}

void CompositeGrid::press_on_obstacles() noexcept {
  obstacle_bounds_.clear();
  supporting_bounds_.clear();
  supports_ = {};
  if (beside_rigid_.empty()) return;
  for (std::size_t n = 0; n < std::min(kOffered, beside_rigid_.size()); ++n) {
    if (++obstacle_cursor_ >= beside_rigid_.size()) obstacle_cursor_ = 0;
    const BesideRigid& beside = beside_rigid_[obstacle_cursor_];
    if (obstacles_[beside.surface].normal == glm::vec3(0.0F)) continue;
    for (std::size_t l = 1; l <= covering_level_; ++l) offer_obstacle(l, beside);
  }
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    const float near_m = kNearby * step_m(levels_[l]);
    for (const ObstacleNode& node : levels_[l].obstacle_nodes) {
      if (is_covered(l, node.node)) continue;
      const float gap = obstacle_gap(levels_[l], node);
      if (gap <= near_m) bound_by_obstacle(l, node, gap);
    }
  }
}

// Bounds a node such that its voxel, which moves with the node, lies on the plane when the node is at its
// bound.
void CompositeGrid::bound_by_obstacle(std::size_t l, const ObstacleNode& node, float gap) noexcept {
  const Obstacle& o = obstacles_[node.surface];
  if (o.normal == glm::vec3(0.0F)) return;
  const auto level = static_cast<std::uint32_t>(l);
  const int along = largest_axis(glm::dvec3(o.normal));
  const float normal = o.normal[along];
  // A force of another level is dropped, because a node of that level stands for another number of voxels.
  ObstacleLoad& load = obstacle_loads_[node.surface];
  if (load.level != level) load = {0.0F, level};
  obstacle_bounds_.push_back({level, node, index(along), normal > 0.0F ? 1.0F : -1.0F,
                              levels_[l].u[index(along)][node.number] - gap / normal,
                              load.along_normal_N * normal});
  if (gap > kSupports * step_m(levels_[l])) return;
  supporting_bounds_.push_back(static_cast<std::uint32_t>(obstacle_bounds_.size() - 1));
  const ObstacleBound& b = obstacle_bounds_.back();
  SupportBox& box = supports_[b.axis][b.sign > 0.0F ? 0 : 1];
  const Index3 at = shifted(node.voxel);
  if (!box.any) box = {at, at, b.sign * b.u, 0, true};
  for (std::size_t d = 0; d < 3; ++d) {
    box.low[d] = std::min(box.low[d], at[d]);
    box.high[d] = std::max(box.high[d], at[d]);
  }
  box.most = std::max(box.most, b.sign * b.u);
  box.beyond = std::max(box.beyond, levels_[l].step / 2);
}

// Adds the obstacles' bounds of one axis to those that the tool's contact has set: on their nodes, and on the
// nodes of coarser levels at the same places. The bounds are not propagated: near a rigid surface,
// clamp_to_supports() and multipliers keep the limits of links.
void CompositeGrid::add_obstacle_bounds(std::size_t axis) noexcept {
  for (const ObstacleBound& b : obstacle_bounds_) {
    if (b.axis != axis) continue;
    const std::size_t kind = b.sign > 0.0F ? 0 : 1;
    if (!levels_[0].bounded[kind]) {
      for (Level& level : levels_) {
        std::fill_n(level.bound[kind].begin(), level.first_row() + level.floats() + kPad,
                    composite::kNoBound);
        level.bounded[kind] = true;
      }
    }
    const auto set = [&](Level& level, std::size_t number) {
      float& own = level.bound[kind][number];
      own = std::max(own, b.sign * b.u);
      // If the two bounds contradict each other, the opposite one gives way, not the rigid surface. Then
      // links of the squeezed tissue exceed their limits.
      float& opposite = level.bound[1 - kind][number];
      opposite = std::min(opposite, -own);
    };
    set(levels_[b.level], b.node.number);
    Index3 node = b.node.node;
    for (std::size_t l = b.level + 1; l < levels_.size(); ++l) {
      const Level &fine = levels_[l - 1], &coarse = levels_[l];
      bool coincides = true;
      for (std::size_t d = 0; d < 3 && coincides; ++d) {
        const int way = fine.at(d, node[d]) - coarse.nodes[d].begin;
        node[d] = way / coarse.step;
        coincides = way >= 0 && way % coarse.step == 0 && node[d] < coarse.nodes[d].count;
      }
      if (!coincides) break;
      set(levels_[l], coarse.node(node[0], node[1], node[2]));
    }
  }
}

// Adds the loads of a level's obstacles to f on one axis. An obstacle has loads on the axes other than that
// of its bound.
void CompositeGrid::add_obstacle_loads(std::size_t l, std::size_t axis) noexcept {
  Level& level = levels_[l];
  for (const ObstacleBound& b : obstacle_bounds_) {
    if (b.level == l && b.axis != axis) level.f[b.node.number] += load_of(b)[static_cast<int>(axis)];
  }
}

glm::vec3 CompositeGrid::load_of(const ObstacleBound& b) const noexcept {
  glm::vec3 load = obstacle_loads_[b.node.surface].along_normal_N * obstacles_[b.node.surface].normal;
  load[static_cast<int>(b.axis)] = 0.0F;
  return load;
}

// Measures the forces of the bounds that hold their nodes, after a cycle on one axis.
void CompositeGrid::measure_obstacle_forces(std::size_t axis) noexcept {
  for (ObstacleBound& b : obstacle_bounds_) {
    if (b.axis != axis) continue;
    const Level& level = levels_[b.level];
    const float u = level.u[axis][b.node.number];
    float pulled = 0.0F;
    if (holds(b)) {
      pulled = level.diagonal[axis][b.node.number] *
               static_cast<float>(static_cast<double>(u) -
                                  minimum_at(level, b.node.number)[static_cast<int>(axis)]);
    }
    b.force_N = b.sign * pulled > 0.0F ? pulled : 0.0F;
    float& load_N = obstacle_loads_[b.node.surface].along_normal_N;
    load_N += kFollows * (b.force_N / obstacles_[b.node.surface].normal[static_cast<int>(axis)] - load_N);
  }
}

glm::dvec3 CompositeGrid::force_of(const ObstacleBound& b) const noexcept {
  glm::dvec3 force_N(load_of(b));
  force_N[static_cast<int>(b.axis)] = static_cast<double>(b.force_N);
  return force_N;
}

std::vector<CompositeGrid::ObstacleForce> CompositeGrid::obstacle_forces() const {
  std::vector<ObstacleForce> forces;
  for (const ObstacleBound& b : obstacle_bounds_) {
    const glm::dvec3 force_N = force_of(b);
    if (force_N != glm::dvec3(0.0)) forces.push_back({b.node.surface, force_N});
  }
  return forces;
}

// set_fine() may have moved a node into its obstacle after the cycle. The node is moved back to the plane.
void CompositeGrid::settle_on_obstacles() noexcept {
  for (const ObstacleBound& b : obstacle_bounds_) {
    Level& level = levels_[b.level];
    const float gap = obstacle_gap(level, b.node);
    if (gap < 0.0F)
      level.u[b.axis][b.node.number] -= gap / obstacles_[b.node.surface].normal[static_cast<int>(b.axis)];
  }
}

float CompositeGrid::step_m(const Level& level) const noexcept {
  return static_cast<float>(lattice_.min_spacing_m()) * static_cast<float>(level.step);
}

bool CompositeGrid::holds(const ObstacleBound& b) const noexcept {
  const float beyond_m = b.sign * (levels_[b.level].u[b.axis][b.node.number] - b.u);
  return beyond_m <= kHolds * static_cast<float>(lattice_.min_spacing_m());
}

// The largest fall of a bound (m) along the shortest chain of links from the box low … high to the place `at`
// (coordinates). A node of a coarse level stands for all voxels up to `beyond` voxels (half a step) away
// across the bound's axis. So along the other axes the first `beyond` links do not count.
double CompositeGrid::fall_from(const Index3& at, std::size_t axis, std::size_t kind, const Index3& low,
                                const Index3& high, int beyond) const noexcept {
  double fall = 0.0;
  for (std::size_t d = 0; d < 3; ++d) {
    const int above = at[d] - high[d], below = low[d] - at[d];
    const int links = std::max({above, below, 0}) - (d == axis ? 0 : beyond);
    // For a link from a up to b: u(b) >= u(a) − limit[0] and u(a) >= u(b) − limit[1]. For −u the two limits
    // change places.
    if (links > 0)
      fall += links * static_cast<double>(limit_m_[d][axis][(above > 0 ? 0U : 1U) ^ kind].widest);
  }
  return fall;
}

glm::dvec3 CompositeGrid::clamp_to_obstacles(const Index3& voxel, const glm::dvec3& u) const noexcept {
  glm::dvec3 result = u;
  const Index3 at = shifted(voxel);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double& to = result[static_cast<int>(axis)];
    for (const std::size_t kind : {std::size_t{0}, std::size_t{1}}) {
      const double sign = kind == 0 ? 1.0 : -1.0;
      const SupportBox& box = supports_[axis][kind];
      // Quick test: no bound is nearer than the box, or greater than `most`.
      if (!box.any || sign * to >= static_cast<double>(box.most) -
                                       fall_from(at, axis, kind, box.low, box.high, box.beyond))
        continue;
      for (const std::uint32_t n : supporting_bounds_) {
        const ObstacleBound& b = obstacle_bounds_[n];
        if (b.axis != axis || (b.sign > 0.0F) != (kind == 0)) continue;
        const Index3 from = shifted(b.node.voxel);
        const double least = static_cast<double>(b.sign * b.u) -
                             fall_from(at, axis, kind, from, from, levels_[b.level].step / 2);
        if (sign * to < least) to = sign * least;
      }
    }
  }
  return result;
}

}  // namespace voxel
