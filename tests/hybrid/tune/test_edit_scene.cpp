// SPDX-License-Identifier: GPL-3.0-or-later
// Writes settings into the text of random scenes, and reads them back.
#include "hybrid/tune/edit_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "hybrid/base/number_text.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::Energy;
using hybrid::ObjectSetting;
using hybrid::Setting;

constexpr const char* kFirst = "# The sündry scene: first line, = [not] \"a\" value\n";

class EditScene : public tests::SceneFile {
 protected:
  int pick(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  bool coin() { return pick(2) == 0; }

  // Text of a soft object's table, with its keys in a random order and layout.
  std::string table_text(const std::string& name) {
    std::vector<std::string> keys{"name = \"" + name + "\"", "formula = \"block\"",
                                  "size = [ 40,\n  # inner ] comment\n  40, 20 ]"};
    keys.push_back(coin() ? "spacing = 2" : "spacing   =   [2.0, 2, 2.5] # [mm]");
    if (coin()) keys.push_back(coin() ? "energy = \"trilinear\"" : "energy='six-link'#glued");
    if (coin()) keys.push_back(coin() ? "model = \"voxels\"" : "model = \"auto\"");
    std::shuffle(keys.begin(), keys.end(), random_);
    const std::string indent(static_cast<std::size_t>(pick(3)), ' ');
    std::string text = indent + "[[soft]] # the \"" + name + "\"\n";
    for (const std::string& key : keys) {
      if (pick(4) == 0) text += "\n" + indent + "# über " + key.substr(0, 4) + "\n";
      text += indent + key + (coin() ? " # é" : "") + "\n";
    }
    return text;
  }

  std::string scene_text() {
    const std::string blocks =
        table_text("one") + "position = [0, 0, 0]\n" + table_text("two") + "position = [100, 0, 0]\n";
    return kFirst + std::string("format = 1\ntitle = \"t\"\n") + blocks +
           "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, 3]\n# the end" + (coin() ? "\n" : "");
  }

  ObjectSetting random_values(const ObjectSetting& own) {
    ObjectSetting values = own;
    if (pick(3) > 0) {
      values.spacing = glm::dvec3(0.5 * (2 + pick(8)));
      if (coin())
        values.spacing.z = std::strtod(hybrid::with_digits(1.0 + pick(999) / 997.0, 7).c_str(), nullptr);
    }
    if (coin()) values.energy = coin() ? Energy::trilinear : Energy::six_link;
    if (coin()) values.work = 0.25 * (1 + pick(4));
    if (coin()) values.patch = 4 + pick(7);
    values.proxy = pick(4) == 0;
    return values;
  }

  std::mt19937 random_{7};
};

std::vector<std::string> comment_lines(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t at = line.find('#');
    if (at != std::string::npos && line.find(hybrid::kReasonMark) == std::string::npos)
      out.push_back(line.substr(at));
  }
  return out;
}

std::size_t reasons_in(const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(hybrid::kReasonMark); at != std::string::npos;
       at = text.find(hybrid::kReasonMark, at + 1))
    ++count;
  return count;
}

void expect_values(const hybrid::Scene& wanted, const hybrid::Scene& read) {
  ASSERT_EQ(wanted.soft.size(), read.soft.size());
  ASSERT_EQ(wanted.rigid.size(), read.rigid.size());
  for (std::size_t n = 0; n < wanted.soft.size(); ++n) {
    const auto &a = wanted.soft[n], &b = read.soft[n];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.energy, b.energy);
    EXPECT_EQ(a.work, b.work);
    EXPECT_EQ(a.patch, b.patch);
    EXPECT_EQ(std::get<voxel::Formula>(a.source).spacing_m, std::get<voxel::Formula>(b.source).spacing_m);
  }
}

TEST_F(EditScene, ReadBackHasTheWantedValuesAndKeepsTheComments) {
  for (int round = 0; round < 200; ++round) {
    const std::string text = scene_text();
    const auto file = write("scene.toml", text);
    const hybrid::Scene as_read = hybrid::read_scene(file);
    const auto objects = hybrid::tunable_objects(as_read);
    ASSERT_EQ(objects.size(), 2U);
    Setting setting;
    for (const auto& object : objects) setting.objects.push_back(random_values(object.own));
    const std::string edited = hybrid::edited_scene(text, file, objects, setting, "because");
    EXPECT_EQ(comment_lines(text), comment_lines(edited)) << edited;
    EXPECT_LE(reasons_in(edited), 2U);
    EXPECT_EQ(reasons_in(edited) > 0, !(setting == hybrid::own_setting(objects)));
    const auto again = write("edited.toml", edited);
    // A proxy keeps the spacing and energy of the file, as they have no effect.
    expect_values(hybrid::with_setting(as_read, setting), hybrid::load_scene(again));

    // The setting is now the file's own, so writing it again changes nothing. Another change replaces the
    // reason in the file instead of adding one.
    const auto now = hybrid::tunable_objects(hybrid::read_scene(again));
    EXPECT_EQ(hybrid::edited_scene(edited, again, now, hybrid::own_setting(now), "no"), edited);
    if (now.empty()) continue;  // both objects became proxies
    Setting back = hybrid::own_setting(now);
    back.objects[0].spacing = glm::dvec3(7.0);
    back.objects[0].proxy = false;
    EXPECT_EQ(reasons_in(hybrid::edited_scene(edited, again, now, back, "other")), 1U);
  }
}

TEST_F(EditScene, InlineTablesAndLinesOfAnotherSystemStayAsTheyAre) {
  const std::string text =
      "format = 1\r\nsoft = [ { name = \"a\", formula = \"ball\", size = 20, spacing = 2 }, # one\r\n"
      "  { name = \"b\", formula = \"ball\", size = 20, spacing = 2, position = [50, 0, 0] } ]\r\n"
      "[path]\r\nkind = \"press\"\r\nfrom = [0, 0, 30]\r\nto = [0, 0, 13]\r\n";
  const auto file = write("scene.toml", text);
  const auto objects = hybrid::tunable_objects(hybrid::read_scene(file));
  Setting setting = hybrid::own_setting(objects);
  setting.objects[0].energy = Energy::trilinear;
  setting.objects[1].spacing = glm::dvec3(2.5);
  EXPECT_EQ(hybrid::edited_scene(text, file, objects, setting, "why"),
            "format = 1\r\n# hybrid tune: why\r\nsoft = [ { name = \"a\", energy = \"trilinear\", "
            "formula = \"ball\", size = 20, spacing = 2 }, # one\r\n  # hybrid tune: why\r\n"
            "  { name = \"b\", formula = \"ball\", size = 20, spacing = 2.5, position = [50, 0, 0] } "
            "]\r\n[path]\r\nkind = \"press\"\r\nfrom = [0, 0, 30]\r\nto = [0, 0, 13]\r\n");
}

TEST_F(EditScene, AFormulaKeepsItsEdgesAtEveryScale) {
  const auto objects = hybrid::tunable_objects(load("format = 1\n" + tests::block + tests::path));
  for (const double scale : {0.3, 0.75, 0.9, 1.3, 2.0, 2.7, 5.0}) {
    const glm::dvec3 spacing = hybrid::scaled(objects[0], scale).spacing;
    const glm::dvec3 size(20.0, 20.0, 10.0);
    for (int d = 0; d < 3; ++d) {
      const double voxels = size[d] / spacing[d];
      EXPECT_NEAR(voxels, std::round(voxels), 1e-5);
      EXPECT_GE(voxels, 2.0 - 1e-5);
    }
  }
  EXPECT_EQ(hybrid::scaled(objects[0], 1.0).spacing, glm::dvec3(2.0));
}

}  // namespace
