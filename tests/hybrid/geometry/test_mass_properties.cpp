// SPDX-License-Identifier: GPL-3.0-or-later
// Mass, centre and inertia of meshes against closed forms.
#include "hybrid/geometry/mass_properties.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <stdexcept>
#include <string>

#include "polygon/surface/primitives.h"

namespace {

using glm::dmat3;
using glm::dvec3;
using hybrid::MassProperties;

void expect_same(const MassProperties& a, const MassProperties& b, double share) {
  EXPECT_NEAR(a.mass_kg, b.mass_kg, share * b.mass_kg);
  const double size = std::sqrt(b.inertia_kg_m2[0][0] / b.mass_kg);
  EXPECT_LE(glm::distance(a.centre_m, b.centre_m), share * size);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(a.inertia_kg_m2[i][j], b.inertia_kg_m2[i][j], share * b.inertia_kg_m2[0][0]) << i << j;
  }
}

polygon::TriangleMesh placed(polygon::TriangleMesh mesh, const dvec3& position, const glm::dquat& rotation) {
  for (dvec3& v : mesh.vertices) v = position + rotation * v;
  return mesh;
}

// A prism with n sides about z. Its inertia tends to that of a cylinder.
polygon::TriangleMesh cylinder(double radius, double length, std::uint32_t n) {
  polygon::TriangleMesh mesh;
  for (std::uint32_t k = 0; k < n; ++k) {
    const double angle = 2.0 * glm::pi<double>() * k / n;
    for (const double z : {-0.5 * length, 0.5 * length})
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  mesh.vertices.emplace_back(0.0, 0.0, -0.5 * length);
  mesh.vertices.emplace_back(0.0, 0.0, 0.5 * length);
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t a = 2 * k, b = 2 * ((k + 1) % n);
    mesh.triangles.push_back({a, b, b + 1});
    mesh.triangles.push_back({a, b + 1, a + 1});
    mesh.triangles.push_back({2 * n, b, a});
    mesh.triangles.push_back({2 * n + 1, a + 1, b + 1});
  }
  return mesh;
}

TEST(MassProperties, OfABoxMeshAreThoseOfTheBox) {
  const dvec3 size(0.04, 0.07, 0.02);
  expect_same(hybrid::mass_of_mesh(polygon::make_box_mesh(0.5 * size, 3), 1200.0),
              hybrid::mass_of_box(size, 1200.0), 1e-12);
}

TEST(MassProperties, OfABallMeshTendToThoseOfTheBall) {
  double before = 1.0;
  for (const int subdivisions : {2, 3, 4, 5}) {
    const MassProperties mesh = hybrid::mass_of_mesh(polygon::make_ball_mesh(0.05, subdivisions), 1000.0);
    const MassProperties ball = hybrid::mass_of_ball(0.05, 1000.0);
    const double error = 1.0 - mesh.inertia_kg_m2[0][0] / ball.inertia_kg_m2[0][0];
    EXPECT_GT(error, 0.0) << "the mesh lies within the ball";
    EXPECT_LT(error, 0.3 * before) << "the error falls with the square of the edge";
    before = error;
  }
  expect_same(hybrid::mass_of_mesh(polygon::make_ball_mesh(0.05, 6), 1000.0),
              hybrid::mass_of_ball(0.05, 1000.0), 1e-3);
}

TEST(MassProperties, OfACylinderMeshAreThoseOfTheCylinder) {
  const double r = 0.03, l = 0.11, density = 2700.0, mass = density * glm::pi<double>() * r * r * l;
  const double across = mass * (r * r / 4.0 + l * l / 12.0);
  const MassProperties exact{mass, dvec3(0.0), {across, 0, 0, 0, across, 0, 0, 0, 0.5 * mass * r * r}};
  expect_same(hybrid::mass_of_mesh(cylinder(r, l, 400), density), exact, 1e-4);
}

TEST(MassProperties, OfACapsuleMeshTendToThoseOfTheCapsule) {
  expect_same(hybrid::mass_of_mesh(polygon::make_capsule_mesh(0.02, 0.03, 300), 900.0),
              hybrid::mass_of_capsule(0.02, 0.06, 900.0), 5e-4);
  // A capsule without a middle part is a ball.
  expect_same(hybrid::mass_of_capsule(0.02, 0.0, 900.0), hybrid::mass_of_ball(0.02, 900.0), 1e-14);
}

TEST(MassProperties, GoWithThePoseOfTheMesh) {
  const dvec3 size(0.04, 0.07, 0.02);
  const glm::dquat rotation = glm::angleAxis(0.7, glm::normalize(dvec3(1, 2, -1)));
  const dmat3 r = glm::mat3_cast(rotation);
  for (const double away : {0.0, 0.3, 1e6}) {
    const dvec3 position(away, -2.0 * away, 0.5 * away);
    const MassProperties box = hybrid::mass_of_box(size, 1000.0);
    const MassProperties exact{box.mass_kg, position, r * box.inertia_kg_m2 * glm::transpose(r)};
    // Far from the origin, the result loses only those digits that the coordinates have lost by rounding.
    expect_same(
        hybrid::mass_of_mesh(placed(polygon::make_box_mesh(0.5 * size, 2), position, rotation), 1000.0),
        exact, 1e-11 + 1e-13 * away);
  }
}

TEST(MassProperties, AreLinearInTheMass) {
  const MassProperties box = hybrid::mass_of_box(dvec3(0.1), 1000.0), half = hybrid::with_mass(box, 0.5);
  EXPECT_NEAR(box.mass_kg, 1.0, 1e-12);
  EXPECT_NEAR(half.inertia_kg_m2[1][1], 0.5 * box.inertia_kg_m2[1][1], 1e-18);
}

TEST(MassProperties, RefuseWhatHasNone) {
  const auto says = [](const polygon::TriangleMesh& mesh, double density) -> std::string {
    try {
      (void)hybrid::mass_of_mesh(mesh, density);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  polygon::TriangleMesh inside_out = polygon::make_box_mesh(dvec3(0.1), 1);
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  EXPECT_NE(says(inside_out, 1.0).find("inside out"), std::string::npos);
  EXPECT_NE(says(polygon::make_plane_mesh(0.1, 2), 1.0).find("no volume"), std::string::npos);
  EXPECT_NE(says({}, 1.0).find("no triangles"), std::string::npos);
  EXPECT_NE(says(polygon::make_box_mesh(dvec3(0.1), 1), 0.0).find("density"), std::string::npos);
  EXPECT_FALSE(hybrid::possible_inertia({1.0, 1.0, 2.1}));
  EXPECT_FALSE(hybrid::possible_inertia({1.0, 0.0, 1.0}));
  EXPECT_TRUE(hybrid::possible_inertia({1.0, 1.0, 2.0}));
}

}  // namespace
