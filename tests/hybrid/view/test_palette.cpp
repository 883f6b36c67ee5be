// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/palette.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "hybrid/scene/tissue_table.h"

namespace {

using hybrid::DrawnScene;

glm::vec3 colour_of(const std::string& name, bool soft, const std::string& material = {}) {
  DrawnScene scene;
  scene.objects.push_back({name, soft, {}, material});
  return hybrid::palette::of_object(scene, 0);
}

// Lightness L* (CIE 1976) of an sRGB colour.
double lightness(const glm::vec3& colour) {
  const auto linear = [](double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); };
  const double y = 0.2126 * linear(colour.r) + 0.7152 * linear(colour.g) + 0.0722 * linear(colour.b);
  return y > 216.0 / 24389.0 ? 116.0 * std::cbrt(y) - 16.0 : y * 24389.0 / 27.0;
}

TEST(CustomaryColours, AreThoseOfTheTableOfTissues) {
  for (const char* name :
       {"femur_left", "skull", "liver", "kidney_right", "brain", "skin", "muscle", "aorta"})
    EXPECT_EQ(colour_of(name, true), hybrid::find_tissue(name)->colour) << name;
  EXPECT_EQ(colour_of("block", true, "liver"), hybrid::find_tissue("liver")->colour) << "by its material";
  EXPECT_EQ(colour_of("brain", true, "gel"), hybrid::find_tissue("brain")->colour) << "the name comes first";
}

TEST(CustomaryColours, LookAsExpected) {
  const glm::vec3 bone = colour_of("rib_left_3", false), liver = colour_of("liver", true),
                  fat = colour_of("fat", true), muscle = colour_of("muscle", true),
                  vessel = colour_of("portal_vein_and_splenic_vein", true);
  EXPECT_GT(lightness(bone), 85.0) << "ivory";
  EXPECT_LT(lightness(liver), 35.0) << "dark";
  EXPECT_GT(liver.r, 2.0F * liver.g) << "red-brown";
  EXPECT_GT(fat.g - fat.b, 0.3F) << "yellowish";
  EXPECT_GT(muscle.r, 2.0F * muscle.g) << "red";
  EXPECT_GT(vessel.r, 4.0F * vessel.g) << "red";
  for (const hybrid::Tissue& tissue : hybrid::tissue_table()) {
    EXPECT_GT(tissue.colour.r, 0.0F) << tissue.name;
    EXPECT_GE(tissue.colour.r, 0.6F * tissue.colour.b) << tissue.name;
  }
}

TEST(CustomaryColours, LeaveTheOthersTheirOwn) {
  DrawnScene scene;
  for (const char* name : {"block", "liver", "pad"}) scene.objects.push_back({name, true, {}});
  EXPECT_EQ(hybrid::palette::of_object(scene, 0), hybrid::palette::soft[0]);
  EXPECT_EQ(hybrid::palette::of_object(scene, 2), hybrid::palette::soft[1]);
  scene.objects[0].materials = {"gel", "liver", "pulp"};
  const auto colours = hybrid::palette::of_materials(scene, 0);
  EXPECT_EQ(colours[1], hybrid::find_tissue("liver")->colour);
  EXPECT_GT(glm::distance(colours[0], colours[2]), 0.15F);
  for (const std::size_t m : {0U, 2U}) EXPECT_GT(glm::distance(colours[m], colours[1]), 0.2F);
}

// The lightness of the ramp rises by equal steps. From a share of 0.15 on, the colour no longer depends on
// the tissue.
TEST(DisplacementRamp, IsPerceptualAndTheSameForAll) {
  const auto& ramp = hybrid::palette::moved;
  const double step = (lightness(ramp.back()) - lightness(ramp.front())) / 8.0;
  EXPECT_GT(step, 8.0);
  for (std::size_t n = 1; n < ramp.size(); ++n)
    EXPECT_NEAR(lightness(ramp[n]) - lightness(ramp[n - 1]), step, 0.35 * step) << n;
  const glm::vec3 pink(0.86F, 0.58F, 0.62F), ivory(0.91F, 0.87F, 0.75F);
  EXPECT_EQ(hybrid::palette::of_displacement(pink, 0.0F), pink);
  for (const float share : {0.15F, 0.4F, 1.0F, 3.0F}) {
    EXPECT_LT(glm::distance(hybrid::palette::of_displacement(pink, share),
                            hybrid::palette::of_displacement(ivory, share)),
              1e-6F);
  }
  EXPECT_LT(glm::distance(hybrid::palette::of_displacement(pink, 1.0F), ramp.back()), 1e-6F);
}

}  // namespace
