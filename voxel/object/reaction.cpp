// SPDX-License-Identifier: GPL-3.0-or-later
// The reaction to the tool: its force and its stiffness. Without links at their limits each pressed voxel
// contributes its load along its normal. Where voxels are tied by such links, their loads are summed first.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "voxel/lattice/near_limit.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/object/soft_object.h"
#include "voxel/relaxation/admm_region.h"

namespace voxel {

Reaction SoftObject::reaction(const ToolInBody& tool) noexcept {
  if (grid_) return reaction_on_grid(tool);
  Reaction result;
  for (Touch& t : touches_) {
    t.at_limit = false;
    t.load = glm::dvec3(0.0);
    if (!t.pressed || t.block != 0) continue;
    t.normal = gap(tool, position(t)).normal;
    t.load = load_on(t.v);
  }
  glm::dvec3 dependents_N(0.0);
  const bool by_rows = claimed_voxels_.empty() && block_seen_.empty();
  if (by_rows) dependents_N = gather_load(result.stiffness_N_per_m);
  for (int axis = 0; axis < 3 && !by_rows; ++axis) {
    if (block_seen_.empty()) {
      gather_load_with_pairs(axis);
    } else {
      gather_load_with_blocks(axis);
    }
    add_stiffness(axis, result.stiffness_N_per_m);
    clear_gathered();
  }
  // Links at their limits pass load between voxels, along and across their normals. Only the sum over all of
  // these voxels is well defined: in this sum the chain's own forces cancel.
  for (const Touch& t : touches_) {
    if (t.pressed && t.at_limit && t.block == 0) result.force_N += t.load;
  }
  result.force_N += dependents_N;
  const glm::dvec3 through_links = result.force_N;
  for (const Touch& t : touches_) {
    if (!t.pressed || t.block != 0) continue;
    const double load = glm::dot(t.at_limit ? through_links : t.load, t.normal);
    if (!t.at_limit && load < 0.0) {
      // Frictionless: the tool feels the load along the normal. A load that pulls is no contact.
      result.force_N += load * t.normal;
    }
    if (load < 0.0) ++result.pressed;
  }
  if (!block_seen_.empty()) add_reaction_of_blocks(tool, result);
  if (result.pressed == 0) result.force_N = glm::dvec3(0.0);  // a load that pulls is no contact
  return result;
}

}  // namespace voxel
