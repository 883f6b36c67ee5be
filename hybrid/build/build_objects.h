// SPDX-License-Identifier: GPL-3.0-or-later
// The two halves of build_scene(): one rigid object, one soft object's volume.
#pragma once

#include "hybrid/build/build_world.h"

namespace hybrid {

// Reads or makes the surface. Findings go to `notes`. Throws std::exception in words.
RigidObject build_rigid(const RigidDescription& description, std::vector<BuildNote>& notes);

// How a built object moves. Throws std::exception in words.
RigidMotion build_motion(const RigidDescription& description, const RigidObject& object);

// How far the exact surface of a primitive may lie from the triangles that stand for it in the occupancy map
// (m).
double map_margin_m(const RigidDescription& description);

// Reads or makes the label volume; its frame lies in the scene (the description's pose applied).
// Throws std::exception in words.
voxel::LabelVolume build_volume(const SoftDescription& description, std::vector<BuildNote>& notes);

// The part of a mesh that none of the planes cuts away, clipped exactly; `to_scene` places the mesh.
polygon::TriangleMesh cut_mesh(const polygon::TriangleMesh& mesh, const Pose& to_scene,
                               const std::vector<CutPlane>& cuts);

// Options of the lattice by the scene's materials and the object's own anchors.
voxel::LatticeOptions lattice_options(const Scene& scene, const SoftDescription& description);

}  // namespace hybrid
