// SPDX-License-Identifier: GPL-3.0-or-later
// Two soft objects that press on one another: surface voxels of the first, each on a facet of the second, a
// triangle between three voxels of its surface.
//
// (Voxel against voxel, from centre to centre, was rejected: two surfaces of balls slide off one another into
// the gaps between them, and through, however slowly they are pressed: 5.5 mm of 2 mm balls. Across the
// surfaces, but still voxel on voxel, they met too late wherever the surface was not level: 0.4 of a
// spacing.)
#pragma once

#include <array>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "voxel/object/soft_object.h"

namespace voxel {

// Where an object's volume frame lies: point_in_scene = origin + rotation · point_in_body.
struct BodyPose {
  glm::dvec3 origin{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
};

struct PosedObject {
  SoftObject& object;
  const BodyPose& pose;
};

// A voxel of the first object and the facet of the second that it is over. The voxel stays as far from the
// facet, along an axis of the second's lattice, as two voxels that touch are apart.
struct PressedPair {
  VoxelId a = 0, b = 0;     // the voxel, and that of the other's surface which it is nearest to
  glm::dvec3 force_N{0.0};  // on the facet, equal and opposite to that on the voxel (scene frame)
  glm::dvec3 side{0.0};     // where the second belongs, seen from the first (scene frame, unit); 0: nowhere
  int axis = 0;             // of the second's lattice, along which the two are apart
  bool upwards = false;     // the surface of the second looks up that axis
  bool over = false;        // there is a facet under the voxel, or an edge close by
  std::array<VoxelId, 3> facet{};  // its corners, …
  std::array<double, 3> share{};   // … and how much of the force each takes: barycentric
  glm::dvec3 across{0.0};          // gradient of the distance when the facet moves (scene frame)
  double reach_m = 0.0;            // that distance in contact
  // Of these, until the facet is looked for again: the gradient in the bodies' frames, how deep the surfaces
  // would overlap with both objects at rest, and surface numbers of the voxel and the corners.
  glm::dvec3 across_a{0.0}, across_b{0.0};
  double at_rest_m = 0.0;
  std::uint32_t number_a = 0;
  std::array<std::uint32_t, 3> number{};
};

// A voxel of the first and one of the second's surface that lies where it may press. `side` is 0 where the
// two surfaces look the same way and say nothing of who is where.
[[nodiscard]] PressedPair pair_of(const PosedObject& a, VoxelId in_a, const PosedObject& b,
                                  VoxelId in_b) noexcept;

// Finds the facet under the voxel as both are now, from `b` on. Before a round of relax_pair().
void find_facet(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept;

// Has the voxel gone over the edge of the facet?
[[nodiscard]] bool left_facet(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;

// Where the surface is a hollow a voxel lies on several facets at a time, each of which it presses: a pair
// for each, all of the same voxel. Does it lie on that one, which it was on before, beside the one that it is
// over now? Finds its share of it, as both objects are now. (On the one that it was over alone, it was pushed
// down the slope of that, over the edge, and deep into the next, which pushed it back in the next tick: with
// it went the tool, up to 0.15 mm up and down a tick, and felt a third too much.)
[[nodiscard]] bool lies_beside(const PosedObject& a, const PosedObject& b, const PressedPair& pair,
                               PressedPair& beside) noexcept;

// The distance between the two surfaces (m; 0 in contact, negative where they overlap); infinite where the
// voxel is over no facet.
[[nodiscard]] double gap_of_pair(const PosedObject& a, const PosedObject& b,
                                 const PressedPair& pair) noexcept;

// Its voxels are the pair's from now on, and no longer.
void hold_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;
void release_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;

// What a pair presses its voxels with, added to what their objects know of. Before a round of relax_pair():
// clear_pair_load() on all pairs, then this once a pair; so roundings of what is added and taken away do not
// add up.
void clear_pair_load(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;
void load_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair) noexcept;

// One step of block Gauss-Seidel on a pair: its voxels go to the joint minimum of their link energies, under
// the loads of the other pairs they are in, subject to not overlapping. Overlap is shared in inverse
// proportion to stiffness, and at rest the two press with equal and opposite force, also where several pairs
// share a voxel. Voxels that passed one another press as if they had not. Returns gap_of_pair() afterwards:
// the chains of both may leave them too little room.
double relax_pair(const PosedObject& a, const PosedObject& b, PressedPair& pair) noexcept;

// Whose voxels give way to an overlap.
enum class GiveWay : std::uint8_t { both, first, second };
// What overlap is left the chains follow: SoftObject::drag(), and settle_dragged() once all pairs were looked
// at. True when there was any.
bool part_pair(const PosedObject& a, const PosedObject& b, const PressedPair& pair, GiveWay who) noexcept;

}  // namespace voxel
