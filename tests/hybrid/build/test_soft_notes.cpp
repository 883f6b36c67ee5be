// SPDX-License-Identifier: GPL-3.0-or-later
// The build's notes on a soft object: the place of the felt surface with thick slices and small tools, and
// keys without effect. The notes' figures are compared with the place where a tool first meets the object.
#include "hybrid/build/soft_notes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/hybrid/fixtures/touch.h"

namespace {

using tests::some_path;
using tests::Touch;
using tests::unlimited;

std::string notes_of(const hybrid::BuiltScene& built) {
  std::string text;
  for (const hybrid::BuildNote& note : built.notes) text += note.object + ": " + note.text + "\n";
  return text;
}

class SoftNotes : public tests::SceneFile {
 protected:
  // A block of 60 x 60 x 36 mm. Its top is drawn at z = 18 mm.
  hybrid::Scene scene(const std::string& spacing, double radius_mm) const {
    return load(
        fmt::format("format = 1\n{}[tool]\nradius = {}\n[[soft]]\nname = \"block\"\nformula = "
                    "\"block\"\nsize = [60, 60, 36]\nspacing = {}\n{}",
                    unlimited, radius_mm, spacing, some_path));
  }
  // Depth below the drawn top at which the tool, coming straight down at (x, y), meets the block (mm).
  static double met_inside_mm(const hybrid::Scene& scene, double x_mm, double y_mm) {
    Touch touch(scene, glm::dvec3(x_mm, y_mm, 50) * 1e-3);
    for (double z = 40.0; z > 0.0; z -= 0.01) {
      if (touch.at(glm::dvec3(x_mm, y_mm, z) * 1e-3).contacts != 0)
        return 18.0 + 1e3 * scene.tool.radius_m - z;
    }
    return 1e9;
  }
};

TEST_F(SoftNotes, ThickSlicesMoveTheFeltSurfaceByTheFiguresThatAreSaid) {
  struct Case {
    const char* spacing;
    double radius_mm;
    const char* said;
    double inside_mm;
  };
  // Expected depth: half a slice + radius − max(radius + 0.5 pixels, 1.5 slices).
  for (const Case& c :
       {Case{"[1, 1, 6]", 12.0, "2.5 mm inside", 2.5}, Case{"[1, 1, 4]", 8.0, "1.5 mm inside", 1.5},
        Case{"[1, 1, 6]", 2.0, "4 mm outside", -4.0}, Case{"[2, 2, 3]", 6.0, "0.5 mm inside", 0.5}}) {
    SCOPED_TRACE(c.spacing);
    const hybrid::Scene with = scene(c.spacing, c.radius_mm);
    Touch touch(with, {0, 0, 0.05});
    const std::string notes = notes_of(touch.built);
    EXPECT_NE(notes.find("block: slices of"), std::string::npos) << notes;
    EXPECT_NE(notes.find(c.said), std::string::npos) << notes;
    // The tool comes down straight above a voxel.
    const double half = c.spacing[1] == '2' ? 1.0 : 0.5;
    EXPECT_NEAR(met_inside_mm(with, half, half), c.inside_mm, 0.03);
  }
}

TEST_F(SoftNotes, BetweenThickSlicesTheToolSinksByTheFigure) {
  const glm::dvec3 spacing(1e-3, 1e-3, 6e-3);
  const hybrid::FeltLattice felt = hybrid::felt_lattice(spacing, 12e-3, 12.5e-3);
  EXPECT_NEAR(felt.inside_m, 2.5e-3, 1e-12);
  EXPECT_NEAR(felt.dip_m, 12.5e-3 - std::sqrt(12.5 * 12.5 - 9.0) * 1e-3, 1e-12);
  EXPECT_NEAR(felt.felt_radius_m, 12e-3, 1e-12);
}

TEST_F(SoftNotes, EqualSpacingAndALargeToolAreNotNoted) {
  for (const char* spacing : {"2", "[2, 2, 2]", "[2, 2, 2.4]"}) {
    Touch touch(scene(spacing, 6.0), {0, 0, 0.05});
    const std::string notes = notes_of(touch.built);
    EXPECT_EQ(notes.find("slices of"), std::string::npos) << notes;
    EXPECT_EQ(notes.find("felt as one of"), std::string::npos) << notes;
  }
}

TEST_F(SoftNotes, ASmallToolIsFeltAsOneOfASpacing) {
  // The felt radius is 1.5 times the slice distance, less half a pixel. For a spacing of 3 mm it is 4.5 − 1.5
  // = 3 mm. With pixels of 1 mm it is 4.5 − 0.5 = 4 mm.
  const hybrid::Scene coarse = scene("3", 1.0);
  Touch touch(coarse, {0, 0, 0.05});
  EXPECT_NE(notes_of(touch.built).find("tool of 1 mm radius is felt as one of 3 mm"), std::string::npos)
      << notes_of(touch.built);
  EXPECT_NEAR(met_inside_mm(coarse, 1.5, 1.5), -2.0, 0.03) << "a ball of 3 mm meets it 2 mm earlier";
  Touch thick(scene("[1, 1, 3]", 1.0), {0, 0, 0.05});
  EXPECT_NE(notes_of(thick.built).find("radius is felt as one of 4 mm"), std::string::npos)
      << notes_of(thick.built);
}

// ---- keys without effect

class UnusedKeys : public SoftNotes {
 protected:
  std::string notes(const std::string& text) const {
    return notes_of(hybrid::build_scene(load("format = 1\n" + text + some_path)));
  }
};

const std::string small_block =
    "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [20, 20, 10]\nspacing = 2\n";
const std::string small_ball = "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 4\n";

TEST_F(UnusedKeys, AreWarnedOfWithLineAndReason) {
  struct Case {
    std::string text, said;
  };
  const std::string plain_materials = "[material.gel]\nyoung = 5000\n";
  for (const Case& c : {
           Case{plain_materials + small_block, "line 2: [material.gel] has no effect: no [[soft]]"},
           Case{plain_materials + "[material.bone]\n" + small_block + "material = \"gel\"\n",
                "line 4: [material.bone] has no effect"},
           Case{small_block + "model = \"proxy\"\nbudget = 100\n",
                "line 8: 'budget' has no effect: the object"},
           Case{small_block + "model = \"proxy\"\nanchors = { faces = [\"-x\"] }\n",
                "'anchors' has no effect"},
           Case{small_block + "anchors = { faces = [\"-z\"], rigid_within = 3 }\n",
                "line 7: 'rigid_within' has no effect: the scene has no [[rigid]]"},
           Case{small_block + "anchors = { faces = [\"-z\"], rigid_within = 3 }\n" + small_ball +
                    "position = [0, 0, 90]\n",
                "no voxel lies within 3 mm"},
           Case{small_ball + "shading = true\n", "'shading' has no effect: a primitive"},
           Case{"[device]\nmodel = \"ideal\"\n[hand]\ngrip = \"firm\"\n" + small_ball,
                "line 4: 'hand' has no effect: the ideal device"},
           Case{"[hand]\ntremor_hz = 9\n" + small_ball, "'tremor_hz' has no effect: there is no tremor"},
           Case{"[device]\nmodel = \"ideal\"\n[safety]\nenergy_window = 0.2\n" + small_ball,
                "'energy_window' has no effect"},
           Case{"[material.gel]\nenergy = \"trilinear\"\n" + small_block +
                    "material = \"gel\"\nenergy = \"six-link\"\n",
                "'energy' has no effect: each of its materials"},
       }) {
    SCOPED_TRACE(c.text);
    const std::string said = notes(c.text);
    EXPECT_NE(said.find(c.said), std::string::npos) << said;
  }
}

TEST_F(UnusedKeys, OfASceneThatUsesAllOfThemNothingIsSaid) {
  const std::string said =
      notes("[hand]\ntremor_mm = 0.1\ntremor_hz = 9\n[safety]\nenergy_window = 0.2\n[material.gel]\n" +
            small_block + "material = \"gel\"\nenergy = \"trilinear\"\n");
  EXPECT_EQ(said.find("no effect"), std::string::npos) << said;
}

TEST_F(UnusedKeys, LabelsWithoutAVoxelAreNamed) {
  // An inclusion that a later inclusion covers has no voxel.
  const std::string covered =
      "[material.gel]\n" + small_block +
      "inclusions = [{ shape = \"ball\", size = 4, label = 2 }, { shape = \"box\", size = 8, label = 3 }]\n"
      "materials = { \"2\" = \"gel\", \"3\" = \"gel\" }\nanchors = { faces = [\"-z\"], labels = [2] }\n";
  const std::string said = notes(covered);
  EXPECT_NE(said.find("no voxel has label 2, which 'materials' names"), std::string::npos) << said;
  EXPECT_NE(said.find("no voxel has label 2, which 'anchors' names"), std::string::npos) << said;
  EXPECT_EQ(said.find("label 3"), std::string::npos) << said;
}

}  // namespace
