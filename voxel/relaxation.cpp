// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/relaxation.h"

#include <algorithm>
#include <cmath>

namespace voxel {
namespace {

constexpr int kCoarsestSweeps = 8;
constexpr int kContactSweeps = 4;         // of the coarsest level of a cycle round a contact, apart
constexpr std::uint64_t kLetGoEvery = 8;  // rounds
constexpr int kPatience = 40;             // cycles without gain before an object counts as resting
constexpr double kWorse = 1.05;
constexpr float kHarder = 8.0F, kSofter = 0.97F, kHardest = 1e4F;
// A residual is what a cycle finds before its coarse levels correct it: round what is a hundred times stiffer
// more than that can be left afterwards. (Another sweep where links differ left less, but some tissue at its
// limits, or hanging by little, did not come to rest with it.)
constexpr double kMeasured = 0.5;
constexpr double kGain = 0.98;      // of the least residual so far: less is a gain
constexpr double kNearRest = 10.0;  // times the tolerance: what limits hold moves together from here on
constexpr double kProgress = 1e-3;  // of the spacing: clusters that move further are on their way
// … and where links have next to no slack, those that all went this much further than ever in a round; not
// between surfaces, where what is squeezed would be on its way for long. (Taken for what their steps free of
// energy, it was for ever.)
constexpr double kDrift = 2e-5;
// Spacings that a coarse cell may have to tell. Between a body and a plate cells ran away to 1e30 m in ten
// ticks; with ten spacings, or four, some went on running to and fro when the body had left.
constexpr float kFarthest = 2.0F;
constexpr std::uint64_t kNextFirst = 7919;  // of these voxels is looked at first in the next round
// Levels of a cycle round a contact where another relaxes the object: what is further away is his. (With all
// of them both moved the coarsest cells, and a brain held for a minute wavered by a tenth of its force. With
// four, or as many as reach three radii of the contact, the force on the way into organs was 4 to 25 %
// higher.)
constexpr int kContactLevels = 5;
constexpr int kNear = 2;           // rows that a cycle round a contact reads beyond those it brings to rest
constexpr int kContactMargin = 3;  // cells round the contact that are smoothed, on each level
constexpr std::uint64_t kBesideContact = 2;  // this part of the budget is left beside cycles round a contact
// Loads of bricks: what a row of them takes, in voxel updates, and what part of a budget they may have.
constexpr std::uint64_t kBrickUpdates = 4 * kRow, kBrickShare = 2;
constexpr int kTileMargin = 3;     // … round a tile, from level 1 on
constexpr int kLooksAtOnce = 256;  // tiles looked at for what coarse levels have to tell them, a call

}  // namespace

Relaxation::Relaxation(const Lattice& lattice) : lattice_(lattice), multigrid_(lattice), clusters_(lattice) {
  set_tolerance(kMeasured * kRestingResidual * lattice.force_scale_N());
  farthest_m_ = kFarthest * static_cast<float>(lattice.max_spacing_m());
  boxes_.resize(static_cast<std::size_t>(multigrid_.levels()));
  standing_.reserve(lattice.surface().size());
}

void Relaxation::set_tolerance(double tolerance_N) noexcept {
  tolerance_N_ = tolerance_N;
  // A motion below this changes no force by more than the tolerance.
  const double scale = lattice_.force_scale_N();
  multigrid_.set_quiet(
      static_cast<float>(tolerance_N),
      scale > 0.0 ? static_cast<float>(tolerance_N / scale * lattice_.min_spacing_m()) : 0.0F);
}

void Relaxation::copy_from(const Relaxation& other) noexcept {
  multigrid_.copy_from(other.multigrid_);
  set_tolerance(other.tolerance_N_);
  unkept_ = other.unkept_;
  wake();
}

void Relaxation::renew_coarse(Displacement& state, const ObstacleView& obstacles) noexcept {
  const auto& dims = lattice_.grid().dims;
  lay_boxes({0, 0, 0}, {dims[0] - 1, dims[1] - 1, dims[2] - 1}, 0);
  stir_all();
  for (int l = 1; l < multigrid_.levels(); ++l) {
    for_rows(l, boxes(l).parents,
             [&](RowId row, OctetSpan span, int, int) { multigrid_.restrict_values(l, row, state, span); });
    for_rows(l, boxes(l).parents, [&](RowId row, OctetSpan span, int, int) {
      multigrid_.restrict_loads(l, row, state, obstacles, span);
    });
  }
}

void Relaxation::leave_to_another() {
  apart_ = true;
  multigrid_.forget_coarse();
  multigrid_.keep_log();
}

void Relaxation::give_away(Displacement& state, const ObstacleView& obstacles) noexcept {
  asleep_ = away_ = true;
  multigrid_.begin_anew();
  const Grid& g = lattice_.grid();
  for (int c = near_.first[0]; c <= near_.last[0]; ++c) {
    for (int k = near_.first[2]; k <= near_.last[2]; ++k) {
      for (int j = near_.first[1]; j <= near_.last[1]; ++j)
        multigrid_.balance(g.row(c, j, k), state, obstacles);
    }
  }
}

void Relaxation::stir_all() noexcept {
  for (RowId row = 0; row < lattice_.grid().rows(); ++row) {
    if (lattice_.filled_in(row) != 0) multigrid_.stir(0, row);
  }
}

// What the tool presses slides, and is held by where it does; see Multigrid.
void Relaxation::hold_what_stands(const Displacement& state, std::span<const VoxelId> held) noexcept {
  standing_.clear();
  for (const VoxelId v : held) {
    if (state.role[v] == Displacement::held && standing_.size() < standing_.capacity())
      standing_.push_back(v);
  }
  multigrid_.set_held(standing_);
}

std::uint64_t Relaxation::run(Displacement& state, const ObstacleView& obstacles,
                              std::span<const VoxelId> held, std::uint64_t budget) noexcept {
  if (asleep_) return 0;
  hold_what_stands(state, held);
  TileQueue& tiles = multigrid_.tiles();
  std::uint64_t spent = 0;
  credit_ += static_cast<std::int64_t>(contact_relaxed_ ? budget / kBesideContact : budget);
  contact_relaxed_ = false;
  const auto spend = [&](std::uint64_t updates) {
    credit_ -= static_cast<std::int64_t>(updates);
    spent += updates;
  };
  spend(kBrickUpdates * multigrid_.renew_bricks(state, 1 + budget / (kBrickShare * kBrickUpdates)));
  while (!asleep_ && credit_ > 0) {
    if (keeping_) {
      spend(keep_yielded(state, static_cast<std::uint64_t>(credit_)));
      continue;
    }
    if (round_left_ == 0) round_left_ = tiles.waiting();
    if (tiles.waiting() > 0) {
      looked_at_ = 0;
      spend(relax_tile(state, obstacles, tiles.pop()));
      if (round_left_ > 0 && --round_left_ == 0) end_round(state, obstacles, running_residual_N_);
      continue;
    }
    // Nothing was stirred: what coarse levels know may still have to be told somewhere.
    for (int n = 0; n < kLooksAtOnce && looked_at_ < tiles.tiles() && tiles.waiting() == 0;
         ++n, ++looked_at_) {
      if (tile_waits_for_coarse(cursor_)) tiles.push(cursor_);
      cursor_ = (cursor_ + 1) % tiles.tiles();
    }
    spend(kLooksAtOnce * 4);
    if (looked_at_ >= tiles.tiles() && tiles.waiting() == 0) {
      looked_at_ = 0;
      running_residual_N_ = 0.0;
      end_round(state, obstacles, std::min(residual_N_, 0.99 * tolerance_N_));
    }
  }
  // What was not needed is not saved up for a tick that has enough to do.
  credit_ = std::min<std::int64_t>(credit_, 0);
  return spent;
}

void Relaxation::run_cycle(Displacement& state, const ObstacleView& obstacles,
                           std::span<const VoxelId> held) noexcept {
  if (asleep_) return;
  if (keeping_) {
    while (keeping_) keep_yielded(state, ~std::uint64_t{0});
    return;
  }
  hold_what_stands(state, held);
  multigrid_.renew_bricks(state, multigrid_.grid(0).rows());
  multigrid_.tiles().clear();
  round_left_ = 0;
  running_residual_N_ = 0.0;
  const auto& dims = lattice_.grid().dims;
  lay_boxes({0, 0, 0}, {dims[0] - 1, dims[1] - 1, dims[2] - 1}, 0);
  cycle(state, obstacles, Look::active, false);
  end_round(state, obstacles, running_residual_N_);
}

std::size_t Relaxation::relax_contact(Displacement& state, const ObstacleView& obstacles,
                                      std::span<const VoxelId> held, std::span<const VoxelId> pressed,
                                      bool again) noexcept {
  contact_relaxed_ = true;
  hold_what_stands(state, held);
  std::array<int, 3> low = lattice_.coordinates(pressed.front()), high = low;
  for (const VoxelId v : pressed) {
    const auto c = lattice_.coordinates(v);
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], c[d]);
      high[d] = std::max(high[d], c[d]);
    }
  }
  for (std::size_t d = 0; d < 3; ++d) {
    const int beyond = high[d] - low[d] - kMaxNear;
    if (beyond <= 0) continue;
    low[d] += beyond / 2;
    high[d] = low[d] + kMaxNear;
  }
  const int wide = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  lay_boxes(low, high, wide);
  const RowBox& b = boxes(0).smoothed;
  const Grid& g = lattice_.grid();
  near_.first = {b.q0 / kOctets + 1, std::max(b.j0 - kNear, 0), std::max(b.k0 - kNear, 0)};
  near_.last = {b.q1 / kOctets + 1, std::min(b.j1 + kNear, g.dims[1] - 1),
                std::min(b.k1 + kNear, g.dims[2] - 1)};
  cycle(state, obstacles, Look::all, apart_ && again);
  return octets_of_cycle();
}

// Smoothed, passed on and told; what of the boxes is empty counts too.
std::size_t Relaxation::octets_of_cycle() const noexcept {
  const auto octets = [](const RowBox& b) {
    return static_cast<std::size_t>(b.q1 - b.q0 + 1) * static_cast<std::size_t>(b.j1 - b.j0 + 1) *
           static_cast<std::size_t>(b.k1 - b.k0 + 1);
  };
  std::size_t sum = 0;
  for (int l = 0; l <= last_level(); ++l) {
    const LevelBoxes& b = boxes_[static_cast<std::size_t>(l)];
    sum += 2 * octets(b.smoothed) + (l < last_level() ? octets(b.told) : 0);
  }
  return sum;
}

std::uint64_t Relaxation::relax_tile(Displacement& state, const ObstacleView& obstacles,
                                     std::size_t number) noexcept {
  const TileQueue::Tile t = multigrid_.tiles().tile(number);
  constexpr int kSide = TileQueue::kSide;
  lay_boxes({t.column * kRow, t.j * kSide, t.k * kSide},
            {(t.column + 1) * kRow - 1, (t.j + 1) * kSide - 1, (t.k + 1) * kSide - 1}, -1);
  cycle(state, obstacles, Look::all, false);
  std::uint64_t updates = 0;
  for (const LevelBoxes& b : boxes_) {
    updates += static_cast<std::uint64_t>(b.smoothed.q1 - b.smoothed.q0 + 1) * kOctet *
               static_cast<std::uint64_t>(b.smoothed.j1 - b.smoothed.j0 + 1) *
               static_cast<std::uint64_t>(b.smoothed.k1 - b.smoothed.k0 + 1);
  }
  return 2 * updates;
}

// What limits held in this round moves with what it pulls on; returns the largest force a voxel that did (N).
// Which voxel is first goes round, so that all have their turn however few a round has time for.
double Relaxation::move_clusters(Displacement& state, const ObstacleView& obstacles) noexcept {
  clusters_.begin();
  std::uint64_t count = 0;
  multigrid_.for_limited([&count](VoxelId, int) { ++count; });
  if (count == 0) return 0.0;
  const std::uint64_t first = cycles_ * kNextFirst % count;
  double most_N = 0.0;
  std::array<double, 3> went{};
  int moves = 0;
  for (const bool before : {false, true}) {
    std::uint64_t n = 0;
    multigrid_.for_limited([&](VoxelId v, int axis) {
      if ((n++ < first) != before) return;
      const float from = state.u[static_cast<std::size_t>(axis)][v];
      const double force = clusters_.move(multigrid_.couplings(), state, v, axis, 0.5 * tolerance_N_);
      if (force == 0.0) return;
      most_N = std::max(most_N, force);
      // Every such step lowers the energy, though it may be far from limit to limit to where the force falls.
      const auto way = static_cast<double>(state.u[static_cast<std::size_t>(axis)][v] - from);
      went[static_cast<std::size_t>(axis)] += way;
      ++moves;
      if (std::fabs(way) > kProgress * lattice_.min_spacing_m())
        cycles_without_gain_ = std::min(cycles_without_gain_, kPatience / 2 + 1);
      for (const VoxelId w : clusters_.moved()) multigrid_.stir(0, w / kRow);
    });
  }
  for (std::size_t axis = 0; axis < 3 && moves > 0 && obstacles.obstacles.empty(); ++axis) {
    drift_m_[axis] += went[axis] / moves;
    const double further = std::fabs(drift_m_[axis]) - furthest_m_[axis];
    if (further <= 0.0) continue;
    furthest_m_[axis] += further;
    if (further > kDrift * lattice_.min_spacing_m())
      cycles_without_gain_ = std::min(cycles_without_gain_, kPatience / 2 + 1);
  }
  credit_ -= static_cast<std::int64_t>(clusters_.looked_at());
  return most_N;
}

// A round has looked at all that moves: is it at rest?
void Relaxation::end_round(Displacement& state, const ObstacleView& obstacles, double residual_N) noexcept {
  residual_N = std::max(residual_N, static_cast<double>(multigrid_.bricks().left_N()));
  // Only when nothing else moves any more: between other corrections they would undo one another (energy grew
  // 1.9 times within a cycle).
  if (residual_N < kNearRest * tolerance_N_ || cycles_without_gain_ > kPatience / 2)
    residual_N = std::max(residual_N, move_clusters(state, obstacles));
  // While rounds gain nothing, what limits hold stays held for a few of them: let go of in every round, two
  // sets of voxels can take turns for ever.
  if (cycles_without_gain_ <= 1 || cycles_ % kLetGoEvery == 0) multigrid_.release_limited();
  // Scattered voxels hold a cell harder than a patch of them does. A cycle that ends worse than it began says
  // so.
  if (residual_N > kWorse * residual_N_ && cycles_without_gain_ > 0) {
    hold_ = std::min(hold_ * kHarder, kHardest);
  } else {
    hold_ = std::max(1.0F, hold_ * kSofter);
  }
  multigrid_.set_hold(hold_);
  residual_N_ = residual_N;
  running_residual_N_ = 0.0;
  ++cycles_;
  if (cycles_without_gain_ == 0 || residual_N_ < kGain * least_residual_N_) {
    least_residual_N_ = residual_N_;
    cycles_without_gain_ = 0;
  }
  ++cycles_without_gain_;
  const bool at_rest =
      (residual_N_ < tolerance_N_ && multigrid_.bricks().round_ended()) || cycles_without_gain_ > kPatience;
  if (!at_rest) return;
  // What yielded is kept at rest, and then there is a new rest to be found.
  if (unkept_) {
    keeping_ = true;
    unkept_ = false;
    keep_row_ = 0;
    return;
  }
  if (multigrid_.tiles().waiting() > 0 && cycles_without_gain_ <= kPatience) return;
  multigrid_.tiles().clear();
  asleep_ = true;
}

std::uint64_t Relaxation::keep_yielded(Displacement& state, std::uint64_t budget) noexcept {
  std::uint64_t spent = 0;
  const auto rows = static_cast<RowId>(lattice_.grid().rows());
  for (; keep_row_ < rows && spent < budget; ++keep_row_, ++spent) {
    if (state.rest.row[keep_row_] == 0 || !multigrid_.prepare(0, keep_row_)) continue;
    multigrid_.yield(keep_row_, state, true);
    spent += kRow;
  }
  keeping_ = keep_row_ < rows;
  return spent;
}

// Have the cells above a tile anything to tell it?
bool Relaxation::tile_waits_for_coarse(std::size_t number) const noexcept {
  constexpr int kSide = TileQueue::kSide;
  const TileQueue::Tile t = multigrid_.tiles().tile(number);
  for (int level = 1; level < multigrid_.levels(); ++level) {
    const Grid& g = multigrid_.grid(level);
    const int column = (t.column >> level) + 1, rows = std::max(1, kSide >> level);
    const int j0 = t.j * kSide >> level, k0 = t.k * kSide >> level;
    for (int k = k0; k < std::min(k0 + rows, g.dims[2]); ++k) {
      for (int j = j0; j < std::min(j0 + rows, g.dims[1]); ++j) {
        const RowId row = g.row(column, j, k);
        if (multigrid_.has(level, row, Multigrid::changed) &&
            multigrid_.untold(level, row) > multigrid_.quiet_m())
          return true;
      }
    }
  }
  return false;
}

// Was anything that a coarse row holds moved since it was passed on?
bool Relaxation::restrict_due(int level, RowId row) const noexcept {
  for (int child = 0; child < 8; ++child) {
    if (multigrid_.has(level - 1, multigrid_.row_below(level, row, child), Multigrid::dirty)) return true;
  }
  return false;
}

int Relaxation::last_level() const noexcept {
  return std::min(multigrid_.levels(), apart_ ? kContactLevels : multigrid_.levels()) - 1;
}

template <class Visit>
void Relaxation::for_rows(int level, const RowBox& box, const Visit& visit) noexcept {
  const Grid& g = multigrid_.grid(level);
  for (int c = box.q0 / kOctets; c <= box.q1 / kOctets && box.q0 <= box.q1; ++c) {
    const OctetSpan span{std::max(box.q0 - c * kOctets, 0), std::min(box.q1 - c * kOctets, kOctets - 1)};
    for (int k = box.k0; k <= box.k1; ++k) {
      for (int j = box.j0; j <= box.j1; ++j) {
        const RowId row = g.row(c + 1, j, k);
        if (multigrid_.prepare(level, row)) visit(row, span, j, k);
      }
    }
  }
}

Relaxation::RowBox Relaxation::clipped(int level, const RowBox& b) const noexcept {
  const Grid& g = multigrid_.grid(level);
  return {std::max(b.q0, 0), std::min(b.q1, (g.columns - 2) * kOctets - 1),
          std::max(b.j0, 0), std::min(b.j1, g.dims[1] - 1),
          std::max(b.k0, 0), std::min(b.k1, g.dims[2] - 1)};
}

// The boxes of a cycle that is to bring voxels low … high to rest: on each level so many cells more on every
// side as the way that a force at the middle is felt, in cells; `wide` is how wide the contact is, or
// negative where there is none and the voxels themselves are enough.
void Relaxation::lay_boxes(const std::array<int, 3>& low, const std::array<int, 3>& high, int wide) noexcept {
  const int last = multigrid_.levels() - 1;
  for (int l = 0; l <= last; ++l) {
    const int margin = wide >= 0 ? kContactMargin + (wide >> l) / 4 : l == 0 ? 0 : kTileMargin;
    std::array<int, 3> from{}, to{};
    for (std::size_t d = 0; d < 3; ++d) {
      from[d] = std::max(0, (low[d] >> l) - margin);
      to[d] = std::min(multigrid_.grid(l).dims[d] - 1, (high[d] >> l) + margin);
    }
    // Whole cells of the next level, so that each of them is passed on once all it holds is smooth.
    RowBox& s = boxes(l).smoothed;
    s = clipped(
        l, {(from[0] / kOctet) & ~1, (to[0] / kOctet) | 1, from[1] & ~1, to[1] | 1, from[2] & ~1, to[2] | 1});
    if (l == last) break;
    const RowBox p{s.q0 / 2, s.q1 / 2, s.j0 / 2, s.j1 / 2, s.k0 / 2, s.k1 / 2};
    boxes(l + 1).parents = p;
    // They and the cells beside them tell all they hold what they know, and the voxels beside those their
    // part of it. Along x one cell more is enough; voxels come by the vector there.
    boxes(l + 1).tellers = clipped(l + 1, {p.q0 - 1, p.q1 + 1, p.j0 - 1, p.j1 + 1, p.k0 - 1, p.k1 + 1});
    const RowBox& t = boxes(l + 1).tellers;
    boxes(l + 1).first_teller = std::max(p.q0 * kOctet - 1, 0);
    boxes(l + 1).last_teller = p.q1 * kOctet + kOctet;
    boxes(l).told =
        clipped(l, {2 * p.q0 - 2, 2 * p.q1 + 3, 2 * t.j0 - 1, 2 * t.j1 + 2, 2 * t.k0 - 1, 2 * t.k1 + 2});
  }
}

// Rows of one colour, so that no two that are beside one another are of the same.
void Relaxation::smooth_box(int level, int colour, Displacement& state, const ObstacleView& obstacles,
                            Look look) noexcept {
  for_rows(level, boxes(level).smoothed, [&](RowId row, OctetSpan span, int j, int k) {
    if (((j + k + colour) & 1) != 0) return;
    if (look == Look::active && !multigrid_.has(level, row, Multigrid::active)) return;
    multigrid_.smooth(level, row, state, obstacles, span);
  });
}

// Tells the rows of a level what the next coarser one knows, within the boxes: cells in the box and beside
// it. Those beside it go along, however little they have to tell: nobody brings what they hold to rest, but
// the box would feel it if they stayed behind, four times as much on each coarser level. (Letting those with
// less than 2e-4 spacings to tell wait was rejected: energy grew without end where tissue hangs by little.)
void Relaxation::tell_box(int level, Displacement& state, const ObstacleView& obstacles) noexcept {
  const LevelBoxes& b = boxes(level + 1);
  bool any = false;
  for_rows(level + 1, b.tellers, [&](RowId row, OctetSpan span, int, int) {
    if (!multigrid_.has(level + 1, row, Multigrid::changed)) return;
    const int origin = (multigrid_.grid(level + 1).row_coordinates(row)[0] - 1) * kRow;
    const float most =
        multigrid_.untold(level + 1, row, span, b.first_teller - origin, b.last_teller - origin);
    if (most <= multigrid_.passed_on_m()) return;
    // Where links at their limits hold tissue between obstacles, coarse cells can run away.
    if (!(most <= farthest_m_)) {
      multigrid_.forget_untold(level + 1, row, state, obstacles);
      return;
    }
    multigrid_.mark(level + 1, row, Multigrid::telling);
    any = true;
  });
  if (!any) return;
  const RowBox& t = boxes(level).told;
  multigrid_.tell(level, {t.q0, t.q1, t.j0, t.j1, t.k0, t.k1, b.first_teller, b.last_teller}, state,
                  obstacles);
}

void Relaxation::cycle(Displacement& state, const ObstacleView& obstacles, Look look,
                       bool smoothed) noexcept {
  const int last = last_level();
  // What coarse levels know and finer ones do not is told first: a step between voxels that were told and
  // others that were not would look like a force to the cells above it.
  for (int l = last - 1; l >= 0; --l) tell_box(l, state, obstacles);
  for (int l = 0; l < last; ++l) {
    if (!smoothed) {
      for (const int colour : {0, 1}) smooth_box(l, colour, state, obstacles, look);
    }
    // Before forces are summed, so that what is called the residual is that of links that yield.
    if (l == 0 && lattice_.yields()) {
      for_rows(0, boxes(0).smoothed, [&](RowId row, OctetSpan, int, int) {
        if (look == Look::all || multigrid_.has(0, row, Multigrid::active | Multigrid::dirty))
          unkept_ = multigrid_.yield(row, state, false) || unkept_;
      });
    }
    const RowBox& parents = boxes(l + 1).parents;
    const Grid& g = multigrid_.grid(l + 1);
    for_rows(l + 1, parents, [&](RowId row, OctetSpan span, int, int) {
      if (look == Look::active) {
        if (!restrict_due(l + 1, row)) return;
        // The load holds a row where it is beside its neighbours where they are.
        for (const RowId r :
             {row, row - 1, row + 1, row - g.row_z, row + g.row_z, row - g.row_x, row + g.row_x})
          multigrid_.mark(l + 1, r, Multigrid::renewed);
      }
      // Apart, coarse cells hold only what was moved since all was balanced, and know that from themselves.
      if (!apart_) multigrid_.restrict_values(l + 1, row, state, span);
    });
    for_rows(l + 1, parents, [&](RowId row, OctetSpan span, int, int) {
      if (look == Look::active) {
        if (!multigrid_.has(l + 1, row, Multigrid::renewed)) return;
        multigrid_.unmark(l + 1, row, Multigrid::renewed);
      }
      const float worst = multigrid_.restrict_loads(l + 1, row, state, obstacles, span);
      if (l == 0) running_residual_N_ = std::max(running_residual_N_, static_cast<double>(worst));
    });
    if (l == 0) multigrid_.renew_holds();
  }
  const int sweeps = apart_ ? kContactSweeps : kCoarsestSweeps;
  for (int n = 0; n < 2 * sweeps; ++n) smooth_box(last, n & 1, state, obstacles, look);
  for (int l = last - 1; l >= 0; --l) {
    tell_box(l, state, obstacles);
    for (const int colour : {1, 0}) smooth_box(l, colour, state, obstacles, look);
  }
}

std::size_t Relaxation::memory_bytes() const {
  return multigrid_.memory_bytes() + clusters_.memory_bytes() + boxes_.capacity() * sizeof(LevelBoxes) +
         standing_.capacity() * sizeof(VoxelId);
}

}  // namespace voxel
