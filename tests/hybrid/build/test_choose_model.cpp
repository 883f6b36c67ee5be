// SPDX-License-Identifier: GPL-3.0-or-later
// model = "auto" chooses voxels if a hand would notice the compliance, and a proxy otherwise.
#include "hybrid/build/choose_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "hybrid/session/session.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using tests::coupling;
using tests::Touch;

class ModelChoice : public tests::SceneFile {
 protected:
  static std::string text(double young_Pa, const std::string& model, double coupling_N_per_m = 1000.0) {
    return "format = 1\n[tool]\nradius = 5\nstiffness = " + std::to_string(coupling_N_per_m) +
           "\n[device]\nmodel = \"ideal\"\n[safety]\nmax_force = 8.5\nmax_slew = 1e9\nsoft_start = 0\n"
           "[material.m]\nyoung = " +
           std::to_string(young_Pa) +
           "\n[[soft]]\nname = \"slab\"\nformula = \"block\"\nsize = [60, 60, 30]\nspacing = 2\n"
           "position = [0, 0, -15]\nmaterial = \"m\"\n" +
           model + tests::some_path;
  }
};

TEST_F(ModelChoice, TheSecantStiffnessIsHertzs) {
  hybrid::Material material;
  material.young_Pa = 1e5;
  const hybrid::Tool ball{.radius_m = 5e-3};
  const double k = hybrid::secant_stiffness_N_per_m(material, ball, 2.0), depth = 2.0 / k;
  EXPECT_NEAR(4.0 / 3.0 * 1e5 / 0.91 * std::sqrt(5e-3) * std::pow(depth, 1.5), 2.0, 1e-12);
  const hybrid::Tool punch{.shape = hybrid::Tool::Shape::punch, .radius_m = 5e-3};
  EXPECT_NEAR(hybrid::secant_stiffness_N_per_m(material, punch, 2.0), 2.0 * 5e-3 * 1e5 / 0.91, 1e-9);
}

TEST_F(ModelChoice, TissueStaysVoxelsAndBoneBecomesAProxy) {
  const hybrid::Scene tissue = load(text(6e3, "model = \"auto\"\n"));
  ASSERT_EQ(tissue.soft.size(), 1U);
  EXPECT_TRUE(tissue.rigid.empty());
  ASSERT_EQ(tissue.model_notes.size(), 1U);
  EXPECT_EQ(tissue.model_notes[0].object, "slab");
  EXPECT_NE(tissue.model_notes[0].text.find("through its voxels: \"m\" answers 8.5 N"), std::string::npos)
      << tissue.model_notes[0].text;
  const hybrid::Scene bone = load(text(1e10, "model = \"auto\"\n"));
  EXPECT_TRUE(bone.soft.empty());
  ASSERT_EQ(bone.rigid.size(), 1U);
  EXPECT_NE(bone.model_notes.at(0).text.find("as rigid"), std::string::npos);
  // With a proxy, the session has no voxel data.
  Touch touch(bone, {0, 0, 0.03});
  EXPECT_TRUE(touch.state().soft.empty());
  EXPECT_TRUE(touch.state().scratch.map_hits.empty());
}

TEST_F(ModelChoice, WhoAsksForAModelGetsIt) {
  EXPECT_EQ(load(text(1e10, "model = \"voxels\"\n")).soft.size(), 1U);
  EXPECT_TRUE(load(text(1e10, "model = \"voxels\"\n")).model_notes.empty());
  const hybrid::Scene proxy = load(text(6e3, "model = \"proxy\"\n"));
  EXPECT_TRUE(proxy.soft.empty());
  EXPECT_EQ(proxy.rigid.size(), 1U);
  EXPECT_NE(refusal(text(6e3, "model = \"rigid\"\n")).find("auto"), std::string::npos);
}

// The device goes to the same depth with voxels and with a proxy. The proxy then gives the force that the
// choice assumes, 8.5 N. The proxy must be chosen if and only if the force of the voxels is less than a JND
// smaller.
TEST_F(ModelChoice, TheChoiceIsWhatAHandWouldTell) {
  for (const double young_Pa : {3e4, 3e5, 1e7}) {
    const bool proxy = load(text(young_Pa, "model = \"auto\"\n")).soft.empty();
    Touch soft(load(text(young_Pa, "")), {0, 0, 0.03}),
        rigid(load(text(young_Pa, "model = \"proxy\"\n")), {0, 0, 0.03});
    const glm::dvec3 to(0, 0, 5e-3 - 8.5e-3);
    soft.go({0, 0, 0.007}, 1e-3);
    rigid.go({0, 0, 0.007}, 1e-3);
    const double felt = coupling(soft.go(to, 5e-5, 500)).z, hard = coupling(rigid.go(to, 5e-5, 500)).z;
    std::printf("%g Pa: %.3f N by voxels, %.3f N by the proxy, %.1f %% less; chosen: %s\n", young_Pa, felt,
                hard, 100.0 * (1.0 - felt / hard), proxy ? "proxy" : "voxels");
    EXPECT_EQ(proxy, 1.0 - felt / hard < hybrid::kJndShare);
  }
}

}  // namespace
