// SPDX-License-Identifier: GPL-3.0-or-later
// Builds the world of a scene, ready to be touched: reads files, builds surfaces, removes overlaps and fills
// the map.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hybrid/scene/scene.h"
#include "hybrid/world/world_state.h"
#include "polygon/mesh/mesh.h"

namespace hybrid {

struct BuildNote {
  std::string object;  // empty: the whole scene
  polygon::Severity severity = polygon::Severity::info;
  std::string text;
};

struct BuiltScene {
  std::unique_ptr<const World> world;
  std::unique_ptr<WorldState> state;  // at rest, not started: see start_proxy()
  std::vector<BuildNote> notes;       // for the user: findings, repairs, removed voxels
  double seconds = 0.0;               // time that building took
  // Resident memory of the whole program after building, and its peak until then.
  std::uint64_t resident_bytes = 0, peak_bytes = 0;
};

// Called with a message at the start of each step; may be an empty function.
using Progress = std::function<void(const std::string&)>;

// Default cell size (m) of the occupancy map for a scene of rigid objects alone. `longest_m`: the scene's
// longest side.
double rigid_cell_m(double longest_m, double tool_radius_m);

// Throws SceneError if a file cannot be used, if no voxels are left after overlap removal, if the memory is
// too small (before allocation; the message has the numbers), or if objects overlap and the scene refuses
// overlaps.
BuiltScene build_scene(const Scene& scene, const Progress& progress = {});

// Box of an object at rest (scene frame, m). Objects are numbered with rigid ones first. in_words() returns
// "x 1.2 to 3.4, y …, z … mm".
struct ObjectBox {
  glm::dvec3 low{0.0}, high{0.0};
};
ObjectBox object_box(const World& world, std::size_t object);
std::string in_words(const ObjectBox& box);

// Upper bound on the memory (bytes) of a soft object with these dimensions before it is touched. The bound
// covers its file's contents, its lattice (at most 2.5 bytes a voxel), its surface and its part of the map.
std::uint64_t soft_load_bytes(const std::array<int, 3>& dims);
// Memory (bytes) of a soft object after all of it has moved: state, coarse levels, and link stiffness if
// there are several labels. A session needs it only for tissue that the tool or relaxation reached.
std::uint64_t soft_touched_bytes(const std::array<int, 3>& dims);  // for a single label
std::uint64_t soft_touched_bytes(const voxel::Lattice& lattice);

}  // namespace hybrid
