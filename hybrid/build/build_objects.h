// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of build_scene(): builds one rigid object, or one soft object's volume.
#pragma once

#include "hybrid/build/build_world.h"

namespace hybrid {

// Reads or makes the surface. Adds findings to `notes`. Throws std::exception with a message.
RigidObject build_rigid(const RigidDescription& description, std::vector<BuildNote>& notes);

// Makes the motion of an object that was built. Throws std::exception with a message.
RigidMotion build_motion(const RigidDescription& description, const RigidObject& object);

// Bound on the distance between the exact surface of a primitive and its triangles in the occupancy map (m).
double map_margin_m(const RigidDescription& description);

// Reads or makes the label volume, in the scene frame (with the description's pose applied). Throws
// std::exception with a message.
voxel::LabelVolume build_volume(const SoftDescription& description, std::vector<BuildNote>& notes);

// Returns the part of a mesh that no plane cuts away, clipped exactly. `to_scene`: the mesh's pose.
polygon::TriangleMesh cut_mesh(const polygon::TriangleMesh& mesh, const Pose& to_scene,
                               const std::vector<CutPlane>& cuts);

// Lattice options from the scene's materials and the object's own anchors.
voxel::LatticeOptions lattice_options(const Scene& scene, const SoftDescription& description);

}  // namespace hybrid
