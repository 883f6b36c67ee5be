// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/geometry/mass_properties.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/matrix.hpp>
#include <stdexcept>

namespace hybrid {
namespace {

glm::dmat3 diagonal(const glm::dvec3& d) {
  return {d.x, 0.0, 0.0, 0.0, d.y, 0.0, 0.0, 0.0, d.z};
}

void check_density(double density) {
  if (!(density > 0.0) || !std::isfinite(density))
    throw std::invalid_argument("a density must be a number above 0");
}

}  // namespace

MassProperties mass_of_mesh(const polygon::TriangleMesh& mesh, double density_kg_per_m3) {
  check_density(density_kg_per_m3);
  if (mesh.empty()) throw std::invalid_argument("the mesh has no triangles, so it has no mass");
  // Integrals over the tetrahedra between each triangle and the middle of the mesh. With a distant origin
  // large terms would cancel. For a tetrahedron 0, a, b, c of volume V the integral of x xᵀ is V/20 · (a aᵀ +
  // b bᵀ + c cᵀ + s sᵀ), with s = a + b + c.
  glm::dvec3 low(1e300), high(-1e300);
  for (const glm::dvec3& v : mesh.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  const glm::dvec3 middle = 0.5 * (low + high);
  double volume = 0.0;
  glm::dvec3 first(0.0);
  glm::dmat3 second(0.0);
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices[t[0]] - middle, b = mesh.vertices[t[1]] - middle,
                     c = mesh.vertices[t[2]] - middle, s = a + b + c;
    const double v = glm::dot(a, glm::cross(b, c)) / 6.0;
    volume += v;
    first += v / 4.0 * s;
    second += v / 20.0 *
              (glm::outerProduct(a, a) + glm::outerProduct(b, b) + glm::outerProduct(c, c) +
               glm::outerProduct(s, s));
  }
  const glm::dvec3 size = high - low;
  if (!(volume > 1e-12 * size.x * size.y * size.z)) {
    throw std::invalid_argument(volume < 0.0 ? "the mesh is turned inside out, so its volume is negative"
                                             : "the mesh encloses no volume, so it has no mass");
  }
  const glm::dvec3 centre = first / volume;
  const glm::dmat3 central = second - volume * glm::outerProduct(centre, centre);
  const double trace = central[0][0] + central[1][1] + central[2][2];
  const MassProperties out{density_kg_per_m3 * volume, middle + centre,
                           density_kg_per_m3 * (diagonal(glm::dvec3(trace)) - central)};
  if (!std::isfinite(out.mass_kg) ||
      !possible_inertia({out.inertia_kg_m2[0][0], out.inertia_kg_m2[1][1], out.inertia_kg_m2[2][2]}))
    throw std::invalid_argument("the mesh does not enclose one volume, so it has no inertia");
  return out;
}

MassProperties mass_of_ball(double radius, double density_kg_per_m3) {
  check_density(density_kg_per_m3);
  const double mass = density_kg_per_m3 * 4.0 / 3.0 * glm::pi<double>() * radius * radius * radius;
  return {mass, glm::dvec3(0.0), diagonal(glm::dvec3(0.4 * mass * radius * radius))};
}

MassProperties mass_of_box(const glm::dvec3& size, double density_kg_per_m3) {
  check_density(density_kg_per_m3);
  const double mass = density_kg_per_m3 * size.x * size.y * size.z;
  const glm::dvec3 square = size * size;
  return {mass, glm::dvec3(0.0),
          diagonal(mass / 12.0 * glm::dvec3(square.y + square.z, square.z + square.x, square.x + square.y))};
}

MassProperties mass_of_capsule(double radius, double length, double density_kg_per_m3) {
  check_density(density_kg_per_m3);
  const double r2 = radius * radius, pi = glm::pi<double>();
  const double cylinder = density_kg_per_m3 * pi * r2 * length;
  const double ball = density_kg_per_m3 * 4.0 / 3.0 * pi * r2 * radius;  // mass of both half balls
  const double along = 0.5 * cylinder * r2 + 0.4 * ball * r2;
  // The centre of mass of a half ball is 3/8 r from its flat face.
  const double across = cylinder * (r2 / 4.0 + length * length / 12.0) +
                        ball * (0.4 * r2 + length * length / 4.0 + 0.375 * length * radius);
  return {cylinder + ball, glm::dvec3(0.0), diagonal({across, across, along})};
}

MassProperties with_mass(const MassProperties& properties, double mass_kg) {
  return {mass_kg, properties.centre_m, properties.inertia_kg_m2 * (mass_kg / properties.mass_kg)};
}

bool possible_inertia(const glm::dvec3& moments) {
  const double sum = moments.x + moments.y + moments.z;
  const double least = std::min({moments.x, moments.y, moments.z}),
               most = std::max({moments.x, moments.y, moments.z});
  return least > 0.0 && std::isfinite(sum) && most <= (sum - most) * (1.0 + 1e-9);
}

}  // namespace hybrid
