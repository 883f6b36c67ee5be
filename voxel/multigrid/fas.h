// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of which a multigrid cycle is made, row by row; which rows, and when, is Relaxation's business.
//
// Full approximation scheme (Brandt 1977; Briggs, Henson & McCormick, A Multigrid Tutorial, chapter 6): a
// coarse cell holds the whole displacement, not a correction. So a neighbourhood of the contact can be
// solved on all levels in a tick while fine voxels further away are still where they were: the coarse cells
// there go on, and the voxels follow when their turn comes.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "voxel/fem/deferred_correction.h"
#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/level_stiffness.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/multigrid/boundary_springs.h"
#include "voxel/multigrid/dirty_rows.h"
#include "voxel/multigrid/dirty_tiles.h"
#include "voxel/multigrid/limited_correction.h"
#include "voxel/multigrid/prolongation.h"
#include "voxel/multigrid/rigid_blocks.h"
#include "voxel/multigrid/row_kernels.h"
#include "voxel/lattice/near_limit.h"
#include "voxel/multigrid/row_smoother.h"

namespace voxel {

class Multigrid {
 public:
  explicit Multigrid(const Lattice& lattice);

  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] const Grid& grid(int level) const { return at(level).couplings->grid(); }
  // The springs of the voxels' links.
  [[nodiscard]] LevelStiffness& couplings() { return *at(0).couplings; }

  // What is known of a row.
  enum Flag : std::uint8_t {
    active = 1,    // its residual may be too large
    dirty = 2,     // it, or a row beside it, changed since it was passed on to the next coarser level
    changed = 4,   // (coarse) it changed since what it holds was told
    renewed = 8,   // (coarse) its values were renewed, its load is to be
    telling = 16,  // (coarse) it tells what it holds, in the cycle that goes on
    limited = 32,  // something in it is held by a limit
  };
  [[nodiscard]] bool has(int level, RowId row, std::uint8_t flag) const {
    return (at(level).flags[row] & flag) != 0;
  }
  void mark(int level, RowId row, std::uint8_t flag) noexcept { at(level).flags[row] |= flag; }
  void unmark(int level, RowId row, std::uint8_t flag) noexcept {
    at(level).flags[row] &= static_cast<std::uint8_t>(~flag);
  }
  // Tiles of voxels near which somebody moved something; see Relaxation.
  [[nodiscard]] TileQueue& tiles() { return tiles_; }
  [[nodiscard]] const TileQueue& tiles() const { return tiles_; }
  // Somebody moved voxels of this row: it and the rows beside it are to be looked at.
  void mark_dirty(int level, RowId row) noexcept {
    log_.note(level, row);
    if (level == 0) bricks_.look_at(row);
    spread(level, row, active | dirty);
  }
  // Finds the loads of bricks anew where voxels moved, in at most so many rows. Returns in how many it did.
  std::size_t renew_bricks(Displacement& state, std::size_t most_rows) noexcept;
  [[nodiscard]] BrickLoads& bricks() { return bricks_; }
  [[nodiscard]] const BrickLoads& bricks() const { return bricks_; }

  // What the tool and other objects hold does not move, and holds on to the cells around it.
  void set_held(std::span<const VoxelId> held) noexcept { boundary_springs_->set_held(held); }
  // So do the tool and obstacles what lies pressed on them, along their normals, as residuals found it since.
  void renew_boundary_springs() noexcept { boundary_springs_->renew(); }
  // Held voxels hold the cells above them as many times harder: what a cycle that overshot asks for.
  void set_hold(float times) noexcept { hold_ = times; }
  // Cells held because a chain at its limit holds a voxel in them, until this is called.
  void release_limited() noexcept;
  // The same, but for those in which a voxel is still pulled against the limit that holds it.
  void release_unlimited(const Displacement& state) noexcept;
  // What pulls a voxel against its limit is passed on as well, until this is said again: for what a wave has
  // just laid at its limits, and is to open altogether.
  void restrict_all(bool all) noexcept { restricts_all_ = all; }
  // What links at their limits were found to pull a voxel by (N), until another is: so it balances what its
  // springs pull by, and the cells above it stand.
  void tie(VoxelId v, const glm::vec3& force_N) noexcept;
  // The voxels among them: `visit(v, axis)` for each axis on which a limit holds one.
  template <class Visit>
  void for_limited(const Visit& visit) const {
    for (const StoppedCell& s : stopped_) {
      if (s.level != 0) continue;
      for (int axis = 0; axis < 3; ++axis) {
        if ((at(0).stopped[s.cell] & (1 << axis)) != 0) visit(s.cell, axis);
      }
    }
  }

  // Is there anything in the row? Call it before any of what follows.
  bool prepare(int level, RowId row) noexcept { return at(level).couplings->prepare(row); }

  // Renews what yielded links add to the load of a row of voxels; `keep`: they keep it. True where a link is
  // beyond what it keeps.
  bool yield(RowId row, Displacement& state, bool keep) noexcept;
  // The children (bit 0: in x, 1: in y, 2: in z) of a coarse row on the level below; where the lattice ends,
  // rows of its empty border.
  // Has a row's values fetched into the cache, to be read or written in a moment; any number.
  void fetch(int level, RowId row, const Displacement& state) const noexcept;
  [[nodiscard]] std::array<RowId, 8> rows_below(int level, RowId row) const noexcept;

  // What follows works on the octets of `span` only; by default, on the whole row.

  // Moves the voxels, or cells, of a row to the minimum of their energy given all other rows, every second
  // one first, without leaving their limits.
  void smooth(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
              LaneSpan span = {}) noexcept;
  // The cells of a coarse row take the means of what they hold, and keep what they know beyond that …
  void restrict_values(int level, RowId row, Displacement& state, LaneSpan span = {}) noexcept;
  // … and the load under which those would be at rest where they are. Returns the largest force left on any
  // voxel below (N); only for level 1 is it one of voxels. Of whole rows it also finds which are at rest.
  float restrict_loads(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                       LaneSpan span = {}) noexcept;
  // Tells the rows of a box on a level what cells above them have yet to tell (see prolongation.h): those of
  // coarse rows marked `telling`, from first to last along x. What links at their limits keep from following,
  // the cells take back: a cell whose voxels stayed behind would pull at the cells beside it, a little more
  // every time, until it was kilometers away. `jointly`: voxels all at once (limited_correction.h), for
  // tissue that has far to go: row by row it is in its own way.
  struct ProlongedBox {
    int q0, q1, j0, j1, k0, k1;     // octets and rows of the level, all included
    int first_source, last_source;  // cells of the next coarser level along x
    int from_k, to_k;               // of these planes now, after those before; no other box comes in between
  };
  void prolong(int level, const ProlongedBox& box, Displacement& state, const ObstacleView& obstacles,
               bool jointly = false) noexcept;
  // The most that any cell of a coarse row has yet to tell, of those in the octets that are also from first
  // to last in the row (m).
  [[nodiscard]] float pending_correction(int level, RowId row, LaneSpan span = {}, int first = 0,
                                         int last = kRow - 1) const noexcept;

  // The cells of a coarse row know nothing any more that what they hold does not.
  void forget_pending_correction(int level, RowId row, Displacement& state,
                                 const ObstacleView& obstacles) noexcept;

  // Rows whose voxels are pulled by less than `tolerance_N`, or whose cells would move less than
  // `motion_tolerance_m`, are left alone.
  [[nodiscard]] float motion_tolerance_m() const { return motion_tolerance_m_; }
  [[nodiscard]] float tolerance_N() const { return tolerance_N_; }
  // Less than this is not passed on to other levels: a small share of what a row is left alone with.
  [[nodiscard]] float restricted_m() const { return motion_tolerance_m_ / 32.0F; }
  void set_motion_tolerance(float tolerance_N, float motion_tolerance_m) noexcept {
    tolerance_N_ = tolerance_N;
    motion_tolerance_m_ = motion_tolerance_m;
    bricks_.set_least(kLeastLoad * tolerance_N);
  }
  void copy_from(const Multigrid& other) noexcept;

  // ---- parts without slack (rigid_blocks.h, rigid_block_passes.cpp); part numbers begin with 0 ----
  [[nodiscard]] bool has_blocks() const { return parts_ != nullptr; }
  [[nodiscard]] const RigidBlocks& parts() const { return *parts_; }
  // On which pressed voxels of theirs the tool holds them, along its normals, until this is called again.
  void set_block_contacts(const Displacement& state, std::span<const VoxelId> held) noexcept;
  [[nodiscard]] bool tool_presses_block(std::size_t part) const {
    return block_state_[part].by_tool.count > 0;
  }
  // What pulls a part (N): springs and loads, and what counts as balanced in it where that is asked for, too.
  [[nodiscard]] glm::dvec3 block_force(std::size_t part, const Displacement& state) const noexcept;
  [[nodiscard]] glm::dvec3 residual_of_block(std::size_t part) const noexcept {
    return block_state_[part].balance;
  }
  // How far its links let it go, [axis][down, up] (m); no less than 0 up, no more down.
  using AdmissibleInterval = std::array<std::array<double, 2>, 3>;
  [[nodiscard]] AdmissibleInterval interval_of_block(std::size_t part,
                                                     const Displacement& state) const noexcept;
  // Adds that to `bounds`, which has room for six more.
  static void add_bounds(const AdmissibleInterval& room, std::vector<BlockBound>& bounds);
  // The same as far as its links and its obstacles let it, and along the tool where that holds it, or the
  // tool is the caller's business; returns how far it went. What another found is not news to it.
  enum class Tool : std::uint8_t { holds, is_seen_to };
  enum class Note : std::uint8_t { in_log, nowhere };
  glm::dvec3 move_block(std::size_t part, const glm::dvec3& way, Displacement& state,
                        const ObstacleView& obstacles, Tool tool = Tool::holds,
                        Note note = Note::in_log) noexcept;
  // Those that meet a box of a level go to where the springs that leave them are in balance.
  void smooth_blocks(int level, const RigidBlocks::Box& box, Displacement& state,
                     const ObstacleView& obstacles) noexcept;
  // What pulls them is found, before the loads of the next coarser level are, and makes up the loads of what
  // they are there afterwards. Returns the largest force a voxel (N); of level 0 only it is one of voxels.
  float measure_blocks(int level, const RigidBlocks::Box& box, Displacement& state,
                       const ObstacleView& obstacles) noexcept;
  void load_blocks(int level, const RigidBlocks::Box& box) noexcept;
  // What pulls them counts as balanced from now on, as with balance().
  void balance_blocks(const Displacement& state) noexcept;

  // ---- two of the same lattice that work on one object, in turns (shadow_object.h) ----
  // From now on every row that is written is noted. Allocates.
  void keep_log();
  [[nodiscard]] ChangeLog& log() { return log_; }
  // Forgets what coarse cells hold, and leaves the loads of bricks to the other. Allocates.
  void forget_coarse();
  // Coarse cells whose rows are in the log hold nothing any more: 0.25 us a row.
  void drop_coarse() noexcept;
  [[nodiscard]] std::size_t rows_to_drop() const noexcept;
  // … and nothing is balanced.
  void begin_anew() noexcept;
  // What still pulls the voxels of a row counts as balanced from now on: they are at rest where they are.
  void balance(RowId row, Displacement& state, const ObstacleView& obstacles, LaneSpan span = {}) noexcept;
  // The load that is for that, beside those that the voxel has of itself (N).
  [[nodiscard]] glm::dvec3 balance_of(VoxelId v, const Displacement& state) const noexcept {
    const float* of_row = balance_of(static_cast<RowId>(v / kRow), 0);
    if (of_row == nullptr) return glm::dvec3(0.0);
    const std::array<float, 3> own = state.bricks.at(v);
    const float* at = of_row + v % kRow;
    return {at[0] - own[0], at[kRow] - own[1], at[2 * kRow] - own[2]};
  }
  // Of what is balanced this part stays so.
  void keep_frozen_residual(float part, const Displacement& state) noexcept;
  // Of a row on one axis, what voxels have of themselves not taken off; null: nothing is balanced.
  [[nodiscard]] const float* balance_of(RowId row, std::size_t axis) const noexcept {
    if (balance_number_.size() == 0 || balance_number_[row] == 0) return nullptr;
    return balance_.data() + ((balance_number_[row] - std::size_t{1}) * 3 + axis) * kRow;
  }
  // Adds to a row of voxels what somebody else found, as far as its links allow.
  void add(RowId row, const RowVector& way, Displacement& state, const ObstacleView& obstacles) noexcept;
  // The same to many rows at once, each given once before: as far as links to the others let it where those
  // go. Where it may not be, it is added alone: it lies near obstacles, or there are too many.
  [[nodiscard]] bool can_join(RowId row, const Displacement& state) noexcept {
    return prepare(0, row) && state.row_obstacles[row] == 0 && !limited_correction_.full();
  }
  // `fill(way)` says where to.
  template <class Fill>
  void join(RowId row, Displacement& state, const Fill& fill) noexcept {
    LimitedCorrection::Row& r = limited_correction_.add(row, {});
    fill(r.from);
    set_out(r, state);
  }
  void add_joined(Displacement& state) noexcept { apply_limited_correction(state); }
  // Was it? Then what of its way is left (m), and whether all that it was to go is gone.
  [[nodiscard]] bool joined(RowId row, const Displacement& state, RowVector& left,
                            bool& gone) const noexcept {
    const LimitedCorrection::Row* r = limited_correction_.find(row);
    if (r != nullptr) gone = left_of(*r, state, left) == 0 && !r->cut;
    return r != nullptr;
  }
  void forget_joined() noexcept { limited_correction_.clear(); }
  // Finds all springs and takes all memory now, not when a tick first needs them.
  void prepare_all() noexcept;
  void prepare_limit_loads() noexcept;  // what tie() writes to
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Level {
    std::unique_ptr<LevelStiffness> couplings;
    // [axis][cell]; those of level 0 are elsewhere. `told` is the value that what the cell holds knows of, so
    // value − told is what it has yet to hear. `loaded_at` is what was told when the load was found: what
    // holds the cell pulls from there on. (From what is told now on, cells beside a cycle's box went a little
    // further in every cycle, as if nothing held them.)
    std::array<LazyArray<float>, 3> value, told, load, loaded_at;
    LazyArray<std::uint8_t> stopped;  // [cell or voxel] bits 0 to 2: held by a limit on that axis
    LazyArray<std::uint8_t> flags;    // [row]
  };
  struct StoppedCell {
    std::uint8_t level;
    VoxelId cell;
  };
  struct StoppedVoxel {
    VoxelId v;
    std::uint8_t axes;  // bits
  };
  // What a row was told and did not follow.
  struct Refused {
    RowId row = 0;
    unsigned axes = 0;  // bits
    LaneSpan span;
    RowVector way;
  };
  static constexpr float kLeastLoad = 0.25F;  // of the tolerance: loads less wrong than this are right

  // Of a part. What is of one level stands by level.
  struct BlockOnLevel {
    glm::dvec3 left{0.0};                // what pulls it, as measured (N)
    glm::dvec3 passed{0.0};              // of the level below, what its cells are pulled by (N)
    glm::dvec3 load{0.0};                // (N)
    glm::dvec3 pending_correction{0.0};  // how far it went that the level below was not told (m)
    glm::dvec3 sum{0.0};                 // of what its cells are told (m)
    bool active = false;                 // in the cycle that goes on
  };
  struct BlockState {
    std::vector<BlockOnLevel> on;  // [level]
    HeldDirections by_tool, held;  // by it; and by obstacles
    std::uint8_t stopped = 0;      // bits: of axes on which a limit holds it
    glm::dvec3 balance{0.0};       // (N)
  };
  static constexpr std::size_t kMaxBlockBounds = 1024;

  [[nodiscard]] Level& at(int level) { return levels_[static_cast<std::size_t>(level)]; }
  [[nodiscard]] const Level& at(int level) const { return levels_[static_cast<std::size_t>(level)]; }
  void prepare_level(int level) noexcept;
  void spread(int level, RowId row, std::uint8_t flags) noexcept;
  void note_change(int level, RowId row, float change) noexcept;
  void add_limit_loads(RowId row, LevelRow& r, RowVector& loads) noexcept;
  void stop_cells(VoxelId v, std::uint8_t bits) noexcept;
  [[nodiscard]] LevelRow row_of(int level, RowId row, Displacement& state) noexcept;
  [[nodiscard]] LevelRow prolonged_row(int level, RowId row) noexcept;
  [[nodiscard]] std::array<float*, 3> loads(int level, RowId row) noexcept;
  RowResidual residual_of(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                          LaneSpan span, RowVector& out) noexcept;
  void interpolate_row(int level, int j, int k, const ProlongedBox& box) noexcept;
  void prolong_row(int level, RowId row, const std::array<ProlongedRow, 4>& prolongation, Displacement& state,
                   const ObstacleView& obstacles, LaneSpan span, bool jointly) noexcept;
  void correct(int level, RowId row, const RowVector& correction, Displacement& state,
               const ObstacleView& obstacles, LaneSpan span, Refused& refused) noexcept;
  void set_out(LimitedCorrection::Row& r, Displacement& state) noexcept;
  void keep_aim(LimitedCorrection::Row& r, const Displacement& state) noexcept;
  void draw_back(LimitedCorrection::Row& r, Displacement& state) noexcept;
  [[nodiscard]] std::array<RowId, 6> beside(RowId row) const noexcept;
  void ask_round(RowId row) noexcept;
  void look_at_others(const LimitedCorrection::Row& r, Displacement& state) noexcept;
  void apply_limited_correction(Displacement& state) noexcept;
  void stay(Displacement& state) noexcept;
  unsigned left_of(const LimitedCorrection::Row& r, const Displacement& state,
                   RowVector& left) const noexcept;
  void take_back_refused(int level, const Refused& refused) noexcept;

  // ---- where something is touched (contact_smoother.cpp) ----
  float smooth_voxels(const LevelRow& r, RowId row, Displacement& state, const ObstacleView& obstacles,
                      LaneSpan span) noexcept;
  RowCorrection correct_voxels(const LevelRow& r, RowId row, const RowVector& correction, Displacement& state,
                               const ObstacleView& obstacles, LaneSpan span, RowVector& refused) noexcept;
  // Lanes that obstacles kept from going along.
  template <class Move>
  std::uint32_t move_outside(LevelRow r, RowId row, Displacement& state, const ObstacleView& obstacles,
                             const Move& move) noexcept;
  float slide_pressed(RowId row, Displacement& state, LaneSpan span) noexcept;
  float slide_pressed_by(RowId row, const RowVector& way, Displacement& state, LaneSpan span) noexcept;
  void balance_contacts(RowId row, Displacement& state, const ObstacleView& obstacles, LaneSpan span,
                        RowResidual& found, RowVector& out) noexcept;
  template <class Visit>
  void for_tilted(int level, RowId row, const LevelRow& r, LaneSpan span, const Visit& visit) noexcept;
  float smooth_tilted(int level, RowId row, const LevelRow& r, LaneSpan span) noexcept;
  void add_tilt(int level, RowId row, const LevelRow& r, LaneSpan span, RowVector& out) noexcept;

  // ---- parts ----
  template <class Visit>
  void for_blocks(int level, const RigidBlocks::Box& box, const Visit& visit) noexcept;
  [[nodiscard]] glm::dvec3 block_pull(int level, std::size_t part, glm::dvec3& stiffness) noexcept;
  template <class Room>
  [[nodiscard]] AdmissibleInterval room_on_border(std::size_t part, const Room& room) const noexcept;
  [[nodiscard]] AdmissibleInterval room_with_others(std::size_t part, const glm::dvec3& way,
                                                    const Displacement& state) const noexcept;
  void take_others_along(std::size_t part, Displacement& state) noexcept;
  std::uint8_t add_what_comes_along(std::size_t part, const Displacement& state, glm::dvec3& pull) noexcept;
  void shift_block(std::size_t part, const glm::dvec3& way, Displacement& state) noexcept;
  void shift_cells(int level, std::size_t part, const glm::dvec3& way) noexcept;
  void set_block_lanes(int level, RowId row, LaneSpan span, RowVector& out) const noexcept;
  void restrict_block_lanes(int level, RowId row, LaneSpan span, const RowVector& sums) noexcept;
  void note_prolonged_blocks(int level, RowId row, LaneSpan span, const RowVector& way) noexcept;
  void prolong_to_blocks(int level, Displacement& state, const ObstacleView& obstacles) noexcept;
  void stop_at_obstacles(std::size_t part, const Displacement& state, const ObstacleView& obstacles,
                         Tool tool) noexcept;
  [[nodiscard]] BoundarySprings::Support support_of_block(std::size_t part) const noexcept;
  void forget_pending_of_blocks(int level, RowId row) noexcept;
  void restart_blocks() noexcept;

  const Lattice& lattice_;
  TileQueue tiles_;
  ChangeLog log_;
  BrickLoads bricks_;
  std::vector<Level> levels_;
  Prolongation prolongation_;
  std::unique_ptr<BoundarySprings> boundary_springs_;
  LazyVector<StoppedCell> stopped_;
  LazyVector<StoppedVoxel> still_stopped_;
  std::array<LazyArray<float>, 3> limit_load_;   // [axis][v] (N)
  LazyArray<std::uint16_t> row_has_limit_load_;  // [row] voxels that are
  LimitedCorrection limited_correction_;
  // Rows in which something balances what pulls: that and their own load (N), one beside the other. (At their
  // voxels' places, each in pages of its own, a first give took up to 1.2 ms, most of it to get these.)
  LazyVector<RowId> frozen_residual_;
  LazyArray<float> balance_;                 // [as frozen_residual_][axis][lane]
  LazyArray<std::uint16_t> balance_number_;  // [row] 1 + where; 0: none
  std::unique_ptr<RigidBlocks> parts_;       // null: there is none
  std::vector<BlockState> block_state_;
  std::vector<BlockBound> block_bounds_;
  std::array<AxisLimits, 3> yield_limits_;
  bool all_visited_ = false;  // cycles look at all in their boxes: which rows are active nobody asks
  bool restricts_all_ = false;
  float tolerance_N_ = 0.0F, motion_tolerance_m_ = 0.0F, hold_ = 1.0F;
};

}  // namespace voxel
