// SPDX-License-Identifier: GPL-3.0-or-later
// The scenes of the extremes suite: rigid, soft and mixed ones of one geometry, so that one motion touches
// all of them, with every named setting taken to its end. Each is a scene file like a user's, read and built
// by what reads and builds a user's.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <string_view>

namespace hybrid {

enum class SceneKind : std::uint8_t { rigid, soft, mixed };
inline constexpr std::array<SceneKind, 3> kSceneKinds{SceneKind::rigid, SceneKind::soft, SceneKind::mixed};
std::string_view name_of(SceneKind kind);

// What a mesh may have that it should not. The shape is the same each time, but of all_flat: only lines are
// left.
enum class MeshFlaw : std::uint8_t { none, slivers, zero_area, all_flat, duplicates, coincident };
// How much of the soft object (or the rigid block) there is; large: 512 voxels (or squares) along each edge.
enum class BlockShape : std::uint8_t { block, sheet, voxel, large };

// At rest: a block with its top in the plane z = 10, in the rigid and the mixed scene a ball of radius 6 that
// lies 2 deep in it (soft tissue is carved for it). Tool: a ball of radius 3. Lengths in units of `unit_m`.
struct SceneSetting {
  SceneKind kind = SceneKind::rigid;
  double unit_m = 1e-3;               // a voxel is two units
  glm::dvec3 origin_m{0.0};           // where the middle of the block lies
  double stiffness_N_per_m = 1000.0;  // of the coupling
  double young_Pa = 8000.0;
  double stretch_min = 0.4, stretch_max = 1.6, shear = 0.6;
  double rate_hz = 1000.0;
  bool ideal_device = false;  // goes exactly where the hand wants it; else a Premium 1.5 in a hand
  bool passivity = false;     // the controller, of a device that a force moves
  BlockShape shape = BlockShape::block;
  MeshFlaw flaw = MeshFlaw::none;
  int coincident = 1'000'000;  // triangles in the same place, of MeshFlaw::coincident
};

// Heights of interest in units: where the tool's centre touches the top of the block, and free space above
// everything.
inline constexpr double kTouchHeight = 13.0, kFreeHeight = 30.0;
inline constexpr double kReach = 60.0;  // units from the middle, beyond which there is nothing

// Writes the scene and its meshes into `folder`, and returns the scene's file. Throws std::runtime_error: not
// writable.
std::filesystem::path write_scene(const SceneSetting& setting, const std::filesystem::path& folder);
// The text alone, with meshes that lie in `folder`.
std::string scene_text(const SceneSetting& setting);

}  // namespace hybrid
