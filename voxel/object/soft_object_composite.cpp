// SPDX-License-Identifier: GPL-3.0-or-later
// A soft object whose contact is on nested patches (composite/grid.h).
//
// The object's own state stays at rest, and nothing is written to it. While tissue is pressed, displacements
// are read from the patches. When the tool has left, the state counts again.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <string>
#include <utility>

#include "voxel/composite/grid.h"
#include "voxel/object/soft_object.h"

namespace voxel {
namespace {

// Voxels of the finest patch beyond the contact of a wide tool, at least.
constexpr int kLeastMargin = 4;
// Fraction of the force, and of the tool's motion. An axis with less of both is relaxed in every second tick.
constexpr double kFelt = 0.3;
// A cycle finds the places of pressed voxels along the tool from those of their neighbours before the cycle.
// These places change the force across. So an axis other than the force's largest, on which a cycle changes
// the force by more than kStillChanges (share of the force), has another one, up to kCyclesInTick.
constexpr double kStillChanges = 0.002;
constexpr int kCyclesInTick = 2;
constexpr std::uint32_t kAllAxes = 4;  // number of ticks at the start of a contact that relax all axes
// In spacings. A voxel no further than kPressed from the tool is pressed. Tissue on its way back is still
// felt up to a distance of kOnItsWay.
constexpr double kPressed = 0.02, kOnItsWay = 0.5;
// Displacements far away scale with this power of the depth.
constexpr double kWithDepth = 1.7;
// Least depth at which displacements are scaled (spacings); largest scaling in a cycle (share of the depth).
constexpr double kLeastToScale = 0.1, kMostScaled = 1.0;
constexpr double kLeastDepth = 0.05;  // fraction of the spacing: least depth for the secant stiffness
constexpr double kNear = 3.0;         // spacings: surface voxels further from the tool are skipped
constexpr double kFlat = 1.5;  // greatest ratio of spacings for which the width of a ball's contact is known

// Call it before a cycle. It extrapolates the displacements to a tool that moved by `way_m` and has displaced
// the pressed voxels by `dent_m` on average. Far tissue is scaled. Near tissue moves with the tool. If near
// tissue were scaled too, it would leave the tool and be pressed in again.
void go_along(CompositeGrid& grid, const glm::dvec3& dent_m, const glm::dvec3& force_N,
              const glm::dvec3& way_m, double spacing_m) noexcept {
  const int axis = CompositeGrid::largest_axis(force_N);
  const double inwards = force_N[axis] > 0.0 ? -1.0 : 1.0, depth_m = inwards * dent_m[axis];
  if (depth_m < kLeastToScale * spacing_m) return;
  const double part = std::clamp(inwards * way_m[axis] / depth_m, -kMostScaled, kMostScaled);
  grid.extrapolate(static_cast<std::size_t>(axis), std::pow(1.0 + part, kWithDepth) - 1.0,
                   std::abs(part) * depth_m);
}

// Mean displacement of the pressed voxels in the direction opposite to the force (unit: meter).
double depth_of(const glm::dvec3& dent_m, const glm::dvec3& force_N) noexcept {
  const double size = glm::length(force_N);
  return size == 0.0 ? 0.0 : -glm::dot(dent_m, force_N) / size;
}

}  // namespace

std::string SoftObject::use_composite_grid(const ToolInBody& tool, int margin) {
  if (lattice_->voxel_count() < kLeastOnGrid)
    return "it has fewer than " + std::to_string(kLeastOnGrid) + " voxels";
  assert(obstacles_.empty() && !moved_ever_);  // obstacles are set only after this call
  if (lattice_->max_spacing_m() > kFlat * lattice_->min_spacing_m()) return "its voxels are not cubes";
  // A ball touches tissue only where the ball is at most as steep as links allow a surface to be.
  const double h = lattice_->min_spacing_m();
  double steepest = 0.0;
  for (const LinkMaterial& m : lattice_->materials().subspan(1))
    steepest = std::max(steepest, m.shear * lattice_->max_spacing_m() / h);
  const double share = tool.shape == ToolInBody::Shape::punch ? 1.0 : steepest / std::hypot(1.0, steepest);
  const int contact = static_cast<int>(std::ceil(share * reach(tool.radius) / h));
  if (contact + kLeastMargin > CompositeGrid::kMaxHalfWidth) return "the tool is many voxels wide";
  const int half = std::min(contact + margin, CompositeGrid::kMaxHalfWidth);
  CompositeGrid::Suitability suitability = CompositeGrid::suitability(*lattice_);
  if (!suitability.reason.empty()) return suitability.reason;
  patch_error_ = suitability.force_error;
  grid_ = std::make_unique<CompositeGrid>(*lattice_, half);
  grid_->find_chains_to_anchors();
  near_on_grid_.reserve(most_in_box(half));
  touches_on_grid_.reserve(kMaxTouched);
  return {};
}

void SoftObject::widen_patches() {
  if (!grid_) return;
  auto wide = std::make_unique<CompositeGrid>(*lattice_, CompositeGrid::kReferenceHalfWidth,
                                              CompositeGrid::kReferenceHalfWidth);
  wide->find_chains_to_anchors();
  wide->begin(centre_);
  if (!obstacles_.empty()) wide->watch_obstacles(obstacles_);
  wide->interpolate_from(*grid_);
  grid_ = std::move(wide);
  near_on_grid_.reserve(most_in_box(CompositeGrid::kReferenceHalfWidth));
  list_near_on_grid();
}

glm::dvec3 SoftObject::displacement_on_grid(VoxelId v) const noexcept {
  const std::array<int, 3> c = lattice_->coordinates(v);
  return grid_->in_fine_patch(c) ? grid_->fine_at(c) : grid_->at(c);
}

glm::dvec3 SoftObject::position_on_grid(VoxelId v) const noexcept {
  const std::array<int, 3> c = lattice_->coordinates(v);
  const glm::dvec3& h = lattice_->spacing_m();
  const glm::dvec3 u = grid_->in_fine_patch(c) ? grid_->fine_at(c) : grid_->at(c);
  return glm::dvec3(c[0] * h.x, c[1] * h.y, c[2] * h.z) + u;
}

// Greatest number of surface voxels in the finest patch.
std::size_t SoftObject::most_in_box(int half_width) const {
  const std::size_t across = 2 * static_cast<std::size_t>(half_width) + 2;
  return std::min(lattice_->surface().size(), across * across * across);
}

// Lists the surface voxels of the finest patch, by rows.
void SoftObject::list_near_on_grid() noexcept {
  near_on_grid_.clear();
  std::array<int, 3> low{}, high{};
  grid_->fine_patch(low, high);
  const Grid& g = lattice_->grid();
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      for (int c = low[0] / kRow; c <= high[0] / kRow; ++c) {
        const auto [first, last] = lattice_->surface_in(g.row(c + 1, j, k));
        for (std::uint32_t s = first; s < last; ++s) {
          const VoxelId v = lattice_->surface()[s];
          const int i = c * kRow + static_cast<int>(v % kRow);
          if (i >= low[0] && i <= high[0] && near_on_grid_.size() < near_on_grid_.capacity())
            near_on_grid_.push_back(v);
        }
      }
    }
  }
}

// Prepares the patches at the voxel that the tool will probably press: the nearest touched voxel, else the
// nearest voxel of the object's box.
void SoftObject::come_near_on_grid(const ToolInBody& tool) noexcept {
  if (!grid_ || on_grid_) return;
  std::array<int, 3> nearest{};
  const auto& dims = lattice_->grid().dims;
  for (int d = 0; d < 3; ++d) {
    const double at = tool.centre[d] / lattice_->spacing_m()[d];
    nearest[static_cast<std::size_t>(d)] =
        static_cast<int>(std::clamp(at + 0.5, 0.0, dims[static_cast<std::size_t>(d)] - 1.0));
  }
  double least = std::numeric_limits<double>::max();
  for (const Touch& t : touches_) {
    const glm::dvec3 away = t.rest - tool.centre;
    if (glm::dot(away, away) >= least) continue;
    least = glm::dot(away, away);
    nearest = lattice_->coordinates(t.v);
  }
  grid_->prepare(nearest);
}

void SoftObject::touch_on_grid(std::span<const VoxelId> near) noexcept {
  contact_work_ = 0;
  split_cycle_ = false;
  if (near.empty()) on_grid_ = false;
  touches_.clear();
  touched_voxels_.clear();
  touched_numbers_.clear();
  for (const VoxelId v : near) {
    if (touches_.size() == kMaxTouched) break;
    touches_.push_back({v, lattice_->surface_number(v), false, lattice_->rest(v)});
    touched_voxels_.push_back(v);
    touched_numbers_.push_back(touches_.back().surface);
  }
}

bool SoftObject::push_out_on_grid(const ToolInBody& tool) noexcept {
  if (on_grid_) return true;  // the next cycle projects
  bool any = false;
  double nearest = 0.0;
  std::array<int, 3> centre{};
  for (Touch& t : touches_) {
    const glm::dvec3 p = position(t);
    if (clear_of(tool, p)) continue;
    const Gap g = gap(tool, p);
    t.pressed = true;
    t.normal = g.normal;
    any = true;
    if (g.distance < nearest) {
      nearest = g.distance;
      centre = lattice_->coordinates(t.v);
    }
  }
  if (any && !on_grid_) {
    grid_->begin(centre);
    centre_ = centre;
    dent_m_ = glm::dvec3(0.0);
    on_grid_ = moved_ever_ = true;
    list_near_on_grid();
    grid_ticks_ = 0;
    axis_waits_ = {};
    grid_force_N_ = glm::dvec3(0.0);
    contact_energy_.begin();
  }
  return any;
}

// The tool's surface as a height along one axis: that of the largest component of its normal at the voxel.
SoftObject::Bound SoftObject::bound_by(const ToolInBody& tool, const Touch& t,
                                       const glm::dvec3& u) const noexcept {
  const glm::dvec3 p = t.rest + u;
  const Gap g = gap(tool, p);
  if (g.distance == std::numeric_limits<double>::max()) return {};
  const int axis = CompositeGrid::largest_axis(g.normal);
  const double way = g.normal[axis] < 0.0 ? -1.0 : 1.0;
  if (tool.shape == ToolInBody::Shape::punch) return {axis, way, u[axis] - g.distance / g.normal[axis], true};
  const double away = reach(tool.radius);
  glm::dvec3 across = p - tool.centre;
  across[axis] = 0.0;
  const double square = away * away - glm::dot(across, across);
  if (square <= 0.0) return {};
  return {axis, way, tool.centre[axis] + way * std::sqrt(square) - t.rest[axis], true};
}

// Projects pressed voxels onto the tool, in the order of the list and then in reverse, because the place of a
// voxel along the tool depends on its neighbours. The cycle itself does not move voxels along the tool.
void SoftObject::put_aside(const ToolInBody& tool) noexcept {
  const auto put = [&](const TouchOnGrid& near) {
    if (near.gap_m > kPressed * lattice_->min_spacing_m()) return;
    const glm::dvec3 rest = touches_[near.touch].rest, wished = grid_->unconstrained_minimum(near.voxel);
    Gap g = gap(tool, rest + wished);
    if (g.distance >= 0.0) return;
    const glm::dvec3 place = project_on_tool(tool, rest, wished, grid_->compliance(near.voxel), g);
    grid_->set_fine(near.voxel, grid_->clamp_to_supports(near.voxel, place));
  };
  std::for_each(touches_on_grid_.begin(), touches_on_grid_.end(), put);
  std::for_each(touches_on_grid_.rbegin(), touches_on_grid_.rend(), put);
}

// Sets the bounds of the patches' voxels. A bound stands whether or not its voxel is pressed. If bounds were
// dropped when coarse levels overshoot, the whole contact would be pressed and released in turns.
void SoftObject::press_on_grid(const ToolInBody& tool) noexcept {
  grid_->clear_pressed(glm::distance(tool.centre, grid_tool_m_));
  grid_->press_on_obstacles();
  touches_on_grid_.clear();
  for (std::uint32_t n = 0; n < touches_.size(); ++n) {
    const std::array<int, 3> c = lattice_->coordinates(touches_[n].v);
    if (!grid_->in_fine_patch(c)) continue;
    const double away = gap(tool, touches_[n].rest + grid_->fine_at(c)).distance;
    if (away <= kNear * lattice_->min_spacing_m()) touches_on_grid_.push_back({n, c, away});
  }
  put_aside(tool);
  for (const TouchOnGrid& near : touches_on_grid_) {
    const Touch& t = touches_[near.touch];
    glm::dvec3 u = grid_->fine_at(near.voxel);
    const Bound bound = bound_by(tool, t, u);
    if (!bound.any) continue;
    u[bound.axis] = bound.u;
    glm::dvec3 normal(0.0);
    normal[bound.axis] = bound.way;
    grid_->press(near.voxel, grid_->clamp_to_supports(near.voxel, u), normal);
    // A voxel that the tool presses sideways is also held sideways, on the tool's surface.
    const glm::dvec3 wished = grid_->unconstrained_minimum(near.voxel);
    Gap g = gap(tool, t.rest + wished);
    if (g.distance >= 0.0) continue;
    const glm::dvec3 place = project_on_tool(tool, t.rest, wished, grid_->compliance(near.voxel), g);
    normal = g.normal;
    normal[bound.axis] = 0.0;
    grid_->press(near.voxel, grid_->clamp_to_supports(near.voxel, place), normal);
  }
}

// Call it after a cycle. It moves all voxels out of the tool, except those that anchors keep in it.
void SoftObject::settle_on_grid(const ToolInBody& tool) noexcept {
  glm::dvec3 sum(0.0), moved(0.0);
  int pressed = 0;
  nearest_m_ = std::numeric_limits<double>::max();
  double least = std::numeric_limits<double>::max();
  const Touch* nearest = nullptr;
  for (Touch& t : touches_) {
    t.pressed = false;
    const glm::dvec3 from = t.rest - tool.centre;
    if (glm::dot(from, from) < least) {
      least = glm::dot(from, from);
      nearest = &t;
    }
    const std::array<int, 3> c = lattice_->coordinates(t.v);
    if (!grid_->in_fine_patch(c)) continue;
    glm::dvec3 u = grid_->fine_at(c);
    Gap g = gap(tool, t.rest + u);
    nearest_m_ = std::min(nearest_m_, g.distance);
    if (g.distance > kPressed * lattice_->min_spacing_m()) continue;
    if (g.distance < 0.0) {
      const Bound bound = bound_by(tool, t, u);
      if (bound.any) u[bound.axis] = bound.u;
      u = grid_->clamp_to_supports(c, u);
      grid_->set_fine(c, u);
    }
    t.pressed = true;
    t.normal = g.normal;
    moved += u;
    sum += glm::dvec3(c[0], c[1], c[2]);
    ++pressed;
  }
  grid_->settle_on_obstacles();
  if (pressed == 0) {
    // Between two contacts the patches follow a tool that stays near, so that the next contact is in them.
    if (nearest != nullptr) centre_ = lattice_->coordinates(nearest->v);
    return;
  }
  sum /= static_cast<double>(pressed);
  dent_m_ = moved / static_cast<double>(pressed);
  for (int d = 0; d < 3; ++d) centre_[static_cast<std::size_t>(d)] = static_cast<int>(std::lround(sum[d]));
}

// Axes to relax if the share of the work is below 1: as many as the share allows, at least one. Axes take
// turns. An axis that carries force has its turn twice as often.
std::array<bool, 3> SoftObject::fewer_axes_due() noexcept {
  const int most = std::max(1, static_cast<int>(3.0 * work_share_));
  const double felt = kFelt * glm::length(grid_force_N_);
  for (int d = 0; d < 3; ++d)
    axis_waits_[static_cast<std::size_t>(d)] += std::abs(grid_force_N_[d]) > felt ? 2 : 1;
  std::array<bool, 3> due{};
  for (int n = 0; n < most; ++n) {
    const auto longest =
        static_cast<std::size_t>(std::ranges::max_element(axis_waits_) - axis_waits_.begin());
    due[longest] = true;
    axis_waits_[longest] = 0;
  }
  return due;
}

// Axes to relax in the next cycle, before which the tool moves by `way_m`. An axis that carries little force
// and along which the tool hardly moves changes little, so it is relaxed in every second tick.
std::array<bool, 3> SoftObject::axes_due(const glm::dvec3& way_m) noexcept {
  ++grid_ticks_;
  if (work_share_ < 1.0) return fewer_axes_due();
  if (grid_ticks_ <= kAllAxes) return {true, true, true};
  std::array<bool, 3> due{};
  const double felt_N = kFelt * glm::length(grid_force_N_), least_m = kFelt * glm::length(way_m);
  int others = 0;
  for (int d = 0; d < 3; ++d) {
    const bool carries = std::abs(grid_force_N_[d]) > felt_N;
    const bool changes = carries || std::abs(way_m[d]) > least_m;
    const bool turn = static_cast<std::uint32_t>(others) == grid_ticks_ % 2;
    due[static_cast<std::size_t>(d)] = changes || turn;
    if (!changes) ++others;
  }
  return due;
}

void SoftObject::relax_on_grid(const ToolInBody& tool) noexcept {
  tool_ = tool;
  if (!on_grid_) return;
  if (contact_work_ > 0) {  // the tick has had its cycles
    settle_on_grid(tool);
    return;
  }
  if (grid_->centre_on(centre_)) list_near_on_grid();
  const double h = lattice_->min_spacing_m();
  const glm::dvec3 way_m = tool.centre - grid_tool_m_;
  if (nearest_m_ <= kPressed * h) go_along(*grid_, dent_m_, grid_force_N_, way_m, h);
  std::array<bool, 3> axes = axes_due(way_m);
  constexpr std::array<bool, 3> kNone{};
  const int most = work_share_ < 1.0 ? 1 : kCyclesInTick;
  for (int n = 0; n < most && axes != kNone; ++n) {
    press_on_grid(tool);
    grid_->cycle(axes);
    contact_work_ += grid_->work_of_cycle();
    settle_on_grid(tool);
    grid_tool_m_ = tool.centre;
    const glm::dvec3 before_N = std::exchange(grid_force_N_, grid_->force_on_tool_N());
    const double changes_N = kStillChanges * glm::length(grid_force_N_);
    for (int d = 0; d < 3; ++d) {
      bool& due = axes[static_cast<std::size_t>(d)];
      due = due && d != CompositeGrid::largest_axis(grid_force_N_) &&
            std::abs(grid_force_N_[d] - before_N[d]) > changes_N;
    }
  }
  contact_energy_.account(way_m, grid_force_N_, depth_of(dent_m_, grid_force_N_));
  const bool away = nearest_m_ > kOnItsWay * lattice_->min_spacing_m();
  if (away && glm::length(grid_force_N_) < ContactEnergy::kNoContact_N) on_grid_ = false;
}

Reaction SoftObject::reaction_on_grid(const ToolInBody& tool) const noexcept {
  Reaction result;
  if (!on_grid_) return result;
  const double size = glm::length(grid_force_N_);
  const glm::dvec3 n = size > 0.0 ? grid_force_N_ / size : glm::dvec3(0.0);
  for (const Touch& t : touches_) result.pressed += t.pressed ? 1U : 0U;
  const double depth = std::max(kLeastDepth * lattice_->min_spacing_m(), depth_of(dent_m_, grid_force_N_));
  if (result.pressed == 0 && (size == 0.0 || nearest_m_ > kOnItsWay * lattice_->min_spacing_m()))
    return result;
  result.pressed = std::max(result.pressed, 1U);
  if (size == 0.0) {
    // no force has reached the anchors yet
    for (const Touch& t : touches_) {
      const std::array<int, 3> c = lattice_->coordinates(t.v);
      if (!t.pressed || !grid_->in_fine_patch(c)) continue;
      const glm::dvec3 springs = 1.0 / grid_->compliance(c);
      for (int d = 0; d < 3; ++d) result.stiffness_N_per_m[d][d] += springs[d];
    }
  } else {
    // The secant stiffness, along the force. Across it the tool slides without friction. Where steps by this
    // model go too far, the tick learns a larger stiffness (settle_contact.cpp).
    result.stiffness_N_per_m = size / depth * glm::outerProduct(n, n);
  }
  // Until the next cycle the force is that of the last cycle, less stiffness times the tool's motion since
  // then.
  result.force_N = grid_force_N_ - result.stiffness_N_per_m * (tool.centre - grid_tool_m_);
  if (glm::dot(result.force_N, n) < 0.0) result.force_N = glm::dvec3(0.0);
  result.force_N *= contact_energy_.share();
  result.stiffness_N_per_m *= contact_energy_.share();
  return result;
}

bool SoftObject::at_anchors_end(VoxelId v, const glm::dvec3& direction) const noexcept {
  if (!on_grid_) return false;
  const glm::dvec3 size = glm::abs(direction);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::array<int, 3> c = lattice_->coordinates(v);
  glm::dvec3 further = displacement(v);
  const double step = (direction[axis] > 0.0 ? 1e-3 : -1e-3) * lattice_->min_spacing_m();
  further[axis] += step;
  return grid_->clamp_to_supports(c, further)[axis] != further[axis];
}

}  // namespace voxel
