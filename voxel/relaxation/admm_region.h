// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue at its limits beside a body: brought to its least energy within limits and obstacles together.
//
// There hardly a voxel can go by itself where its links pull it, nor can all that hang on one another in the
// same direction: one that slides along the body takes what hangs on it up or down as it goes aside, each
// another way. One by one they stay where they came to be, whatever is done on coarser levels: under a ball
// with 2 % of their energy left to give, and the ball rested where it should have been carried by 0.94 of its
// weight.
//
// So the least energy is looked for outside of the limits as well, by the alternating direction method of
// multipliers (Boyd et al., Distributed Optimization and Statistical Learning via ADMM, 2011, chapter 3),
// with a sweep of Gauss and Seidel's in place of the exact minimum. Multipliers are kept from call to call.
// What was found is brought within the limits, and the tissue goes there as far as its energy falls.
//
// The same under the tool, in objects that lie beside nothing else: what it presses slides on its tangent
// plane, and what hangs on that by tight links goes along. (Without, a ball ten spacings deep in 10^6 voxels
// was felt by 2.3 % too much for good, and 1.4 % of the energy was left.)
//
// The multipliers are the forces of links at their limits and of obstacles: coarse levels know of the first
// (Multigrid::tie), or they would pull at what these hold, and a body that gives way feels the second.
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
  // All its memory now, which else comes where a body first goes.
  void prepare_all();
  // … but what is kept by voxel, a large part of which no tool comes to.
  void prepare_lists();

  // Voxels round those that limits hold, or that lie `on_body`, and on from there along links at their
  // limits, go on towards their least energy. Empty: those that lay on a body the last time, and for longer.
  // Where no link is at its limit, or something is squeezed into an obstacle, which no multiplier balances,
  // all is forgotten. `briefly`: half as long, in tissue that is on its way. Returns the largest force that
  // moved one of them (N).
  double relax(Multigrid& multigrid, Displacement& state, const ObstacleView& obstacles,
               std::span<const VoxelId> on_body, bool briefly = false) noexcept;
  // Was there any link at its limit?
  [[nodiscard]] bool found() const { return found_; }
  // What presses a voxel on its obstacle, as the last relax() left it (N).
  [[nodiscard]] double pressed_N(VoxelId v) const noexcept {
    const double x = static_cast<double>(pressed_[0][v]), y = static_cast<double>(pressed_[1][v]),
                 z = static_cast<double>(pressed_[2][v]);
    return std::sqrt(x * x + y * y + z * z);
  }
  // There was nothing to do: what nobody asked about for some calls is forgotten.
  void pass(Multigrid& multigrid) noexcept;
  void forget(Multigrid& multigrid) noexcept;
  // Work of the last relax(), in voxel updates.
  [[nodiscard]] std::uint64_t looked_at() const { return looked_at_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Penalty of the augmented Lagrangian (unit: the link's own spring, or the voxel's springs at its obstacle).
  static constexpr double kOfLink = 1.0;

  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  using Axes = std::array<double, 3>;
  struct Member {
    VoxelId v = 0;
    bool moves = false;    // false: it is beside the region
    bool outside = false;  // of an obstacle, or of the tool
    Obstacle plane;        // that, as the voxel meets it
    std::array<std::uint32_t, 3> up{kNone, kNone, kNone}, down{kNone, kNone, kNone};  // members beside it
    Axes from{}, found{};     // where it is, and is to go (m)
    Axes load_N{};            // beside its springs
    Axes inverse{};           // of all springs that hold it, per axis (m/N)
    double hold_N_per_m = 0;  // of its obstacle
    Axes out{}, pressed{};    // outside of that (m), and the multiplier, as a way of that spring (m)
  };
  struct Link {  // of a member and the one above it, per axis
    Axes stiff_N_per_m{}, low{}, high{};
    Axes within{}, beyond{};  // its limits (m), and the multiplier, as a way of that spring (m)
    std::uint8_t near = 0;    // bits: it may come to a limit
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
  LazyVector<VoxelId> on_body_;  // as was said last
  LazyVector<Member> members_;
  LazyVector<Link> links_;           // [3 member + d]
  LazyArray<std::uint32_t> number_;  // [v] 1 + index into members_; 0: none
  // What is kept from call to call.
  LazyVector<VoxelId> known_;
  LazyArray<std::uint32_t> asked_;           // [v] in which call, of those known; 0: none
  std::array<LazyArray<float>, 9> beyond_;   // [3 axis + d][v] of the link to the voxel above (m)
  std::array<LazyArray<float>, 3> pressed_;  // [axis][v] (N)
  std::uint32_t calls_ = 0;
  std::uint64_t looked_at_ = 0;
  bool found_ = false;
};

// `visit(link, other member, up, d)` for the links of a member.
template <class Visit>
void AdmmRegion::for_links(std::size_t i, const Visit& visit) const noexcept {
  const Member& m = members_[i];
  for (std::size_t d = 0; d < 3; ++d) {
    if (m.up[d] != kNone) visit(links_[3 * i + d], members_[m.up[d]], true);
    if (m.down[d] != kNone) visit(links_[3 * m.down[d] + d], members_[m.down[d]], false);
  }
}

}  // namespace voxel
