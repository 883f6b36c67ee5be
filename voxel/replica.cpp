// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/replica.h"

#include <algorithm>
#include <cmath>

namespace voxel {
namespace {

std::size_t at(RowId row) {
  return static_cast<std::size_t>(row) * kRow;
}

}  // namespace

Replica::Parcel::Parcel(Multigrid& multigrid) {
  std::size_t rows = 0, floats = 0;
  for (int l = 0; l < multigrid.levels(); ++l) {
    rows += multigrid.grid(l).rows();
    floats += multigrid.grid(l).rows() * fields(l) * kRow;
  }
  entries_ = LazyArray<Entry>(rows);
  values_ = LazyArray<float>(floats);
}

float* Replica::Parcel::add(int level, RowId row) noexcept {
  entries_[count_++] = {filled_, row, static_cast<std::uint32_t>(level)};
  float* values = values_.data() + filled_;
  filled_ += fields(level) * kRow;
  return values;
}

Replica::Replica(SoftObject& object)
    : lattice_(object.lattice()),
      state_(object.state_),
      relaxation_(lattice_),
      obstacles_(object.obstacles_),
      before_(static_cast<std::size_t>(multigrid().levels())),
      given_(multigrid()),
      found_(multigrid()) {
  object.relaxation_.multigrid().keep_log();
  multigrid().keep_log();
  relaxation_.copy_from(object.relaxation_);
  least_m_ = multigrid().quiet_m();
  least_N_ = multigrid().tolerance_N();
  const std::size_t most_held = lattice_.surface().size() + SoftObject::kMaxTouched;
  held_.reserve(most_held);
  given_held_.reserve(most_held);
  given_roles_.reserve(2 * most_held);
  given_obstacles_.reserve(lattice_.surface().size());
  object.changed_obstacles_.reserve(lattice_.surface().size());
  object.obstacle_changed_.assign(object.obstacles_.size(), 0);
  for (int l = 0; l < multigrid().levels(); ++l) {
    for (std::size_t which = 0; which < fields(l); ++which)
      before(l, which) = field(state_, multigrid(), l, which);
  }
  if (lattice_.voxel_count() >= SoftObject::kPreparedWhole) return;
  relaxation_.prepare_all();
  for (auto& axis : state_.u) axis.populate();
  state_.role.populate();
  for (auto& level : before_) {
    for (auto& field : level) field.populate();
  }
  given_.populate();
  found_.populate();
}

void Replica::give(SoftObject& object) noexcept {
  Multigrid& from = object.relaxation_.multigrid();
  given_.clear();
  for (int l = 0; l < from.levels(); ++l) {
    for (const RowId row : from.log().rows(l)) {
      float* to = given_.add(l, row);
      for (std::size_t which = 0; which < fields(l); ++which, to += kRow)
        std::copy_n(field(object.state_, from, l, which).data() + at(row), kRow, to);
    }
  }
  from.log().clear();
  given_roles_.clear();
  given_obstacles_.clear();
  for (const std::uint32_t s : object.changed_obstacles_) {
    object.obstacle_changed_[s] = 0;
    given_obstacles_.push_back({s, object.obstacles_[s]});
    const VoxelId v = lattice_.surface()[s];
    given_roles_.push_back({v, object.resting_role(v)});
  }
  object.changed_obstacles_.clear();
  for (const VoxelId v : given_held_) given_roles_.push_back({v, object.resting_role(v)});
  object.list_held();
  given_held_.clear();
  for (const VoxelId v : object.all_held_) given_held_.push_back(v);
  object.relaxation_.sleep();  // until something moves again
}

void Replica::open_given() noexcept {
  Multigrid& to = multigrid();
  for (std::size_t n = 0; n < given_.count(); ++n) {
    const Parcel::Entry& entry = given_.entry(n);
    const int level = static_cast<int>(entry.level);
    const float* from = given_.values(entry);
    for (std::size_t which = 0; which < fields(level); ++which, from += kRow) {
      std::copy_n(from, kRow, field(state_, to, level, which).data() + at(entry.row));
      std::copy_n(from, kRow, before(level, which).data() + at(entry.row));
    }
    to.stir(level, entry.row);
    if (level > 0) to.mark(level, entry.row, Multigrid::changed);
  }
  for (const GivenObstacle& given : given_obstacles_) {
    obstacles_[given.surface_number] = given.obstacle;
    to.stir(0, lattice_.surface()[given.surface_number] / kRow);
  }
  for (const GivenRole& given : given_roles_) state_.set_role(given.v, given.role);
  held_.clear();
  for (const VoxelId v : given_held_) {
    held_.push_back(v);
    state_.set_role(v, Displacement::held);
  }
  if (given_.count() > 0 || !given_obstacles_.empty()) relaxation_.wake();
  to.log().clear();
}

void Replica::relax() noexcept {
  open_given();
  relaxation_.run_cycle(state_, {obstacles_, &lattice_}, held_);
  work_ = multigrid().log().count();
  pack_changes();
}

// From the coarsest level down: before cells are what they are to be, what they told would be told twice.
void Replica::pack_changes() noexcept {
  found_.clear();
  taken_ = 0;
  at_rest_ = relaxation_.asleep();
  progress_ = relaxation_.progress();
  for (int l = multigrid().levels() - 1; l >= 0; --l) {
    for (const RowId row : multigrid().log().rows(l)) {
      if (!pack_row(l, row)) found_.drop_last();
    }
  }
}

// False where next to nothing changed, less than a row is left alone with: that waits until it is more.
bool Replica::pack_row(int level, RowId row) noexcept {
  float* way = found_.add(level, row);
  bool any = false;
  for (std::size_t which = 0; which < fields(level); ++which) {
    const float* now = field(state_, multigrid(), level, which).data() + at(row);
    const float* was = before(level, which).data() + at(row);
    const float least = which < 6 ? least_m_ : least_N_;
    float most = 0.0F;
    for (std::size_t i = 0; i < kRow; ++i) {
      way[which * kRow + i] = now[i] - was[i];
      most = std::max(most, std::fabs(way[which * kRow + i]));
    }
    any = any || most > least;
  }
  if (!any) return false;
  // The same sum as the tick's, to the last bit.
  for (std::size_t which = 0; which < fields(level); ++which) {
    float* now = field(state_, multigrid(), level, which).data() + at(row);
    float* was = before(level, which).data() + at(row);
    for (std::size_t i = 0; i < kRow; ++i) was[i] += way[which * kRow + i];
    std::copy_n(was, kRow, now);
  }
  return true;
}

void Replica::take_cells(Multigrid& to, const Parcel::Entry& entry) noexcept {
  const int level = static_cast<int>(entry.level);
  const float* way = found_.values(entry);
  for (std::size_t which = 0; which < Multigrid::kFields; ++which, way += kRow) {
    float* there = to.field(level, which).data() + at(entry.row);
    for (std::size_t i = 0; i < kRow; ++i) there[i] += way[i];
  }
  to.mark(level, entry.row, Multigrid::changed);
}

void Replica::take_voxels(SoftObject& object, const Parcel::Entry& entry) noexcept {
  Multigrid& to = object.relaxation_.multigrid();
  const float* way = found_.values(entry);
  RowVector ways, wanted;
  for (std::size_t axis = 0; axis < 3; ++axis, way += kRow) {
    const float* there = object.state_.u[axis].data() + at(entry.row);
    for (std::size_t i = 0; i < kRow; ++i) {
      ways[axis][i] = way[i];
      wanted[axis][i] = there[i] + way[i];
    }
  }
  to.add(entry.row, ways, object.state_, object.obstacle_view());
  if (to.log().has(0, entry.row)) return;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!std::equal(wanted[axis].begin(), wanted[axis].end(), object.state_.u[axis].data() + at(entry.row))) {
      to.log().note(0, entry.row);
      return;
    }
  }
}

bool Replica::take(SoftObject& object, std::size_t rows) noexcept {
  Multigrid& to = object.relaxation_.multigrid();
  for (; rows > 0 && taken_ < found_.count(); --rows, ++taken_) {
    const Parcel::Entry& entry = found_.entry(taken_);
    if (entry.level > 0) {
      take_cells(to, entry);
    } else {
      take_voxels(object, entry);
    }
  }
  if (taken_ < found_.count()) return false;
  object.relaxation_.take_over(progress_);
  if (!at_rest_ || found_.count() > 0) object.relaxation_.wake();
  return true;
}

std::size_t Replica::memory_bytes() const {
  std::size_t bytes = relaxation_.memory_bytes() + obstacles_.size() * sizeof(Obstacle) +
                      state_.role.resident_bytes() + state_.row_held.resident_bytes() +
                      state_.row_obstacles.resident_bytes() + given_.memory_bytes() + found_.memory_bytes();
  for (const auto& axis : state_.u) bytes += axis.resident_bytes();
  for (const auto& level : before_) {
    for (const auto& field : level) bytes += field.resident_bytes();
  }
  return bytes;
}

}  // namespace voxel
