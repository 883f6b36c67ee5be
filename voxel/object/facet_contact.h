// SPDX-License-Identifier: GPL-3.0-or-later
// Contact of two soft objects: surface voxels of the first, each on a facet of the second. A facet is a
// triangle between three voxels of a surface.
//
// Contact of voxels with voxels would fail: balls slide off one another into the gaps between them, and
// surfaces that are not level meet too late.
#pragma once

#include <array>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "voxel/object/soft_object.h"

namespace voxel {

// Pose of an object's volume frame: point_in_scene = origin + rotation · point_in_body.
struct BodyPose {
  glm::dvec3 origin{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
};

struct PosedObject {
  SoftObject& object;
  const BodyPose& pose;
};

// A voxel of the first object and the facet of the second object under it. In contact the distance between
// voxel and facet, along an axis of the second's lattice, is `reach_m`.
struct PressedPair {
  VoxelId a = 0, b = 0;     // the voxel, and the voxel of the other surface that is nearest to it
  glm::dvec3 force_N{0.0};  // force on the facet; opposite to that on the voxel (scene frame)
  glm::dvec3 side{
      0.0};      // direction from the first object to the second (scene frame, unit); 0: unknown, no contact
  int axis = 0;  // axis of the second's lattice along which distance is measured
  bool upwards = false;            // the second's outside is in the + direction of that axis
  bool over = false;               // a facet, or an edge nearby, is under the voxel
  std::array<VoxelId, 3> facet{};  // corners of the facet
  std::array<double, 3> share{};   // the voxel's barycentric coordinates: the corners' shares of the force
  glm::dvec3 across{0.0};  // gradient of the overlap with respect to the voxel's position (scene frame); with
                           // respect to the facet's position the gradient is the opposite
  double reach_m = 0.0;    // distance of voxel and facet in contact, along the axis
  // Derived from the members above, and kept until the facet is found anew: the gradient in both body frames,
  // the overlap of the surfaces at rest, and the surface numbers of voxel and corners.
  glm::dvec3 across_a{0.0}, across_b{0.0};
  double at_rest_m = 0.0;
  std::uint32_t number_a = 0;
  std::array<std::uint32_t, 3> number{};
};

// Makes a pair of two surface voxels that may touch, one of each object. `side` is 0 if the two surfaces face
// the same way, because the direction from one object to the other is then unknown.
[[nodiscard]] PressedPair pair_of(const PosedObject& a, VoxelId in_a, const PosedObject& b,
                                  VoxelId in_b) noexcept;

// Finds the facet under the voxel in the current state, starting at pair.b. Call before a round of
// relax_pair().
void find_facet(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept;

// Is the voxel no longer over its facet?
[[nodiscard]] bool left_facet(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;

// Does the voxel of `pair` also touch the facet of `beside`, over which it was before? Sets the shares of
// `beside` in the current state. In a hollow a voxel may touch several facets at a time. Each facet then has
// a pair with the same voxel. With one facet only, voxel and tool would be pushed from facet to facet in
// turns.
[[nodiscard]] bool lies_beside(const PosedObject& a, const PosedObject& b, const PressedPair& pair,
                               PressedPair& beside) noexcept;

// Gap of the two surfaces (m; negative: overlap); infinite if the voxel is over no facet.
[[nodiscard]] double gap_of_pair(const PosedObject& a, const PosedObject& b,
                                 const PressedPair& pair) noexcept;

// Claims the pair's voxels for the pair solver, and releases them.
void claim_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;
void release_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;

// Set the pair loads of the voxels (SoftObject::pair_load()) to 0, and add the load of a pair. Before a round
// of relax_pair(), call clear_pair_load() on all pairs, and then load_pair() once a pair. So rounding errors
// do not accumulate.
void clear_pair_load(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;
void load_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;

// One step of block Gauss-Seidel on a pair: its voxels move to the joint minimum of their link energies
// without overlap. The loads of their other pairs act on them. Where the two surfaces overlap before the
// step, both move apart, in proportion to their compliance. At equilibrium both objects press with equal and
// opposite force, also if several pairs share a voxel. A voxel that has passed through the facet is still
// pressed back to its own side. Returns gap_of_pair() afterwards. It is negative if chains leave too little
// room.
double relax_pair(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept;

// Which object's voxels move.
enum class GiveWay : std::uint8_t { both, first, second };
// Removes remaining overlap by drag(); call settle_dragged() after all pairs, so that the chains follow. True
// if there was any.
bool part_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair, GiveWay who) noexcept;

}  // namespace voxel
