// SPDX-License-Identifier: GPL-3.0-or-later
// The tissue of composed scenes: its spacing, stiffness and names, and the part of the path that is in
// contact.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <set>
#include <string>

#include "hybrid/compose/compose.h"
#include "hybrid/session/session.h"
#include "tests/hybrid/compose/label_boxes.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "voxel/volume/write_volume.h"

namespace {

namespace fs = std::filesystem;
using hybrid::Composed;
using hybrid::ComposeOptions;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class ComposedTissue : public tests::SceneFile {
 protected:
  ComposeOptions of(const voxel::LabelVolume& volume) const {
    voxel::save_volume(folder_ / "labels.nii.gz", volume);
    ComposeOptions options;
    options.labels = folder_ / "labels.nii.gz";
    options.names =
        write("names.csv", "1,liver\n2,rib_left_1\n3,vertebrae_L1\n4,spleen\n5,my organ\n6,colon\n");
    options.out = folder_ / "out";
    return options;
  }
  static std::string notes_of(const Composed& composed) {
    return std::accumulate(composed.notes.begin(), composed.notes.end(), std::string(),
                           [](const std::string& all, const std::string& note) { return all + note + "\n"; });
  }
  static std::string refused(const ComposeOptions& options) {
    try {
      (void)hybrid::compose(options);
    } catch (const hybrid::ComposeError& error) {
      return error.what();
    }
    return {};
  }
  static std::string build_notes(const hybrid::BuiltScene& built) {
    std::string text;
    for (const hybrid::BuildNote& note : built.notes) text += note.text + "\n";
    return text;
  }
};

// ---- spacing

TEST_F(ComposedTissue, ThickSlicesAreReadAtTheSameSpacingAlongAllAxes) {
  for (const double slice_mm : {6.0, 1.0, 2.4}) {
    SCOPED_TRACE(slice_mm);
    voxel::LabelVolume volume = tests::volume_of(tests::torso());
    volume.spacing_m.z = slice_mm * 1e-3;  // pixels of 2 mm
    ComposeOptions options = of(volume);
    options.force = true;
    const Composed composed = hybrid::compose(options);
    const hybrid::BuiltScene built = hybrid::build_scene(hybrid::load_scene(composed.scene));
    const glm::dvec3 h = built.state->soft[0]->lattice().spacing_m();
    const bool uneven = slice_mm != 2.4;  // spacings that differ by less than a quarter are kept
    EXPECT_EQ(notes_of(composed).find("along all axes") != std::string::npos, uneven) << notes_of(composed);
    EXPECT_THAT(build_notes(built), Not(HasSubstr("slices of")));
    if (uneven) {
      // The number of voxels stays about the same. The spacing is the cube root of 2 x 2 x slice, rounded up
      // to two digits.
      const double wanted_mm = std::ceil(10.0 * std::cbrt(4.0 * slice_mm) - 1e-9) / 10.0;
      EXPECT_NEAR(h.x, wanted_mm * 1e-3, 1e-9);
      EXPECT_NEAR(h.z, h.x, 1e-12);
      EXPECT_GE(composed.tool_radius_m, 1.99 * h.x) << "the tool is felt as it is";
    } else {
      EXPECT_NEAR(h.z, 2.4e-3, 1e-9);
    }
  }
}

TEST_F(ComposedTissue, AGivenSpacingIsTaken) {
  voxel::LabelVolume volume = tests::volume_of(tests::torso());
  volume.spacing_m.z = 6e-3;
  ComposeOptions options = of(volume);
  options.spacing_m = 2e-3;
  const Composed composed = hybrid::compose(options);
  const hybrid::BuiltScene built = hybrid::build_scene(hybrid::load_scene(composed.scene));
  EXPECT_EQ(built.state->soft[0]->lattice().spacing_m(), glm::dvec3(2e-3));
}

TEST_F(ComposedTissue, OptionsWithoutEffectAreRefused) {
  const ComposeOptions plain = of(tests::volume_of(tests::torso()));
  ComposeOptions options = plain;
  options.range = {1.0, 2.0};
  EXPECT_THAT(refused(options), HasSubstr("--range has no effect"));
  options = plain;
  options.spacing_m = 2e-3;
  options.soft = {"none"};
  EXPECT_THAT(refused(options), HasSubstr("--spacing has no effect"));
  EXPECT_FALSE(fs::exists(plain.out));
}

// ---- names and stiffness

TEST_F(ComposedTissue, LabelsNameTheObjectAndItsMaterials) {
  std::vector<tests::LabelBox> boxes = tests::torso();
  boxes.push_back({{14, 12, 8}, {31, 14, 23}, 6});
  boxes.push_back({{14, 12, 8}, {19, 14, 12}, 5});
  const Composed composed = hybrid::compose(of(tests::volume_of(boxes)));
  const hybrid::Scene scene = hybrid::load_scene(composed.scene);
  EXPECT_EQ(scene.soft.at(0).name, "liver_and_spleen_and_2") << "the largest two of four";
  std::set<std::string> names;
  for (const auto& [name, material] : scene.materials) names.insert(name);
  EXPECT_EQ(names, (std::set<std::string>{"liver", "spleen", "my_organ", "colon"}));
  EXPECT_EQ(scene.soft[0].budget_place.line, 0U) << "no key without effect";
  const hybrid::BuiltScene built = hybrid::build_scene(scene);
  EXPECT_THAT(build_notes(built), AllOf(Not(HasSubstr("no effect")), Not(HasSubstr("no voxel has"))));
}

TEST_F(ComposedTissue, NamesKeepTheirLettersInAnyScript) {
  std::vector<tests::LabelBox> boxes = tests::torso();
  boxes.push_back({{14, 12, 8}, {31, 14, 23}, 6});
  ComposeOptions options = of(tests::volume_of(boxes));
  const std::string long_name(70, 'x');
  options.names = write("names.csv", "1,肝臓\n2,Rib\n3,rib\n4,Milz (groß)\n6," + long_name + "\n");
  const Composed composed = hybrid::compose(options);
  const hybrid::Scene scene = hybrid::load_scene(composed.scene);
  std::set<std::string> names;
  for (const auto& [name, material] : scene.materials) names.insert(name);
  EXPECT_EQ(names, (std::set<std::string>{"肝臓", "Milz__groß_", std::string(48, 'x')}));
  EXPECT_EQ(scene.soft.at(0).name, "肝臓_and_Milz__groß__and_1");
  // Files whose names differ in case only would be one file in some file systems.
  EXPECT_EQ(scene.rigid.at(0).name, "Rib");
  EXPECT_EQ(scene.rigid.at(1).name, "rib-2");
}

TEST_F(ComposedTissue, LabelsThatLookAlikeHaveTheirOwnMaterials) {
  std::vector<tests::LabelBox> boxes = tests::torso();
  boxes.push_back({{14, 12, 8}, {31, 14, 23}, 6});
  ComposeOptions options = of(tests::volume_of(boxes));
  options.names = write("names.csv", "1,part (1)\n2,rib\n3,rib\n4,part 1)\n6,part [1]\n");
  const Composed composed = hybrid::compose(options);
  const hybrid::Scene scene = hybrid::load_scene(composed.scene);
  std::set<std::string> names;
  for (const auto& [name, material] : scene.materials) names.insert(name);
  EXPECT_EQ(names, (std::set<std::string>{"part__1_", "part__1_-2", "part_1_"}));
}

TEST_F(ComposedTissue, OneLabelGivesTheObjectItsName) {
  ComposeOptions options = of(tests::volume_of(tests::torso()));
  options.soft = {"spleen"};
  EXPECT_EQ(hybrid::load_scene(hybrid::compose(options).scene).soft.at(0).name, "spleen");
}

TEST_F(ComposedTissue, LinksGetTheRatioForWhichTheyAreRightAndTheSameContactModulus) {
  const Composed composed = hybrid::compose(of(tests::volume_of(tests::torso())));
  const hybrid::Scene scene = hybrid::load_scene(composed.scene);
  const hybrid::Material& liver = scene.materials.at("liver");
  EXPECT_EQ(liver.poisson, 0.3);
  EXPECT_FALSE(liver.energy.has_value());
  EXPECT_NEAR(liver.young_Pa / (1.0 - 0.3 * 0.3), 5500.0 / (1.0 - 0.45 * 0.45), 1.0);
  // Cartilage has a lower Poisson's ratio. Nested patches do not support another ratio beside other tissue,
  // so it is replaced too.
  const hybrid::LatticeStiffness stiff = hybrid::as_six_links(*hybrid::find_tissue("costal_cartilages"));
  EXPECT_EQ(stiff.poisson, 0.3);
  EXPECT_NEAR(stiff.young_Pa / (1.0 - 0.3 * 0.3), 7.0e5 / (1.0 - 0.1 * 0.1), 1.0);
}

// ---- a volume without labels

TEST_F(ComposedTissue, NamesTheScanForPictures) {
  const voxel::LabelVolume volume = tests::volume_of(tests::torso());
  ComposeOptions options = of(volume);
  voxel::save_volume(folder_ / "ct.nii.gz", volume);
  options.inputs = {folder_ / "ct.nii.gz"};
  const hybrid::Scene scene = hybrid::load_scene(hybrid::compose(options).scene);
  const auto scan_of = [](const hybrid::Scene& s) {
    return std::get<hybrid::VolumeSource>(s.soft[0].source).scan;
  };
  EXPECT_EQ(scan_of(scene), fs::absolute(folder_ / "ct.nii.gz"));
  ComposeOptions whole;
  whole.inputs = options.inputs;
  whole.range = {0.5, 9.0};
  whole.out = folder_ / "whole";
  EXPECT_EQ(scan_of(hybrid::load_scene(hybrid::compose(whole).scene)), fs::absolute(folder_ / "ct.nii.gz"));
  // A scan that is gone does not keep a scene from being felt.
  fs::remove(folder_ / "ct.nii.gz");
  EXPECT_NO_THROW((void)hybrid::build_scene(hybrid::load_scene(folder_ / "whole" / "scene.toml")));
}

TEST_F(ComposedTissue, BoneOfAScanWithoutLabelsIsSaidUnlessToldWhatIsTissue) {
  // A cube of 40 HU in air, with 12 voxels a side. Its core, with 4 voxels a side, is bone.
  std::string data;
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) {
        const int most = std::max({std::abs(2 * i - 19), std::abs(2 * j - 19), std::abs(2 * k - 19)});
        const auto value = static_cast<std::uint16_t>(most <= 3 ? 1000 : most <= 11 ? 40 : -1000);
        data += static_cast<char>(value & 0xFFU);
        data += static_cast<char>(value >> 8U);
      }
    }
  }
  ComposeOptions options;
  options.inputs = {write("head.mha",
                          "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
                          "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nDimSize = 20 20 20\n"
                          "ElementSpacing = 2 2 2\nElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
                              data)};
  options.out = folder_ / "out";
  options.force = true;
  EXPECT_THAT(notes_of(hybrid::compose(options)),
              AllOf(HasSubstr("bone too: 3.7 % of it lies above 300"), HasSubstr("range = [300, 1000]")));
  options.range = {0.0, 200.0};
  EXPECT_THAT(notes_of(hybrid::compose(options)), Not(HasSubstr("bone")));
}

TEST_F(ComposedTissue, OfAScanWithoutBrightVoxelsNoBoneIsSaid) {
  voxel::save_volume(folder_ / "dim.nii.gz", tests::volume_of({{{4, 4, 4}, {39, 35, 27}, 200}}));
  ComposeOptions options;
  options.out = folder_ / "out";
  options.inputs = {folder_ / "dim.nii.gz"};
  EXPECT_THAT(notes_of(hybrid::compose(options)), Not(HasSubstr("bone")));
}

// ---- the path

TEST_F(ComposedTissue, MostOfThePathIsInContactAndEachPressFeelsWhatItNames) {
  const Composed composed = hybrid::compose(of(tests::volume_of(tests::torso())));
  const hybrid::Scene scene = hybrid::load_scene(composed.scene);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::SessionResult felt = hybrid::run_session(scene, built, {});
  EXPECT_GT(static_cast<double>(felt.contact_ticks), 0.4 * static_cast<double>(felt.ticks));
  ASSERT_EQ(felt.felt_materials.size(), 1U);
  for (const hybrid::FeltMaterial& material : felt.felt_materials[0]) {
    if (material.name == "liver" || material.name == "spleen") {
      EXPECT_GT(material.contact_ticks, 500U) << material.name;
      EXPECT_GT(material.max_force_N, 0.0);
    }
  }
}

// ---- parts that the path does not press

// The spleen lies within the liver, so the tool cannot come to it from any side.
TEST_F(ComposedTissue, APartBehindOthersOnEverySideIsNotPressedAndTheSceneSaysWhy) {
  const auto text_of = [](const Composed& composed) {
    std::ifstream in(composed.scene);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  ComposeOptions options =
      of(tests::volume_of({{{6, 6, 6}, {29, 29, 25}, 1}, {{14, 14, 12}, {21, 21, 19}, 4}}));
  const Composed composed = hybrid::compose(options);
  ASSERT_EQ(composed.path.presses.size(), 1U);
  EXPECT_THAT(composed.path.presses[0].what, HasSubstr("liver"));
  ASSERT_EQ(composed.path.not_pressed.size(), 1U);
  EXPECT_EQ(composed.path.not_pressed[0].what, "spleen");
  EXPECT_TRUE(composed.path.not_pressed[0].hidden);
  EXPECT_THAT(text_of(composed),
              HasSubstr("# Not pressed, because others lie in front on every side: spleen\n"));
  options = of(tests::volume_of(tests::torso()));
  options.force = true;
  EXPECT_THAT(text_of(hybrid::compose(options)), Not(HasSubstr("Not pressed")));
}

}  // namespace
