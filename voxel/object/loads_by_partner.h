// SPDX-License-Identifier: GPL-3.0-or-later
// Divides the load on the held voxels of a soft object among the partners that hold them. For reports,
// between ticks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "voxel/object/soft_object.h"

namespace voxel {

// A partner is the hand, the anchors, or one rigid object (from number 2 on).
inline constexpr std::uint32_t kHandPartner = 0, kAnchorPartner = 1, kFirstRigidPartner = 2;
inline constexpr std::size_t kMostPartners = 64;  // bits of a set of partners

// A voxel that a partner holds against the pull of the voxel's links.
struct HeldVoxel {
  VoxelId v = 0;
  std::uint32_t partner = kHandPartner;
};

struct PartnerLoad {
  glm::dvec3 force_N{0.0};  // of the partner on the object (body frame)
  // False if links at their limits tie the partner to another partner, or to more voxels than are searched.
  // Then the displacements do not determine how the load is divided.
  bool known = true;
  bool through_limits = false;  // links at their limits may carry a part of the load
};

// Appends the anchored voxels that other tissue of the object may pull.
void list_anchors(const SoftObject& object, std::vector<HeldVoxel>& held);

// Returns the force of each of the `partners` partners on the object in its present state. The entry of the
// hand stays 0. The forces balance those of springs, bricks and other soft objects (SoftObject::pair_load),
// and the loads that links at their limits pass on to `held`. `hand_N` is the force of the hand on the
// object. It is needed where links at their limits tie voxels both to the hand and to one other partner: that
// partner carries the rest of their load. A voxel may be in `held` once for each of its partners. Allocates;
// reads the state only. Not for an object on nested patches or with rigid blocks.
[[nodiscard]] std::vector<PartnerLoad> loads_by_partner(const SoftObject& object,
                                                        std::span<const HeldVoxel> held, std::size_t partners,
                                                        const glm::dvec3& hand_N);

}  // namespace voxel
