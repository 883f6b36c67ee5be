// SPDX-License-Identifier: GPL-3.0-or-later
// Strain and shares of limits from displacements, against closed forms.
#include "hybrid/view/tissue/tissue_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <random>

#include "tests/hybrid/view/cored_block.h"

namespace {

using hybrid::TissueColour;
using hybrid::TissueField;

// Displacements of a field's points by a linear map of the scene.
std::vector<glm::vec3> moved_by(const TissueField& field, const glm::dmat3& gradient) {
  std::vector<glm::vec3> moved;
  for (const glm::dvec3& at : field.points_m()) moved.emplace_back(gradient * at);
  return moved;
}

// Places within the block, some of them on its border and a little outside.
std::vector<glm::dvec3> places_in_block() {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> within(-10.2e-3, 10.2e-3);
  std::vector<glm::dvec3> places;
  for (int n = 0; n < 300; ++n) places.emplace_back(within(random), within(random), within(random));
  return places;
}

TEST(TissueFieldOf, HasTheLargestPrincipalStrainOfALinearMap) {
  const TissueField field(tests::cored_block(), places_in_block());
  // Stretch, compression, and simple shear by g, whose principal strains are ± g / 2.
  struct Case {
    glm::dmat3 gradient;
    float strain;
  };
  const glm::dmat3 turn = glm::mat3_cast(glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 2.0, -1.0))));
  glm::dmat3 stretch(0.0), shear(0.0), two(0.0);
  stretch[0][0] = 0.03;
  shear[1][0] = 0.08;
  two[0][0] = 0.02, two[1][1] = -0.05, two[2][2] = 0.01;
  for (const Case& c : {Case{stretch, 0.03F}, Case{shear, 0.04F}, Case{two, 0.05F},
                        Case{turn * two * glm::transpose(turn), 0.05F}}) {
    for (const float strain : field.values(TissueColour::strain, moved_by(field, c.gradient)))
      EXPECT_NEAR(strain, c.strain, 1e-5F);
  }
}

TEST(TissueFieldOf, DoesNotDependOnTheObjectsPose) {
  hybrid::DrawnInside inside = tests::cored_block();
  const glm::dmat3 turn = glm::mat3_cast(glm::angleAxis(1.1, glm::normalize(glm::dvec3(-1.0, 0.5, 2.0))));
  glm::dmat3 gradient(0.0);
  gradient[0] = {0.04, 0.01, 0.0};
  gradient[2] = {0.0, -0.03, 0.02};
  std::vector<glm::dvec3> places = places_in_block();
  const TissueField upright(inside, places);
  inside.to_scene = turn;
  inside.origin_m = turn * inside.origin_m;
  for (glm::dvec3& at : places) at = turn * at;
  const TissueField turned(inside, places);
  for (const TissueColour colour : {TissueColour::strain, TissueColour::limits}) {
    const auto a = upright.values(colour, moved_by(upright, gradient));
    const auto b = turned.values(colour, moved_by(turned, turn * gradient * glm::transpose(turn)));
    for (std::size_t n = 0; n < a.size(); ++n) EXPECT_NEAR(a[n], b[n], 1e-5F);
  }
}

TEST(TissueFieldOf, SaysHowNearLinksAreToTheirLimits) {
  const hybrid::DrawnInside inside = tests::cored_block();  // links from 0.4 to 1.6 lengths, shear 0.6
  const TissueField field(inside, places_in_block());
  glm::dmat3 gradient(0.0);
  gradient[1][1] = 0.3;  // half of the way to the longest link
  for (const float share : field.values(TissueColour::limits, moved_by(field, gradient)))
    EXPECT_NEAR(share, 0.5F, 1e-4F);
  gradient[1][1] = -0.15;
  for (const float share : field.values(TissueColour::limits, moved_by(field, gradient)))
    EXPECT_NEAR(share, 0.25F, 1e-4F);
  gradient = glm::dmat3(0.0);
  gradient[2][0] = 0.9;  // beyond the limit across
  for (const float share : field.values(TissueColour::limits, moved_by(field, gradient)))
    EXPECT_EQ(share, 1.0F);
}

TEST(TissueFieldOf, IsZeroAtRestInRigidMotionAndFarFromTissue) {
  const TissueField field(tests::cored_block(), places_in_block());
  const std::vector<glm::vec3> rest(field.points_m().size(), glm::vec3(0.0F)),
      shifted(field.points_m().size(), glm::vec3(0.02F, -0.01F, 0.03F));
  for (const TissueColour colour : {TissueColour::strain, TissueColour::limits}) {
    for (const auto& moved : {rest, shifted}) {
      for (const float value : field.values(colour, moved)) EXPECT_EQ(value, 0.0F);
    }
  }
  const std::vector<glm::dvec3> far{{1.0, 0.0, 0.0}, {std::nan(""), 0.0, 0.0}};
  EXPECT_TRUE(TissueField(tests::cored_block(), far).points_m().empty());
  EXPECT_EQ(TissueField(tests::cored_block(), far).values(TissueColour::strain, {}).size(), 2U);
  EXPECT_TRUE(TissueField({}, far).points_m().empty());
}

TEST(TissueFieldOf, IsFiniteForAnyDisplacement) {
  const TissueField field(tests::cored_block(), places_in_block());
  std::mt19937 random(2);
  const std::array<float, 6> odd{std::nanf(""), INFINITY, -INFINITY, 3e38F, 1e-40F, 1e-3F};
  std::vector<glm::vec3> moved;
  for (std::size_t n = 0; n < field.points_m().size(); ++n)
    moved.emplace_back(odd[random() % 6], odd[random() % 6], odd[random() % 6]);
  for (const TissueColour colour : {TissueColour::strain, TissueColour::limits}) {
    for (const float value : field.values(colour, moved)) {
      EXPECT_TRUE(std::isfinite(value));
      EXPECT_GE(value, 0.0F);
    }
  }
}

}  // namespace
