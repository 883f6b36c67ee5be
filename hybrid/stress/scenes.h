// SPDX-License-Identifier: GPL-3.0-or-later
// The scenes of the extremes suite: rigid, soft and mixed, all of one geometry, so that one motion touches
// all of them. Each setting can be taken to its extremes. Each scene is a file, and is read and built like a
// user's.
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

// Flaws of a mesh. They do not change its shape, except all_flat, which leaves only lines.
enum class MeshFlaw : std::uint8_t { none, slivers, zero_area, all_flat, duplicates, coincident };
// Size of the soft object, or of the rigid block. large: 512 voxels (or squares) along each edge.
enum class BlockShape : std::uint8_t { block, sheet, voxel, large };

// At rest there is a block with its top in the plane z = 10. In rigid and mixed scenes a ball of radius 6
// lies 2 deep in it; soft tissue is carved out there. The tool is a ball of radius 3. Lengths are in units of
// `unit_m`.
struct SceneSetting {
  SceneKind kind = SceneKind::rigid;
  double unit_m = 1e-3;               // a voxel is two units
  glm::dvec3 origin_m{0.0};           // origin of the units: the middle of a BlockShape::block
  double stiffness_N_per_m = 1000.0;  // of the coupling
  double young_Pa = 8000.0;
  double stretch_min = 0.4, stretch_max = 1.6, shear = 0.6;
  double rate_hz = 1000.0;
  bool ideal_device = false;  // true: follows the hand's target exactly; false: a Premium 1.5 in a hand
  bool passivity = false;     // use the passivity controller, for a device that a force moves
  BlockShape shape = BlockShape::block;
  MeshFlaw flaw = MeshFlaw::none;
  int coincident = 1'000'000;  // MeshFlaw::coincident: triangles in the same place
};

// Heights in units: of the tool's centre when it touches the top of the block, and of free space above
// everything.
inline constexpr double kTouchHeight = 13.0, kFreeHeight = 30.0;
inline constexpr double kReach = 60.0;  // units; everything lies within this distance of the middle

// Writes the scene and its meshes into `folder`, and returns the scene's file. Throws std::runtime_error if a
// file is not writable.
std::filesystem::path write_scene(const SceneSetting& setting, const std::filesystem::path& folder);
// The text of the scene. It expects the meshes in the scene's folder.
std::string scene_text(const SceneSetting& setting);

}  // namespace hybrid
