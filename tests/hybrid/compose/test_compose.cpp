// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid compose`: the objects that it makes, the touch of the written scene, and its refusals.
#include "hybrid/compose/compose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "hybrid/session/session.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/compose/label_boxes.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/shared_data.h"
#include "voxel/volume/read_volume.h"
#include "voxel/volume/write_volume.h"

namespace {

namespace fs = std::filesystem;
using hybrid::Composed;
using hybrid::ComposeOptions;
using ::testing::AllOf;
using ::testing::HasSubstr;
using tests::LabelBox;
using tests::torso;
using tests::volume_of;

constexpr const char* kNames =
    "label,name\n1,liver\n2,rib_left_1\n3,vertebrae_L1\n4,spleen\n5,mystery\n6,rib_left_2\n7,skull\n";

class Compose : public tests::SceneFile {
 protected:
  void SetUp() override {
    SceneFile::SetUp();
    names_ = write("names.csv", kNames);
    labels_ = save("labels.nii.gz", volume_of(torso()));
  }
  fs::path save(const std::string& name, const voxel::LabelVolume& volume) const {
    voxel::save_volume(folder_ / name, volume);
    return folder_ / name;
  }
  ComposeOptions of_torso() const {
    ComposeOptions options;
    options.labels = labels_;
    options.names = names_;
    options.out = folder_ / "out";
    return options;
  }
  // The text of the refusal; empty if nothing is refused.
  static std::string refused(const ComposeOptions& options) {
    try {
      (void)hybrid::compose(options);
    } catch (const std::exception& error) {
      return error.what();
    }
    return {};
  }
  static std::string text_of(const fs::path& file) {
    std::ifstream in(file);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }

  fs::path names_, labels_;
};

// [object] number of ticks in which it is touched along the scene's own path.
std::map<std::string, std::uint64_t> touched(const fs::path& file) {
  const hybrid::Scene scene = hybrid::load_scene(file);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::SessionResult result = hybrid::run_session(scene, built, {});
  EXPECT_GT(result.contact_ticks, 0U);
  EXPECT_LE(result.max_force_N, built.world->limits.max_force_N);
  EXPECT_EQ(built.state->nonfinite, 0U);
  EXPECT_EQ(built.state->faults, 0U);
  std::map<std::string, std::uint64_t> ticks;
  for (std::size_t o = 0; o < built.world->object_count(); ++o) {
    const std::size_t rigid = built.world->rigid.size();
    ticks[o < rigid ? built.world->rigid[o].name : built.world->soft[o - rigid].name] =
        result.object_contact_ticks[o];
  }
  return ticks;
}

const hybrid::ComposedPart& row(const Composed& composed, const std::string& name) {
  const auto found = std::find_if(composed.rows.begin(), composed.rows.end(),
                                  [&](const hybrid::ComposedPart& r) { return r.name == name; });
  if (found == composed.rows.end()) throw std::runtime_error("no row " + name);
  return *found;
}

std::string all(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

// ---- from a segmentation

TEST_F(Compose, BonesBecomeSurfacesAndTheRestTissueAndEachIsFelt) {
  const Composed composed = hybrid::compose(of_torso());
  EXPECT_TRUE(row(composed, "rib_left_1").rigid);
  EXPECT_TRUE(row(composed, "vertebrae_L1").rigid);
  EXPECT_EQ(row(composed, "rib_left_1").source, "closed surface");
  EXPECT_FALSE(row(composed, "liver").rigid);
  EXPECT_EQ(row(composed, "liver").young_Pa, 5500.0);
  EXPECT_EQ(row(composed, "spleen").young_Pa, 2900.0);
  EXPECT_NEAR(row(composed, "liver").size_m.x, 0.048, 1e-12);
  EXPECT_EQ(row(composed, "rib_left_1").voxels, 6U * 4U * 16U);
  // The surface is 12 x 8 x 32 mm large and lies at its labels, within the smoothing of one voxel.
  const auto rib = polygon::load_mesh(composed.scene.parent_path() / "rib_left_1.ply").mesh;
  glm::dvec3 low(1e300), high(-1e300);
  for (const glm::dvec3& v : rib.vertices) {
    low = glm::min(low, v);
    high = glm::max(high, v);
  }
  const glm::dvec3 expected_low = glm::dvec3(-0.04, 0.01, 0.3) + (glm::dvec3(8, 8, 8) - 0.5) * 2e-3;
  EXPECT_LT(glm::length(low - expected_low), 2e-3);
  EXPECT_LT(glm::length(high - low - glm::dvec3(0.012, 0.008, 0.032)), 2e-3);

  const auto ticks = touched(composed.scene);
  ASSERT_EQ(ticks.size(), 3U);
  for (const auto& [name, count] : ticks) EXPECT_GT(count, 100U) << name;
  EXPECT_EQ(composed.path.presses.size(), 4U) << "rib, vertebra, liver, spleen";
  EXPECT_TRUE(composed.path.not_pressed.empty());
}

TEST_F(Compose, TissueThatTouchesNothingRigidIsHeldAndSpecksGo) {
  const Composed composed = hybrid::compose(of_torso());
  EXPECT_THAT(all(composed.notes), AllOf(HasSubstr("1 of 3 pieces (2048 voxels) touch nothing rigid"),
                                         HasSubstr("2 voxels left out, loose specks")));
  const hybrid::Scene scene = hybrid::load_scene(composed.scene);
  ASSERT_EQ(scene.soft.size(), 1U);
  ASSERT_EQ(scene.soft[0].anchors.labels.size(), 1U);
  EXPECT_GT(scene.soft[0].anchors.rigid_within_m, 2e-3);
  EXPECT_TRUE(scene.soft[0].anchors.faces.empty());
  const std::uint8_t held = scene.soft[0].anchors.labels[0];
  EXPECT_EQ(scene.soft[0].materials.at(held), "spleen");
  // The held layer is the rearmost layer of the spleen: 8 x 16 voxels at j = 27.
  const auto& source = std::get<hybrid::VolumeSource>(scene.soft[0].source);
  const voxel::LabelVolume volume = voxel::load_volume(source.file, {});
  EXPECT_EQ(std::count(volume.labels.begin(), volume.labels.end(), held), 8 * 16);
  EXPECT_EQ(std::count(volume.labels.begin(), volume.labels.end(), 4), 8 * 15 * 16);
  EXPECT_EQ(std::count(volume.labels.begin(), volume.labels.end(), 1), 24 * 16 * 16);
  EXPECT_EQ(volume.voxel_count(), 35U * 16U * 16U) << "cropped to what is soft";
  // The liver has anchors too, at the bones, so that all tissue returns to rest.
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  EXPECT_GT(built.state->soft[0]->lattice().anchored_count(), 8U * 16U);
}

TEST_F(Compose, WithoutBoneTissueIsHeldAtTheBack) {
  ComposeOptions options = of_torso();
  options.rigid = {"none"};
  options.soft = {"liver"};
  const Composed composed = hybrid::compose(options);
  EXPECT_THAT(all(composed.notes), HasSubstr("left out: rib_left_1, vertebrae_L1, spleen"));
  const auto ticks = touched(composed.scene);
  EXPECT_EQ(ticks.size(), 1U);
  const hybrid::Scene scene = hybrid::load_scene(composed.scene);
  EXPECT_EQ(scene.soft[0].anchors.labels.size(), 1U);
}

TEST_F(Compose, NamesPatternsAndNumbersChoose) {
  ComposeOptions options = of_torso();
  options.rigid = {
      "RIB_*,3"};  // only the program splits at commas; here this is one pattern, which fits no label
  EXPECT_THAT(refused(options), HasSubstr("no label fits"));
  options.rigid = {"RIB_*", "3"};
  options.soft = {"l?ver"};
  const Composed composed = hybrid::compose(options);
  EXPECT_EQ(composed.rows.size(), 3U);
  EXPECT_TRUE(row(composed, "rib_left_1").rigid);
  EXPECT_TRUE(row(composed, "vertebrae_L1").rigid);
  EXPECT_FALSE(row(composed, "liver").rigid);
  EXPECT_THAT(all(composed.notes), HasSubstr("left out: spleen"));
}

TEST_F(Compose, ABoneMayBeSoftAndAnOrganRigid) {
  ComposeOptions options = of_torso();
  options.rigid = {"liver"};
  options.soft = {"spleen", "rib*"};
  const Composed composed = hybrid::compose(options);
  EXPECT_TRUE(row(composed, "liver").rigid);
  EXPECT_FALSE(row(composed, "rib_left_1").rigid);
  EXPECT_THAT(all(composed.notes), HasSubstr("rib_left_1: no stiffness of such a tissue is known here"));
  EXPECT_NO_THROW((void)hybrid::load_scene(composed.scene));
}

TEST_F(Compose, ANameThatNoTableKnowsGetsAStatedDefault) {
  std::vector<LabelBox> boxes = torso();
  boxes.push_back({{14, 4, 8}, {25, 11, 23}, 5});
  ComposeOptions options = of_torso();
  options.labels = save("more.nrrd", volume_of(boxes));
  const Composed composed = hybrid::compose(options);
  EXPECT_THAT(all(composed.notes), AllOf(HasSubstr("mystery: no stiffness"), HasSubstr("5 kPa")));
  EXPECT_EQ(row(composed, "mystery").young_Pa, 5000.0);
}

TEST_F(Compose, WithoutNamesLabelsAreNumbersAndTissue) {
  ComposeOptions options = of_torso();
  options.names.clear();
  options.rigid = {"2", "3"};
  const Composed composed = hybrid::compose(options);
  EXPECT_TRUE(row(composed, "label_2").rigid);
  EXPECT_FALSE(row(composed, "label_1").rigid);
  EXPECT_THAT(all(composed.notes), HasSubstr("4 labels have no name"));
}

TEST_F(Compose, TheFolderCanBeMoved) {
  const Composed composed = hybrid::compose(of_torso());
  fs::rename(composed.scene.parent_path(), folder_ / "elsewhere");
  EXPECT_NO_THROW((void)hybrid::build_scene(hybrid::load_scene(folder_ / "elsewhere" / "scene.toml")));
  EXPECT_EQ(text_of(folder_ / "elsewhere" / "scene.toml").find(folder_.string()), std::string::npos);
}

TEST_F(Compose, TissueIsReadCoarserWhereAskedAndBoneIsNot) {
  ComposeOptions options = of_torso();
  options.spacing_m = 4e-3;
  const Composed composed = hybrid::compose(options);
  EXPECT_EQ(row(composed, "rib_left_1").voxels, 6U * 4U * 16U);
  EXPECT_LT(row(composed, "liver").voxels, 24U * 16U * 16U / 6U);
  EXPECT_NEAR(composed.tool_radius_m, 8e-3, 1e-12) << "two spacings";
  EXPECT_GT(touched(composed.scene).at("liver_and_spleen"), 0U);
}

// ---- from meshes and volumes

TEST_F(Compose, AMeshIsPlacedInAVolume) {
  auto part = polygon::make_box_mesh({10, 10, 10}, 4);  // half edges in mm, the unit in which meshes are read
  polygon::save_ply(folder_ / "part.ply", part);
  voxel::LabelVolume head = volume_of({{{4, 4, 4}, {39, 35, 27}, 200}});
  ComposeOptions options;
  options.inputs = {folder_ / "part.ply", save("head.nii.gz", head)};
  options.out = folder_ / "out";
  options.place = {"part=5,28,360,0,0,45"};
  const Composed composed = hybrid::compose(options);
  const hybrid::Scene scene = hybrid::load_scene(composed.scene);
  EXPECT_EQ(scene.rigid.at(0).pose.position_m, glm::dvec3(0.005, 0.028, 0.36));
  EXPECT_NEAR(glm::angle(scene.rigid.at(0).pose.rotation), glm::radians(45.0), 1e-9);
  EXPECT_THAT(all(composed.notes), HasSubstr("Otsu"));
  EXPECT_THAT(all(composed.places), HasSubstr("part and head: their boxes share"));
  const auto ticks = touched(composed.scene);
  EXPECT_GT(ticks.at("part"), 100U);
  EXPECT_GT(ticks.at("head"), 100U);
}

TEST_F(Compose, WhatLiesFarAwayIsSaid) {
  polygon::save_ply(folder_ / "a.ply", polygon::make_box_mesh({10, 10, 10}, 4));
  polygon::save_ply(folder_ / "b.ply", polygon::make_box_mesh({0.001, 0.001, 0.001}, 4));
  ComposeOptions options;
  options.inputs = {folder_ / "a.ply", folder_ / "b.ply"};
  options.out = folder_ / "out";
  options.place = {"b=500,0,0"};
  const Composed composed = hybrid::compose(options);
  EXPECT_THAT(all(composed.places), HasSubstr("lies far from everything else"));
  EXPECT_THAT(all(composed.notes), HasSubstr("if the file is in meters"));
}

// ---- the starter scene

TEST_F(Compose, TheStarterSceneRuns) {
  ComposeOptions options;
  options.out = folder_ / "new" / "scene";
  const Composed composed = hybrid::compose(options);
  const auto ticks = touched(composed.scene);
  EXPECT_GT(ticks.at("ball"), 200U);
  EXPECT_GT(ticks.at("block"), 200U);
  EXPECT_THAT(text_of(composed.scene), HasSubstr("# How stiff the tissue is."));
}

// ---- refusals

TEST_F(Compose, NothingIsOverwrittenUnasked) {
  ComposeOptions options = of_torso();
  fs::create_directories(options.out);
  write("out/scene.toml", "mine");
  EXPECT_THAT(refused(options),
              AllOf(HasSubstr("scene.toml"), HasSubstr("is there already"), HasSubstr("--force")));
  EXPECT_EQ(text_of(options.out / "scene.toml"), "mine");
  fs::remove(options.out / "scene.toml");
  // Other files of the folder are not overwritten either. Files that were written before the refusal are
  // removed.
  write("out/vertebrae_L1.ply", "mine too");
  EXPECT_THAT(refused(options), AllOf(HasSubstr("vertebrae_L1.ply"), HasSubstr("is there already")));
  EXPECT_EQ(text_of(options.out / "vertebrae_L1.ply"), "mine too");
  EXPECT_FALSE(fs::exists(options.out / "rib_left_1.ply"));
  options.force = true;
  EXPECT_EQ(refused(options), "");
  EXPECT_NE(text_of(options.out / "vertebrae_L1.ply"), "mine too");
}

TEST_F(Compose, ARefusalSaysWhatWhereAndWhatToDoAndLeavesNothing) {
  struct Case {
    const char* what;
    std::function<void(ComposeOptions&)> change;
    std::vector<std::string> said;
  };
  const fs::path other = save("other.nii.gz", volume_of(torso(), 3e-3));
  const fs::path nothing = save("nothing.nii.gz", volume_of({}));
  const fs::path same = save("same.nii.gz", volume_of(torso()));
  const std::vector<Case> cases{
      {"no labels file", [](auto& o) { o.labels = "gone.nii.gz"; }, {"gone.nii.gz", "no such file", "give"}},
      {"no input", [](auto& o) { o.inputs = {"gone.ply"}; }, {"gone.ply", "no such file"}},
      {"no names file", [](auto& o) { o.names = "gone.csv"; }, {"gone.csv", "no such file"}},
      {"misspelt",
       [](auto& o) { o.rigid = {"rib_lef_1"}; },
       {"--rigid rib_lef_1", "nearest is \"rib_left_1\""}},
      {"misspelt soft", [](auto& o) { o.soft = {"livre"}; }, {"--soft livre", "nearest is \"liver\""}},
      {"a pattern of nothing",
       [](auto& o) { o.rigid = {"femur*"}; },
       {"--rigid femur*", "no label fits", "liver (1)"}},
      {"a name without voxels",
       [](auto& o) { o.rigid = {"skull"}; },
       {"--rigid skull", "no voxel in this volume"}},
      {"a number without voxels", [](auto& o) { o.rigid = {"99"}; }, {"--rigid 99", "no label fits"}},
      {"both", [](auto& o) { o.rigid = o.soft = {"liver"}; }, {"liver (1)", "in --rigid and in --soft"}},
      {"nothing chosen",
       [](auto& o) { o.rigid = o.soft = {"none"}; },
       {"leave nothing", "name at least one"}},
      {"another grid",
       [&](auto& o) { o.inputs = {other}; },
       {"another grid", "3 x 3 x 3 mm", "2 x 2 x 2 mm"}},
      {"two scans",
       [&](auto& o) {
         o.inputs = {same, labels_};
       },
       {"one by one"}},
      {"no label", [&](auto& o) { o.labels = nothing; }, {"every voxel is 0", "give a segmentation"}},
      {"placed what is not there",
       [](auto& o) { o.place = {"part=1,2,3"}; },
       {"--place part=1,2,3", "no input"}},
      {"no numbers", [](auto& o) { o.place = {"part=1,2"}; }, {"--place part=1,2", "NAME=x,y,z"}},
      {"names alone",
       [](auto& o) {
         o.labels.clear();
         o.inputs = {};
       },
       {"need something to work on"}},
      {"a range the wrong way round",
       [&](auto& o) {
         o.labels.clear();
         o.names.clear();
         o.inputs = {same};
         o.range = std::array{5.0, 1.0};
       },
       {"--range 5,1", "LO at most HI"}},
      {"a range of nothing",
       [&](auto& o) {
         o.labels.clear();
         o.names.clear();
         o.inputs = {same};
         o.range = std::array{500.0, 600.0};
       },
       {"no voxel lies within 500 to 600", "goes from 0 to 4"}},
      {"a spacing that leaves nothing", [](auto& o) { o.spacing_m = 1.0; }, {"--spacing"}},
      {"a folder that cannot be made",
       [&](auto& o) { o.out = names_ / "out"; },
       {"names.csv/out", "nothing can be written there"}},
      {"a file for a folder", [&](auto& o) { o.out = names_; }, {"is a file", "name a folder"}},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    ComposeOptions options = of_torso();
    c.change(options);
    const std::string text = refused(options);
    for (const std::string& part : c.said) EXPECT_THAT(text, HasSubstr(part));
    EXPECT_FALSE(fs::exists(folder_ / "out")) << "nothing is left behind";
  }
}

TEST_F(Compose, NamesThatCannotBeReadSayTheirRow) {
  ComposeOptions options = of_torso();
  options.names = write("bad.csv", "label,name\n1,liver\nspleen\n");
  EXPECT_THAT(refused(options), AllOf(HasSubstr("bad.csv:3:"), HasSubstr("as in 5,liver")));
  options.names = write("twice.csv", "1,liver\n1,spleen\n");
  EXPECT_THAT(refused(options), AllOf(HasSubstr("twice.csv:2:"), HasSubstr("\"liver\" and \"spleen\"")));
  options.names = write("big.csv", "300,spleen\n");
  EXPECT_THAT(refused(options), HasSubstr("names no label from 1 to 255"));
  options.names = write("bad.json", "{\"labels\": 5");
  EXPECT_THAT(refused(options), HasSubstr("is no JSON"));
}

// The scan's frame counts the same voxels from the other end of two axes, as some formats do.
TEST_F(Compose, AGridThatIsCountedFromAnotherEndIsTheSameGrid) {
  voxel::LabelVolume scan = volume_of(torso());
  const glm::dvec3 far = glm::dvec3(scan.dims[0] - 1, scan.dims[1] - 1, 0) * scan.spacing_m;
  scan.origin_m += far;
  scan.rotation = glm::angleAxis(glm::radians(180.0), glm::dvec3(0, 0, 1));
  ComposeOptions options = of_torso();
  options.inputs = {save("turned.nii.gz", scan)};
  EXPECT_EQ(refused(options), "");
}

// ---- a real scan

TEST_F(Compose, AnAbdomenOfSixtyLabelsBecomesASceneOnWhichBoneAndOrgansAreFelt) {
  const fs::path data = tests::shared_data("data/volumes");
  SKIP_WITHOUT(data);
  ComposeOptions options;
  options.inputs = {data / "ts_ct_abdomen_3mm.nii.gz"};
  options.labels = data / "ts_ct_abdomen_3mm_labels.nii.gz";
  options.names = data / "totalsegmentator_v2_ct_labels.csv";
  options.rigid = {"rib_*", "vertebrae_L*"};
  options.soft = {"liver", "autochthon_*"};
  options.out = folder_ / "out";
  const Composed composed = hybrid::compose(options);
  std::uint64_t ribs = 0, spine = 0, tissue = 0;
  for (const auto& [name, ticks] : touched(composed.scene)) {
    if (name.starts_with("rib")) ribs += ticks;
    if (name.starts_with("vertebrae")) spine += ticks;
    if (name.find("liver") != std::string::npos) tissue += ticks;
  }
  EXPECT_GT(ribs, 50U);
  EXPECT_GT(spine, 50U);
  EXPECT_GT(tissue, 200U);
}

TEST_F(Compose, AVolumeWithoutAnatomyIsTouchedFromNoSideOfABody) {
  ComposeOptions options = of_torso();
  const auto sides = [](const Composed& composed) {
    return std::count_if(composed.path.presses.begin(), composed.path.presses.end(), [](const auto& press) {
      return press.where.find("from the ") == 0 || press.where.find("from its ") == 0;
    });
  };
  EXPECT_GT(sides(hybrid::compose(options)), 0);
  std::string bytes = text_of(save("labels.nrrd", volume_of(torso())));
  const std::string space = "left-posterior-superior";
  options.labels = write("scanner.nrrd", bytes.replace(bytes.find(space), space.size(), "scanner-xyz"));
  options.out = folder_ / "scanner";
  const Composed composed = hybrid::compose(options);
  EXPECT_EQ(sides(composed), 0);
  EXPECT_THAT(composed.notes, ::testing::Contains(HasSubstr("anatomical directions are unknown")));
  EXPECT_EQ(text_of(composed.scene).find("patient's left"), std::string::npos);
}

}  // namespace
