// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation of the six-link energy towards its equilibrium, under chain limits, anchors and obstacles.
//
// Per axis the energy is ½ Σ k (u(b) − u(a))² over the links: an anisotropic Laplace problem, solved by
// multigrid cycles (see fas.h). A cycle works on a box of voxels and, on each coarser level, on a box
// of cells round it: about the same work for any size of object, and whole in itself, so that cycles in
// different places, one after the other, never find one another half done. (A cycle over the whole object,
// cut into pieces of a tick's work, was rejected: with cycles round the contact in between, what it had set
// aside to be told was found a second time and told twice, and a contact in a large object sank.)
//
// Round the contact there is a cycle in every tick, or, where another thread relaxes the object and the
// contact is wide, a part of one: no other cycle comes between its parts. Everywhere else one tile after the
// other that was stirred, as many voxel updates as the budget says: counted work, never measured time.
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

// An object counts as at rest when no free voxel is pulled by more than this share of the force scale.
inline constexpr double kRestingResidual = 1e-5;

class AdmmRegion;

class Relaxation {
 public:
  explicit Relaxation(const Lattice& lattice);
  ~Relaxation();

  // Spends `budget` voxel updates, on average over many calls (a cycle is not cut), unless the object is at
  // rest; half of it where a contact was relaxed since the last call. Returns what it spent.
  std::uint64_t run(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held,
                    std::uint64_t budget) noexcept;
  // One cycle over the whole object. For references, not for the tick.
  void run_cycle(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held) noexcept;
  // One cycle round the contact: the box of `pressed`, of which there is one at least; those of them are in
  // `held`. Of a contact wider than kMaxNear voxels the middle: the rest is left to whole cycles.
  // `again`: another ended just before. Where the object is left to another (below), such a one goes straight
  // to the coarse levels. It is cheaper by a quarter, and takes more of what the tool moved to where it
  // reaches far: an organ held 1.2 s into a path was 0.12 to 0.2 N off, now 0.04, of 1.43; a block in which
  // all is near was 0.075 N off at most, now 0.095.
  // Returns what it took, in counted work: as many octets told, of 45 ns or so.
  // Of a wide one (below) that takes more than `at_once` a part is done; the rest is for continue_contact().
  static constexpr int kMaxNear = 64;
  static constexpr std::size_t kWhole = ~std::size_t{0};
  std::size_t relax_contact(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held,
                            std::span<const VoxelId> pressed, bool again = false,
                            std::size_t at_once = kWhole) noexcept;
  // Goes on with it, in the same boxes, by about so much; a step at least. Parts are as equal as these let
  // them be. Between two of them everything may be moved.
  std::size_t continue_contact(Displacement& state, const ObstacleView& obstacles,
                               std::span<const VoxelId> held, std::size_t at_once) noexcept;
  [[nodiscard]] bool under_way() const { return step_ > 0 || plane_ > 0; }
  // Had the last one, or has this one, more than kNarrow octets to visit, on all levels?
  static constexpr std::size_t kNarrow = 2500;
  // … or than this share of it: where a tick has less work, more goes in parts.
  void set_narrow_share(double share) noexcept { narrow_share_ = share; }
  [[nodiscard]] bool wide() const { return wide_; }
  // What coarse levels have still to tell waits for the next cycle.
  void end_contact() noexcept { step_ = plane_ = 0; }

  // The same in boxes wide enough for tissue that has spacings to go, for a thread that has the time for it:
  // 2.5 ms where a whole cycle of 10^6 voxels takes 50. What limits hold is let go of first: while most of
  // the way is still to go, that is other voxels in every cycle. (A ball pressed ten spacings deep felt 18 %
  // too much after two times four such cycles, and 69 % after two times six in which it stayed held.)
  // After a jump `coarse_first`: the coarse levels come to rest among themselves, and then tell all voxels of
  // the boxes at once. One such cycle is worth four others there. Returns octets.
  std::size_t relax_large_patch(Displacement& state, const ObstacleView& obstacles,
                                std::span<const VoxelId> held, std::span<const VoxelId> pressed,
                                bool coarse_first) noexcept;
  // Coarse levels tell what is round such boxes what they know, and no more. Returns octets.
  std::size_t prolong_large_patch(Displacement& state, const ObstacleView& obstacles,
                                  std::span<const VoxelId> pressed) noexcept;
  // A cycle over all of the object, coarse levels first. Voxels are told last, and not smoothed:
  // relax_around_blocks() has to follow. (Smoothed everywhere before that, a force was 0.9 % off in place of
  // 0.2.) Returns octets, as a whole cycle's.
  std::size_t run_thoroughly(Displacement& state, const ObstacleView& obstacles,
                             std::span<const VoxelId> held) noexcept;
  // What limits hold under the tool (see AdmmRegion), after cycles that are not of whole rounds.
  void relax_limited(Displacement& state, const ObstacleView& obstacles) noexcept;
  // A cycle round each part without slack that the tool presses: springs all about it are what is felt.
  void relax_around_blocks(Displacement& state, const ObstacleView& obstacles) noexcept;

  [[nodiscard]] LevelStiffness& couplings() { return multigrid_.couplings(); }
  [[nodiscard]] Multigrid& multigrid() { return multigrid_; }
  [[nodiscard]] const Multigrid& multigrid() const { return multigrid_; }

  // Voxels of a row (v / kRow) were moved by somebody else: it and the rows beside it are to be looked at.
  void mark_dirty(RowId row) noexcept { multigrid_.mark_dirty(0, row); }
  void mark_all_dirty() noexcept;
  // Where links round voxels that lie on a body are at their limits: these and all round them go on towards
  // their least energy. False: no link is.
  bool relax_limited(Displacement& state, const ObstacleView& obstacles,
                     std::span<const VoxelId> on_body) noexcept;
  [[nodiscard]] const AdmmRegion& limited() const { return *limited_; }
  // Did links at their limits hold what the tool, or a body, presses, when they were last asked?
  [[nodiscard]] bool limits_hold() const noexcept;
  // Something moved: relax until the residual is below the tolerance again.
  void wake() noexcept {
    asleep_ = false;
    cycles_without_gain_ = 0;
    drift_m_ = furthest_m_ = {};
  }
  [[nodiscard]] bool asleep() const { return asleep_ && !away_; }
  // From now on another relaxes it (shadow_object.h), and what is left to do here is to follow the tool with
  // what is near the contact. Allocates.
  void leave_to_another();
  [[nodiscard]] bool left_to_another() const { return apart_; }
  // … and is at it now.
  [[nodiscard]] bool away() const { return away_; }
  // It was given to that: nothing to do here until somebody moves something. What pulls near the contact is
  // the other's business now, and counts as balanced here.
  void assign_residual(Displacement& state, const ObstacleView& obstacles) noexcept;
  [[nodiscard]] bool idle() const { return asleep_; }
  // What comes with that, and with take_over(), done ahead of it: what coarse cells had still to tell is
  // lost.
  [[nodiscard]] std::size_t rows_to_drop() const noexcept { return multigrid_.rows_to_drop(); }
  void drop_coarse() noexcept {
    end_contact();
    multigrid_.drop_coarse();
  }
  // What it found is taken from here on; with that residual (N).
  void take_over(double residual_N) noexcept {
    away_ = false;
    end_contact();
    residual_N_ = residual_N;
    multigrid_.begin_anew();
    multigrid_.release_limited();
  }
  // Rows of voxels that the last cycle round a contact read, as rows and columns: [first, last] of columns,
  // j, k.
  struct NearRows {
    std::array<int, 3> first{0, 0, 0}, last{-1, -1, -1};
    // How many rows away one is; 0: it is one of them.
    [[nodiscard]] int distance(const std::array<int, 3>& row) const {
      int most = 0;
      for (std::size_t d = 0; d < 3; ++d) most = std::max({most, first[d] - row[d], row[d] - last[d]});
      return most;
    }
  };
  [[nodiscard]] const NearRows& near_contact() const { return near_; }
  // Largest force that any free voxel still feels, as the last cycle over all that moves found it (unit:
  // newton); below the tolerance it is only known to be that.
  [[nodiscard]] double residual_N() const { return residual_N_; }
  // Cycles stop when the residual falls below this (unit: newton), or has not fallen for a while: what chain
  // limits hold has a residual that no relaxation removes. Default: half of kRestingResidual of the lattice's
  // force scale, so that no more than that is left.
  void set_tolerance(double tolerance_N) noexcept;
  // Cycles over all that moves.
  [[nodiscard]] std::uint64_t cycles() const { return cycles_; }
  void prepare_all() noexcept { multigrid_.prepare_all(); }
  void prepare_beside_bodies();  // that move
  void prepare_under_tool();     // for whole rounds there, which a replica has
  // Starts in the same state as `other`, of the same lattice …
  void copy_from(const Relaxation& other) noexcept;
  // … which was left to another, so that its coarse cells know next to nothing: they are found anew.
  void renew_coarse(Displacement& state, const ObstacleView& obstacles) noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Octets q0 … q1 along x, counted from the first voxel on, and rows j0 … j1 and k0 … k1, all included.
  struct RowBox {
    int q0 = 0, q1 = -1, j0 = 0, j1 = -1, k0 = 0, k1 = -1;
  };
  // Of one cycle, on one level.
  struct LevelBoxes {
    RowBox smoothed;                         // what is brought to rest
    RowBox parents;                          // cells that hold what is brought to rest on the level below
    RowBox source_cells;                     // these, and the cells beside them
    int first_source = 0, last_source = -1;  // cells along x
    RowBox told;                             // what the next level's tellers have something to tell
  };
  enum class Look : std::uint8_t { all, active };  // rows at rest are left alone

  void end_round(Displacement& state, const ObstacleView& obstacles, double residual_N) noexcept;
  void hold_what_stands(const Displacement& state, std::span<const VoxelId> held) noexcept;
  double step_clusters(Displacement& state, const ObstacleView& obstacles) noexcept;
  std::uint64_t relax_tile(Displacement& state, const ObstacleView& obstacles, std::size_t number) noexcept;
  std::uint64_t commit_plastic_offsets(Displacement& state, std::uint64_t budget) noexcept;
  [[nodiscard]] bool tile_waits_for_coarse(std::size_t number) const noexcept;

  // ---- one cycle (v_cycle.cpp) ----
  static constexpr int kNoContact = -1;
  // How often levels 2 and 3 are solved in a cycle, each time with all coarser ones. Of a whole object they
  // have next to nothing: a sixty-fourth of it and less.
  enum class Visits : std::uint8_t { once, twice };
  void lay_boxes(const std::array<int, 3>& low, const std::array<int, 3>& high, int wide, int contact_margin,
                 Visits visits) noexcept;
  void lay_contact_boxes(std::span<const VoxelId> pressed, int margin, Visits visits) noexcept;
  void lay_whole_boxes(Visits visits) noexcept;
  // In steps: on the way down a level is smoothed, then passed on; the coarsest; on the way up it is told,
  // then smoothed. A level that is solved again was smoothed last.
  struct Step {
    int level;
    enum What : std::uint8_t { smooths, restricts, solves, is_source, smooths_after } what;
  };
  void list_steps();  // of cycles of either kind; allocates
  void add_steps(std::vector<Step>& to, int level, Visits visits, bool again) const;
  [[nodiscard]] Step step_of(int n) const noexcept { return steps_now()[static_cast<std::size_t>(n)]; }
  [[nodiscard]] const std::vector<Step>& steps_now() const noexcept {
    return steps_[static_cast<std::size_t>(visits_)];
  }
  // All but the coarsest level's may be done by planes along z, first … last of the box, beginning with 0.
  struct Planes {
    int first = 0, last = 0;
  };
  static constexpr Planes kAllPlanes{0, 1 << 24};
  [[nodiscard]] int planes_of_step(int n) const noexcept;
  [[nodiscard]] int steps() const noexcept { return static_cast<int>(steps_now().size()); }
  void cycle(Displacement& state, const ObstacleView& obstacles, Look look) noexcept {
    run_steps_over(0, steps(), state, obstacles, look);
  }
  void step(int n, Planes planes, Displacement& state, const ObstacleView& obstacles, Look look,
            bool smoothed) noexcept;
  std::size_t run_steps(Displacement& state, const ObstacleView& obstacles, std::size_t at_once) noexcept;
  [[nodiscard]] std::size_t work_of_step(int n) const noexcept;
  [[nodiscard]] std::size_t work_of_planes(int n, int first) const noexcept;  // of it, from that plane on
  void restrict_residual(int level, Displacement& state, const ObstacleView& obstacles, Look look,
                         Planes planes) noexcept;
  void fetch_ahead_below(int level, RowId row, const Displacement& state) const noexcept;
  void smooth_box(int level, int first_colour, Displacement& state, const ObstacleView& obstacles, Look look,
                  Planes planes) noexcept;
  void prolong_box(int level, Displacement& state, const ObstacleView& obstacles, Planes planes) noexcept;
  bool mark_source_cells(int level, Displacement& state, const ObstacleView& obstacles) noexcept;
  // A cycle whose coarse levels come to rest among themselves; voxels are told last, and not smoothed.
  void run_coarse_first(Displacement& state, const ObstacleView& obstacles) noexcept;
  void run_steps_over(int first, int last, Displacement& state, const ObstacleView& obstacles,
                      Look look) noexcept {
    for (int n = first; n < last; ++n) step(n, kAllPlanes, state, obstacles, look, false);
  }
  [[nodiscard]] bool restrict_due(int level, RowId row) const noexcept;
  template <class Visit>
  void for_rows(int level, const RowBox& box, const Visit& visit) noexcept;
  [[nodiscard]] RowBox clipped(int level, const RowBox& box) const noexcept;
  [[nodiscard]] int last_level() const noexcept;  // of a cycle
  [[nodiscard]] static std::size_t octets(const RowBox& box);
  [[nodiscard]] static RigidBlocks::Box cells(const RowBox& b) {
    return {{b.q0 * kLanes, b.j0, b.k0}, {b.q1 * kLanes + kLanes - 1, b.j1, b.k1}};
  }
  [[nodiscard]] std::size_t octets_of_cycle() const noexcept;
  [[nodiscard]] LevelBoxes& boxes(int level) { return boxes_[static_cast<std::size_t>(level)]; }

  const Lattice& lattice_;
  Multigrid multigrid_;
  ClusterSteps cluster_steps_;
  std::unique_ptr<AdmmRegion> limited_;
  std::vector<LevelBoxes> boxes_;
  std::array<std::vector<Step>, 2> steps_;  // [Visits]
  Visits visits_ = Visits::once;            // of the cycle whose boxes these are
  LazyVector<VoxelId> standing_;            // what the last cycle found held, on all axes
  bool tool_presses_ = false;               // … or on the tool
  bool patient_ = false;                    // rounds are nobody's tick
  std::int64_t credit_ = 0;                 // voxel updates that may be spent; negative: were spent too many
  std::size_t round_left_ = 0;              // tiles until this round ends
  std::size_t cursor_ = 0, looked_at_ = 0;  // tiles looked at for what coarse levels have to tell them
  RowId keep_row_ = 0;                      // where keeping goes on
  bool asleep_ = true, away_ = false;
  bool apart_ = false;  // another relaxes it
  NearRows near_;
  bool contact_relaxed_ = false;  // since run() last was
  bool wide_ = false;
  double narrow_share_ = 1.0;
  int step_ = 0;                        // the next one of a cycle round the contact, with its boxes in boxes_
  int plane_ = 0;                       // … and the next plane of that
  bool any_source_ = false;             // has a level of it anything to tell?
  bool smoothed_ = false;               // and on its way down nothing is smoothed
  bool unkept_ = false;                 // some link is beyond what it keeps
  bool keeping_ = false;                // it is kept now
  bool is_limited_correction_ = false;  // voxels are told all at once
  double residual_N_ = 0.0, running_residual_N_ = 0.0, tolerance_N_ = 0.0, least_residual_N_ = 0.0;
  float hold_ = 1.0F;
  std::array<double, 3> drift_m_{}, furthest_m_{};  // of clusters at limits, since it was woken
  float farthest_m_ = 0.0F;                         // a cell that has more to tell forgets it
  int cycles_without_gain_ = 0;
  std::uint64_t cycles_ = 0;
};

}  // namespace voxel
