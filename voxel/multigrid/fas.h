// SPDX-License-Identifier: GPL-3.0-or-later
// The passes of a multigrid cycle, row by row. Relaxation decides which rows they visit, and when.
//
// Full approximation scheme (FAS; Brandt 1977; Briggs, Henson & McCormick, A Multigrid Tutorial, chapter 6):
// a coarse cell holds a displacement, not a correction. So a tick can solve the neighbourhood of the contact
// on all levels. Further away it moves only the coarse cells, and later ticks prolong their corrections to
// the voxels. A correction that is not prolonged yet is *pending*.
//
// Terms: a coarse cell stands for 2 × 2 × 2 cells of the finer level, its *children*; it is the cell *above*
// them. A *Float8* is a vector of 8 neighbouring values of a row. An *active limit* holds a voxel or cell on
// one axis: a link is at its limit, and the net force pushes against that limit. The held voxel or cell does
// not move on that axis until the limit is *released*.
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
#include "voxel/lattice/near_limit.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/multigrid/boundary_springs.h"
#include "voxel/multigrid/dirty_rows.h"
#include "voxel/multigrid/dirty_tiles.h"
#include "voxel/multigrid/limited_correction.h"
#include "voxel/multigrid/prolongation.h"
#include "voxel/multigrid/rigid_blocks.h"
#include "voxel/multigrid/row_kernels.h"
#include "voxel/multigrid/row_smoother.h"

namespace voxel {

class Multigrid {
 public:
  explicit Multigrid(const Lattice& lattice);

  [[nodiscard]] int levels() const { return static_cast<int>(levels_.size()); }
  [[nodiscard]] const Grid& grid(int level) const { return at(level).couplings->grid(); }
  // Springs of the voxels' links (level 0).
  [[nodiscard]] LevelStiffness& couplings() { return *at(0).couplings; }

  // State of a row.
  enum Flag : std::uint8_t {
    active = 1,    // its residual may be above the tolerance
    dirty = 2,     // it, or a row beside it, changed since it was last restricted
    changed = 4,   // (coarse) it has a pending correction
    renewed = 8,   // (coarse) its values were restricted, but its load was not yet
    source = 16,   // (coarse) it prolongs its correction in the current cycle
    limited = 32,  // an active limit holds a voxel or cell of it
  };
  [[nodiscard]] bool has(int level, RowId row, std::uint8_t flag) const {
    return (at(level).flags[row] & flag) != 0;
  }
  void mark(int level, RowId row, std::uint8_t flag) noexcept { at(level).flags[row] |= flag; }
  void unmark(int level, RowId row, std::uint8_t flag) noexcept {
    at(level).flags[row] &= static_cast<std::uint8_t>(~flag);
  }
  // Tiles near which something moved; see Relaxation.
  [[nodiscard]] TileQueue& tiles() { return tiles_; }
  [[nodiscard]] const TileQueue& tiles() const { return tiles_; }
  // Call when voxels of this row were moved from outside: marks the row and the rows beside it.
  void mark_dirty(int level, RowId row) noexcept {
    log_.note(level, row);
    if (level == 0) bricks_.look_at(row);
    spread(level, row, active | dirty);
  }
  // Renews the loads of bricks near moved voxels, in at most `most_rows` rows. Returns the number of rows
  // renewed.
  std::size_t renew_bricks(Displacement& state, std::size_t most_rows) noexcept;
  [[nodiscard]] BrickLoads& bricks() { return bricks_; }
  [[nodiscard]] const BrickLoads& bricks() const { return bricks_; }

  // Sets the voxels that the tool and other objects hold. They do not move, and the cells above them get
  // boundary springs.
  void set_held(std::span<const VoxelId> held) noexcept { boundary_springs_->set_held(held); }
  // Renews the boundary springs of voxels that slide on the tool or on obstacles, as found by the last
  // residuals.
  void renew_boundary_springs() noexcept { boundary_springs_->renew(); }
  // Factor for the boundary springs of held voxels; raised after a cycle that overshot.
  void set_boundary_scale(float times) noexcept { boundary_scale_ = times; }
  // Releases all active limits. The voxels and cells that they held may move again.
  void release_active() noexcept;
  // Releases the active limits that no voxel pulls against any more.
  void release_inactive(const Displacement& state) noexcept;
  // If set, forces against active limits are restricted, too. This is for tissue that a wave has just brought
  // to its limits: its voxels have to leave the limits together.
  void restrict_all(bool all) noexcept { restricts_all_ = all; }
  // Sets the force of active limits on a voxel (N), until it is set again. The force balances that of the
  // springs, and the cells above the voxel do not move.
  void set_limit_load(VoxelId v, const glm::vec3& force_N) noexcept;
  // Calls visit(v, axis) for each axis on which an active limit holds voxel v.
  template <class Visit>
  void for_active(const Visit& visit) const {
    for (const StoppedCell& s : stopped_) {
      if (s.level != 0) continue;
      for (int axis = 0; axis < 3; ++axis) {
        if ((at(0).stopped[s.cell] & (1 << axis)) != 0) visit(s.cell, axis);
      }
    }
  }

  // Has the row any voxel or cell? Call it before the functions below.
  bool prepare(int level, RowId row) noexcept { return at(level).couplings->prepare(row); }

  // Renews the plastic part of a row's load; `keep`: commits the plastic offsets. True if a link is beyond
  // its committed offset.
  bool update_plasticity(RowId row, Displacement& state, bool keep) noexcept;
  // fetch() prefetches a row's values; any row number is allowed. rows_below() lists the children of a coarse
  // row on the finer level. Bits 0 to 2 of their index select the upper child along x, y and z. Children
  // beyond the lattice are rows of its empty border.
  void fetch(int level, RowId row, const Displacement& state) const noexcept;
  [[nodiscard]] std::array<RowId, 8> rows_below(int level, RowId row) const noexcept;

  // The functions below work on the Float8 of `span`; by default on the whole row.

  // Smooths a row: moves every second voxel or cell, then the others, each to the minimum of its energy
  // within its limits. All other rows stay fixed.
  void smooth(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
              LaneSpan span = {}) noexcept;
  // Restricts values: the value of a coarse cell becomes the mean of its children plus its pending
  // correction.
  void restrict_values(int level, RowId row, Displacement& state, LaneSpan span = {}) noexcept;
  // Restricts loads. With its load, the residual of a coarse cell at the prolonged value is the sum of its
  // children's residuals. Returns the largest residual on the finer level (N); for level 1 that is the level
  // of voxels. If the span is the whole row, it also finds which finer rows are at rest.
  float restrict_loads(int level, RowId row, Displacement& state, const ObstacleView& obstacles,
                       LaneSpan span = {}) noexcept;
  // Prolongs pending corrections of coarse rows marked `source` to the rows of a box (see prolongation.h),
  // plane by plane. Links at their limits may refuse a part of a correction. This part is subtracted from the
  // cells again, because otherwise these cells would pull at their neighbours more in every cycle. `jointly`:
  // all voxels move together (limited_correction.h). This is for tissue that has far to go and whose rows
  // would block one another.
  struct ProlongedBox {
    int q0, q1, j0, j1, k0, k1;     // Float8 and rows of the level, inclusive
    int first_source, last_source;  // cells of the next coarser level along x that prolong
    int from_k, to_k;  // planes of this call; calls for one box follow each other in the order of planes
  };
  void prolong(int level, const ProlongedBox& box, Displacement& state, const ObstacleView& obstacles,
               bool jointly = false) noexcept;
  // Largest pending correction of a coarse row's cells, in the Float8 of `span` and between lanes `first` and
  // `last` (m).
  [[nodiscard]] float pending_correction(int level, RowId row, LaneSpan span = {}, int first = 0,
                                         int last = kRow - 1) const noexcept;

  // Drops the pending corrections of a coarse row, and restricts it anew.
  void forget_pending_correction(int level, RowId row, Displacement& state,
                                 const ObstacleView& obstacles) noexcept;

  // Rows are at rest if no voxel is pulled by more than `tolerance_N`, and no cell would move by more than
  // `motion_tolerance_m`.
  [[nodiscard]] float motion_tolerance_m() const { return motion_tolerance_m_; }
  [[nodiscard]] float tolerance_N() const { return tolerance_N_; }
  // Changes smaller than this (m) are neither restricted nor prolonged.
  [[nodiscard]] float restricted_m() const { return motion_tolerance_m_ / 32.0F; }
  void set_motion_tolerance(float tolerance_N, float motion_tolerance_m) noexcept {
    tolerance_N_ = tolerance_N;
    motion_tolerance_m_ = motion_tolerance_m;
    bricks_.set_least(kLeastLoad * tolerance_N);
  }
  void copy_from(const Multigrid& other) noexcept;

  // ---- rigid blocks (rigid_blocks.h, rigid_block_passes.cpp); numbers begin with 0 ----
  [[nodiscard]] bool has_blocks() const { return blocks_ != nullptr; }
  [[nodiscard]] const RigidBlocks& blocks() const { return *blocks_; }
  // `held`: voxels that the tool holds. Until the next call, a block with such voxels cannot move along the
  // tool's normals at these voxels.
  void set_block_contacts(const Displacement& state, std::span<const VoxelId> held) noexcept;
  [[nodiscard]] bool tool_presses_block(std::size_t block) const {
    return block_state_[block].by_tool.count > 0;
  }
  // Force of springs and loads on a block (N).
  [[nodiscard]] glm::dvec3 block_force(std::size_t block, const Displacement& state) const noexcept;
  // Load that freezes the residual of a block (N): its force when it was frozen, negated.
  [[nodiscard]] glm::dvec3 residual_of_block(std::size_t block) const noexcept {
    return block_state_[block].frozen_N;
  }
  // Interval in which its links let a block move, [axis][down, up] (m); down <= 0 <= up.
  using AdmissibleInterval = std::array<std::array<double, 2>, 3>;
  [[nodiscard]] AdmissibleInterval interval_of_block(std::size_t block,
                                                     const Displacement& state) const noexcept;
  // Adds an interval to `bounds`, which has room for six more.
  static void add_bounds(const AdmissibleInterval& room, std::vector<BlockBound>& bounds);
  // Moves a block by `way` as far as its links and obstacles allow, and returns its motion (m). A block that
  // the tool presses slides on the tool, unless the caller handles the tool. Use Note::unlogged for results
  // of another solver.
  enum class Tool : std::uint8_t { constrains, caller_handles };
  enum class Note : std::uint8_t { logged, unlogged };
  glm::dvec3 move_block(std::size_t block, const glm::dvec3& way, Displacement& state,
                        const ObstacleView& obstacles, Tool tool = Tool::constrains,
                        Note note = Note::logged) noexcept;
  // Moves the blocks that meet a box of a level to the equilibrium of their border's springs.
  void smooth_blocks(int level, const RigidBlocks::Box& box, Displacement& state,
                     const ObstacleView& obstacles) noexcept;
  // measure_blocks() finds the residuals of the blocks on `level`; call it before loads are restricted to the
  // coarser level. load_blocks() then finds the blocks' own loads on the coarser level; call it after that
  // restriction. For level 0, measure_blocks() returns the largest residual of a block, divided by the square
  // root of the block's number of border links (N).
  float measure_blocks(int level, const RigidBlocks::Box& box, Displacement& state,
                       const ObstacleView& obstacles) noexcept;
  void load_blocks(int level, const RigidBlocks::Box& box) noexcept;
  // Freezes the residual of the blocks, as freeze_residual() does.
  void freeze_blocks(const Displacement& state) noexcept;

  // ---- asynchronous relaxation: two Multigrid of one lattice work in turns (shadow_object.h) ----
  // Starts the log of written rows. Allocates.
  void keep_log();
  [[nodiscard]] ChangeLog& log() { return log_; }
  // Drops all coarse cells. From then on only the shadow renews the loads of bricks. Allocates.
  void forget_coarse();
  // Sets coarse cells of logged rows to 0.
  void drop_coarse() noexcept;
  [[nodiscard]] std::size_t rows_to_drop() const noexcept;
  // Calls drop_coarse(). Afterwards no residual is frozen.
  void restart() noexcept;
  // Freezes the residual of a row: its voxels count as at rest where they are.
  void freeze_residual(RowId row, Displacement& state, const ObstacleView& obstacles,
                       LaneSpan span = {}) noexcept;
  // The load that freezes a voxel's residual, without the voxel's own load (N).
  [[nodiscard]] glm::dvec3 frozen_load(VoxelId v, const Displacement& state) const noexcept {
    const float* of_row = frozen_load(static_cast<RowId>(v / kRow), 0);
    if (of_row == nullptr) return glm::dvec3(0.0);
    const std::array<float, 3> own = state.bricks.at(v);
    const float* at = of_row + v % kRow;
    return {at[0] - own[0], at[kRow] - own[1], at[2 * kRow] - own[2]};
  }
  // Scales the frozen residuals by `part`.
  void keep_frozen_residual(float part, const Displacement& state) noexcept;
  // Load of a row with a frozen residual on one axis, the voxels' own load included; null: its residual is
  // not frozen.
  [[nodiscard]] const float* frozen_load(RowId row, std::size_t axis) const noexcept {
    if (frozen_number_.size() == 0 || frozen_number_[row] == 0) return nullptr;
    return frozen_residual_.data() + ((frozen_number_[row] - std::size_t{1}) * 3 + axis) * kRow;
  }
  // Adds motion that another solver found to a row, as far as its links allow.
  void add_motion(RowId row, const RowVector& way, Displacement& state,
                  const ObstacleView& obstacles) noexcept;
  // A batch adds motion to many rows together. Each row moves as far as its links to the new places of the
  // other rows allow. Add each row once. If can_batch() is false (obstacles nearby, or too many rows), use
  // add_motion().
  [[nodiscard]] bool can_batch(RowId row, const Displacement& state) noexcept {
    return prepare(0, row) && state.row_obstacles[row] == 0 && !limited_correction_.full();
  }
  // Adds a row to the batch; `fill(way)` writes its motion.
  template <class Fill>
  void batch(RowId row, Displacement& state, const Fill& fill) noexcept {
    LimitedCorrection::Row& r = limited_correction_.add(row, {});
    fill(r.from);
    set_out(r, state);
  }
  void move_batch(Displacement& state) noexcept { apply_limited_correction(state); }
  // True if the row was added. Then `left` is the part of its motion that it has not made (m), and `gone`
  // is true if the row has made all of its motion.
  [[nodiscard]] bool batched(RowId row, const Displacement& state, RowVector& left,
                             bool& gone) const noexcept {
    const LimitedCorrection::Row* r = limited_correction_.find(row);
    if (r != nullptr) gone = left_of(*r, state, left) == 0 && !r->cut;
    return r != nullptr;
  }
  void clear_batch() noexcept { limited_correction_.clear(); }
  // Finds all springs and takes all memory now, not when a tick first needs them.
  void prepare_all() noexcept;
  void prepare_limit_loads() noexcept;  // takes the memory that set_limit_load() writes to
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Level {
    std::unique_ptr<LevelStiffness> couplings;
    // [axis][cell] of coarse levels. `prolonged` is the part of the value that the finer level knows, so
    // value − prolonged is the pending correction. `loaded_at` is the value of `prolonged` when the load was
    // found. Boundary springs pull towards `loaded_at`.
    std::array<LazyArray<float>, 3> value, prolonged, load, loaded_at;
    LazyArray<std::uint8_t> stopped;  // [cell or voxel] bits 0 to 2: an active limit holds it on that axis
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
  // The part of a correction that a row refused.
  struct Refused {
    RowId row = 0;
    unsigned axes = 0;  // bits
    LaneSpan span;
    RowVector way;
  };
  static constexpr float kLeastLoad = 0.25F;  // (unit: tolerance) smaller errors of a load are ignored

  // State of a block on one level.
  struct BlockOnLevel {
    glm::dvec3 left{0.0};                // residual (N)
    glm::dvec3 passed{0.0};              // residual restricted from the finer level (N)
    glm::dvec3 load{0.0};                // (N)
    glm::dvec3 pending_correction{0.0};  // pending correction (m)
    glm::dvec3 sum{0.0};                 // sum of the corrections prolonged to its cells (m)
    bool active = false;                 // its residual was measured in the current cycle
  };
  struct BlockState {
    std::vector<BlockOnLevel> on;  // [level]
    HeldDirections by_tool, held;  // directions fixed by the tool; by the tool and by obstacles
    std::uint8_t stopped = 0;      // bits: axes on which a limit holds it
    glm::dvec3 frozen_N{0.0};      // load that freezes its residual
  };
  static constexpr std::size_t kMaxBlockBounds = 1024;  // bounds of one block, at most

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

  // ---- contacts (contact_smoother.cpp) ----
  float smooth_voxels(const LevelRow& r, RowId row, Displacement& state, const ObstacleView& obstacles,
                      LaneSpan span) noexcept;
  RowCorrection correct_voxels(const LevelRow& r, RowId row, const RowVector& correction, Displacement& state,
                               const ObstacleView& obstacles, LaneSpan span, RowVector& refused) noexcept;
  // Returns the lanes that obstacles hold back.
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

  // ---- rigid blocks ----
  template <class Visit>
  void for_blocks(int level, const RigidBlocks::Box& box, const Visit& visit) noexcept;
  [[nodiscard]] glm::dvec3 block_pull(int level, std::size_t block, glm::dvec3& stiffness) noexcept;
  template <class Room>
  [[nodiscard]] AdmissibleInterval room_on_border(std::size_t block, const Room& room) const noexcept;
  [[nodiscard]] AdmissibleInterval room_with_others(std::size_t block, const glm::dvec3& way,
                                                    const Displacement& state) const noexcept;
  void take_others_along(std::size_t block, Displacement& state) noexcept;
  std::uint8_t add_what_comes_along(std::size_t block, const Displacement& state, glm::dvec3& pull) noexcept;
  void shift_block(std::size_t block, const glm::dvec3& way, Displacement& state) noexcept;
  void shift_cells(int level, std::size_t block, const glm::dvec3& way) noexcept;
  void set_block_lanes(int level, RowId row, LaneSpan span, RowVector& out) const noexcept;
  void restrict_block_lanes(int level, RowId row, LaneSpan span, const RowVector& sums) noexcept;
  void note_prolonged_blocks(int level, RowId row, LaneSpan span, const RowVector& way) noexcept;
  void prolong_to_blocks(int level, Displacement& state, const ObstacleView& obstacles) noexcept;
  void stop_at_obstacles(std::size_t block, const Displacement& state, const ObstacleView& obstacles,
                         Tool tool) noexcept;
  [[nodiscard]] BoundarySprings::Support support_of_block(std::size_t block) const noexcept;
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
  LazyArray<std::uint16_t> row_has_limit_load_;  // [row] number of voxels with a limit load
  LimitedCorrection limited_correction_;
  // Rows with a frozen residual, and their loads (N). The loads are contiguous, so that freezing touches few
  // pages of memory.
  LazyVector<RowId> frozen_rows_;
  LazyArray<float> frozen_residual_;        // [index into frozen_rows_][axis][lane]
  LazyArray<std::uint16_t> frozen_number_;  // [row] 1 + index; 0: not frozen
  std::unique_ptr<RigidBlocks> blocks_;     // null: there are no blocks
  std::vector<BlockState> block_state_;
  std::vector<BlockBound> block_bounds_;
  std::array<AxisLimits, 3> yield_limits_;
  bool all_visited_ = false;  // cycles visit every row of their boxes, so active flags are not kept
  bool restricts_all_ = false;
  float tolerance_N_ = 0.0F, motion_tolerance_m_ = 0.0F, boundary_scale_ = 1.0F;
};

}  // namespace voxel
