// SPDX-License-Identifier: GPL-3.0-or-later
// Mass, centre of mass and inertia of evenly filled shapes.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "polygon/mesh/mesh.h"

namespace hybrid {

struct MassProperties {
  double mass_kg = 0.0;
  glm::dvec3 centre_m{0.0};       // body frame
  glm::dmat3 inertia_kg_m2{0.0};  // about the centre, along the axes of the body frame
};

// Of the volume in a closed mesh with outward orientation, by the divergence theorem (Mirtich 1996; Eberly,
// 'Polyhedral Mass Properties', 2002). Any positive volume is accepted: the caller must know that the mesh is
// closed. Throws std::invalid_argument with a message: no volume, a density that is not positive, values not
// finite.
MassProperties mass_of_mesh(const polygon::TriangleMesh& mesh, double density_kg_per_m3);

// Exact shapes, centred on the body origin; the capsule lies along z. Sizes in meters.
MassProperties mass_of_ball(double radius, double density_kg_per_m3);
MassProperties mass_of_box(const glm::dvec3& size, double density_kg_per_m3);
MassProperties mass_of_capsule(double radius, double length, double density_kg_per_m3);

// The same shape with another mass.
MassProperties with_mass(const MassProperties& properties, double mass_kg);

// Are these possible moments of inertia about a rigid body's own axes? Each is positive, and none exceeds the
// sum of the others (except for rounding).
bool possible_inertia(const glm::dvec3& moments);

}  // namespace hybrid
