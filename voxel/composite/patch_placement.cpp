// SPDX-License-Identifier: GPL-3.0-or-later
// Where the boxes of a composite grid are. To lay one costs a tenth of a tick's work and more, so they are
// laid one a tick: ahead of a contact, while the tool comes near, and one after another as a contact moves.
#include <algorithm>
#include <cstdlib>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

constexpr int kMoves = 2;      // voxels that a contact goes before boxes follow it
constexpr int kOffCentre = 4;  // of the finest box, from the contact: further, and all move at once

}  // namespace

bool CompositeGrid::in_place(std::size_t l) const noexcept {
  const Level& level = levels_[l];
  if (!level.laid) return false;
  for (std::size_t d = 0; d < 3; ++d) {
    const Span wanted = span_of(l, d, shifted(centre_)[d]);
    if (wanted.low != level.line[d].begin || wanted.count(level.step) != level.line[d].count) return false;
  }
  return true;
}

// Does the next coarser box, as it is, have unknowns all round this one?
bool CompositeGrid::nested(std::size_t l) const noexcept {
  const Level &fine = levels_[l], &coarse = levels_[l + 1];
  for (std::size_t d = 0; d < 3; ++d) {
    const Line &in = fine.line[d], &out = coarse.line[d];
    if (in.open_low && out.open_low && in.begin < out.begin + coarse.step) return false;
    if (in.open_high && out.open_high && fine.at(d, in.count - 1) > coarse.at(d, out.count - 1) - coarse.step)
      return false;
  }
  return true;
}

bool CompositeGrid::off_centre(const Place& centre) const noexcept {
  const auto& line = levels_[0].line;
  const Place at = shifted(centre);
  for (std::size_t d = 0; d < 3; ++d) {
    const int low = at[d] - line[d].begin, high = levels_[0].at(d, line[d].count - 1) - at[d];
    if (line[d].open_low && low < half_width_ - kOffCentre) return true;
    if (line[d].open_high && high < half_width_ - kOffCentre) return true;
  }
  return false;
}

// Of a grid at rest.
void CompositeGrid::lay_anew(std::size_t l) noexcept {
  Level& level = levels_[l];
  lay_lines(level, l, shifted(centre_));
  lay(level);
  level.laid = true;
  if (l + 1 < levels_.size()) join(level, levels_[l + 1]);
  if (l > 0) join(levels_[l - 1], level);
}

void CompositeGrid::put_to_rest(Level& level) noexcept {
  for (auto* arrays : {&level.u, &level.held}) {
    for (Floats& axis : *arrays) std::fill(axis.begin(), axis.end(), 0.0F);
  }
  level.bounded = {};
  level.moved = false;
}

void CompositeGrid::aim_at(const Place& centre) noexcept {
  centre_ = centre;
  if (!cells_.align_to(centre)) return;
  for (Level& level : levels_) level.laid = false;
}

void CompositeGrid::prepare(const Place& centre) noexcept {
  bool moves = false;
  for (std::size_t d = 0; d < 3; ++d) moves = moves || std::abs(centre[d] - centre_[d]) >= kMoves;
  if (moves) aim_at(centre);
  let_go_of_links();
  for (Level& level : levels_) {
    if (!level.moved) continue;
    put_to_rest(level);
    break;
  }
  for (std::size_t l = levels_.size(); l-- > 0;) {
    if (in_place(l)) continue;
    lay_anew(l);
    break;
  }
}

void CompositeGrid::begin(const Place& centre) noexcept {
  bool ready = !off_centre(centre);
  for (std::size_t l = 0; l < levels_.size(); ++l)
    ready = ready && levels_[l].laid && (l == whole_ || l + 1 == levels_.size() || nested(l));
  if (!ready) {
    aim_at(centre);
    for (std::size_t l = levels_.size(); l-- > 0;) {
      if (!in_place(l)) lay_anew(l);
    }
  }
  let_go_of_links();
  for (Level& level : levels_) {
    if (level.moved) put_to_rest(level);
    level.moved = true;
  }
  pressed_.clear();
}

bool CompositeGrid::centre_on(const Place& centre) noexcept {
  if (whole_ == 0) return false;
  bool moves = false;
  for (std::size_t d = 0; d < 3; ++d) moves = moves || std::abs(centre[d] - centre_[d]) >= kMoves;
  if (moves) centre_ = centre;
  // The coarsest that is due, and with it those that it would hold no more.
  const bool all = off_centre(centre);
  bool any = false, joins = false;
  for (std::size_t l = whole_; l-- > 0;) {
    const bool due = (!any || all || !nested(l)) && !in_place(l);
    if (due) move(l);
    if (due || joins) join(levels_[l], levels_[l + 1]);
    any = any || due;
    joins = due;
  }
  return joins;
}

// A box goes on: what is new in it is interpolated.
void CompositeGrid::move(std::size_t l) noexcept {
  box_moved_ = true;
  Level& level = levels_[l];
  before_.line = level.line;  // assigned element by element: the same sizes, nothing is allocated
  before_.step = level.step;
  before_.stride = level.stride;
  before_.plane = level.plane;
  keep_limits(level);
  lay_lines(level, l, shifted(centre_));
  const std::size_t floats = before_.first_row() + before_.floats() + kPad;
  for (std::size_t a = 0; a < 3; ++a) {
    std::copy_n(level.u[a].begin(), floats, before_.u[a].begin());
    std::copy_n(level.held[a].begin(), floats, before_.held[a].begin());
    std::fill(level.u[a].begin(), level.u[a].end(), 0.0F);
    std::fill(level.held[a].begin(), level.held[a].end(), 0.0F);
  }
  const auto& line = level.line;
  Place by{};
  for (std::size_t d = 0; d < 3; ++d) by[d] = (line[d].begin - before_.line[d].begin) / level.step;
  for (int k = 0; k < line[2].count; ++k) {
    for (int j = 0; j < line[1].count; ++j) {
      for (int i = 0; i < line[0].count; ++i) {
        const Place was{i + by[0], j + by[1], k + by[2]};
        bool known = true;
        for (std::size_t d = 0; d < 3; ++d) known = known && was[d] >= 0 && was[d] < before_.line[d].count;
        const std::size_t to = level.node(i, j, k);
        if (known) {
          const std::size_t from = before_.node(was[0], was[1], was[2]);
          for (std::size_t a = 0; a < 3; ++a) {
            level.u[a][to] = before_.u[a][from];
            level.held[a][to] = before_.held[a][from];
          }
          continue;
        }
        const glm::dvec3 u = interpolate(
            levels_[l + 1], {static_cast<double>(level.at(0, i)), static_cast<double>(level.at(1, j)),
                             static_cast<double>(level.at(2, k))});
        for (std::size_t a = 0; a < 3; ++a) level.u[a][to] = static_cast<float>(u[static_cast<int>(a)]);
      }
    }
  }
  lay(level);
  take_limits(level, by);
}

}  // namespace voxel
