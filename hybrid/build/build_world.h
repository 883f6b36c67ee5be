// SPDX-License-Identifier: GPL-3.0-or-later
// From a scene as written to a world that can be touched: files read, surfaces built, overlaps carved, map
// filled.
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
  std::string object;  // empty: of the scene
  polygon::Severity severity = polygon::Severity::info;
  std::string text;
};

struct BuiltScene {
  std::unique_ptr<const World> world;
  std::unique_ptr<WorldState> state;  // at rest, not started: see start_proxy()
  std::vector<BuildNote> notes;       // what a person should know: findings, repairs, voxels carved
  double seconds = 0.0;               // from the files to ready to be touched
  // Of the whole program, when that was done: resident, and the most that ever was.
  std::uint64_t held_bytes = 0, peak_bytes = 0;
};

// `progress` is told what begins, in words; may be empty.
using Progress = std::function<void(const std::string&)>;

// The occupancy map's cell (m) for a scene of rigid objects alone that is so long, unless it says otherwise.
double rigid_cell_m(double longest_m, double tool_radius_m);

// Throws SceneError: a file that cannot be used, nothing left after carving, too large for the memory (with
// the numbers, before it is allocated), objects that overlap where the scene asks to refuse that.
BuiltScene build_scene(const Scene& scene, const Progress& progress = {});

// Where an object lies at rest (scene frame, meters), rigid ones first; in words: "x 1.2 to 3.4, y …, z …
// mm".
struct ObjectBox {
  glm::dvec3 low{0.0}, high{0.0};
};
ObjectBox object_box(const World& world, std::size_t object);
std::string in_words(const ObjectBox& box);

// The most that a soft object of so many voxels takes until it is touched: what it is read into, its lattice
// (2.5 bytes a voxel at their most), its surface and its part of the map.
std::uint64_t soft_load_bytes(const std::array<int, 3>& dims);
// And once something has moved everywhere in it: state and coarse levels, and springs where they are not all
// of one label. In a session that is as far as the tool went and relaxation followed.
std::uint64_t soft_touched_bytes(const std::array<int, 3>& dims);  // of one label
std::uint64_t soft_touched_bytes(const voxel::Lattice& lattice);

}  // namespace hybrid
