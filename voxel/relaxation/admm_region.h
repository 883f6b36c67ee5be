// SPDX-License-Identifier: GPL-3.0-or-later
// Minimises the energy of tissue at its limits, beside a body or under the tool. Limits and obstacles are
// solved together on a small region.
//
// Relaxation of one voxel at a time hardly works there: limits block each single voxel, and a voxel that
// slides along a body drags its dependents in other directions. Coarse levels do not help.
//
// The solver is the alternating direction method of multipliers (ADMM; Boyd et al., Distributed Optimization
// and Statistical Learning via ADMM, 2011, chapter 3), with a Gauss-Seidel sweep instead of the exact
// minimisation. Multipliers are kept from call to call. The result is clamped to the limits, and the tissue
// moves towards it as far as its energy falls.
//
// If the object touches nothing but the tool, the region also contains the voxels that the tool presses, and
// the voxels tied to them by links at their limits (their dependents). Pressed voxels slide on the tool's
// tangent planes.
//
// Multipliers are the forces of links at their limits and of obstacles. The coarse levels get the forces of
// links as loads (Multigrid::set_limit_load): otherwise they would pull at voxels that limits hold. A moving
// body feels the forces of obstacles.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/multigrid/fas.h"

namespace voxel {

class AdmmRegion {
 public:
  explicit AdmmRegion(const Lattice& lattice);
  // Allocates all memory now rather than when a body is first pressed.
  void prepare_all();
  // Allocates all memory except the arrays by voxel, most of which a tool never touches.
  void prepare_lists();

  // Relaxes a region. It consists of the voxels that active limits hold, the voxels `on_body` (that lie on a
  // moving body), and their neighbourhood, which extends further along links at their limits. If `on_body` is
  // empty, the last list that was not empty is used again, with more sweeps. `briefly` halves the sweeps, for
  // tissue that is still moving. Returns the largest force that moved a voxel (N). Two cases end with nothing
  // moved and all multipliers dropped: no link is at its limit, or a voxel is squeezed into an obstacle. No
  // multiplier balances the force on a squeezed voxel.
  double relax(Multigrid& multigrid, Displacement& state, const ObstacleView& obstacles,
               std::span<const VoxelId> on_body, bool briefly = false) noexcept;
  // Was any link of the region at its limit in the last relax()?
  [[nodiscard]] bool at_limits() const { return at_limits_; }
  // Force between a voxel and its obstacle after the last relax() (N).
  [[nodiscard]] double pressed_N(VoxelId v) const noexcept {
    const double x = static_cast<double>(pressed_[0][v]), y = static_cast<double>(pressed_[1][v]),
                 z = static_cast<double>(pressed_[2][v]);
    return std::sqrt(x * x + y * y + z * z);
  }
  // Call skip() if there is nothing to relax: it drops multipliers that no call has used for a while.
  // forget() drops all of them.
  void skip(Multigrid& multigrid) noexcept;
  void forget(Multigrid& multigrid) noexcept;
  // Work of the last relax(), in voxel updates.
  [[nodiscard]] std::uint64_t looked_at() const { return looked_at_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Penalty of a link in the augmented Lagrangian (unit: the link's own spring).
  static constexpr double kOfLink = 1.0;

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  using Axes = std::array<double, 3>;
  struct Member {
    VoxelId v = 0;
    bool moves = false;    // false: a fixed voxel that borders the region
    bool outside = false;  // it has to stay outside of an obstacle or of the tool
    Obstacle plane;        // half-space that bounds the displacement, of the obstacle or the tool
    std::array<std::uint32_t, 3> up{kNone, kNone, kNone},
        down{kNone, kNone, kNone};  // neighbours, as indices into members_
    Axes from{}, found{};           // displacement before relax(), and of the current iterate (m)
    Axes load_N{};                  // load without the forces of its links
    Axes inverse{};                 // 1 / (springs of its links and all penalties), per axis (m/N)
    double hold_N_per_m = 0;        // penalty of its obstacle
    // Displacement that ADMM keeps outside of the obstacle (m); force of the obstacle / hold_N_per_m (m).
    Axes out{}, pressed{};
  };
  struct Link {  // from a member to its neighbour above; values per axis
    Axes stiff_N_per_m{}, low{}, high{};
    // Difference of the ends that ADMM keeps within the limits (m); force of the limit / penalty (m).
    Axes within{}, beyond{};
    std::uint8_t near = 0;  // bits: axes on which it may reach a limit
  };

  std::uint32_t add(VoxelId v) noexcept;
  [[nodiscard]] bool at_limit(const Displacement& state, VoxelId v, VoxelId up, int d) const noexcept;
  bool gather(const Multigrid& multigrid, const Displacement& state, bool with_tool) noexcept;
  void add_neighbours() noexcept;
  bool prepare(Multigrid& multigrid, const Displacement& state, const ObstacleView& obstacles) noexcept;
  void prepare_links(LevelStiffness& couplings) noexcept;
  [[nodiscard]] double tighter(const Link& link, std::size_t axis) const noexcept;
  template <class Visit>
  void for_links(std::size_t i, const Visit& visit) const noexcept;
  void sweep(bool forwards) noexcept;
  void set_multipliers() noexcept;
  bool come_within(std::size_t axis, bool downwards) noexcept;
  bool allow() noexcept;
  [[nodiscard]] double share() const noexcept;
  void keep_multipliers(Multigrid& multigrid) noexcept;
  void forget(Multigrid& multigrid, VoxelId v) noexcept;

  const Lattice& lattice_;
  double spacing_m_;
  double tighter_m_ = 0.0;
  LazyVector<VoxelId> on_body_;  // the last `on_body` that was not empty
  LazyVector<Member> members_;
  LazyVector<Link> links_;           // [3 member + d]
  LazyArray<std::uint32_t> number_;  // [v] 1 + index into members_; 0: none
  // The following members are kept from call to call.
  LazyVector<VoxelId> known_;
  LazyArray<std::uint32_t> asked_;  // [v] number of the last call that used its multipliers; 0: it has none
  // [3 axis + d][v] Link::beyond of the link to the voxel above (m).
  std::array<LazyArray<float>, 9> beyond_;
  std::array<LazyArray<float>, 3> pressed_;  // [axis][v] force of the obstacle (N)
  std::uint32_t calls_ = 0;
  std::uint64_t looked_at_ = 0;
  bool at_limits_ = false;
};

// Calls visit(link, neighbour, up) for the links of a member. `up`: the neighbour is the upper end.
template <class Visit>
void AdmmRegion::for_links(std::size_t i, const Visit& visit) const noexcept {
  const Member& m = members_[i];
  for (std::size_t d = 0; d < 3; ++d) {
    if (m.up[d] != kNone) visit(links_[3 * i + d], members_[m.up[d]], true);
    if (m.down[d] != kNone) visit(links_[3 * m.down[d] + d], members_[m.down[d]], false);
  }
}

}  // namespace voxel
