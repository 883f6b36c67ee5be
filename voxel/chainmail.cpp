// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/chainmail.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace voxel {
namespace {

constexpr int kObstaclePasses = 2;
constexpr double kTouching = 1e-6;  // of the spacing: no deeper in its obstacle than this, a voxel lies on it

}  // namespace

ChainMail::ChainMail(const Lattice& lattice)
    : lattice_(lattice), mark_(lattice.size(), untouched), ring_(lattice.voxel_count() + 1) {
  touched_.reserve(lattice.voxel_count());
  moved_.reserve(lattice.voxel_count());
  pulled_.reserve(lattice.anchored_count());
  stopped_.reserve(lattice.surface().size());
  stops_.reserve(lattice.surface().size());
}

void ChainMail::enqueue(VoxelId v) noexcept {
  if ((mark_[v] & queued) != 0) return;
  mark_[v] |= queued;
  ring_[tail_] = v;
  tail_ = tail_ + 1 == ring_.size() ? 0 : tail_ + 1;
}

void ChainMail::note_moved(VoxelId v) noexcept {
  if (mark_[v] == untouched) touched_.push_back(v);
  if ((mark_[v] & listed) != 0) return;
  mark_[v] |= listed;
  moved_.push_back(v);
}

void ChainMail::note_pulled(VoxelId anchor) noexcept {
  if (mark_[anchor] == untouched) touched_.push_back(anchor);
  if ((mark_[anchor] & pulled) != 0) return;
  mark_[anchor] |= pulled;
  pulled_.push_back(anchor);
}

// The link says low <= u(to) − u(from) <= high, and `from` has just moved: raised, it can only have broken
// the lower bound of `to`, lowered only the upper one; a fixed one, either.
void ChainMail::visit(Displacement& state, int axis, VoxelId from, VoxelId to, float low,
                      float high) noexcept {
  ++candidates_;
  auto& u = state.u[static_cast<std::size_t>(axis)];
  const bool up = (mark_[from] & (raised | fixed)) != 0 && u[to] < u[from] + low;
  const bool down = (mark_[from] & (lowered | fixed)) != 0 && u[to] > u[from] + high;
  if (!up && !down) return;
  if (lattice_.anchored(to)) {
    note_pulled(to);
    return;
  }
  if (down && (mark_[to] & raised) != 0 && (mark_[from] & fixed) == 0) {
    // Asked to go both ways: sources that are not mutually feasible. What was raised stays, and pushes back.
    // A voxel changes from lowered to raised once at most, so this ends.
    enqueue(to);
    return;
  }
  note_moved(to);
  u[to] = up ? u[from] + low : u[from] + high;
  // Both marks, where it went both ways: what it broke on its way down is looked at although it was raised
  // since.
  mark_[to] |= up ? raised : lowered;
  enqueue(to);
}

void ChainMail::spread(Displacement& state, int axis) noexcept {
  while (head_ != tail_) {
    const VoxelId v = ring_[head_];
    head_ = head_ + 1 == ring_.size() ? 0 : head_ + 1;
    mark_[v] &= static_cast<std::uint8_t>(~queued);
    for (int d = 0; d < 3; ++d) {
      const auto step = static_cast<VoxelId>(lattice_.stride(d));
      if (lattice_.filled(v + step)) {
        const auto b = lattice_.bounds(v, d, axis);
        visit(state, axis, v, v + step, b[0], b[1]);
      }
      if (lattice_.filled(v - step)) {
        const auto b = lattice_.bounds(v - step, d, axis);
        visit(state, axis, v, v - step, -b[1], -b[0]);
      }
    }
  }
}

void ChainMail::begin_axis() noexcept {
  head_ = tail_ = 0;
  for (const VoxelId v : touched_) mark_[v] &= listed | pulled;
}

void ChainMail::spread_moves(Displacement& state, std::span<const VoxelId> voxels,
                             std::span<const glm::vec3> moves) noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    begin_axis();
    for (std::size_t i = 0; i < voxels.size(); ++i) {
      // Not fixed: another one may push it further the way it went.
      const float move = moves[i][axis];
      if (move == 0.0F) continue;
      mark_[voxels[i]] |= move > 0.0F ? raised : lowered;
      enqueue(voxels[i]);
    }
    spread(state, axis);
  }
}

// What went into its obstacle is put back onto the surface. True when any was.
bool ChainMail::stop_at(Displacement& state, std::span<const Obstacle> obstacles,
                        std::span<const std::uint32_t> surface_number) noexcept {
  stopped_.clear();
  stops_.clear();
  const double touching = kTouching * lattice_.min_spacing_m();
  for (const VoxelId v : moved_) {
    if (state.role[v] != Displacement::obstacle) continue;
    const Obstacle& o = obstacles[surface_number[v]];
    const glm::dvec3 n(o.normal), before = state.at(v);
    const double depth = static_cast<double>(o.bound) - glm::dot(n, before);
    if (depth <= touching) continue;
    state.set(v, before + depth * n);
    stopped_.push_back(v);
    stops_.emplace_back(state.at(v) - before);
  }
  return !stopped_.empty();
}

void ChainMail::settle(Displacement& state, std::span<const VoxelId> sources,
                       std::span<const glm::vec3> moves, std::span<const Obstacle> obstacles,
                       std::span<const std::uint32_t> surface_number) noexcept {
  moved_.clear();
  touched_.clear();
  pulled_.clear();
  candidates_ = 0;
  for (const VoxelId v : sources) note_moved(v);

  // The sources move what hangs on them; anchors stay, and are remembered where they were pulled.
  spread_moves(state, sources, moves);

  // What the wave pushed into bone is stopped at its surface, and the tool's voxels give way. At rest
  // everything is clear, so along an axis what is stopped never meets another obstacle; one oblique to the
  // lattice moves its voxel on axes where it was in nobody's way, and may need to be asked again.
  for (int n = 0; n < kObstaclePasses && !obstacles.empty(); ++n) {
    if (!stop_at(state, obstacles, surface_number)) break;
    spread_moves(state, stopped_, stops_);
  }

  // What was pulled and may not move is now the source, and everything gives way. Anchors are mutually
  // feasible, so this leaves no link violated.
  for (int axis = 0; axis < 3 && !pulled_.empty(); ++axis) {
    begin_axis();
    for (const VoxelId v : pulled_) {
      mark_[v] |= fixed;
      enqueue(v);
    }
    spread(state, axis);
  }
  for (const VoxelId v : touched_) mark_[v] = untouched;
}

std::size_t ChainMail::memory_bytes() const {
  return mark_.size() +
         (ring_.size() + touched_.capacity() + moved_.capacity() + pulled_.capacity() + stopped_.capacity()) *
             sizeof(VoxelId) +
         stops_.capacity() * sizeof(glm::vec3);
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
        worst =
            std::max({worst, difference - static_cast<double>(b[1]), static_cast<double>(b[0]) - difference});
      }
    }
  }
  return worst;
}

}  // namespace voxel
