// SPDX-License-Identifier: GPL-3.0-or-later
// The interface to graphics: fixed surfaces once, and a snapshot of everything that moves. The core never
// opens a window; picture and viewer read only these types.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/snapshot/scene_choices.h"
#include "hybrid/world/edits.h"
#include "hybrid/world/object_feel.h"
#include "polygon/mesh/mesh.h"

namespace voxel {
class Lattice;
}

namespace hybrid {

// The voxels of a soft object, at rest.
struct DrawnInside {
  std::shared_ptr<const voxel::Lattice> lattice{};  // null: a rigid object
  glm::dmat3 to_scene{1};                           // rotation from the object's axes to the scene's
  glm::dvec3 origin_m{0.0};                         // middle of voxel (0, 0, 0), scene frame
  std::vector<std::string> materials{};             // those that the surface shows come first
  std::array<std::uint8_t, 256> of_label{};         // [label] index in `materials`

  // Point at rest (scene frame) in the object's axes, in voxels; and back.
  [[nodiscard]] glm::dvec3 to_voxels(const glm::dvec3& at_rest_m) const noexcept;
  [[nodiscard]] glm::dvec3 from_voxels(const glm::dvec3& voxels) const noexcept;
  // Index of the material at a point at rest (scene frame); empty: outside.
  [[nodiscard]] std::optional<std::size_t> material_at(const glm::dvec3& at_rest_m) const noexcept;
};

// The file with the grey values that a soft object was made from.
struct DrawnScan {
  std::filesystem::path file;
  std::optional<double> unit_m{};  // length unit of its numbers; empty: as the file says
  glm::dmat3 to_scene{1};          // from the file's frame
  glm::dvec3 origin_m{0.0};
};

struct DrawnObject {
  std::string name;
  bool soft = false;
  polygon::TriangleMesh surface;  // scene frame, meters, at rest
  // Name of the material that the surface of a soft object shows. Empty if the material has no name, or if
  // the surface shows several.
  std::string material{};
  // For a soft object with several visible materials: their names, the largest area first, and for each
  // vertex the index of the material beneath it. Otherwise both are empty.
  std::vector<std::string> materials{};
  std::vector<std::uint8_t> vertex_material{};
  DrawnInside inside{};
  std::optional<DrawnScan> scan{};
  ObjectChoices choices{};

  // Does the surface hide a material?
  [[nodiscard]] bool hides_material() const {
    return inside.materials.size() > (materials.empty() ? 1 : materials.size());
  }
};

struct DrawnScene {
  std::string title;
  std::vector<DrawnObject> objects;
  bool tool_is_punch = false;
  double tool_radius_m = 0.0;
  double max_force_N = 0.0;  // scale of the force arrow
  std::vector<EditableValue> editable{};
  ToolChoices tool_choices{};
  std::vector<glm::dvec3> path_m{};  // places of the hand on its path, for the first view; may be empty
};

// Present place of a rigid object relative to its place at rest: a rotation about a point that moves with the
// object.
struct RigidPlace {
  bool moved = false;
  glm::dvec3 about_m{0.0}, shift_m{0.0};  // scene frame
  glm::dquat turn{1.0, 0.0, 0.0, 0.0};

  [[nodiscard]] glm::dvec3 operator()(const glm::dvec3& at_rest_m) const {
    return moved ? about_m + shift_m + turn * (at_rest_m - about_m) : at_rest_m;
  }
};

// Points of a soft object near the tool, at rest, and their displacements (scene frame, m).
struct SoftPatch {
  std::vector<glm::vec3> at_rest_m, moved_m;
};

// Displacements of a soft object on nested boxes of nodes, the finest first. The first box that contains a
// point defines the point's displacement, by interpolation.
struct SoftDent {
  struct Box {
    // `first`: position of node (0, 0, 0) (unit: the object's spacing). `count`: nodes along each axis.
    std::array<int, 3> first{}, count{};
    int step = 1;  // distance between nodes (unit: the object's spacing)
    // Does the object continue beyond the box on this side? If not, points less than half a step beyond have
    // the displacement of the last node.
    std::array<bool, 3> open_low{}, open_high{};
    std::size_t stride = 0, plane = 0;
    std::array<std::vector<float>, 3> moved_m{};  // [axis of the object][k · plane + j · stride + i]
  };
  bool used = false;       // the object uses boxes; outside all boxes it is at rest
  glm::dmat3 to_scene{1};  // rotation from the object's axes to the scene's
  glm::dvec3 origin_m{0.0}, spacing_m{1.0};
  std::size_t count = 0;  // number of boxes in use; further boxes keep their capacity
  std::vector<Box> boxes{};

  // Displacement of a point at rest (scene frame, m).
  [[nodiscard]] glm::vec3 at(const glm::dvec3& at_rest_m) const noexcept;
};

// [object][vertex of its surface] displacement (scene frame, meters); empty for a rigid object.
using MovedSurfaces = std::vector<std::vector<glm::vec3>>;

// Rest points of soft objects whose displacements a view asks for, besides those of the surfaces.
struct AskedPoints {
  std::uint64_t number = 0;                        // sets with equal numbers have equal points
  std::vector<std::vector<glm::dvec3>> at_rest_m;  // [object] (scene frame); empty: none
};
// The displacements of AskedPoints (scene frame, m). An object without an answer is empty.
struct AnsweredPoints {
  std::uint64_t number = 0;
  MovedSurfaces moved_m{};
};
// Tissue as the relaxation thread knows it.
struct RelaxedTissue {
  MovedSurfaces surfaces;
  AnsweredPoints asked;
};

// The force of two objects of DrawnScene::objects on one another, or of a soft object's anchors on it.
struct PairPress {
  static constexpr std::uint32_t kAnchors = 0xFFFFFFFFU;
  std::uint32_t soft = 0, other = kAnchors;
  std::optional<double> force_N{};  // empty: not known
};

// The difference that a hand would feel between two models of an object, at each vertex of its surface. The
// tool is pressed in to the same depth at each vertex, and stands still until all tissue is at rest.
struct FeltDifference {
  std::uint64_t comparison = 0, number = 0;  // number of the comparison; number of the result
  std::size_t object = 0;                    // of DrawnScene::objects
  std::vector<float> jnd{};                  // [vertex] NaN: not known, because the tool cannot come there
  std::size_t places = 0, pressed = 0;       // places that were tried; those with both forces
  double gap_m = 0.0;                        // greatest distance of a vertex from its nearest place
  double share_felt = 0.0;                   // share of the known surface with more than 1 JND
  struct Most {                              // the place with the largest difference
    glm::dvec3 at_m{0.0};
    double jnd = 0.0, a_N = 0.0, b_N = 0.0;
  } most{};
};

struct Snapshot {
  std::uint32_t scene =
      0;  // number of earlier changes of the scene; the DrawnScene must be of the same scene
  std::uint64_t tick = 0;
  double t_s = 0.0;
  glm::dvec3 device_m{0.0}, proxy_m{0.0}, force_N{0.0};  // scene frame
  std::vector<ObjectFeel> feel;                          // one per object
  // [object] displacement of each surface vertex (scene frame, m); empty for rigid objects. Positions are not
  // stored, because a float position 1,000 km from the origin is off by centimetres.
  MovedSurfaces soft_moved_m;
  // [object] filled for objects under asynchronous relaxation, whose thread supplies the rest.
  std::vector<SoftPatch> patches{};
  // [object], or empty; for objects with contacts on nested patches, instead of soft_moved_m.
  std::vector<SoftDent> dents{};
  // [object], or empty: displacements within the touched soft objects, for a cut.
  std::vector<SoftDent> inside{};
  AnsweredPoints asked{};
  std::vector<RigidPlace> rigid_place;  // [object]; if shorter: further objects have not moved
  double tick_us = 0.0;
  std::vector<PairPress> presses{};  // pairs that touch; filled between ticks, if anyone asks for them
  std::vector<double> values{};      // present values of DrawnScene::editable, SI
  std::shared_ptr<const FeltDifference> difference{};  // null: no models are compared

  [[nodiscard]] RigidPlace place_of(std::size_t object) const {
    return object < rigid_place.size() ? rigid_place[object] : RigidPlace{};
  }
};

// One row of a trace: the result of one tick.
struct TraceRow {
  double t_s = 0.0;
  glm::dvec3 device_m{0.0}, proxy_m{0.0}, force_N{0.0};
  double rigid_N = 0.0, soft_N = 0.0;
  std::uint32_t contacts = 0;  // bit per object; all objects from the 32nd on share the last bit
  double tick_us = 0.0;
  glm::dvec3 coupling_N{0.0};  // of the virtual coupling, before the limits; not in files
};

}  // namespace hybrid
