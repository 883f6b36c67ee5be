// SPDX-License-Identifier: GPL-3.0-or-later
// A soft object that a tool can press: lattice, displacement, chain, relaxation and the contact between them.
// All points and vectors are in the volume frame ("body") of the object, in metres and newtons.
//
// Terms: a surface voxel near the tool is *touched* (a contact candidate, one Touch each). A touched voxel
// that carries load towards the tool is *pressed* (an active contact). A *held* voxel does not move while
// others relax. *Dependents* of a voxel are tied to it by links at active limits. A *pair* is a contact of a
// voxel of one soft object with a facet of another (facet_contact.h). It presses voxels of both.
//
// One haptic tick calls (see hybrid/tick/tick.cpp): touch() takes the surface voxels near the tool →
// push_out() moves voxels out of the tool, and the chain follows → relax_near() brings the neighbourhood of
// the contact near equilibrium → reaction() returns force and stiffness → the proxy moves by δ → follow()
// moves the pressed voxels along. The sequence from push_out() on repeats a few times; relax_background()
// runs once.
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

// The tool in the frame of one soft object.
struct ToolInBody {
  enum class Shape : std::uint8_t { ball, punch } shape = Shape::ball;
  glm::dvec3 centre{0.0};           // of the ball, or of the punch's flat face (unit: meter)
  glm::dvec3 axis{0.0, 0.0, -1.0};  // punch: unit vector out of its face
  double radius = 0.0;              // of ball or face (unit: meter)
};

// Force of the object on the tool and its derivative: the quadratic model that the proxy minimises.
struct Reaction {
  glm::dvec3 force_N{0.0};
  // Symmetric, positive semi-definite; of the pressed voxels, with all other voxels fixed.
  glm::dmat3 stiffness_N_per_m{0.0};
  std::uint32_t pressed = 0;  // voxels that carry load
};

// Load on a voxel that a rigid surface or another soft object presses.
struct ContactLoad {
  glm::dvec3 force_N{0.0};            // of its links and of its dependents
  glm::dvec3 stiffness_N_per_m{0.0};  // per axis, of the voxel and its dependents, all others fixed
  bool at_limit = false;              // a link at its limit carries load between the voxel and another one
  bool has_multipliers = false;  // AdmmRegion knows the multipliers of limits and obstacles around the voxel
  double pressed_N = 0.0;        // force of its obstacle along the normal; 0 unless has_multipliers
};

// The tool's centre q must satisfy normal · q >= offset (body frame).
struct ToolBound {
  glm::dvec3 normal{0.0};
  double offset = 0.0;
  VoxelId voxel = 0;  // the voxel that bounds the tool
};

class SoftObject {
 public:
  // Largest number of touched voxels. Other voxels near the tool are left to the next tick.
  static constexpr std::size_t kMaxTouched = 4096;

  explicit SoftObject(std::shared_ptr<const Lattice> lattice, Tables tables = Tables::whole);
  ~SoftObject();
  SoftObject(const SoftObject&) = delete;
  SoftObject& operator=(const SoftObject&) = delete;
  SoftObject(SoftObject&&) = delete;
  SoftObject& operator=(SoftObject&&) = delete;
  // Returns an object in the same state that shares the lattice. For references beside a running session.
  // Allocates.
  [[nodiscard]] std::unique_ptr<SoftObject> copy(Tables tables = Tables::whole) const;

  [[nodiscard]] const Lattice& lattice() const { return *lattice_; }
  [[nodiscard]] const std::shared_ptr<const Lattice>& shared_lattice() const { return lattice_; }
  [[nodiscard]] const Displacement& state() const { return state_; }
  // Displacement of a voxel (unit: meter). state() has it only without patches (see below).
  [[nodiscard]] glm::dvec3 displacement(VoxelId v) const noexcept {
    return on_grid_ ? displacement_on_grid(v) : state_.at(v);
  }
  [[nodiscard]] glm::dvec3 position(VoxelId v) const {
    return on_grid_ ? position_on_grid(v) : lattice_->rest(v) + state_.at(v);
  }
  // A voxel acts as a ball of this radius: the tool's surface stays this far from the voxel's centre.
  [[nodiscard]] double voxel_radius() const { return 0.5 * lattice_->min_spacing_m(); }
  // Distance from a ball tool's centre to the centre of a voxel in contact. A tool smaller than the gaps
  // between voxels is felt as if it were just too large to slip between them.
  [[nodiscard]] double reach(double tool_radius) const;

  // A large object may keep its contact on nested patches (composite/grid.h). Then the cost of a tick does
  // not depend on depth and size. state() then stays at rest, and displacement() returns the present
  // displacements. Patches are only for objects that touch nothing but the tool and rigid surfaces that stand
  // still. Call use_composite_grid() before obstacles are set. If the object is unsuitable, returns the
  // reason and changes nothing. Returns an empty string if patches are in use. Allocates.
  static constexpr std::size_t kLeastOnGrid = 10'000;  // voxels
  // `margin`: voxels of the finest patch beyond the contact, on each side. A wide tool has less.
  std::string use_composite_grid(const ToolInBody& tool, int margin);
  [[nodiscard]] bool uses_patches() const { return grid_ != nullptr; }
  // Largest relative force error in trials of use_composite_grid(), against patches twice as wide.
  [[nodiscard]] double patch_error() const { return patch_error_; }
  // The patches; null unless something is pressed.
  [[nodiscard]] const CompositeGrid* patches_in_use() const { return on_grid_ ? grid_.get() : nullptr; }
  // Call it once a tick while nothing is pressed. It prepares a part of the patches for this tool.
  void come_near_on_grid(const ToolInBody& tool) noexcept;
  // Surface voxels in the finest patch. During a contact every touched voxel is among them.
  [[nodiscard]] std::span<const VoxelId> near_on_grid() const { return near_on_grid_; }
  // Replaces the patches by wider ones (CompositeGrid::kReferenceHalfWidth), for references. Allocates.
  void widen_patches();

  // ---- the tick; none of these allocates, locks or throws ----
  // Sets the touched voxels: surface voxels near the tool, each once; at most kMaxTouched are kept.
  void touch(std::span<const VoxelId> near) noexcept;
  // Moves every touched voxel out of the tool, and the chain follows. True if any voxel overlapped the tool.
  bool push_out(const ToolInBody& tool) noexcept;
  void relax_near(const ToolInBody& tool, int sweeps) noexcept;
  // True if a cycle around a large contact patch, or a part of one, ran since touch().
  [[nodiscard]] bool large_patch_cycle() const { return split_cycle_; }
  // Share (0 to 1) of the counted work that a tick may spend on its contact under asynchronous relaxation;
  // less than 1 for a slow machine. Later ticks do the remaining work.
  void set_work_share(double share) noexcept {
    work_share_ = own_work_share_ * share;
    relaxation_.set_small_patch_share(work_share_);
  }
  // The share on any machine. On nested patches a share below 1 bounds the axes that a tick relaxes.
  void set_own_work_share(double share) noexcept;
  [[nodiscard]] double work_share() const { return work_share_; }
  // Counted work (see Relaxation) that remains for this tick.
  [[nodiscard]] std::size_t work_left() const noexcept;
  // Does the tool press a large patch and hardly move? Slip of single voxels and results that are still to
  // come do not count as motion.
  [[nodiscard]] bool contact_is_still() const noexcept;
  // Makes the next tick neither begin nor continue a contact cycle while the tool presses the object.
  void skip_next_cycle() noexcept { skip_requested_ = true; }
  // Prepares the next exchange with the ShadowObject one tick ahead: drops coarse cells. Returns false, and
  // does nothing, if so few of them are due that they do not need a tick of their own.
  bool prepare_exchange() noexcept;
  [[nodiscard]] Reaction reaction(const ToolInBody& tool) noexcept;
  // The tool moves by `delta` (m): each pressed voxel moves by its component along the voxel's normal.
  void follow(const glm::dvec3& delta) noexcept;
  // Call it at the start of a tick. It records the depth of each touched voxel in the tool.
  void record_depths(const ToolInBody& tool) noexcept;
  // Writes bounds of the tool where the chain kept voxels in the tool. A voxel that does not move may stop
  // the tool but must not push it: the tool may stay as deep as it was when the tick began. A voxel that was
  // beside a punch when the tick began bounds the punch sideways. Returns the number of bounds written.
  std::size_t give_way(const ToolInBody& tool, std::span<ToolBound> out) const noexcept;
  // Does a chain of links at their limits tie the voxel to an anchor, or to a voxel that a rigid surface
  // stops along `direction`? Searches along the largest component of `direction`, through a few hundred
  // voxels at most.
  [[nodiscard]] bool is_immovable(VoxelId v, const glm::dvec3& direction) noexcept;
  std::uint64_t relax_background(std::uint64_t budget) noexcept;
  // Runs one cycle over the whole object, without a limit on its work. Does nothing if the object is at rest.
  void relax_cycle() noexcept;

  // Call it before the first set_obstacle(). Allocates.
  void reserve_obstacles();
  // Call it if obstacles will move, before a ShadowObject is made. Allocates the memory for that.
  void prepare_beside_bodies();
  // Sets the rigid surface near a surface voxel (index into lattice().surface()). A zero normal removes it.
  void set_obstacle(std::size_t surface_number, const Obstacle& obstacle) noexcept;
  [[nodiscard]] std::span<const Obstacle> obstacles() const { return obstacles_; }
  // Call it after obstacles moved: moves these surface voxels out of them in one wave; the chain follows.
  void leave_obstacles(std::span<const std::uint32_t> surface_numbers) noexcept;
  // Finds the loads of voxels at obstacles. `held` lists each voxel once, in the order of `loads`. Obstacles
  // press the first `pressed` voxels (kMaxTouched at most); the others are only near. If one of these is a
  // dependent of a pressed voxel on an axis, its own force on that axis is 0: the force is added to that of
  // the pressed voxel.
  void contact_loads(std::span<const VoxelId> held, std::size_t pressed,
                     std::span<ContactLoad> loads) noexcept;
  // Under asynchronous relaxation: if links at voxels pressed by fixed obstacles are at their limits, relaxes
  // these voxels and their neighbourhood together (AdmmRegion). Results of the shadow are applied row by row
  // and cannot move such voxels.
  void relax_at_obstacles(std::span<const VoxelId> pressed) noexcept;
  // Call it if the obstacle of surface voxel number s is gone. The voxel is then relaxed again.
  void mark_dirty(std::size_t surface_number) noexcept;
  // Rows that the chain or a result of the shadow moved since forget_moved_rows(). Obstacles may have to be
  // looked up there. Each row is listed once; at most the first kMostMovedRows are listed.
  static constexpr std::size_t kMostMovedRows = 1024;
  [[nodiscard]] std::span<const RowId> moved_rows() const { return moved_rows_; }
  void forget_moved_rows() noexcept;
  // Claims a voxel that another soft object presses: its role is `held`, and only the caller moves it. Calls
  // nest: the voxel is free after as many release() calls. See facet_contact.h.
  void claim(VoxelId v) noexcept;
  void release(VoxelId v) noexcept;
  // Force of other soft objects on a surface voxel (body frame, N). If the chain is tight down to that voxel,
  // the tool feels this force.
  void clear_pair_load(std::uint32_t surface_number) noexcept {
    pair_load_[surface_number] = glm::vec3(0.0F);
  }
  void add_pair_load(std::uint32_t surface_number, const glm::dvec3& force_N) noexcept {
    pair_load_[surface_number] += glm::vec3(force_N);
  }
  [[nodiscard]] glm::dvec3 pair_load(std::uint32_t surface_number) const noexcept {
    return glm::dvec3(pair_load_[surface_number]);
  }
  // Finds the dependents of at most kMaxTouched voxels that pairs press. The dependents are kept until
  // forget_pair_dependents().
  void find_pair_dependents() noexcept;
  void forget_pair_dependents() noexcept;
  // Runs one cycle around the voxels that pairs press, or a part of a cycle for a large patch. Does nothing
  // unless these voxels have dependents, the tool presses nothing, and relaxation is asynchronous.
  void relax_near_pairs() noexcept;
  // For a voxel that pairs press. The load is that of the voxel's dependents, without the voxel's own links.
  // The stiffness is that of the voxel with its dependents. Both are 0 if no dependents are known.
  [[nodiscard]] ContactLoad dependents_of_pair(std::uint32_t surface_number) const noexcept {
    if (pair_dependents_.empty()) return {};
    const std::uint32_t entry = pair_entry_[surface_number];
    return entry == 0 ? ContactLoad{} : pair_dependents_[entry - 1U];
  }
  // For the pair solver: the displacement at which the links alone are in equilibrium, and the compliance per
  // axis (m/N); both 0 at an anchor.
  [[nodiscard]] glm::dvec3 unconstrained_minimum(VoxelId v) noexcept;
  [[nodiscard]] glm::dvec3 compliance(VoxelId v) noexcept;
  // Moves a voxel as far as its links allow.
  void move(VoxelId v, const glm::dvec3& displacement) noexcept;
  // drag() moves a voxel regardless of its links. After all drags, call settle_dragged(): the chain follows.
  // Anchors and rigid surfaces may keep a voxel from the place to which it was dragged.
  void drag(VoxelId v, const glm::dvec3& by) noexcept;
  void settle_dragged() noexcept;

  [[nodiscard]] bool moved_ever() const { return moved_ever_; }
  [[nodiscard]] bool asleep() const { return relaxation_.asleep() && !on_grid_; }
  // Largest force left on any free voxel (N).
  [[nodiscard]] double residual_N() const { return relaxation_.residual_N(); }
  [[nodiscard]] const Relaxation& relaxation() const { return relaxation_; }
  // Touched voxels of the last touch(), and their surface numbers.
  [[nodiscard]] std::span<const VoxelId> touched() const { return touched_voxels_; }
  [[nodiscard]] std::span<const std::uint32_t> touched_numbers() const { return touched_numbers_; }
  // Surface number of a voxel; kNoSurface for one inside.
  static constexpr std::uint32_t kNoSurface = Lattice::kNoSurface;
  [[nodiscard]] std::uint32_t surface_number(VoxelId v) const { return lattice_->surface_number(v); }

  // Displacement at any rest point in the body (m), interpolated between voxels; 0 if no voxel is near.
  [[nodiscard]] glm::dvec3 displacement_at(const glm::dvec3& rest_point) const noexcept;

  // Force of the springs on the anchors (N, body frame); at rest it equals the force that presses the object.
  // Empty if a link to an anchor is at its limit, because the spring of such a link does not show the link's
  // load. Also empty if the contact is on patches. For references.
  [[nodiscard]] std::optional<glm::dvec3> carried_by_anchors_N() const noexcept;
  // Energy of the springs plus plastic dissipation since the last state of rest (J). For tests and reports.
  [[nodiscard]] double energy_J() const noexcept;
  // Relaxes with the tool fixed until the residual is below `tolerance_N` or `max_cycles` passed; true in the
  // first case. For references, not for the tick.
  bool settle(const ToolInBody& tool, double tolerance_N, int max_cycles) noexcept;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  friend class ShadowObject;  // relaxes the same object on another thread
  // Objects with fewer voxels get all memory at construction (280 bytes a voxel), because the first access to
  // a page in a tick is slow. Larger objects get memory on first access.
  static constexpr std::size_t kPreparedWhole = 1U << 21U;

  struct Touch {
    VoxelId v;
    std::uint32_t surface;   // surface number; stored, because it takes a search
    bool pressed = false;    // carries load towards the tool
    glm::dvec3 rest{0.0};    // stored, because it is used several times a tick and costs two divisions
    glm::dvec3 normal{0.0};  // from tool to voxel, unit
    glm::dvec3 load{0.0};  // N; of its links; if there are pairs, blocks or obstacles, also of its dependents
    double start_depth = 0.0;       // depth in the tool at the start of the tick (m)
    bool beside_punch = false;      // it was beside a punch at the start of the tick
    bool at_limit = false;          // a link at its limit carries load between the voxel and another one
    glm::dvec3 frozen_motion{0.0};  // motion to equilibrium that remained when the residual was frozen (m)
    std::uint16_t block = 0;        // number of its rigid block, from 1 on (Lattice::block()); 0: none
  };
  struct Gap {
    double distance = 0.0;  // from the voxel to the tool's surface along normal; negative: overlap
    glm::dvec3 normal{0.0};
  };
  static constexpr std::size_t kMaxGathered = 20'000;  // pressed voxels and their dependents
  static constexpr double kDirtyMotion = 1e-5;  // fraction of the spacing; a smaller motion wakes nothing
  // Fraction of the voxel radius. A smaller overlap is left to the next push_out().
  static constexpr double kGiveWay = 0.01;
  struct Gathered {
    VoxelId v;
    std::uint32_t touch;  // touch (or index of a load) to which its load is added
  };
  struct Dependent {     // a dependent, and the link that first led to it
    std::uint32_t from;  // index into gathered_
    bool up, down;       // the link's limit pushes the dependent up, down
    double load;         // of the voxel and of its own dependents (N)
  };

  [[nodiscard]] glm::dvec3 position(const Touch& t) const { return t.rest + displacement(t.v); }
  [[nodiscard]] Gap gap(const ToolInBody& tool, const glm::dvec3& position) const noexcept;
  // Projects a voxel out of the tool, in the metric of its springs. `wished`: displacement at the equilibrium
  // of its links. `g`: on entry its gap at `wished`, on return its gap after the last projection.
  [[nodiscard]] glm::dvec3 project_on_tool(const ToolInBody& tool, const glm::dvec3& rest,
                                           const glm::dvec3& wished, const glm::dvec3& compliance,
                                           Gap& g) const noexcept;
  // surely_clear_of() is a quick test without a square root: true for most voxels outside of the tool, false
  // for all others. clear_of() is exact.
  [[nodiscard]] bool surely_clear_of(const ToolInBody& tool, const glm::dvec3& position) const noexcept;
  [[nodiscard]] bool clear_of(const ToolInBody& tool, const glm::dvec3& position) const noexcept;
  void settle_chain() noexcept;
  void note_moved(RowId row) noexcept;
  // Role of a voxel that the tool does not press; by id, and by surface number.
  [[nodiscard]] Displacement::Role resting_role(VoxelId v) const noexcept;
  [[nodiscard]] Displacement::Role resting_role_at(std::uint32_t surface) const noexcept;
  [[nodiscard]] bool is_claimed(const Touch& t) const {
    return !claimed_voxels_.empty() && pair_claims_[t.surface] != 0;
  }
  void set_touch_roles() noexcept;
  void assign_residual() noexcept;  // freezes the residual near the contact: the shadow owns it
  void keep_frozen_residual(float part) noexcept;  // the shadow still owns this fraction
  std::size_t list_held() noexcept;
  [[nodiscard]] bool any_pressed() const noexcept;
  [[nodiscard]] bool cycle_due() const noexcept;
  [[nodiscard]] std::size_t shared(std::size_t work) const noexcept;
  [[nodiscard]] std::size_t left_of(std::size_t work) const noexcept;  // part of `work` that is left
  // All arguments and results are displacements from rest. clamp_depth_in_tool() shortens the motion from
  // `now` to `place` so that the voxel gets no deeper into the tool than it is now.
  // project_on_tool_within_limits() finds the least energy on the tool within the links' limits.
  // project_voxel() is the constrained projection of one touched voxel.
  [[nodiscard]] glm::dvec3 clamp_depth_in_tool(const ToolInBody& tool, const glm::dvec3& rest,
                                               const glm::dvec3& now, const glm::dvec3& place) const noexcept;
  [[nodiscard]] glm::dvec3 project_on_tool_within_limits(const ToolInBody& tool, const VoxelLinks& links,
                                                         const glm::dvec3& wished,
                                                         Touch& touch) const noexcept;
  [[nodiscard]] glm::dvec3 project_voxel(const ToolInBody& tool, const VoxelLinks& links,
                                         Touch& touch) noexcept;
  void relax_touch(const ToolInBody& tool, Touch& touch) noexcept;
  // ---- touched voxels of rigid blocks, which move as one (rigid_block_contact.cpp) ----
  template <class Visit>
  void for_touched_blocks(const Visit& visit) noexcept;
  void bound_block(const ToolInBody& tool, std::uint16_t block, double within_m) noexcept;
  void push_blocks_out(const ToolInBody& tool) noexcept;
  void follow_blocks(const glm::dvec3& delta) noexcept;
  void relax_blocks(const ToolInBody& tool) noexcept;
  void add_reaction_of_blocks(const ToolInBody& tool, Reaction& reaction) noexcept;
  [[nodiscard]] glm::dvec3 dependents_of_block(std::size_t block,
                                               const Multigrid::AdmissibleInterval& room) noexcept;
  void gather_load_with_blocks(int axis) noexcept;
  [[nodiscard]] bool any_pressed(std::uint16_t block) const noexcept;
  void add_stiffness(int axis, glm::dmat3& stiffness) noexcept;
  [[nodiscard]] glm::dvec3 load_on(VoxelId v) noexcept;
  [[nodiscard]] double load_on(VoxelId v, int axis) noexcept;
  void move_followers() noexcept;
  void gather(VoxelId v, std::uint32_t touch) noexcept;
  [[nodiscard]] glm::dvec3 gather_load(glm::dmat3& stiffness) noexcept;
  void add_stiffness_of_touches(int axis, const glm::dvec3& way, glm::dmat3& stiffness) noexcept;
  void gather_load_with_pairs(int axis) noexcept;
  void add_dependents(int axis, std::span<const VoxelId> pressed, std::span<ContactLoad> loads) noexcept;
  void add_stiffness(int axis, std::span<ContactLoad> loads) noexcept;
  void reassign_multiplier(int axis) noexcept;
  void clear_gathered() noexcept;
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
  [[nodiscard]] std::array<bool, 3> axes_due(const glm::dvec3& way_m) noexcept;
  [[nodiscard]] std::array<bool, 3> fewer_axes_due() noexcept;
  [[nodiscard]] Reaction reaction_on_grid(const ToolInBody& tool) const noexcept;
  [[nodiscard]] bool at_anchors_end(VoxelId v, const glm::dvec3& direction) const noexcept;
  // Bound of a pressed voxel on one axis: the axis, the direction out of the tool, and the displacement at
  // the tool's surface.
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
  LazyArray<std::uint16_t> pair_claims_;      // [surface number] number of pairs that claim it
  LazyArray<glm::vec3> pair_load_;            // [surface number] force of other soft objects (N)
  std::vector<VoxelId> pair_sources_;         // voxels that pairs press, hardest first
  std::vector<ContactLoad> pair_dependents_;  // [as pair_sources_] their dependents; empty: none
  LazyArray<std::uint32_t> pair_entry_;       // [surface number] 1 + index into pair_sources_; 0: none
  std::vector<Obstacle> obstacles_;           // [surface number]; empty: there are no obstacles
  std::size_t moving_obstacles_ = 0;          // number of obstacles on moving bodies
  std::vector<RowId> moved_rows_;
  LazyArray<std::uint8_t> row_moved_;             // 1: in moved_rows_; empty: no obstacles
  std::vector<std::uint32_t> changed_obstacles_;  // surface numbers; changed since the last submission
  std::vector<std::uint8_t> obstacle_changed_;  // [surface number] 1: in changed_obstacles_; empty: no shadow
  LazyVector<Touch> touches_;
  LazyVector<Touch> touched_before_;   // pressed touches before touch()
  std::vector<VoxelId> pressed_last_;  // in the last contact cycle; empty if none is pressed
  ToolInBody tool_;                    // the tool in the last relax_near()
  std::vector<VoxelId> touched_voxels_;
  std::vector<std::uint32_t> touched_numbers_;  // [as touched_voxels_] surface number
  LazyVector<VoxelId> claimed_voxels_;          // claimed by pairs
  LazyVector<VoxelId> held_voxels_;             // voxels pressed by the tool, then those claimed by pairs
  LazyVector<VoxelId> sources_;
  LazyVector<glm::vec3> moves_;
  std::vector<BlockBound> block_bounds_;    // of one rigid block: first by the tool, then by limits
  std::vector<std::uint32_t> bound_touch_;  // [as the first of block_bounds_] index into touches_
  std::vector<std::uint8_t> block_seen_;    // [block] 1: for_touched_blocks() has visited it
  LimitReactions limit_reactions_;
  LimitFollowers limit_followers_;
  std::vector<VoxelId> limit_sources_;     // sources of the two above: pressed, not anchored
  LazyVector<Gathered> gathered_;          // pressed voxels first, then their dependents
  LazyVector<Dependent> dependents_;       // [as gathered_]
  LazyArray<std::uint8_t> gathered_mark_;  // [v] 1: in gathered_ (within touch(): was pressed; between drag()
                                           // and settle_dragged(): was dragged)
  LazyArray<std::uint32_t> gathered_index_;  // [v] touch or load of that voxel; only if marked
  double unrelaxed_m_ = 0.0;                 // motion of pressed voxels since the last wake of the background
  double unsettled_m_ = 0.0;                 // estimated distance of the contact from equilibrium
  std::size_t contact_work_ = 0;             // counted work of contact cycles since touch() …
  int cycles_since_touch_ = 0;               // … and their number
  int cold_ticks_ = 0;  // ticks for which the contact's neighbourhood is not in the caches yet
  double own_work_share_ = 1.0, work_share_ = 1.0;
  bool split_cycle_ = false;  // a cycle around a large patch ran, or a part of one
  bool skip_requested_ = false;
  bool skips_cycle_ = false;  // no contact cycle begins in this tick unless the tool jumps
  bool dragging_ = false;     // sources_ lists the dragged voxels, moves_ their displacements before the drag
  bool moved_ever_ = false;
  bool anchors_pull_ = false;   // since push_out() a wave of the chain reached anchors that stopped it
  bool beside_bodies_ = false;  // prepare_beside_bodies() was called
  bool on_grid_ = false;        // a contact exists, and its displacements are on nested patches
  std::unique_ptr<CompositeGrid> grid_;  // null: contacts are in state_
  double patch_error_ = 0.0;
  std::vector<VoxelId> near_on_grid_;
  struct TouchOnGrid {  // a touched voxel in the finest patch at the start of a cycle
    std::uint32_t touch;
    std::array<int, 3> voxel;
    double gap_m;
  };
  std::vector<TouchOnGrid> touches_on_grid_;
  std::array<int, 3> centre_{};      // of the contact (voxel)
  std::uint32_t grid_ticks_ = 0;     // since the contact began
  std::array<int, 3> axis_waits_{};  // cycles since each axis was relaxed; with force they count twice
  glm::dvec3 grid_force_N_{0.0}, grid_tool_m_{0.0};  // force and tool position of the last cycle
  ContactEnergy contact_energy_;
  double nearest_m_ = 0.0;  // smallest gap between a voxel and the tool
  glm::dvec3 dent_m_{0.0};  // mean displacement of the voxels pressed last
};

}  // namespace voxel
