// SPDX-License-Identifier: GPL-3.0-or-later
// The objects of a scene in the graphics card's memory. Vertices and values are uploaded only if they changed
// since the last frame. Every call needs the renderer's context to be current.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/gl/gl_objects.h"
#include "hybrid/view/tissue_view.h"

namespace hybrid {

inline constexpr glm::vec4 kKeepAll{0.0F, 0.0F, 0.0F, 1.0F};  // a plane that clips nothing

// A picture cuts an object in which one material hides another. The part towards the eye is left out, and the
// face of the cut shows the materials.
// The cut is a plane through the tool along the force, with its normal towards the eye. There is a cut only
// if the tool presses the object, the object hides a material, and the snapshot has the displacements within
// the object.
[[nodiscard]] std::optional<SectionPlane> choose_cut(const DrawnScene& scene, const Snapshot& snapshot,
                                                     const Camera& camera, std::size_t object);

struct GlSection {
  GlMesh mesh;
  GlName image = 0;
  std::uint64_t image_number = 0, shape_number = 0,
                moved_number = 0;  // numbers of the TissueSlice at the last upload

  void upload(const Section& section, const DrawMesh& moved, const SectionImage& image_of_section);
  void release();
};

// The greatest changes of the vertices of a part of a mesh.
struct PartMove {
  float moved_m = 0.0F;
  float recoloured = 0.0F;  // change of DrawVertex::value

  PartMove& operator+=(const PartMove& more) {
    moved_m += more.moved_m;
    recoloured += more.recoloured;
    return *this;
  }
};

struct SceneMesh {
  GlMesh mesh;
  bool soft = false;
  bool lit_by_vertex = false;
  bool closed = false;  // as is_closed_outwards() says
  glm::vec3 colour{1.0F};
  SceneBounds bounds;         // at rest
  glm::mat4 placed{1.0F};     // from the uploaded pose to the present one
  float most_moved_m = 0.0F;  // greatest displacement of a vertex from rest
  std::vector<GlSection> slices;
  GlSection face;            // face of the cut in the present view; empty: no cut
  glm::vec4 kept{kKeepAll};  // plane of the cut: the part on its positive side is drawn

  // ---- soft objects: mesh, displacements and values as they were uploaded last ----
  DrawMesh moving;
  std::vector<glm::vec3> moved_m;
  std::uint64_t values_number = 0;
  std::vector<PartMove> moves;  // [part] since the frame before; empty: none

  // ---- soft objects whose materials have looks of their own: a mesh for each visible material ----
  std::vector<SceneMesh> materials;
  std::string material{};                            // of one of `materials`: its name
  std::uint64_t shape_number = 0, moved_number = 0;  // the same: as uploaded; of MaterialSurface
};

class SceneMeshes {
 public:
  // Uploads the scene at rest, relative to `origin_m`. `light_vertices`: large meshes are lit at their
  // vertices.
  SceneMeshes(const DrawnScene& scene, const glm::dvec3& origin_m, bool light_vertices);
  // Uploads the places of moved rigid objects and the displacements of tissue.
  void move(const DrawnScene& scene, const Snapshot& snapshot, const TissueView& tissue);
  // Cuts the visible objects that a picture cuts in this view (section.h).
  void cut(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera, const ViewSettings& view);
  void release();

  // Radius of a ball about the middle of `bounds` (the scene at rest) that contains everything that is drawn.
  // It takes only a few values (rounded_up()).
  [[nodiscard]] double radius_m(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                                const SceneBounds& bounds) const;
  [[nodiscard]] const std::vector<SceneMesh>& all() const { return meshes_; }

 private:
  void move_materials(SceneMesh& mesh, const DrawnScene& scene, std::size_t object,
                      const std::vector<MaterialSurface>& surfaces) const;
  void move_surface(SceneMesh& mesh, const std::vector<glm::dvec3>& at_rest,
                    const std::vector<glm::vec3>& moved_m, const TissueView& tissue, std::size_t object);

  glm::dvec3 origin_m_;
  bool light_vertices_;
  std::vector<SceneMesh> meshes_;  // [object]
};

}  // namespace hybrid
