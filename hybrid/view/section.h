// SPDX-License-Identifier: GPL-3.0-or-later
// A cut through a soft object in which one material hides another. The part towards the eye is left out, and
// the face of the cut shows the materials. Knows no graphics library.
#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"
#include "hybrid/view/unit_shapes.h"

namespace hybrid {

// A plane through the tool, along the force. The part on the side of `toward_eye` (unit vector) is left out.
struct Cut {
  glm::dvec3 point_m{0.0}, toward_eye{0.0, 0.0, 1.0};
};

// Chooses a cut if the tool presses the object, the object hides a material, and the snapshot has the
// displacements within the object. Otherwise empty.
std::optional<Cut> choose_cut(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                              std::size_t object);

// The face of the cut, deformed as the tissue is in the snapshot.
struct SectionMesh {
  DrawMesh mesh;
  std::vector<VertexColour> colours;  // one for each vertex
};
SectionMesh make_section(const DrawnScene& scene, const Snapshot& snapshot, std::size_t object,
                         const Cut& cut, const glm::dvec3& origin_m);

}  // namespace hybrid
