// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/chainmail.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace voxel {

ChainMail::ChainMail(const Lattice& lattice)
    : lattice_(lattice), mark_(lattice.size(), untouched), ring_(lattice.voxel_count() + 1) {
  touched_.reserve(lattice.voxel_count());
  moved_.reserve(lattice.voxel_count());
  immovable_.reserve(lattice.voxel_count());
}

void ChainMail::enqueue(VoxelId v) noexcept {
  if ((mark_[v] & queued) != 0) return;
  mark_[v] |= queued;
  ring_[tail_] = v;
  tail_ = tail_ + 1 == ring_.size() ? 0 : tail_ + 1;
}

void ChainMail::note_moved(VoxelId v) noexcept {
  if ((mark_[v] & (direction | queued | fixed | listed)) == 0) touched_.push_back(v);
  if ((mark_[v] & listed) != 0) return;
  mark_[v] |= listed;
  moved_.push_back(v);
}

// The link says low <= u(to) − u(from) <= high, and `from` has just moved: raised, it can only have broken the lower
// bound of `to`, lowered only the upper one; a fixed one, either.
void ChainMail::visit(Displacement& state, int axis, VoxelId from, VoxelId to, float low, float high,
                      bool hold_anchors) noexcept {
  ++candidates_;
  auto& u = state.u[static_cast<std::size_t>(axis)];
  const bool up = (mark_[from] & (raised | fixed)) != 0 && u[to] < u[from] + low;
  const bool down = (mark_[from] & (lowered | fixed)) != 0 && u[to] > u[from] + high;
  if (!up && !down) return;
  if (lattice_.anchored(to)) {
    if (!hold_anchors) immovable_.push_back(to);  // first pass: settled in the second
    return;
  }
  if ((mark_[to] & fixed) != 0) return;  // two fixed voxels are mutually feasible up to rounding
  if (down && (mark_[to] & raised) != 0) {
    // Asked to go both ways: sources that are not mutually feasible. What was raised stays, and pushes back.
    // A voxel changes from lowered to raised once at most, so this ends.
    if ((mark_[from] & fixed) == 0) {
      enqueue(to);
      return;
    }
  }
  note_moved(to);
  u[to] = up ? u[from] + low : u[from] + high;
  mark_[to] = static_cast<std::uint8_t>((mark_[to] & ~direction) | (up ? raised : lowered));
  enqueue(to);
}

void ChainMail::spread(Displacement& state, int axis, bool hold_anchors) noexcept {
  while (head_ != tail_) {
    const VoxelId v = ring_[head_];
    head_ = head_ + 1 == ring_.size() ? 0 : head_ + 1;
    mark_[v] &= static_cast<std::uint8_t>(~queued);
    for (int d = 0; d < 3; ++d) {
      const auto step = static_cast<VoxelId>(lattice_.stride(d));
      if (lattice_.filled(v + step)) {
        const auto b = lattice_.bounds(v, d, axis);
        visit(state, axis, v, v + step, b[0], b[1], hold_anchors);
      }
      if (lattice_.filled(v - step)) {
        const auto b = lattice_.bounds(v - step, d, axis);
        visit(state, axis, v, v - step, -b[1], -b[0], hold_anchors);
      }
    }
  }
}

void ChainMail::settle(Displacement& state, std::span<const VoxelId> sources, std::span<const glm::vec3> moves,
                       std::span<const Obstacle> obstacles,
                       std::span<const std::uint32_t> surface_number) noexcept {
  moved_.clear();
  touched_.clear();
  immovable_.clear();
  candidates_ = 0;
  for (const VoxelId v : sources) note_moved(v);

  // First pass: the sources move what hangs on them; anchors stay, and are remembered where they were pulled.
  for (int axis = 0; axis < 3; ++axis) {
    head_ = tail_ = 0;
    for (const VoxelId v : touched_) mark_[v] &= listed;
    for (std::size_t i = 0; i < sources.size(); ++i) {
      // Not fixed: a neighbouring source may push it further the way it went.
      const float move = moves[i][axis];
      if (move == 0.0F) continue;
      mark_[sources[i]] |= move > 0.0F ? raised : lowered;
      enqueue(sources[i]);
    }
    spread(state, axis, false);
  }

  // Obstacles: what the wave pushed into bone is stopped at its surface.
  const std::size_t pulled_anchors = immovable_.size();
  if (!obstacles.empty()) {
    for (const VoxelId v : moved_) {
      if (state.role[v] != Displacement::obstacle) continue;
      const Obstacle& o = obstacles[surface_number[v]];
      const glm::dvec3 n(o.normal);
      const double depth = static_cast<double>(o.bound) - glm::dot(n, state.at(v));
      if (depth <= 0.0) continue;
      state.set(v, state.at(v) + depth * n);
      immovable_.push_back(v);
    }
  }
  if (pulled_anchors == 0 && immovable_.empty()) {
    for (const VoxelId v : touched_) mark_[v] = untouched;
    return;
  }

  // Second pass: what may not move is now the source, and the tool's voxels give way.
  for (int axis = 0; axis < 3; ++axis) {
    head_ = tail_ = 0;
    for (const VoxelId v : touched_) mark_[v] &= listed;
    for (const VoxelId v : immovable_) {
      if (mark_[v] == untouched) touched_.push_back(v);
      mark_[v] |= fixed;
      enqueue(v);
    }
    spread(state, axis, true);
  }
  for (const VoxelId v : touched_) mark_[v] = untouched;
}

std::size_t ChainMail::memory_bytes() const {
  return mark_.size() + (ring_.size() + touched_.capacity() + moved_.capacity() + immovable_.capacity()) * sizeof(VoxelId);
}

double worst_violation(const Lattice& lattice, const Displacement& state) {
  double worst = 0.0;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const auto v = static_cast<VoxelId>(i);
    if (!lattice.filled(v)) continue;
    for (int d = 0; d < 3; ++d) {
      const VoxelId w = v + static_cast<VoxelId>(lattice.stride(d));
      if (!lattice.filled(w)) continue;
      for (int axis = 0; axis < 3; ++axis) {
        const auto b = lattice.bounds(v, d, axis);
        const auto& u = state.u[static_cast<std::size_t>(axis)];
        const double difference = static_cast<double>(u[w]) - static_cast<double>(u[v]);
        worst = std::max({worst, difference - static_cast<double>(b[1]), static_cast<double>(b[0]) - difference});
      }
    }
  }
  return worst;
}

}  // namespace voxel
