// SPDX-License-Identifier: GPL-3.0-or-later
// A link at its limit passes on a load that the displacements do not show. But it pulls its two ends with
// opposite forces. A *cluster* consists of all voxels that links at their limits tie together. In the sum of
// the loads of a cluster the forces of these links cancel, and the rest is the load that the partners of the
// cluster carry. Limits act on each axis separately, so each axis has its own clusters.
#include "voxel/object/loads_by_partner.h"

#include <algorithm>
#include <bit>
#include <glm/geometric.hpp>
#include <unordered_map>

#include "voxel/lattice/near_limit.h"
#include "voxel/lattice/voxel_links.h"

namespace voxel {
namespace {

// Fraction of the spacing. A link nearer to a limit counts as being at the limit. A false tie does no harm,
// because the loads that it adds balance at rest. A missed tie would lose a load.
constexpr float kTied = 0.02F;

using PartnerSet = std::uint64_t;  // bit n: partner n

constexpr PartnerSet set_of(std::uint32_t partner) {
  return PartnerSet{1} << partner;
}

// The clusters of one axis that contain held voxels.
class Clusters {
 public:
  static constexpr std::size_t kMost = 400'000;  // voxels that are searched, at most

  Clusters(const SoftObject& object, std::span<const HeldVoxel> held, int axis)
      : object_(object), lattice_(object.lattice()), axis_(axis) {
    for (const HeldVoxel& h : held) node(h.v, set_of(h.partner));
    for (std::uint32_t i = 0; i < voxels_.size() && voxels_.size() < kMost; ++i) tie(i);
  }
  [[nodiscard]] bool any_ties() const { return ties_; }
  [[nodiscard]] bool complete() const { return voxels_.size() < kMost; }

  // Calls visit(set of partners, load (N)) for each cluster.
  template <class Visit>
  void for_each(const Visit& visit) {
    std::vector<double> load_N(voxels_.size(), 0.0);
    std::vector<PartnerSet> partners(voxels_.size(), 0);
    for (std::uint32_t i = 0; i < voxels_.size(); ++i) {
      const std::uint32_t root = root_of(i);
      load_N[root] += load_on(voxels_[i]);
      partners[root] |= partners_[i];
    }
    for (std::uint32_t i = 0; i < voxels_.size(); ++i) {
      if (parent_[i] == i) visit(partners[i], load_N[i]);
    }
  }

 private:
  std::uint32_t node(VoxelId v, PartnerSet partners) {
    const auto [at, fresh] = index_.try_emplace(v, static_cast<std::uint32_t>(voxels_.size()));
    if (fresh) {
      voxels_.push_back(v);
      partners_.push_back(partners);
      parent_.push_back(at->second);
    } else {
      partners_[at->second] |= partners;
    }
    return at->second;
  }
  std::uint32_t root_of(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  // Ties voxel number i to its neighbours across links at their limits. Anchored voxels are not tied to one
  // another.
  void tie(std::uint32_t i) {
    const VoxelId v = voxels_[i];
    if (!may_be_at_limit(lattice_, object_.state(), v, axis_, kTied)) return;
    const auto& u = object_.state().u[static_cast<std::size_t>(axis_)];
    for (int d = 0; d < 3; ++d) {
      const float tight_m = kTied * static_cast<float>(lattice_.spacing_m()[d]);
      for (const bool up : {false, true}) {
        const VoxelId w = up ? lattice_.up(v, d) : lattice_.down(v, d);
        if (!lattice_.filled(w) || (lattice_.anchored(v) && lattice_.anchored(w))) continue;
        const float longer = up ? u[w] - u[v] : u[v] - u[w];
        const auto bounds = lattice_.bounds(up ? v : w, d, axis_);
        if (longer > bounds[0] + tight_m && longer < bounds[1] - tight_m) continue;
        ties_ = true;
        parent_[root_of(node(w, lattice_.anchored(w) ? set_of(kAnchorPartner) : 0))] = root_of(i);
      }
    }
  }
  [[nodiscard]] double load_on(VoxelId v) const {
    double load_N = link_force(lattice_, object_.state(), v)[axis_];
    const std::uint32_t s = object_.surface_number(v);
    if (s != SoftObject::kNoSurface && object_.state().role[v] == Displacement::held)
      load_N += object_.pair_load(s)[axis_];
    return load_N;
  }

  const SoftObject& object_;
  const Lattice& lattice_;
  int axis_;
  bool ties_ = false;
  std::unordered_map<VoxelId, std::uint32_t> index_;
  std::vector<VoxelId> voxels_;
  std::vector<PartnerSet> partners_;
  std::vector<std::uint32_t> parent_;
};

struct Group {
  PartnerSet partners = 0;
  double load_N = 0.0;
};

// Divides the loads of one axis among the partners.
void divide(std::span<const Group> groups, int axis, double hand_N, std::span<PartnerLoad> out) {
  const PartnerSet hand = set_of(kHandPartner);
  double hand_alone_N = 0.0;
  std::size_t with_hand = 0;
  for (const Group& group : groups) {
    if (group.partners == hand) hand_alone_N -= group.load_N;
    if ((group.partners & hand) != 0 && group.partners != hand) ++with_hand;
  }
  for (const Group& group : groups) {
    if (group.partners == 0 || group.partners == hand) continue;
    const PartnerSet others = group.partners & ~hand;
    const bool beside_hand = others != group.partners;
    if (std::popcount(others) > 1 || (beside_hand && with_hand > 1)) {
      for (std::size_t p = 0; p < out.size(); ++p) {
        if ((others >> p & 1U) != 0) out[p].known = false;
      }
      continue;
    }
    const auto p = static_cast<std::size_t>(std::countr_zero(others));
    out[p].force_N[axis] -= group.load_N + (beside_hand ? hand_N - hand_alone_N : 0.0);
  }
}

// May other tissue pull this voxel? Links reach the six neighbours. Bricks also reach neighbours across edges
// and corners.
bool may_be_pulled(const SoftObject& object, VoxelId v) {
  const Lattice& lattice = object.lattice();
  if (lattice.has_bricks() || lattice.has_plasticity()) return true;
  for (int d = 0; d < 3; ++d) {
    for (const VoxelId w : {lattice.up(v, d), lattice.down(v, d)}) {
      if (lattice.filled(w) && object.state().at(w) != glm::dvec3(0.0)) return true;
    }
  }
  return false;
}

}  // namespace

void list_anchors(const SoftObject& object, std::vector<HeldVoxel>& held) {
  const Lattice& lattice = object.lattice();
  for (RowId row = 0; row < lattice.grid().rows(); ++row) {
    for (std::uint32_t lanes = lattice.anchored_lanes(row); lanes != 0; lanes &= lanes - 1) {
      const VoxelId v = row * kRow + static_cast<VoxelId>(std::countr_zero(lanes));
      if (may_be_pulled(object, v)) held.push_back({v, kAnchorPartner});
    }
  }
}

std::vector<PartnerLoad> loads_by_partner(const SoftObject& object, std::span<const HeldVoxel> held,
                                          std::size_t partners, const glm::dvec3& hand_N) {
  std::vector<PartnerLoad> out(partners);
  const auto all_unknown = [&out] {
    for (PartnerLoad& load : out) load.known = false;
  };
  if (partners > kMostPartners) {
    all_unknown();
    return out;
  }
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<Group> groups;
    Clusters clusters(object, held, axis);
    if (!clusters.complete()) all_unknown();
    if (clusters.any_ties()) {
      for (PartnerLoad& load : out) load.through_limits = true;
    }
    clusters.for_each([&](PartnerSet set, double load_N) {
      const auto found =
          std::find_if(groups.begin(), groups.end(), [set](const Group& g) { return g.partners == set; });
      (found != groups.end() ? *found : groups.emplace_back(Group{.partners = set})).load_N += load_N;
    });
    divide(groups, axis, hand_N[axis], out);
  }
  return out;
}

}  // namespace voxel
