// SPDX-License-Identifier: GPL-3.0-or-later
// Mass, centre of mass and inertia of shapes with uniform density.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "polygon/mesh/mesh.h"

namespace hybrid {

struct MassProperties {
  double mass_kg = 0.0;
  glm::dvec3 centre_m{0.0};       // body's frame
  glm::dmat3 inertia_kg_m2{0.0};  // about the centre of mass, along the body's axes
};

// Properties of the volume in a closed mesh with outward orientation, by the divergence theorem (Mirtich
// 1996; Eberly, 'Polyhedral Mass Properties', 2002). Any positive volume is accepted, so the caller must know
// that the mesh is closed. Throws std::invalid_argument with a message: no volume, a density that is not
// positive, values not finite.
MassProperties mass_of_mesh(const polygon::TriangleMesh& mesh, double density_kg_per_m3);

// Exact values for shapes centred on the body's origin. The capsule lies along z. Sizes are in meters.
MassProperties mass_of_ball(double radius, double density_kg_per_m3);
MassProperties mass_of_box(const glm::dvec3& size, double density_kg_per_m3);
MassProperties mass_of_capsule(double radius, double length, double density_kg_per_m3);

// The properties of the same shape with another mass.
MassProperties with_mass(const MassProperties& properties, double mass_kg);

// Are these possible principal moments of inertia of a rigid body? Each must be positive, and none may exceed
// the sum of the others (except for rounding).
bool possible_inertia(const glm::dvec3& moments);

}  // namespace hybrid
