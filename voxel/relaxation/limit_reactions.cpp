// SPDX-License-Identifier: GPL-3.0-or-later
// Search for dependents by rows, and the sums over them.
#include "voxel/relaxation/limit_reactions.h"

#include <algorithm>
#include <bit>
#include <bitset>

#include "voxel/lattice/near_limit.h"
#include "voxel/multigrid/fas.h"

namespace voxel {
namespace {

// A voxel whose links are all further from their limits than this has no dependents (unit: spacing).
constexpr float kSurelyFree = 2e-4F;

// Sum over the lanes whose bits are set.
double sum_of(const float* lanes, std::uint32_t bits) {
  double sum = 0.0;
  for (; bits != 0; bits &= bits - 1U) sum += static_cast<double>(lanes[std::countr_zero(bits)]);
  return sum;
}

}  // namespace

struct LimitReactions::Gathering {
  LevelStiffness& couplings;
  std::span<const VoxelId> sources;  // sorted
  const Multigrid* multigrid;        // null: there are no rigid blocks
  std::uint16_t source_block;        // 1 + index of the block whose voxels are the sources; 0: none
  bool border_known = false;         // all of that block's border was visited
  std::bitset<Lattice::kMaxBlocks> known;
  std::array<double, Lattice::kMaxBlocks> pull_N;  // [block] valid if known[block]

  // Gives the voxels of a rigid block the sign of the block's load. Their own loads may have either sign,
  // which would end the search at an inclusion.
  void pull_as_blocks(const Displacement& state, int axis, Row& row) {
    std::uint32_t of_blocks = 0, up = 0, down = 0;
    std::uint16_t last = 0;  // most rows hold one block only
    double pull = 0.0;
    for (VoxelId lane = 0; lane < kRow; ++lane) {
      const std::uint16_t number = multigrid->blocks().of(0, row.row * kRow + lane);
      if (number == 0) continue;
      if (number != last) {
        last = number;
        pull = pull_of(number - 1U, state, axis);
      }
      const std::uint32_t bit = 1U << lane;
      of_blocks |= bit;
      up |= pull > 0.0 ? bit : 0U;
      down |= pull < 0.0 ? bit : 0U;
      if (number == source_block) row.sources |= bit;
    }
    row.links.pulled_up = (row.links.pulled_up & ~of_blocks) | up;
    row.links.pulled_down = (row.links.pulled_down & ~of_blocks) | down;
  }

  double pull_of(std::size_t block, const Displacement& state, int axis) {
    if (!known[block]) {
      known.set(block);
      pull_N[block] = multigrid->block_force(block, state)[axis];
    }
    return pull_N[block];
  }

  // Does the row hold nothing but the source block?
  [[nodiscard]] bool within_source_block(const Lattice& lattice, RowId row) const {
    if (source_block == 0 || !multigrid->blocks().fill_row(0, row)) return false;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (lattice.filled(v) && multigrid->blocks().of(0, v) != source_block) return false;
    }
    return true;
  }
};

LimitReactions::LimitReactions(const Lattice& lattice) : lattice_(lattice), entry_(lattice.grid().rows()) {
  rows_.reserve(kMostRows);
  queue_.resize(kMostRows);
}

// Null if the row is empty, or if too many rows were searched.
LimitReactions::Row* LimitReactions::look_at(RowId row) noexcept {
  if (entry_[row] != 0) return &rows_[entry_[row] - 1U];
  if (rows_.size() == kMostRows || !gathering_->couplings.prepare(row)) return nullptr;
  // the row is inside of a block whose border was visited
  if (gathering_->border_known && gathering_->within_source_block(lattice_, row)) return nullptr;
  const Grid& g = lattice_.grid();
  const auto ua = static_cast<std::size_t>(axis_);
  LevelRow at;
  at.u[ua] = state_->u[ua].data() + static_cast<std::size_t>(row) * kRow;
  at.load[ua] = state_->load_of(row, axis_);
  at.z = static_cast<std::ptrdiff_t>(g.row_z) * kRow;
  at.x = static_cast<std::ptrdiff_t>(g.row_x) * kRow;
  gathering_->couplings.all(row, at.springs);
  std::array<float, 3> at_limit{};
  for (std::size_t d = 0; d < 3; ++d) at_limit[d] = kAtLimit * static_cast<float>(lattice_.spacing_m()[d]);
  Row& out = rows_.emplace_back();
  out.row = row;
  links_at_limits(at, gathering_->couplings.limits(row), ua, at_limit, out.links);
  if (gathering_->multigrid != nullptr && gathering_->multigrid->blocks().in_row(0, row))
    gathering_->pull_as_blocks(*state_, axis_, out);
  entry_[row] = static_cast<std::uint16_t>(rows_.size());
  const auto& sources = gathering_->sources;
  for (auto v = std::lower_bound(sources.begin(), sources.end(), row * kRow);
       v != sources.end() && *v / kRow == row; ++v)
    out.sources |= 1U << *v % kRow;
  if (out.sources != 0) add(out, out.sources);
  return &out;
}

// Returns the lanes of a row whose voxels are pushed against their loads, or blocked both ways, by links at
// their limits. `end`: the end of these links that lies in the row.
std::uint32_t LimitReactions::pushed(const Row& row, std::uint32_t at_low, std::uint32_t at_high,
                                     End end) noexcept {
  const std::uint32_t up = end == End::upper ? at_low : at_high, down = end == End::upper ? at_high : at_low;
  return (up & row.links.pulled_down) | (down & row.links.pulled_up) | (up & down);
}

// Adds voxels of a row, and their dependents in the same row.
void LimitReactions::add(Row& row, std::uint32_t bits) noexcept {
  const std::uint32_t before = row.gathered, low = row.links.at_low[0], high = row.links.at_high[0];
  row.gathered |= bits;
  const std::uint32_t upwards = pushed(row, low << 1U, high << 1U, End::upper) & row.links.movable,
                      downwards = pushed(row, low, high, End::lower) & row.links.movable;
  for (std::uint32_t more = ~0U; more != 0; row.gathered |= more)
    more = ((row.gathered << 1U & upwards) | (row.gathered >> 1U & downwards)) & ~row.gathered;
  row.fresh |= row.gathered & ~before;
  if (row.fresh == 0 || row.queued) return;
  row.queued = true;
  queue_[(head_ + waiting_++) % kMostRows] = static_cast<std::uint32_t>(&row - rows_.data());
}

// Adds the voxels of `row` that depend on voxels of the row beside it. `at_low` and `at_high`: links between
// the two rows that are at a limit. `end`: the end of these links that lies in `row`.
void LimitReactions::ask(RowId row, std::uint32_t at_low, std::uint32_t at_high, End end) noexcept {
  if ((at_low | at_high) == 0) return;
  Row* to = look_at(row);
  if (to == nullptr) return;
  const std::uint32_t more = pushed(*to, at_low, at_high, end) & to->links.movable & ~to->gathered;
  if (more != 0) add(*to, more);
}

void LimitReactions::begin(Gathering& gathering, Displacement& state, int axis) noexcept {
  gathering_ = &gathering;
  state_ = &state;
  axis_ = axis;
  for (const Row& r : rows_) entry_[r.row] = 0;
  rows_.clear();
  head_ = waiting_ = 0;
}

void LimitReactions::gather(LevelStiffness& couplings, Displacement& state, std::span<const VoxelId> sources,
                            int axis) noexcept {
  Gathering gathering{couplings, sources, nullptr, 0, false, {}, {}};
  begin(gathering, state, axis);
  for (const VoxelId v : sources) {
    if (may_be_at_limit(lattice_, state, v, axis, kSurelyFree)) look_at(v / kRow);
  }
  find_all();
  // A source may lie beside a dependent of another source. So the rows of such sources are read, too.
  // Otherwise dependents() would count the link between the two as a link to a voxel that is neither source
  // nor dependent.
  for (const VoxelId v : sources) {
    if (rows_.empty()) break;
    if (find(v / kRow) != nullptr) continue;
    for (int n = 0; n < 6; ++n) {
      if (gathered(n % 2 == 0 ? lattice_.up(v, n / 2) : lattice_.down(v, n / 2))) look_at(v / kRow);
    }
  }
  gathering_ = nullptr;
}

void LimitReactions::gather_on_block(LevelStiffness& couplings, Displacement& state,
                                     const Multigrid& multigrid, std::size_t block, int axis) noexcept {
  Gathering gathering{couplings, {}, &multigrid, static_cast<std::uint16_t>(block + 1), false, {}, {}};
  begin(gathering, state, axis);
  for (const RigidBlocks::Link& l : multigrid.blocks().on(0, block).border) look_at(l.cell / kRow);
  gathering.border_known = true;
  find_all();
  gathering_ = nullptr;
}

void LimitReactions::find_all() noexcept {
  const Grid& g = lattice_.grid();
  while (waiting_ > 0) {
    Row& row = rows_[queue_[head_]];  // rows_ stays within its capacity, so the reference is stable
    head_ = (head_ + 1) % kMostRows;
    --waiting_;
    const std::uint32_t fresh = row.fresh;
    row.fresh = 0;
    row.queued = false;
    const LinksAtLimits& links = row.links;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::uint32_t low = links.at_low[d] & fresh, high = links.at_high[d] & fresh,
                          down_low = links.down_at_low[d] & fresh, down_high = links.down_at_high[d] & fresh;
      const RowId away = d == 0 ? g.row_x : d == 1 ? 1U : g.row_z;
      // along x only the last and first voxel have neighbours in other rows
      const int up = d == 0 ? kRow - 1 : 0;
      ask(row.row + away, low >> up, high >> up, End::upper);
      ask(row.row - away, down_low << up, down_high << up, End::lower);
    }
  }
}

bool LimitReactions::at_limit(VoxelId source) const noexcept {
  const Row* own = find(source / kRow);
  if (own == nullptr) return false;
  const VoxelId lane = source % kRow;
  for (int d = 0; d < 3; ++d) {
    const auto ud = static_cast<std::size_t>(d);
    const LinksAtLimits& l = own->links;
    if (((l.at_low[ud] | l.at_high[ud]) >> lane & 1U) != 0 && !lattice_.anchored(lattice_.up(source, d)))
      return true;
    if (((l.down_at_low[ud] | l.down_at_high[ud]) >> lane & 1U) != 0 &&
        !lattice_.anchored(lattice_.down(source, d)))
      return true;
  }
  return false;
}

LimitReactions::Dependents LimitReactions::dependents(const LevelStiffness& couplings) const noexcept {
  Dependents sum;
  const RowId row_z = lattice_.grid().row_z, row_x = lattice_.grid().row_x;
  for (const Row& r : rows_) {
    const std::uint32_t hangs = r.gathered & ~r.sources;
    if (hangs == 0) continue;
    sum.force_N += sum_of(r.links.pull_N.data(), hangs);
    RowStiffness s;
    couplings.all(r.row, s);
    const std::array<std::uint32_t, 3> up{r.gathered >> 1U | gathered_in(r.row + row_x) << (kRow - 1),
                                          gathered_in(r.row + 1), gathered_in(r.row + row_z)};
    const std::array<std::uint32_t, 3> down{r.gathered << 1U | gathered_in(r.row - row_x) >> (kRow - 1),
                                            gathered_in(r.row - 1), gathered_in(r.row - row_z)};
    for (std::size_t d = 0; d < 3; ++d) {
      const bool along = static_cast<int>(d) == axis_;
      sum.stiffness_N_per_m += sum_of((along ? s.up_along : s.up_across) + d * kRow, hangs & ~up[d]) +
                               sum_of((along ? s.down_along : s.down_across)[d], hangs & ~down[d]);
    }
  }
  return sum;
}

}  // namespace voxel
