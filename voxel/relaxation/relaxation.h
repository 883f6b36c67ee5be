// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation of the six-link energy towards equilibrium, under chain limits, anchors and obstacles.
//
// Per axis the energy is ½ Σ k (u(b) − u(a))² over the links. This is an anisotropic Laplace problem, solved
// by multigrid cycles (fas.h). A cycle works on a box of voxels and, on each coarser level, on a box of cells
// around it. So its cost hardly depends on the size of the object. A cycle is complete in itself: a cycle
// elsewhere never meets its corrections half prolonged.
//
// Around the contact there is a cycle in every tick (a *contact cycle*). Under asynchronous relaxation a
// cycle around a large patch may be split over ticks, and no other cycle runs between its parts. Elsewhere
// *tiles* (blocks of rows, dirty_tiles.h) in which something moved are relaxed one after the other, within a
// budget of voxel updates. The budget counts work, never time. A *round* is one visit of all tiles that wait.
// Terms of limits are explained in fas.h.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/multigrid/fas.h"
#include "voxel/relaxation/cluster_steps.h"

namespace voxel {

// An object is at rest if no free voxel is pulled by more than this share of the force scale.
inline constexpr double kRestingResidual = 1e-5;

// The tables of the relaxation that an object has from the beginning. whole: all tables, so that no tick pays
// for one. They take most of an object's memory. where_used: only those that are needed, for an object that
// does not tick.
enum class Tables : std::uint8_t { whole, where_used };

class AdmmRegion;

class Relaxation {
 public:
  explicit Relaxation(const Lattice& lattice);
  ~Relaxation();

  // Spends `budget` voxel updates on average over many calls. Single calls spend more or less, because a
  // cycle is not cut. Spends half of `budget` if a contact cycle ran since the last call, and less if the
  // object is at rest. Returns the updates spent.
  std::uint64_t run(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held,
                    std::uint64_t budget) noexcept;
  // Runs one cycle over the whole object. For references, not for the tick.
  void run_cycle(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held) noexcept;
  // Runs one cycle around the contact, which is the bounding box of `pressed`. `pressed` must be a non-empty
  // part of `held`. If the contact is wider than kMaxNear voxels, the cycle covers its middle only; whole
  // cycles relax the rest. `again`: another contact cycle has just ended. Under asynchronous relaxation this
  // cycle then skips smoothing on the way to the coarse levels, which is cheaper and moves far tissue more.
  // Returns the counted work: the number of Float8 whose prolongation would cost as much (about 45 ns each).
  // If a cycle around a large patch costs more than `at_once`, only a part of it is done, and
  // continue_contact() does the rest.
  static constexpr int kMaxNear = 64;
  static constexpr std::size_t kUnlimited = ~std::size_t{0};
  std::size_t relax_contact(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held,
                            std::span<const VoxelId> pressed, bool again = false,
                            std::size_t at_once = kUnlimited) noexcept;
  // Continues the cycle of relax_contact() in the same boxes with about `at_once` of counted work. Parts are
  // as equal as the steps allow. Voxels may be moved between parts.
  std::size_t continue_contact(Displacement& state, const ObstacleView& obstacles,
                               std::span<const VoxelId> held, std::size_t at_once) noexcept;
  [[nodiscard]] bool under_way() const { return step_ > 0 || plane_ > 0; }
  // A contact cycle has a large patch if it visits more than kSmallPatch Float8 on all levels together.
  // has_large_patch() tells whether the last or current contact cycle has one.
  static constexpr std::size_t kSmallPatch = 2500;
  // Factor on kSmallPatch (0 to 1). A smaller factor splits more cycles, for ticks that may do less work.
  void set_small_patch_share(double share) noexcept { small_patch_share_ = share; }
  [[nodiscard]] bool has_large_patch() const { return large_patch_; }
  // Ends a cycle that is under way; pending corrections wait for the next one.
  void end_contact() noexcept { step_ = plane_ = 0; }

  // Runs a cycle on boxes that are large enough for tissue that has to move by whole spacings. Too slow for
  // the tick. Active limits are released first, because during such motion each cycle has different active
  // limits. `coarse_first`, after a jump: coarse levels are relaxed to rest among themselves, and their
  // correction is then prolonged to all voxels of the boxes at once. Returns the number of Float8 visited.
  std::size_t relax_large_patch(Displacement& state, const ObstacleView& obstacles,
                                std::span<const VoxelId> held, std::span<const VoxelId> pressed,
                                bool coarse_first) noexcept;
  // Prolongs pending corrections in the boxes of relax_large_patch() and around them, and does nothing else.
  // Returns the number of Float8 prolonged.
  std::size_t prolong_large_patch(Displacement& state, const ObstacleView& obstacles,
                                  std::span<const VoxelId> pressed) noexcept;
  // Runs a cycle over the whole object, coarse levels first. Voxels get the correction last and are not
  // smoothed: call relax_around_blocks() after it. Returns the number of Float8 visited.
  std::size_t run_whole_coarse_first(Displacement& state, const ObstacleView& obstacles,
                                     std::span<const VoxelId> held) noexcept;
  // Relaxes voxels that limits hold under the tool (AdmmRegion). Rounds do so at their end; call it after
  // cycles that do not end a round.
  void relax_region(Displacement& state, const ObstacleView& obstacles) noexcept;
  // Runs a cycle around each rigid block that the tool presses, because the force depends on the springs all
  // around the block.
  void relax_around_blocks(Displacement& state, const ObstacleView& obstacles) noexcept;

  [[nodiscard]] LevelStiffness& couplings() { return multigrid_.couplings(); }
  [[nodiscard]] Multigrid& multigrid() { return multigrid_; }
  [[nodiscard]] const Multigrid& multigrid() const { return multigrid_; }

  // Call when voxels of a row (v / kRow) were moved from outside: the row and the rows beside it are relaxed
  // again.
  void mark_dirty(RowId row) noexcept { multigrid_.mark_dirty(0, row); }
  void mark_all_dirty() noexcept;
  // If links around voxels on a body are at their limits, relaxes these voxels and their neighbourhood
  // together (AdmmRegion). Returns false if no link is at its limit.
  bool relax_region(Displacement& state, const ObstacleView& obstacles,
                    std::span<const VoxelId> on_body) noexcept;
  [[nodiscard]] const AdmmRegion& region() const { return *region_; }
  // True if a link was at its limit in the last region that was relaxed under the tool or beside a body.
  [[nodiscard]] bool at_limits() const noexcept;
  // Call when something moved: relaxation goes on until the residual is below the tolerance again.
  void wake() noexcept {
    asleep_ = false;
    cycles_without_gain_ = 0;
    drift_m_ = furthest_m_ = {};
  }
  [[nodiscard]] bool asleep() const { return asleep_ && !shadow_busy_; }
  // From now on a shadow relaxes the object (shadow_object.h). This Relaxation only relaxes the neighbourhood
  // of the contact. Allocates.
  void leave_to_shadow();
  [[nodiscard]] bool left_to_shadow() const { return left_to_shadow_; }
  // True while a submitted state is with the shadow.
  [[nodiscard]] bool shadow_busy() const { return shadow_busy_; }
  // Call when the state was submitted to the shadow. From then on the shadow reduces the residual of this
  // state. So near the contact this residual is frozen: the tissue counts as at rest here until it moves
  // again.
  void assign_residual(Displacement& state, const ObstacleView& obstacles) noexcept;
  [[nodiscard]] bool idle() const { return asleep_; }
  // assign_residual() and resume() set the coarse cells of rows_to_drop() rows to 0. Call drop_coarse() in an
  // earlier tick to have this work done there. Pending corrections are lost.
  [[nodiscard]] std::size_t rows_to_drop() const noexcept { return multigrid_.rows_to_drop(); }
  void drop_coarse() noexcept {
    end_contact();
    multigrid_.drop_coarse();
  }
  // Call just before the last part of the shadow's result is applied. `residual_N` is the result's residual.
  void resume(double residual_N) noexcept {
    shadow_busy_ = false;
    end_contact();
    residual_N_ = residual_N;
    multigrid_.restart();
    multigrid_.release_active();
  }
  // Rows of voxels that the last contact cycle read: [first, last] of columns, j and k.
  struct NearRows {
    std::array<int, 3> first{0, 0, 0}, last{-1, -1, -1};
    // Distance of `row` from these rows (in rows or columns); 0: it is one of them.
    [[nodiscard]] int distance(const std::array<int, 3>& row) const {
      int most = 0;
      for (std::size_t d = 0; d < 3; ++d) most = std::max({most, first[d] - row[d], row[d] - last[d]});
      return most;
    }
  };
  [[nodiscard]] const NearRows& near_contact() const { return near_; }
  // Largest force on any free voxel (N), as the last round found it. Rounds skip rows at rest, so below the
  // tolerance the value is not exact.
  [[nodiscard]] double residual_N() const { return residual_N_; }
  // Relaxation stops when the residual falls below this (N), or has not fallen for a while: under active
  // limits a residual remains that no relaxation removes. Default: half of kRestingResidual of the lattice's
  // force scale.
  void set_tolerance(double tolerance_N) noexcept;
  // Number of rounds so far. A round covers everything that moves.
  [[nodiscard]] std::uint64_t cycles() const { return cycles_; }
  void prepare_all() noexcept { multigrid_.prepare_all(); }
  void prepare_beside_bodies();  // call if obstacles will move
  void prepare_under_tool();     // call for a shadow, whose rounds relax under the tool
  // Copies the state of `other`, which has the same lattice.
  void copy_from(const Relaxation& other) noexcept;
  // Call it after copy_from() if `other` is relaxed by a shadow, because it then has hardly any coarse cells.
  // Restricts all coarse cells anew.
  void renew_coarse(Displacement& state, const ObstacleView& obstacles) noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Float8 q0 … q1 along x, counted from the first voxel, and rows j0 … j1 and k0 … k1, inclusive.
  struct RowBox {
    int q0 = 0, q1 = -1, j0 = 0, j1 = -1, k0 = 0, k1 = -1;
  };
  // Boxes of one cycle on one level.
  struct LevelBoxes {
    RowBox smoothed;                         // relaxed
    RowBox parents;                          // cells above the relaxed box of the finer level
    RowBox source_cells;                     // the parents and the cells beside them, which prolong
    int first_source = 0, last_source = -1;  // range of the source cells along x
    RowBox prolonged;                        // receives the corrections of the coarser level's source cells
  };
  enum class Look : std::uint8_t { all_rows, active_rows };  // active: rows at rest are skipped

  void end_round(Displacement& state, const ObstacleView& obstacles, double residual_N) noexcept;
  void fix_held_voxels(const Displacement& state, std::span<const VoxelId> held) noexcept;
  double step_clusters(Displacement& state, const ObstacleView& obstacles) noexcept;
  std::uint64_t relax_tile(Displacement& state, const ObstacleView& obstacles, std::size_t number) noexcept;
  std::uint64_t commit_plastic_offsets(Displacement& state, std::uint64_t budget) noexcept;
  [[nodiscard]] bool tile_waits_for_coarse(std::size_t number) const noexcept;

  // ---- one cycle (v_cycle.cpp) ----
  static constexpr int kNoContact = -1;
  // Number of visits of levels 2 and 3 in a cycle. Each visit includes all coarser levels. Visits cost
  // little: at most a sixty-fourth of the whole object.
  enum class Visits : std::uint8_t { once, twice };
  void lay_boxes(const std::array<int, 3>& low, const std::array<int, 3>& high, int wide, int contact_margin,
                 Visits visits) noexcept;
  void lay_contact_boxes(std::span<const VoxelId> pressed, int margin, Visits visits) noexcept;
  void lay_whole_boxes(Visits visits) noexcept;
  // A cycle is a list of steps: on the way to coarse levels each level is smoothed and restricted; the
  // coarsest is solved; on the way back each level gets the correction (prolongs) and is smoothed. A level
  // that is visited again skips the first smoothing.
  struct Step {
    int level;
    enum What : std::uint8_t { smooths, restricts, solves, prolongs, smooths_after } what;
  };
  void list_steps();  // for each value of Visits; allocates
  void add_steps(std::vector<Step>& to, int level, Visits visits, bool again) const;
  [[nodiscard]] Step step_of(int n) const noexcept { return steps_now()[static_cast<std::size_t>(n)]; }
  [[nodiscard]] const std::vector<Step>& steps_now() const noexcept {
    return steps_[static_cast<std::size_t>(visits_)];
  }
  // Planes first … last along z of a step's box; plane 0 is the first of the box. Steps on all levels but the
  // coarsest may be split into planes.
  struct Planes {
    int first = 0, last = 0;
  };
  static constexpr Planes kAllPlanes{0, 1 << 24};  // planes beyond the box do not count
  [[nodiscard]] int planes_of_step(int n) const noexcept;
  [[nodiscard]] int steps() const noexcept { return static_cast<int>(steps_now().size()); }
  void cycle(Displacement& state, const ObstacleView& obstacles, Look look) noexcept {
    run_steps_over(0, steps(), state, obstacles, look);
  }
  void step(int n, Planes planes, Displacement& state, const ObstacleView& obstacles, Look look,
            bool smoothed) noexcept;
  std::size_t run_steps(Displacement& state, const ObstacleView& obstacles, std::size_t at_once) noexcept;
  [[nodiscard]] std::size_t work_of_step(int n) const noexcept;
  // Work of step n from plane `first` on.
  [[nodiscard]] std::size_t work_of_planes(int n, int first) const noexcept;
  void restrict_residual(int level, Displacement& state, const ObstacleView& obstacles, Look look,
                         Planes planes) noexcept;
  void fetch_ahead_below(int level, RowId row, const Displacement& state) const noexcept;
  void smooth_box(int level, int first_colour, Displacement& state, const ObstacleView& obstacles, Look look,
                  Planes planes) noexcept;
  void prolong_box(int level, Displacement& state, const ObstacleView& obstacles, Planes planes) noexcept;
  bool mark_source_cells(int level, Displacement& state, const ObstacleView& obstacles) noexcept;
  // Relaxes the coarse levels to rest among themselves. Voxels get the correction last and are not smoothed.
  void run_coarse_first(Displacement& state, const ObstacleView& obstacles) noexcept;
  void run_steps_over(int first, int last, Displacement& state, const ObstacleView& obstacles,
                      Look look) noexcept {
    for (int n = first; n < last; ++n) step(n, kAllPlanes, state, obstacles, look, false);
  }
  [[nodiscard]] bool restrict_due(int level, RowId row) const noexcept;
  template <class Visit>
  void for_rows(int level, const RowBox& box, const Visit& visit) noexcept;
  [[nodiscard]] RowBox clipped(int level, const RowBox& box) const noexcept;
  [[nodiscard]] int last_level() const noexcept;  // coarsest level of a cycle
  [[nodiscard]] static std::size_t groups(const RowBox& box);
  [[nodiscard]] static RigidBlocks::Box cells(const RowBox& b) {
    return {{b.q0 * kLanes, b.j0, b.k0}, {b.q1 * kLanes + kLanes - 1, b.j1, b.k1}};
  }
  [[nodiscard]] std::size_t octets_of_cycle() const noexcept;
  [[nodiscard]] LevelBoxes& boxes(int level) { return boxes_[static_cast<std::size_t>(level)]; }

  const Lattice& lattice_;
  Multigrid multigrid_;
  ClusterSteps cluster_steps_;
  std::unique_ptr<AdmmRegion> region_;
  std::vector<LevelBoxes> boxes_;
  std::array<std::vector<Step>, 2> steps_;  // [Visits]
  Visits visits_ = Visits::once;            // visits of the cycle whose boxes are laid
  LazyVector<VoxelId> standing_;            // voxels held on all axes in the last cycle
  bool tool_presses_ = false;               // the tool presses voxels
  bool patient_ = false;                    // rounds may take longer than a tick
  std::int64_t credit_ = 0;                 // voxel updates left; negative: overspent
  std::size_t round_left_ = 0;              // tiles left in this round
  // Search for tiles with a pending correction above them: the next tile, and the number of tiles searched in
  // vain.
  std::size_t cursor_ = 0, looked_at_ = 0;
  RowId commit_row_ = 0;  // next row whose plastic offsets are to be committed
  bool asleep_ = true, shadow_busy_ = false;
  bool left_to_shadow_ = false;  // a shadow relaxes the object
  NearRows near_;
  bool contact_relaxed_ = false;  // a contact cycle ran since the last run()
  bool large_patch_ = false;
  double small_patch_share_ = 1.0;
  int step_ = 0;                        // next step of a contact cycle, whose boxes are laid
  int plane_ = 0;                       // next plane of that step
  bool any_source_ = false;             // the cells that prolong in this step have a pending correction
  bool smoothed_ = false;               // the cycle skips smoothing on the way to coarse levels
  bool uncommitted_ = false;            // some plastic offset is not committed
  bool committing_ = false;             // offsets are being committed
  bool is_limited_correction_ = false;  // corrections move all voxels together (limited_correction.h)
  double residual_N_ = 0.0, running_residual_N_ = 0.0, tolerance_N_ = 0.0, least_residual_N_ = 0.0;
  float boundary_scale_ = 1.0F;
  std::array<double, 3> drift_m_{}, furthest_m_{};  // mean motion of clusters since wake(); its maximum
  float farthest_m_ = 0.0F;                         // a cell with a larger pending correction drops it
  int cycles_without_gain_ = 0;
  std::uint64_t cycles_ = 0;
};

}  // namespace voxel
