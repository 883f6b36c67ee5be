// SPDX-License-Identifier: GPL-3.0-or-later
// A soft object that a tool can press: lattice, displacement, chain, relaxation and the contact between them.
// Everything here is in the volume frame ("body") of the object: meters, newtons.
//
// One haptic tick uses it so (see hybrid/tick/tick.cpp):
//   touch() names the surface voxels near the tool → push_out() moves what the tool overlaps, and the chain
//   with it → relax_near() brings the neighbourhood of the contact near equilibrium → reaction() says what
//   the tool feels and how stiff it is → the proxy moves by δ → follow() takes the pressed voxels along … a
//   few times; relax_background() once.
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "voxel/chain/chainmail.h"
#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/object/contact_energy_observer.h"
#include "voxel/relaxation/limit_followers.h"
#include "voxel/relaxation/limit_reactions.h"
#include "voxel/relaxation/relaxation.h"

namespace voxel {

class CompositeGrid;

// The tool as one soft object sees it.
struct ToolInBody {
  enum class Shape : std::uint8_t { ball, punch } shape = Shape::ball;
  glm::dvec3 centre{0.0};           // of the ball, or of the punch's flat face (unit: meter)
  glm::dvec3 axis{0.0, 0.0, -1.0};  // punch: unit vector out of its face
  double radius = 0.0;              // of ball or face (unit: meter)
};

// Force of the object on the tool, and how it grows when the tool moves: the quadratic model that the proxy
// minimises.
struct Reaction {
  glm::dvec3 force_N{0.0};
  glm::dmat3 stiffness_N_per_m{
      0.0};  // symmetric, positive semi-definite; of the pressed voxels with all others still
  std::uint32_t pressed = 0;  // voxels that carry load
};

// What one of several voxels that are held in place would pull at what holds it with.
struct HeldLoad {
  glm::dvec3 force_N{0.0};            // of its links, and of what hangs on it by tight links
  glm::dvec3 stiffness_N_per_m{0.0};  // per axis, of them all while the others stand still
  bool tight = false;                 // some tight link hands part of its load to or from another voxel
  bool balanced = false;              // limits and obstacles were found that hold it and all round it …
  double pressed_N = 0.0;             // … it with so much along its normal
};

// The tool's centre q must satisfy normal · q >= offset (body frame).
struct ToolBound {
  glm::dvec3 normal{0.0};
  double offset = 0.0;
  VoxelId voxel = 0;  // that is in the way
};

class SoftObject {
 public:
  static constexpr std::size_t kMaxTouched =
      4096;  // surface voxels near the tool; more are left to the next tick

  explicit SoftObject(std::shared_ptr<const Lattice> lattice);
  ~SoftObject();
  SoftObject(const SoftObject&) = delete;
  SoftObject& operator=(const SoftObject&) = delete;
  SoftObject(SoftObject&&) = delete;
  SoftObject& operator=(SoftObject&&) = delete;
  // The same object in the same state, sharing the lattice; for references found beside a running session.
  [[nodiscard]] std::unique_ptr<SoftObject> copy() const;

  [[nodiscard]] const Lattice& lattice() const { return *lattice_; }
  [[nodiscard]] const Displacement& state() const { return state_; }
  // How far a voxel has moved; in state() only where the object keeps its contact there (see below).
  [[nodiscard]] glm::dvec3 displacement(VoxelId v) const noexcept {
    return on_grid_ ? displacement_on_grid(v) : state_.at(v);
  }
  [[nodiscard]] glm::dvec3 position(VoxelId v) const {
    return on_grid_ ? position_on_grid(v) : lattice_->rest(v) + state_.at(v);
  }
  // A voxel is a ball of half its smallest spacing: the tool's surface stays this far from its centre.
  [[nodiscard]] double voxel_radius() const { return 0.5 * lattice_->min_spacing_m(); }
  // Distance of a ball tool's centre to the centre of a voxel it touches. A tool smaller than the gaps
  // between voxels is felt as one that just cannot slip between them.
  [[nodiscard]] double reach(double tool_radius) const;

  // A large object may keep what a tool does to it on a composite grid (grid.h): then
  // a tick costs the same for any depth and size, and state() is the object as it was before, at rest, while
  // displacement() is asked for what is felt. For objects that meet nothing but the tool. Returns what is in
  // the way of that, and it stays as it is; empty: nothing. Allocates.
  static constexpr std::size_t kLeastOnGrid = 10'000;  // voxels
  std::string use_composite_grid(const ToolInBody& tool);
  [[nodiscard]] bool uses_patches() const { return grid_ != nullptr; }
  // While something is pressed.
  [[nodiscard]] const CompositeGrid* patches_in_use() const { return on_grid_ ? grid_.get() : nullptr; }
  // Once a tick, while nothing is pressed: what a contact with this tool will need is made ready, a part at a
  // time.
  void come_near_on_grid(const ToolInBody& tool) noexcept;
  // Surface voxels where the contact is: while there is one, what may be touched is among them.
  [[nodiscard]] std::span<const VoxelId> near_on_grid() const { return near_on_grid_; }
  // Boxes many times as wide, for references. Allocates.
  void widen_patches();

  // ---- the tick; none of these allocates, locks or throws ----
  // The surface voxels near the tool, each once; at most kMaxTouched are kept.
  void touch(std::span<const VoxelId> near) noexcept;
  // Moves every touched voxel that the tool overlaps out of it, and the chain after. True when any was.
  bool push_out(const ToolInBody& tool) noexcept;
  void relax_near(const ToolInBody& tool, int sweeps) noexcept;
  // Was there, since touch(), a wide cycle round the contact, or a part of one? What it leaves of a tick, as
  // Relaxation counts work.
  [[nodiscard]] bool large_patch_cycle() const { return split_cycle_; }
  // Of the counted work that a tick has for its contact, where another relaxes the object: 1, all of it, or
  // less, for a machine on which that takes too long. What is not done in one tick is in the next ones.
  void set_work_share(double share) noexcept {
    work_share_ = share;
    relaxation_.set_narrow_share(share);
  }
  [[nodiscard]] double work_share() const { return work_share_; }
  [[nodiscard]] std::size_t work_left() const noexcept;
  // Is the tool pressed into it, wide enough for cycles in parts, and hardly moves? A voxel that slips, or a
  // result on its way, is no motion.
  [[nodiscard]] bool held_still() const noexcept;
  // While the tool presses it, no cycle round the contact is begun, or goes on, in the next tick.
  void ask_to_rest() noexcept { asked_to_rest_ = true; }
  // Part of what it takes to be given to a replica, or to take what that found, done in the tick before it;
  // false where there is too little of it to be worth a tick.
  bool prepare_exchange() noexcept;
  [[nodiscard]] Reaction reaction(const ToolInBody& tool) noexcept;
  // The tool moves by `delta`: pressed voxels go along, each by the part of it along its own normal.
  void follow(const glm::dvec3& delta) noexcept;
  // The tool as a tick begins: where each touched voxel is in it.
  void note_depths(const ToolInBody& tool) noexcept;
  // Where the chain did not let voxels out of the tool's way, the tool has to give way. But what did not move
  // can stop a tool, and cannot push one: where it was as deep when the tick began, the tool may stay, and
  // what was beside a punch then stops it by its side. (A punch that slid sideways under 8 mm of anchored
  // tissue was lifted out by it, and gave the hand 35 mJ from nothing.) Returns how many bounds were written.
  std::size_t give_way(const ToolInBody& tool, std::span<ToolBound> out) const noexcept;
  // Whether a voxel cannot move along `direction` because tight links tie it to what stands still: anchors,
  // or voxels on rigid surfaces. Looks along the largest component of it, no further than some hundred
  // voxels.
  [[nodiscard]] bool is_immovable(VoxelId v, const glm::dvec3& direction) noexcept;
  std::uint64_t relax_background(std::uint64_t budget) noexcept;
  // One whole cycle of it, however long that takes; nothing when at rest.
  void relax_cycle() noexcept;

  // Before the first set_obstacle(); allocates.
  void reserve_obstacles();
  // Some of them will move: all memory that this takes, now. Before a ShadowObject is made; allocates.
  void prepare_beside_bodies();
  // A rigid surface near surface voxel number s (index into lattice().surface()); a zero normal: none any
  // more.
  void set_obstacle(std::size_t surface_number, const Obstacle& obstacle) noexcept;
  [[nodiscard]] std::span<const Obstacle> obstacles() const { return obstacles_; }
  // Obstacles moved: brings these surface voxels out of theirs, as one wave, and the chain with them.
  void leave_obstacles(std::span<const std::uint32_t> surface_numbers) noexcept;
  // What voxels that obstacles hold press these with, each of `held` once, in their order. The first
  // `pressed` of them, kMaxTouched at most, do; the others are near: what of them hangs on the first is not
  // theirs.
  void load_held(std::span<const VoxelId> held, std::size_t pressed, std::span<HeldLoad> loads) noexcept;
  // What obstacles that answer to nothing press, while another thread relaxes the object and links there are
  // at their limits: goes on towards its least energy with all round it. A result is added row by row, and
  // none of them can go that way by itself.
  void relax_held(std::span<const VoxelId> pressed) noexcept;
  // An obstacle that surface voxel number s lay on went away: it looks for its place.
  void mark_dirty(std::size_t surface_number) noexcept;
  // Where there may be obstacles: rows that the chain moved, or what was found apart, since these were
  // forgotten, each once, the first kMostMovedRows of them.
  static constexpr std::size_t kMostMovedRows = 1024;
  [[nodiscard]] std::span<const RowId> moved_rows() const { return moved_rows_; }
  void forget_moved_rows() noexcept;
  // A voxel pressed by another soft object: moved by the caller, held meanwhile, until it was released as
  // often as it was held. See facet_contact.h.
  void hold(VoxelId v) noexcept;
  void release(VoxelId v) noexcept;
  // What other objects press it with (body frame, N): a tool under which the chain is tight down to it feels
  // that.
  void clear_pair_load(std::uint32_t surface_number) noexcept {
    pair_load_[surface_number] = glm::vec3(0.0F);
  }
  void add_pair_load(std::uint32_t surface_number, const glm::dvec3& force_N) noexcept {
    pair_load_[surface_number] += glm::vec3(force_N);
  }
  [[nodiscard]] glm::dvec3 pair_load(std::uint32_t surface_number) const noexcept {
    return glm::dvec3(pair_load_[surface_number]);
  }
  // What hangs by tight links on the voxels that pairs press, kMaxTouched of them at most: as it is now,
  // until it is forgotten.
  void find_hanging_on_pairs() noexcept;
  void forget_hanging_on_pairs() noexcept;
  // While something does, in an object that the tool does not press and another thread relaxes: a cycle round
  // these voxels, or a part of a wide one. Otherwise nothing.
  void relax_near_pairs() noexcept;
  // Of one of them, what that pulls it by, without its own links, and the springs of them all; 0: nothing
  // hangs on it.
  [[nodiscard]] HeldLoad hanging_on_pair(std::uint32_t surface_number) const noexcept {
    if (hanging_on_pairs_.empty()) return {};
    const std::uint32_t entry = hanging_entry_[surface_number];
    return entry == 0 ? HeldLoad{} : hanging_on_pairs_[entry - 1U];
  }
  // For the pair solver. Where its links alone would have a voxel, and how far a force of 1 N on it alone
  // would move it (m/N): both 0 where it is anchored.
  [[nodiscard]] glm::dvec3 free_displacement(VoxelId v) noexcept;
  [[nodiscard]] glm::dvec3 compliance(VoxelId v) noexcept;
  // Moves it, as far as its links allow.
  void move(VoxelId v, const glm::dvec3& displacement) noexcept;
  // Moves it however far, and, once all that is to be moved so was, the chain after: anchors and rigid
  // surfaces may keep it from getting there.
  void drag(VoxelId v, const glm::dvec3& by) noexcept;
  void settle_dragged() noexcept;

  [[nodiscard]] bool moved_ever() const { return moved_ever_; }
  [[nodiscard]] bool asleep() const { return relaxation_.asleep() && !on_grid_; }
  // Largest force left on any free voxel (N): what separates the state from equilibrium.
  [[nodiscard]] double residual_N() const { return relaxation_.residual_N(); }
  [[nodiscard]] const Relaxation& relaxation() const { return relaxation_; }
  // Touched voxels of the last touch(), for the map to look at, and their surface numbers.
  [[nodiscard]] std::span<const VoxelId> touched() const { return touched_voxels_; }
  [[nodiscard]] std::span<const std::uint32_t> touched_numbers() const { return touched_numbers_; }
  // Number of a surface voxel; kNoSurface for one inside.
  static constexpr std::uint32_t kNoSurface = Lattice::kNoSurface;
  [[nodiscard]] std::uint32_t surface_number(VoxelId v) const { return lattice_->surface_number(v); }

  // Displacement at any rest point in the body, from the voxels around it (unit: meter); 0 where none is
  // near.
  [[nodiscard]] glm::dvec3 displacement_at(const glm::dvec3& rest_point) const noexcept;

  // What its springs pull the anchors with (N, body frame): at rest, what presses it, whether or not links
  // are at their limits. Empty where a link to an anchor is, which carries what no spring says. For
  // references.
  [[nodiscard]] std::optional<glm::dvec3> carried_by_anchors_N() const noexcept;
  // What the springs store, and what yielding spent since the last state of rest (J); for tests and reports.
  [[nodiscard]] double energy_J() const noexcept;
  // Relaxes with the tool still until the residual is below `tolerance_N` or `max_cycles` passed; true when
  // it is. For references, not for the tick.
  bool settle(const ToolInBody& tool, double tolerance_N, int max_cycles) noexcept;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  friend class ShadowObject;  // the same object, relaxed elsewhere
  // Voxels of an object that has all its memory from the start, 280 bytes a voxel: what a tick touches for
  // the first time takes it five times as long. A larger one gets it where it is touched.
  static constexpr std::size_t kPreparedWhole = 1U << 21U;

  struct Touch {
    VoxelId v;
    std::uint32_t surface;   // its surface number, which takes a search to find
    bool pressed = false;    // carries load towards the tool
    glm::dvec3 rest{0.0};    // asked for several times a tick, and to find it takes two divisions
    glm::dvec3 normal{0.0};  // from tool to voxel, unit
    glm::dvec3 load{0.0};    // of its links; beside other soft objects, of what hangs on it, too (N)
    double noted = 0.0;      // how deep it was in the tool as the tick began (m)
    bool beside = false;     // it was beside a punch then
    bool tight = false;      // some tight link hands part of its load to or from another voxel
    glm::dvec3 left{0.0};    // the way it had still to go when the object was given away (m)
    std::uint16_t part = 0;  // without slack that it is in, plus one; 0: none
  };
  struct Gap {
    double distance = 0.0;  // of the voxel from the tool's surface along normal; negative: overlap
    glm::dvec3 normal{0.0};
  };
  static constexpr std::size_t kMaxCarried =
      20'000;                                   // voxels that may hang on the pressed ones by tight links
  static constexpr double kDirtyMotion = 1e-5;  // of the spacing: voxels that moved less wake nobody
  static constexpr double kGiveWay = 0.01;      // of the voxel radius: less is left to the next push
  struct Carried {
    VoxelId v;
    std::uint32_t touch;  // whose load it adds to
  };
  struct Hanging {       // as Carried, by the link through which it was first reached
    std::uint32_t from;  // index into carried_
    bool up, down;       // that link is at the limit that pulls it up, down
    double load;         // of it, and of what hangs on it (N)
  };

  [[nodiscard]] glm::dvec3 position(const Touch& t) const { return t.rest + displacement(t.v); }
  [[nodiscard]] Gap gap(const ToolInBody& tool, const glm::dvec3& position) const noexcept;
  // Where a voxel that is in the tool goes, its links wishing it at `wished` (from its rest place); `g`: its
  // gap there, and in the end its last one.
  [[nodiscard]] glm::dvec3 project_on_tool(const ToolInBody& tool, const glm::dvec3& rest,
                                           const glm::dvec3& wished, const glm::dvec3& compliance,
                                           Gap& g) const noexcept;
  // Is the gap no overlap? Most that is near is far enough to be told so without a root: surely.
  [[nodiscard]] bool surely_clear_of(const ToolInBody& tool, const glm::dvec3& position) const noexcept;
  [[nodiscard]] bool clear_of(const ToolInBody& tool, const glm::dvec3& position) const noexcept;
  void settle_chain() noexcept;
  void note_moved(RowId row) noexcept;
  // When no tool presses; of a voxel, and of a surface number.
  [[nodiscard]] Displacement::Role resting_role(VoxelId v) const noexcept;
  [[nodiscard]] Displacement::Role resting_role_at(std::uint32_t surface) const noexcept;
  [[nodiscard]] bool pair_held(const Touch& t) const {
    return !held_voxels_.empty() && pair_held_[t.surface] != 0;
  }
  void set_touch_roles() noexcept;
  void assign_residual() noexcept;      // what pulls near the contact is somebody else's
  void keep_away(float part) noexcept;  // … and this part of it still is
  std::size_t list_held() noexcept;
  [[nodiscard]] bool any_pressed() const noexcept;
  [[nodiscard]] bool cycle_due() const noexcept;
  [[nodiscard]] std::size_t shared(std::size_t work) const noexcept;
  [[nodiscard]] std::size_t left_of(std::size_t work) const noexcept;  // of a tick's; less while all is cold
  // From rest, all three: on the way to `place` no deeper in the tool than it is now; on the tool and within
  // its links' limits; where a touched voxel belongs.
  [[nodiscard]] glm::dvec3 no_deeper_in(const ToolInBody& tool, const glm::dvec3& rest, const glm::dvec3& now,
                                        const glm::dvec3& place) const noexcept;
  [[nodiscard]] glm::dvec3 project_on_tool_within_limits(const ToolInBody& tool, const VoxelLinks& links,
                                                         const glm::dvec3& wished,
                                                         Touch& touch) const noexcept;
  [[nodiscard]] glm::dvec3 place_of(const ToolInBody& tool, const VoxelLinks& links, Touch& touch) noexcept;
  void relax_touch(const ToolInBody& tool, Touch& touch) noexcept;
  // ---- touched voxels of parts without slack, which move as one (rigid_block_contact.cpp) ----
  template <class Visit>
  void for_touched_blocks(const Visit& visit) noexcept;
  void bound_block(const ToolInBody& tool, std::uint16_t part, double within_m) noexcept;
  void push_blocks_out(const ToolInBody& tool) noexcept;
  void follow_blocks(const glm::dvec3& delta) noexcept;
  void relax_blocks(const ToolInBody& tool) noexcept;
  void add_reaction_of_blocks(const ToolInBody& tool, Reaction& reaction) noexcept;
  [[nodiscard]] glm::dvec3 dependents_of_block(std::size_t part,
                                               const Multigrid::AdmissibleInterval& room) noexcept;
  void gather_load_with_blocks(int axis) noexcept;
  [[nodiscard]] bool any_pressed(std::uint16_t part) const noexcept;
  void add_stiffness(int axis, glm::dmat3& stiffness) noexcept;
  [[nodiscard]] glm::dvec3 load_on(VoxelId v) noexcept;
  [[nodiscard]] double load_on(VoxelId v, int axis) noexcept;
  void move_followers() noexcept;
  void carry(VoxelId v, std::uint32_t touch) noexcept;
  [[nodiscard]] glm::dvec3 gather_load(glm::dmat3& stiffness) noexcept;
  void add_stiffness_of_touches(int axis, const glm::dvec3& way, glm::dmat3& stiffness) noexcept;
  void gather_load_with_pairs(int axis) noexcept;
  void add_hanging(int axis, std::span<const VoxelId> pressed, std::span<HeldLoad> loads) noexcept;
  void add_stiffness(int axis, std::span<HeldLoad> loads) noexcept;
  void hand_on(int axis) noexcept;
  void let_go_of_carried() noexcept;
  [[nodiscard]] ObstacleView obstacle_view() const { return {obstacles_, lattice_.get(), moving_obstacles_}; }
  // ---- on the composite grid (soft_object_composite.cpp) ----
  [[nodiscard]] glm::dvec3 displacement_on_grid(VoxelId v) const noexcept;
  [[nodiscard]] glm::dvec3 position_on_grid(VoxelId v) const noexcept;
  [[nodiscard]] std::size_t most_in_box(int half_width) const;
  void list_near_on_grid() noexcept;
  void touch_on_grid(std::span<const VoxelId> near) noexcept;
  bool push_out_on_grid(const ToolInBody& tool) noexcept;
  void relax_on_grid(const ToolInBody& tool) noexcept;
  void put_aside(const ToolInBody& tool) noexcept;
  void press_on_grid(const ToolInBody& tool) noexcept;
  void settle_on_grid(const ToolInBody& tool) noexcept;
  [[nodiscard]] std::array<bool, 3> axes_due() noexcept;
  [[nodiscard]] double depth_on_grid() const noexcept;
  [[nodiscard]] Reaction reaction_on_grid(const ToolInBody& tool) const noexcept;
  [[nodiscard]] bool at_anchors_end(VoxelId v, const glm::dvec3& direction) const noexcept;
  // The axis along which a voxel is pressed, the way out of the tool, and where on it the tool's surface is.
  struct Bound {
    int axis = 0;
    double way = 1.0, u = 0.0;
    bool any = false;
  };
  [[nodiscard]] Bound bound_by(const ToolInBody& tool, const Touch& touch,
                               const glm::dvec3& u) const noexcept;

  std::shared_ptr<const Lattice> lattice_;
  Displacement state_;
  ChainMail chain_;
  Relaxation relaxation_;
  LazyArray<std::uint16_t> pair_held_;      // [surface number] pairs with other soft objects it is in
  LazyArray<glm::vec3> pair_load_;          // [surface number] and with what force (N)
  std::vector<VoxelId> pair_roots_;         // what pairs press, hardest first
  std::vector<HeldLoad> hanging_on_pairs_;  // [as pair_roots_]; empty: nothing hangs on any
  LazyArray<std::uint32_t> hanging_entry_;  // [surface number] 1 + index into these; 0: none
  std::vector<Obstacle> obstacles_;         // [surface number], empty when there is none
  std::size_t moving_obstacles_ = 0;        // of them, those of bodies that move
  std::vector<RowId> moved_rows_;
  LazyArray<std::uint8_t> row_moved_;             // 1: among them; empty: no obstacles
  std::vector<std::uint32_t> changed_obstacles_;  // surface numbers, since a replica was last told
  std::vector<std::uint8_t> obstacle_changed_;    // [surface number] 1: among them; empty: no replica
  LazyVector<Touch> touches_;
  LazyVector<Touch> touched_before_;   // those pressed then
  std::vector<VoxelId> pressed_last_;  // while any is pressed, and in the call in which the last is let go
  ToolInBody tool_;                    // as relax_near() last saw it
  std::vector<VoxelId> touched_voxels_;
  std::vector<std::uint32_t> touched_numbers_;  // [as touched_voxels_] surface number
  LazyVector<VoxelId> held_voxels_;             // by pairs
  LazyVector<VoxelId> all_held_;                // by the tool, too
  LazyVector<VoxelId> sources_;
  LazyVector<glm::vec3> moves_;
  std::vector<BlockBound> block_bounds_;    // of one part without slack: of touches, then others
  std::vector<std::uint32_t> bound_touch_;  // [as block_bounds_] of the first, index into touches_
  std::vector<std::uint8_t> block_seen_;    // [part] 1: for_touched_blocks() was there
  LimitReactions limit_reactions_;
  LimitFollowers limit_followers_;
  std::vector<VoxelId> roots_;              // of these: what is pressed and not anchored
  LazyVector<Carried> carried_;             // [pressed first, then what hangs on them by a tight link]
  LazyVector<Hanging> hanging_;             // [as carried_]
  LazyArray<std::uint8_t> carried_mark_;    // [v] 1: in carried_ (within touch(): was pressed)
  LazyArray<std::uint32_t> carried_index_;  // [v]
  double unrelaxed_m_ = 0.0;                // motion of pressed voxels since the background was last woken
  double unsettled_m_ = 0.0;                // how far the contact may be from the rest of the object
  std::size_t contact_work_ = 0;            // since touch(), of cycles round the contact …
  int cycles_since_touch_ = 0;              // of which there were so many
  int cold_ticks_ = 0;                      // for which what is near the contact is in no cache
  double work_share_ = 1.0;
  bool split_cycle_ = false;  // one of those cycles was wide
  bool asked_to_rest_ = false;
  bool rests_ = false;     // none of them is begun now, if that can wait
  bool dragging_ = false;  // sources_ are what drag() moved, moves_ where they were
  bool moved_ever_ = false;
  bool anchors_pull_ = false;            // since push_out(), a wave of the chain came to some, and they held
  bool beside_bodies_ = false;           // that move
  bool on_grid_ = false;                 // there is a contact, and it is on the composite grid
  std::unique_ptr<CompositeGrid> grid_;  // none: contacts are in state_
  std::vector<VoxelId> near_on_grid_;
  struct TouchOnGrid {  // of those in the box of level 0, near the tool as a cycle begins
    std::uint32_t touch;
    std::array<int, 3> voxel;
    double gap_m;
  };
  std::vector<TouchOnGrid> touches_on_grid_;
  std::array<int, 3> centre_{};                      // of the contact
  std::uint32_t grid_cycles_ = 0;                    // since it began
  glm::dvec3 grid_force_N_{0.0}, grid_tool_m_{0.0};  // and where the tool was
  ContactEnergy contact_energy_;
  double nearest_m_ = 0.0;  // of a voxel to the tool
};

}  // namespace voxel
