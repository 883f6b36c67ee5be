// SPDX-License-Identifier: GPL-3.0-or-later
// The models of the objects of small scenes, side by side.
#include "hybrid/models/models_in_scene.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>

#include "hybrid/compare/compare.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/models/models_text.h"
#include "hybrid/models/variants.h"
#include "hybrid/tune/edit_scene.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::ModelRow;
using hybrid::ModelsInScene;
using hybrid::ObjectModels;
using testing::ElementsAre;
using testing::HasSubstr;

class Models : public tests::SceneFile {
 protected:
  std::filesystem::path gel(const std::string& tool, const std::string& more = {},
                            const std::string& to = "6.5") const {
    return write(
        "gel.toml",
        "format = 1\n[tool] # the tool\nradius = 4\nstiffness = 1500\n" + tool +
            "[material.gel]\nyoung = 8000\n[[soft]]\nname = \"block\" # of gel\nformula = \"block\"\n"
            "size = [24, 24, 10]\nspacing = 2\nmaterial = \"gel\"\n" +
            more + "[path]\nkind = \"press\"\nfrom = [0, 0, 10]\nto = [0, 0, " + to +
            "]\nhold = 0.1\nspeed = 40\n");
  }
  static const ModelRow& row(const ObjectModels& object, const std::string& name) {
    const auto found = std::ranges::find(object.rows, name, &ModelRow::name);
    if (found == object.rows.end()) throw std::runtime_error("no row " + name);
    return *found;
  }
};

TEST_F(Models, OfASoftBlock) {
  const hybrid::Scene scene = hybrid::read_scene(gel(""));
  const ModelsInScene models = hybrid::models_in_scene(scene, {});
  ASSERT_EQ(models.objects.size(), 1U);
  const ObjectModels& block = models.objects[0];
  EXPECT_TRUE(block.alone);
  std::vector<std::string> names;
  for (const ModelRow& r : block.rows) names.push_back(r.name);
  EXPECT_THAT(names, ElementsAre("as given", "six-link", "trilinear", "spacing x 1.5", "spacing x 2", "proxy",
                                 "proxy, matched"));
  EXPECT_THAT(row(block, "six-link").left_out, HasSubstr("has this model already"));

  // A row's error is that of its own course, over the ticks in which the reference is at rest.
  const ModelRow& given = row(block, "as given");
  double most = 0.0;
  for (std::size_t t = 0; t < given.course.size(); ++t) {
    if (!given.course[t].soft && !block.reference[t].soft) continue;
    if (!block.reference[t].at_rest) continue;
    most =
        std::max(most, hybrid::jnd_of(given.course[t].force_N, block.reference[t].force_N, models.floor_N));
  }
  EXPECT_EQ(std::max(given.felt.error.moving.max_jnd, given.felt.error.still.max_jnd), most);

  // A proxy is felt with the stiffness of its coupling, as given and as fitted.
  ASSERT_TRUE(block.match);
  EXPECT_NEAR(*row(block, "proxy").felt.stiffness_N_per_m, 1500.0, 1.0);
  const ModelRow& matched = row(block, "proxy, matched");
  EXPECT_NEAR(*matched.felt.stiffness_N_per_m, block.match->stiffness_N_per_m,
              0.01 * block.match->stiffness_N_per_m);
  EXPECT_LT(matched.felt.error.worst_jnd(), 0.1 * row(block, "proxy").felt.error.worst_jnd());
  EXPECT_THAT(hybrid::told_apart_by(row(block, "proxy"), block), testing::Contains("stiffness"));

  // Coarser voxels are fewer. At most a bare finger tells the chosen row from the reference.
  EXPECT_LT(row(block, "spacing x 2").soft_voxels, given.soft_voxels);
  const auto best = hybrid::cheapest_untold(block);
  if (best) {
    for (const std::string& by : hybrid::told_apart_by(block.rows[*best], block))
      EXPECT_EQ(by, "stiffness (finger)");
  }
  const auto json = hybrid::models_json(models);
  EXPECT_EQ(json.at("objects").at(0).at("models").size(), block.rows.size());
  EXPECT_FALSE(hybrid::to_svg(hybrid::models_figure(models, "gel")).empty());

  // The tables fit into 100 columns, and each of the two has the given row.
  std::istringstream lines(hybrid::models_words(models));
  std::size_t of_given = 0;
  for (std::string line; std::getline(lines, line);) {
    const bool in_table = std::ranges::any_of(block.rows, [&](const ModelRow& r) {
      return line.starts_with(r.name + " ") && line.find(": ") == std::string::npos;
    });
    if (in_table) {
      EXPECT_LE(line.size(), 100U) << line;
    }
    of_given += line.starts_with("as given ") ? 1 : 0;
  }
  EXPECT_EQ(of_given, 2U);

  // A written variant keeps the file's comments, and gives the forces of its row.
  std::ifstream in(scene.file, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const ModelRow& r : block.rows) {
    if (!r.left_out.empty() || r.name == hybrid::kAsGiven) continue;
    ASSERT_TRUE(r.setting) << r.name;
    const std::string edited =
        hybrid::edited_scene(text, scene.file, models.tunable, *r.setting, "why", hybrid::kVariantMark);
    EXPECT_THAT(edited, HasSubstr("# the tool\n"));
    EXPECT_THAT(edited, HasSubstr("# of gel\n"));
    EXPECT_THAT(edited, HasSubstr("# hybrid compare: why\n"));
    const hybrid::Scene written = hybrid::on_ideal_device(hybrid::load_scene(write("variant.toml", edited)));
    const auto played = hybrid::play_setting(written, {"block"}, hybrid::scene_motion(written), {});
    ASSERT_EQ(played.course.size(), r.course.size());
    for (std::size_t t = 0; t < r.course.size(); t += 10)
      EXPECT_NEAR(glm::length(played.course[t].force_N - r.course[t].force_N), 0.0, 1e-4) << r.name;
  }
}

TEST_F(Models, APunchHasNoProxyAndSaysSo) {
  const ModelsInScene models =
      hybrid::models_in_scene(hybrid::read_scene(gel("shape = \"punch\"\n", "", "3.5")), {});
  const ObjectModels& block = models.objects.at(0);
  EXPECT_FALSE(block.depth_from_proxy);
  EXPECT_THAT(row(block, "proxy").left_out, HasSubstr("a punch is felt by voxels alone"));
  EXPECT_THAT(row(block, "proxy, matched").left_out, HasSubstr("a punch is felt by voxels alone"));
  EXPECT_TRUE(row(block, "as given").felt.stiffness_N_per_m);
}

// Nothing soft is touched, so the scene as given is exact. The rigid object also gets a row with voxels.
TEST_F(Models, OfARigidBox) {
  const auto file =
      write("box.toml",
            "format = 1\n[tool]\nradius = 4\nstiffness = 800\n[[rigid]]\nname = \"box\"\n"
            "primitive = \"box\"\nsize = [24, 24, 10]\n[[rigid]]\nname = \"far\"\nprimitive = "
            "\"ball\"\nradius = 5\nposition = [100, 0, 0]\n[path]\nkind = \"press\"\nfrom = [0, 0, "
            "12]\nto = [0, 0, 6.5]\nhold = 0.1\nspeed = 40\n");
  const ModelsInScene models = hybrid::models_in_scene(hybrid::read_scene(file), {});
  EXPECT_FALSE(models.truth);
  EXPECT_THAT(models.untouched, ElementsAre("far"));
  const ObjectModels& box = models.objects.at(0);
  EXPECT_EQ(row(box, "as given").felt.error.worst_jnd(), 0.0);
  EXPECT_NEAR(*row(box, "as given").felt.stiffness_N_per_m, 800.0, 1.0);
  EXPECT_LT(*row(box, "as voxels").felt.stiffness_N_per_m, 800.0);
  EXPECT_EQ(hybrid::cheapest_untold(box), 0U);
}

TEST_F(Models, ReasonsAreGivenForObjectsWithoutVoxels) {
  hybrid::Scene scene;
  scene.tool.radius_m = 4e-3;
  const auto add = [&](const std::string& name, const hybrid::RigidSource& source) {
    auto& rigid = scene.rigid.emplace_back();
    rigid.name = name;
    rigid.source = source;
  };
  add("sheet", hybrid::PlanePrimitive{0.1});
  add("thin", hybrid::BoxPrimitive{{0.02, 0.02, 0.001}});
  add("moves", hybrid::BallPrimitive{0.01});
  scene.rigid.back().motion = hybrid::FreeMotion{};
  const auto reason = [&](const std::string& name, const glm::dvec3& extent_m) {
    return hybrid::voxel_variant(scene, name, extent_m).left_out;
  };
  EXPECT_THAT(reason("sheet", {0.1, 0.1, 0.0}), HasSubstr("no inside"));
  EXPECT_THAT(reason("thin", {0.02, 0.02, 0.001}), HasSubstr("1 mm thin"));
  EXPECT_THAT(reason("moves", glm::dvec3(0.02)), HasSubstr("it moves"));
}

TEST_F(Models, AnObjectThatIsNotTouchedIsRefused) {
  const hybrid::Scene scene = hybrid::read_scene(
      gel("", "[[rigid]]\nname = \"far\"\nprimitive = \"ball\"\nradius = 5\nposition = [100, 0, 0]\n"));
  const auto refusal = [&](const std::string& object) {
    try {
      (void)hybrid::models_in_scene(scene, {.object = object});
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal("far"), HasSubstr("its path does not touch \"far\""));
  EXPECT_THAT(refusal("bock"), HasSubstr("no object \"bock\"; it has \"far\" \"block\""));
}

}  // namespace
