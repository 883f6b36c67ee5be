// SPDX-License-Identifier: GPL-3.0-or-later
// Submission, relaxation and packing of a shadow object.
#include "voxel/object/shadow_object.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "voxel/lattice/prefetch.h"

namespace voxel {
namespace {

// Rows near the contact that a tick applies at once, at most. If a contact has more rows, steps are felt.
constexpr std::size_t kMaxAtOnce = 1000;
// After the tool moved by more than kMoved spacings between two submissions, kContactCycles contact cycles
// follow the whole cycle in each of the next kUnsettled results. The reason: a whole cycle reduces the error
// at the contact only a little. At rest no contact cycles follow, because then coarse cells outside of their
// boxes would get the last sweeps of the whole cycle only in the next cycle. A voxel that barely touches the
// tool would be released and pressed in turns.
constexpr int kContactCycles = 4, kUnsettled = 4;
// Cycles around a pressed rigid block that follow the whole cycle, too.
constexpr int kBlockCycles = 4;
constexpr double kMoved = 0.1;  // (unit: spacing)
// Far from the contact a change is passed on only if it is kFarther times least_m_ or more; smaller
// ones are deferred until all is at rest. Rows within kNearRows of the contact are always passed on,
// and so are submitted rows: a later submission would undo their deferred part.
constexpr float kFarther = 20.0F;
constexpr std::size_t kNearRows = 3;
// If tissue moved by more than kJumped spacings since the last submission, the next kCoarseFirstResults
// results are of contact cycles on large boxes. In the first of them, coarse levels come to rest before the
// finer ones. Their corrections are also prolonged beyond the boxes: tissue left behind there would hold back
// the contact. A pressed rigid block has one such result over the whole object, because no box is large
// enough. Loads of bricks are not renewed meanwhile: they are of little use on tissue that moves far.
constexpr float kJumped = 5.0F;
constexpr int kCoarseFirstResults = 3;
// Number of cycles on large boxes in each of the kCoarseFirstResults results.
constexpr std::array<int, kCoarseFirstResults> kLargePatchCycles{3, 4, 2};
// Number of Float8 per row that a cycle over the whole object smooths and prolongs.
constexpr std::size_t kGroupsOfRow = 12;
// Arrays of a row in a result: motion, and loads of bricks if there are any.
std::size_t arrays_of(const Lattice& lattice) {
  return lattice.has_bricks() ? 6 : 3;
}

}  // namespace

ShadowObject::ShadowObject(SoftObject& object)
    : lattice_(object.lattice()),
      state_(object.state_),
      relaxation_(lattice_),
      obstacles_(object.obstacles_),
      moving_obstacles_(object.moving_obstacles_),
      deferred_rows_(lattice_.grid().rows()),
      deferred_(lattice_.grid().rows()),
      distance_(lattice_.grid().rows()),
      by_distance_(lattice_.grid().rows()),
      submitted_(lattice_.grid().rows()),
      results_{RowDelta(lattice_.grid().rows(), arrays_of(lattice_)),
               RowDelta(lattice_.grid().rows(), arrays_of(lattice_))},
      retry_(lattice_.grid().rows()) {
  for (BlockMoves& ways : block_moves_) ways.assign(lattice_.block_count(), glm::dvec3(0.0));
  multigrid().keep_log();
  relaxation_.copy_from(object.relaxation_);
  object.relaxation_.leave_to_shadow();
  // With rigid blocks the limit is smaller, because a block sums the errors along its whole border.
  least_m_ = multigrid().has_blocks() ? multigrid().restricted_m() : multigrid().motion_tolerance_m();
  const std::size_t most_held = lattice_.surface().size() + SoftObject::kMaxTouched;
  held_.reserve(most_held);
  submitted_held_.reserve(most_held);
  submitted_contacts_.reserve(SoftObject::kMaxTouched);
  submitted_roles_.reserve(2 * most_held);
  submitted_obstacles_.reserve(lattice_.surface().size());
  object.changed_obstacles_.reserve(lattice_.surface().size());
  object.obstacle_changed_.assign(object.obstacles_.size(), 0);
  for (std::size_t axis = 0; axis < 3; ++axis) before_[axis] = state_.u[axis];
  if (lattice_.voxel_count() >= SoftObject::kPreparedWhole) return;
  relaxation_.prepare_all();
  relaxation_.prepare_under_tool();
  object.relaxation_.prepare_all();
  if (object.beside_bodies_) relaxation_.prepare_beside_bodies();
  const std::vector<bool> rows = relaxation_.couplings().rows_in_use();
  state_.populate(rows);
  for (auto& axis : before_) axis.populate(kRow, rows);
  const auto most = static_cast<std::size_t>(std::count(rows.begin(), rows.end(), true));
  submitted_.populate(most);
  for (RowDelta& delta : results_) delta.populate(most);
  retry_.populate();
}

void ShadowObject::submit(SoftObject& object) noexcept {
  ChangeLog& log = object.relaxation_.multigrid().log();
  submitted_.clear();
  const RowDelta& delta = results_[applying_];
  for (const RowId row : log.rows(0)) {
    float* to = submitted_.add(row);
    for (std::size_t axis = 0; axis < 3; ++axis)
      std::copy_n(object.state_.u[axis].data() + at(row), kRow, to + axis * kRow);
    // The row is submitted as it will be when the result is applied. Otherwise it would differ from its
    // neighbours by motion that the shadow has already computed, and the shadow would compute that motion
    // twice.
    const std::size_t n = delta.find(row);
    if (n == delta.count() || (n < rows_applied_ && !retry_.waits(n))) continue;
    for (std::size_t i = 0; i < std::size_t{3} * kRow; ++i) to[i] += delta.values(n)[i];
  }
  submitted_roles_.clear();
  submitted_obstacles_.clear();
  for (const std::uint32_t s : object.changed_obstacles_) {
    object.obstacle_changed_[s] = 0;
    submitted_obstacles_.push_back({s, object.obstacles_[s]});
    const VoxelId v = lattice_.surface()[s];
    submitted_roles_.push_back({v, object.resting_role(v)});
  }
  object.changed_obstacles_.clear();
  for (const VoxelId v : submitted_held_) submitted_roles_.push_back({v, object.resting_role(v)});
  submitted_pressed_ = object.list_held();
  note_motion(object);
  submitted_held_.clear();
  submitted_contacts_.clear();
  for (const VoxelId v : object.held_voxels_) {
    submitted_held_.push_back(v);
    if (object.state_.role[v] == Displacement::pressed || Displacement::in_block(object.state_.role[v]))
      submitted_contacts_.push_back({v, object.state_.tool_normal[lattice_.surface_number(v)]});
  }
  near_ = submitted_held_.empty() ? Relaxation::NearRows{} : object.relaxation_.near_contact();
  object.assign_residual();
  log.clear();
}

void ShadowObject::note_motion(const SoftObject& object) noexcept {
  const double way = glm::distance(object.tool_.centre, submitted_tool_m_);
  submitted_tool_m_ = object.tool_.centre;
  if (way > kMoved * lattice_.min_spacing_m()) unsettled_ = kUnsettled;
  settle_contact_ = unsettled_ > 0 && submitted_pressed_ > 0;
  if (unsettled_ > 0) --unsettled_;
}

void ShadowObject::read_submission() noexcept {
  Multigrid& to = multigrid();
  float moved_m = 0.0F;
  for (std::size_t n = 0; n < submitted_.count(); ++n) {
    const RowId row = submitted_.row(n);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* now = submitted_.values(n) + axis * kRow;
      const float* was = before_[axis].data() + at(row);
      for (std::size_t i = 0; i < kRow; ++i) moved_m = std::max(moved_m, std::fabs(now[i] - was[i]));
      std::copy_n(submitted_.values(n) + axis * kRow, kRow, state_.u[axis].data() + at(row));
      std::copy_n(submitted_.values(n) + axis * kRow, kRow, before_[axis].data() + at(row));
    }
    to.mark_dirty(0, row);
  }
  for (const SubmittedObstacle& submitted : submitted_obstacles_) {
    Obstacle& o = obstacles_[submitted.surface_number];
    moving_obstacles_ = moving_obstacles_ + (submitted.obstacle.moving ? 1 : 0) - (o.moving ? 1 : 0);
    o = submitted.obstacle;
    to.mark_dirty(0, lattice_.surface()[submitted.surface_number] / kRow);
  }
  for (const SubmittedRole& submitted : submitted_roles_) state_.set_role(submitted.v, submitted.role);
  held_.clear();
  for (const VoxelId v : submitted_held_) {
    held_.push_back(v);
    state_.set_role(v, Displacement::held);
  }
  for (const SubmittedContact& submitted : submitted_contacts_) {
    state_.set_role(submitted.v, Displacement::pressed);
    state_.tool_normal[lattice_.surface_number(submitted.v)] = submitted.normal;
  }
  if (submitted_.count() > 0 || !submitted_obstacles_.empty()) relaxation_.wake();
  to.log().clear();
  // At least one whole cycle runs between two jumps, so that the rest of the object is relaxed, too.
  if (moved_m > kJumped * static_cast<float>(lattice_.min_spacing_m()) && coarse_first_left_ == 0 &&
      !was_coarse_first_) {
    coarse_first_left_ = kCoarseFirstResults;
    large_motion_left_ = kCoarseFirstResults + kUnsettled;
  }
  // A pressed rigid block moves tissue all around it, far from the contact.
  block_pressed_ = std::any_of(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(submitted_pressed_),
                               [this](VoxelId v) { return lattice_.block(v) != 0; });
  if (submitted_pressed_ == 0) coarse_first_left_ = 0;
  if (block_pressed_) coarse_first_left_ = std::min(coarse_first_left_, 1);
}

void ShadowObject::relax_coarse_first(const ObstacleView& obstacles) noexcept {
  std::size_t groups = 0;
  const bool first = coarse_first_left_ == kCoarseFirstResults;
  --coarse_first_left_;
  if (block_pressed_) {
    groups = relaxation_.run_whole_coarse_first(state_, obstacles, held_);
    relaxation_.relax_around_blocks(state_, obstacles);
    work_ = groups / kGroupsOfRow;
    return;
  }
  const std::span<const VoxelId> pressed{held_.data(), submitted_pressed_};
  if (first) {
    groups += relaxation_.relax_large_patch(state_, obstacles, held_, pressed, true);
    groups += relaxation_.prolong_large_patch(state_, obstacles, pressed);
  }
  const int cycles =
      kLargePatchCycles[static_cast<std::size_t>(kCoarseFirstResults - 1 - coarse_first_left_)];
  for (int n = 0; n < cycles; ++n)
    groups += relaxation_.relax_large_patch(state_, obstacles, held_, pressed, false);
  // relax_region() does not run in the first result with coarse levels first, because the tool then goes on
  // to press other voxels. It does not run in the last one either, because the next result has a whole cycle,
  // which ends with relax_region().
  if (!first && coarse_first_left_ > 0) relaxation_.relax_region(state_, obstacles);
  work_ = groups / kGroupsOfRow;
}

void ShadowObject::relax() noexcept {
  read_submission();
  const ObstacleView obstacles{obstacles_, &lattice_, moving_obstacles_};
  was_coarse_first_ = coarse_first_left_ > 0;
  at_limits_ = false;
  large_motion_ = large_motion_left_ > 0;
  if (large_motion_) --large_motion_left_;
  if (was_coarse_first_) {
    relax_coarse_first(obstacles);
  } else {
    relaxation_.run_cycle(state_, obstacles, held_);
    at_limits_ = relaxation_.at_limits();
    for (int n = 0; n < kBlockCycles && settle_contact_ && block_pressed_; ++n)
      relaxation_.relax_around_blocks(state_, obstacles);
    for (int n = 0; n < kContactCycles && settle_contact_; ++n)
      relaxation_.relax_contact(state_, obstacles, held_, {held_.data(), submitted_pressed_});
    work_ = multigrid().log().count();
  }
  pack_changes();
  ++times_relaxed_;
}

ShadowObject::Result ShadowObject::result() const {
  const RowDelta& delta = results_[1 - applying_];
  const std::size_t floats = arrays_of(lattice_) * kRow;
  Result out{{},         {},       near_count_, large_motion_,
             at_limits_, at_rest_, residual_N_, block_moves_[1 - applying_]};
  for (std::size_t n = 0; n < delta.count(); ++n) {
    out.rows.push_back(delta.row(n));
    out.values.insert(out.values.end(), delta.values(n), delta.values(n) + floats);
  }
  return out;
}

void ShadowObject::replay_result(const Result& result) noexcept {
  RowDelta& delta = results_[1 - applying_];
  const std::size_t floats = arrays_of(lattice_) * kRow;
  delta.clear();
  for (std::size_t n = 0; n < result.rows.size(); ++n)
    std::copy_n(result.values.data() + n * floats, floats, delta.add(result.rows[n]));
  block_moves_[1 - applying_] = result.block_moves;
  near_count_ = result.near_count;
  large_motion_ = result.large_motion;
  at_limits_ = result.at_limits;
  at_rest_ = result.at_rest;
  residual_N_ = result.residual_N;
}

// A counting sort; within one distance rows stay in the order of the log.
void ShadowObject::sort_by_distance() noexcept {
  const auto rows = multigrid().log().rows(0);
  begin_.fill(0);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const int away = near_.distance(lattice_.grid().row_coordinates(rows[n]));
    distance_[n] = static_cast<std::uint8_t>(std::min(away, kDistances - 1));
    ++begin_[distance_[n] + 1U];
  }
  for (std::size_t d = 1; d < begin_.size(); ++d) begin_[d] += begin_[d - 1];
  for (std::size_t n = 0; n < rows.size(); ++n) by_distance_[begin_[distance_[n]]++] = rows[n];
}

void ShadowObject::pack_changes() noexcept {
  RowDelta& delta = results_[1 - applying_];
  delta.clear();
  at_rest_ = relaxation_.asleep();
  residual_N_ = relaxation_.residual_N();
  pack_block_moves();
  sort_by_distance();
  near_count_ = 0;
  const std::size_t count = multigrid().log().rows(0).size();
  // After the sort begin_[d] is the end of distance d.
  const std::size_t near = near_.first[0] > near_.last[0] ? 0 : std::min<std::size_t>(begin_[0], kMaxAtOnce);
  for (std::size_t n = 0; n < count; ++n) {
    if (n + kAhead < count) fetch_change_ahead(by_distance_[n + kAhead]);
    const RowId row = by_distance_[n];
    const bool all = at_rest_ || n < begin_[kNearRows] || submitted_.find(row) != submitted_.count();
    if (!pack_row(row, all ? least_m_ : kFarther * least_m_)) {
      delta.drop_last();
      if (!all) defer_row(row);
    }
    if (n < near) near_count_ = delta.count();
  }
  if (at_rest_) pack_deferred();
}

// Packs the motion of rigid blocks, and removes it from the changes of their rows.
void ShadowObject::pack_block_moves() noexcept {
  BlockMoves& ways = block_moves_[1 - applying_];
  for (std::size_t p = 0; p < ways.size(); ++p) {
    const RigidBlocks& blocks = multigrid().blocks();
    const VoxelId first = blocks.first(p);
    glm::vec3 way(0.0F);
    for (int axis = 0; axis < 3; ++axis) {
      const auto ua = static_cast<std::size_t>(axis);
      way[axis] = state_.u[ua][first] - before_[ua][first];
    }
    if (way == glm::vec3(0.0F)) {
      ways[p] = glm::dvec3(0.0);
      continue;
    }
    // Smaller motion is left out, because move_block() would ignore it.
    if (std::max({std::fabs(way.x), std::fabs(way.y), std::fabs(way.z)}) <= multigrid().restricted_m())
      way = glm::vec3(0.0F);
    ways[p] = glm::dvec3(way);
    for (int axis = 0; axis < 3; ++axis) {
      const auto ua = static_cast<std::size_t>(axis);
      const float to = before_[ua][first] + way[axis];
      for (const RigidBlocks::Run& run : blocks.on(0, p).rows) {
        for (VoxelId v = run.row * kRow; v < (run.row + 1) * kRow; ++v) {
          if ((run.lanes >> v % kRow & 1U) != 0) state_.u[ua][v] = before_[ua][v] = to;
        }
      }
    }
  }
}

// A block has one displacement, so all of it moves at once, whichever of its rows are near the contact.
void ShadowObject::apply_block_moves(SoftObject& object) noexcept {
  const BlockMoves& ways = block_moves_[applying_];
  Multigrid& to = object.relaxation_.multigrid();
  for (std::size_t p = 0; p < ways.size(); ++p) {
    if (ways[p] == glm::dvec3(0.0)) continue;
    const VoxelId first = to.blocks().first(p);
    const glm::vec3 wanted(object.state_.at(first) + ways[p]);
    to.move_block(p, ways[p], object.state_, object.obstacle_view(), Multigrid::Tool::caller_handles,
                  Multigrid::Note::unlogged);
    if (glm::vec3(object.state_.at(first)) == wanted) continue;
    for (const RigidBlocks::Run& run : to.blocks().on(0, p).rows) to.log().note(0, run.row);
  }
}

void ShadowObject::defer_row(RowId row) noexcept {
  if (deferred_[row] != 0) return;
  deferred_[row] = 1;
  deferred_rows_[deferred_count_++] = row;
}

void ShadowObject::pack_deferred() noexcept {
  for (std::size_t n = 0; n < deferred_count_; ++n) {
    const RowId row = deferred_rows_[n];
    deferred_[row] = 0;
    if (!multigrid().log().has(0, row) && !pack_row(row, least_m_)) results_[1 - applying_].drop_last();
  }
  deferred_count_ = 0;
}

std::size_t ShadowObject::memory_bytes() const {
  std::size_t bytes = relaxation_.memory_bytes() + obstacles_.size() * sizeof(Obstacle) +
                      state_.role.resident_bytes() + state_.row_standing.resident_bytes() +
                      state_.row_obstacles.resident_bytes() + submitted_.memory_bytes() +
                      distance_.resident_bytes() + by_distance_.resident_bytes() +
                      deferred_.resident_bytes() + deferred_rows_.resident_bytes() + retry_.memory_bytes();
  for (const RowDelta& delta : results_) bytes += delta.memory_bytes();
  for (std::size_t axis = 0; axis < 3; ++axis)
    bytes += state_.u[axis].resident_bytes() + before_[axis].resident_bytes();
  return bytes;
}

}  // namespace voxel
