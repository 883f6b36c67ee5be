// SPDX-License-Identifier: GPL-3.0-or-later
// Every error in a scene file is refused with its place and a remedy. broken_scenes/ has a file for each
// error.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "hybrid/build/load_scene.h"
#include "hybrid/scene/scene.h"
#include "hybrid/scene/table_reader.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::load_scene;
using hybrid::Scene;
using hybrid::SceneError;
using tests::block;
using tests::path;

const std::filesystem::path broken_folder =
    tests::source_folder / "tests" / "hybrid" / "scene" / "broken_scenes";

class SceneRefusal : public tests::SceneFile {};

struct Broken {
  const char* file;
  const char* place;   // line:column
  const char* wrong;   // part of the error's text
  const char* remedy;  // part of the remedy's text
};
// Names a case by its file. By default GoogleTest prints a case's bytes, and the pointers in it differ
// between runs.
void PrintTo(const Broken& scene, std::ostream* out) {
  *out << scene.file;
}

const Broken broken[] = {
    {"empty", "1:1", "empty", "format = 1"},
    {"format-missing", "1:1", "'format' is missing", "first key"},
    {"format-not-first", "2:1", "must be the first", "move format = 1"},
    {"format-two", "1:1", "format 1", "format = 1"},
    {"binary", "3:1", "not text", ".toml"},
    {"binary-later", "2:10", "UTF-8", "save the file as UTF-8"},
    {"utf16", "1:1", "UTF-16", "save it as UTF-8"},
    {"syntax", "2:9", "value", "quotes"},
    {"syntax-header", "2:2", "no key", "correct the TOML"},
    {"not-ascii-key", "3:1", "outside of quotes", "quotes"},
    {"not-ascii-escape", "3:1", "behind a backslash", "remove"},
    {"duplicate-key", "7:11", "'spacing'", "keep one"},
    {"deep-nesting", "2:41", "nested", "list of points"},
    {"long-dotted-key", "2:130", "64 parts", "shorten"},
    {"unknown-root-key", "2:1", "'unit'", "'units'"},
    {"unknown-table", "12:2", "'tools'", "'tool'"},
    {"unknown-tool-key", "4:1", "'stifness'", "'stiffness'"},
    {"key-of-other-primitive", "6:1", "'size'", "remove it"},
    {"units-unknown", "2:1", "inch", "m, cm, mm, um"},
    {"single-brackets", "2:2", "single brackets", "[[soft]]"},
    {"double-brackets", "2:3", "double brackets", "[tool]"},
    {"no-objects", "1:1", "no objects", "[[rigid]]"},
    {"no-path", "1:1", "no [path]", "kind = "},
    {"no-source", "2:1", "made of", "mesh, primitive, volume"},
    {"two-sources", "4:1", "two sources", "keep one"},
    {"two-selections", "6:1", "both say", "keep one"},
    {"same-name", "8:1", "line 2", "name of its own"},
    {"name-missing", "2:1", "'name' is missing", "add name"},
    {"name-empty", "3:1", "empty", "letters"},
    {"name-blank", "3:1", "empty", "letters"},
    {"name-turned", "3:1", "'muscle?' is empty, too long or not printable", "letters"},
    {"mesh-missing", "4:1", "does not exist", "relative to the folder"},
    {"mesh-is-folder", "4:1", "folder", "name a file"},
    {"radius-text", "3:1", "a string", "e.g. 2"},
    {"radius-zero", "3:1", "is a point", "two spacings of \"block\""},
    {"spacing-negative", "6:1", "is -2", "above 0"},
    {"spacing-too-coarse", "6:1", "no voxel", "smaller"},
    {"stiffness-nan", "3:1", "is nan", "above 0"},
    {"position-infinite", "9:3", "is inf", "length in mm"},
    {"position-two-numbers", "7:1", "2 numbers", "give three"},
    {"transform-and-position", "8:1", "both say where", "keep one"},
    {"lattice-too-large", "6:1", "2e+15 bytes", "spacing larger"},
    {"layers-too-thick", "9:5", "11 mm", "thinner"},
    {"inclusion-outside", "7:33", "outside", "move it inside"},
    {"label-zero", "5:14", "is 0", "from 1"},
    {"label-above-255", "5:1", "1001", "ranges"},
    {"labels-empty", "5:1", "empty list", "remove the key"},
    {"labels-too-many", "5:1", "255 labels", "at most 254"},
    {"range-reversed", "5:1", "down to", "smaller number first"},
    {"no-anchor", "7:1", "cannot balance the tool's force", "faces"},
    {"no-anchor-rigid", "7:1", "cannot balance the tool's force", "add a face"},
    {"anchor-face", "7:28", "no side", "-z"},
    {"anchor-label-unknown", "7:13", "label 7", "one of its labels: 1"},
    {"material-unknown", "7:1", "not defined", "'tissue'"},
    {"material-label-unknown", "7:15", "label 3", "one of its labels"},
    {"poisson", "12:1", "is 0.5", "below 0.5"},
    {"young-negative", "12:1", "is -1", "above 0"},
    {"stretch-reversed", "12:1", "above its max", "smaller number first"},
    {"stretch-min-above-one", "12:1", "1.1", "min <= 1"},
    {"stretch-none", "12:1", "may slip but not stretch", "give both some slack"},
    {"shear-none", "12:1", "may stretch but not slip", "or neither"},
    {"shear-negative", "12:1", "is -0.1", "0 or more"},
    {"yield-zero", "12:1", "is 0", "strain, above 0"},
    {"yield-negative", "12:1", "is -0.1", "strain, above 0"},
    {"yield-nan", "12:1", "is nan", "strain, above 0"},
    {"yield-text", "12:1", "a string", "0.2"},
    {"yield-as-plastic", "12:1", "'plastic'", "yield = 0.2"},
    {"yield-as-elastic", "12:1", "'elastic'", "remove it"},
    {"rigid-stiffness-zero", "6:1", "is 0", "above 0"},
    {"damping-negative", "6:1", "is -1", "0 or more"},
    {"friction-negative", "6:18", "is -0.1", "friction coefficient"},
    {"friction-reversed", "6:1", "holds less at rest", "static coefficient first"},
    {"friction-three", "6:1", "3 numbers", "[static, dynamic]"},
    {"friction-text", "6:1", "a string", "write e.g. 0.4"},
    {"friction-key", "6:28", "'dinamic'", "'dynamic'"},
    {"shading-number", "6:1", "true or false", "shading = true"},
    {"texture-empty", "6:8", "what it is", "image, pattern"},
    {"texture-image-missing", "7:1", "does not exist", "relative to the folder"},
    {"texture-two-sources", "8:1", "an image and a pattern", "keep one"},
    {"texture-pattern-unknown", "7:1", "unknown", "bumps"},
    {"texture-size-zero", "8:1", "is 0", "above 0"},
    {"texture-too-steep", "9:1", "more than half", "flatter"},
    {"texture-kind-unknown", "6:56", "unknown", "height, shading"},
    {"texture-key-unknown", "6:42", "'heigth'", "'height'"},
    {"yield-of-bricks", "5:1", "both a yield", "take one"},
    {"work-above-one", "7:1", "is 1.5", "from 0.1 to 1"},
    {"patch-too-narrow", "7:1", "is 3", "4 to 10"},
    {"later-energy", "7:1", "not supported yet", "trilinear"},
    {"later-device", "3:1", "not supported yet", "ideal"},
    {"device-scale-simulated", "4:1", "no meaning with a simulated model", "remove it"},
    {"device-scale-zero", "4:1", "is 0", "0.001 to 1000"},
    {"device-scale-word", "4:1", "unknown", "fit"},
    {"later-delay", "3:1", "not supported yet", "delay_ticks"},
    {"delay-ideal", "4:1", "ideal", "model"},
    {"delay-real", "4:1", "real device", "remove it"},
    {"delay-fraction", "3:1", "whole number", "delay_ticks = 0"},
    {"watchdog-zero", "3:1", "is 0", "above 0"},
    {"grip-unknown", "3:1", "unknown", "firm"},
    {"tremor-large", "3:1", "is 1000", "0 to 100"},
    {"passivity-ideal", "5:1", "ideal", "touch"},
    {"passivity-text", "3:1", "must be true or false", "passivity = true"},
    {"max-energy-zero", "3:1", "is 0", "above 0"},
    {"deadline-short", "3:1", "is 0.5", "above 1"},
    {"device-unknown", "3:1", "unknown", "premium-1.5"},
    {"rate-too-low", "3:1", "is 1", "100 to 20000"},
    {"path-kind-missing", "7:2", "'kind' is missing", "kind = "},
    {"path-speed-zero", "11:1", "is 0", "above 0"},
    {"path-too-long", "11:1", "340000 s", "raise the speed"},
    {"path-point", "11:3", "point 2", "[x, y, z, seconds]"},
    {"path-csv-missing", "9:1", "motion.csv", "relative"},
    {"repeat-fraction", "11:1", "whole number", "repeat = 1"},
    {"motion-unknown", "10:1", "unknown", "free"},
    {"motion-path-missing", "10:1", "along which", "[rigid.path]"},
    {"motion-mass-fixed", "10:1", "no meaning with motion", "motion = \"free\""},
    {"motion-path-free", "12:8", "no meaning with motion", "motion = \"path\""},
    {"motion-no-mass", "10:1", "neither mass nor density", "mass = 0.1"},
    {"motion-mass-twice", "12:1", "both mass and density", "keep one"},
    {"motion-mass-zero", "11:1", "is 0", "above 0"},
    {"motion-inertia", "12:1", "any body", "sum of the other two"},
    {"motion-inertia-density", "12:1", "no mass", "write mass"},
    {"motion-drag-negative", "12:1", "is -1", "0 or more"},
    {"spin-axis", "11:10", "no direction", "axis = [0, 0, 1]"},
    {"spin-rate-missing", "11:1", "'rate' is missing", "rate = 90"},
    {"spin-twice", "11:10", "to and fro", "keep rate"},
    {"spin-frequency-missing", "11:1", "'frequency' is missing", "frequency = "},
    {"spin-key", "11:10", "'rat'", "'rate'"},
    {"path-of-rigid", "11:8", "'to' is missing", "add to"},
    {"cut-normal", "6:10", "no direction", "normal = [0, 0, 1]"},
};

class BrokenScene : public ::testing::TestWithParam<Broken> {};

TEST_P(BrokenScene, IsRefusedWithItsPlaceAndARemedy) {
  const Broken& scene = GetParam();
  const std::filesystem::path file = broken_folder / (std::string(scene.file) + ".toml");
  ASSERT_TRUE(std::filesystem::exists(file)) << file;
  try {
    (void)load_scene(file);
    FAIL() << file << " was not refused";
  } catch (const SceneError& error) {
    const std::string what = error.what();
    const std::string start = hybrid::words(file.string(), ":", scene.place, ": ");
    EXPECT_EQ(what.substr(0, start.size()), start) << what;
    const std::size_t remedy = what.find("; ");
    ASSERT_NE(remedy, std::string::npos) << what;
    EXPECT_LT(what.find(scene.wrong), remedy) << what;
    EXPECT_NE(what.find(scene.remedy, remedy), std::string::npos) << what;
  }
}

INSTANTIATE_TEST_SUITE_P(Each, BrokenScene, ::testing::ValuesIn(broken), [](const auto& scene) {
  std::string name = scene.param.file;
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
});

TEST(BrokenScenes, EachFileStandsInTheTable) {
  for (const auto& entry : std::filesystem::directory_iterator(broken_folder)) {
    const std::string name = entry.path().stem().string();
    EXPECT_TRUE(std::any_of(std::begin(broken), std::end(broken), [&](const Broken& b) {
      return name == b.file;
    })) << name;
  }
}

TEST_F(SceneRefusal, WhatIsNoSceneFileIsRefused) {
  const auto says = [](const std::filesystem::path& file, const char* word) {
    try {
      (void)load_scene(file);
    } catch (const SceneError& error) {
      return std::string(error.what()).find(word) != std::string::npos;
    }
    return false;
  };
  EXPECT_TRUE(says(folder_, "folder"));
  EXPECT_TRUE(says(folder_ / "none.toml", "no such file"));
  EXPECT_TRUE(says("/dev/zero", "ordinary file"));
  EXPECT_TRUE(says("", "no such file"));
  EXPECT_TRUE(says(folder_ / std::string(5000, 'a'), "too long"));
  EXPECT_TRUE(says(write("big.toml", std::string(17U << 20U, '#')), "16777216"));
  std::string many = "format = 1\ntitle = [";
  for (int i = 0; i < 1'000'001; ++i) many += "1,";
  EXPECT_TRUE(says(write("many.toml", many + "]\n"), "CSV"));
}

TEST_F(SceneRefusal, ARefusalIsOnePrintableLine) {
  const std::string what =
      refusal("format = 1\n\"\\u0007\\n" + std::string(500, 'k') + "\" = 1\n" + block + path);
  EXPECT_LT(what.size(), 400U);
  for (const char c : what) EXPECT_TRUE(c == ' ' || std::isgraph(static_cast<unsigned char>(c)) != 0);
}

TEST(SceneScreen, LetsTextInQuotesAndCommentsPass) {
  const std::vector<std::string> good = {
      "title = \"é µ\" # é\n",  "title = 'é\\' # é\n",
      "title = \"\\\"é\"\n",    "title = \"\"\"é\n\"\" \\\n  a é\"\"\"\"\"\nformat = 1\n",
      "title = '''é\n\\é'''\n", "\"é\" = \"\"\n",
      "a = \"\" # \"é\n",
  };
  for (const std::string& text : good) EXPECT_NO_THROW((void)hybrid::parse_tree(text, "scene.toml")) << text;
  const std::vector<std::string> bad = {"é = 1\n",       "a = é\n",
                                        "a = \"\" é\n",  "a = \"\"\"b\"\"\" é\n",
                                        "a = 'b\\' é\n", "a = \"\"\"\\é\"\"\"\n"};
  for (const std::string& text : bad) {
    try {
      (void)hybrid::parse_tree(text, "scene.toml");
      ADD_FAILURE() << text;
    } catch (const SceneError& error) {
      EXPECT_NE(std::string(error.what()).find("the character 'é' stands"), std::string::npos)
          << error.what();
    }
  }
}

TEST(SceneKeys, EditDistanceCountsEditsAndSwaps) {
  EXPECT_EQ(hybrid::edit_distance("radius", "radius"), 0U);
  EXPECT_EQ(hybrid::edit_distance("radius", "Radius"), 0U);
  EXPECT_EQ(hybrid::edit_distance("radus", "radius"), 1U);
  EXPECT_EQ(hybrid::edit_distance("raidus", "radius"), 1U);
  EXPECT_EQ(hybrid::edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(hybrid::edit_distance("", "abc"), 3U);
}

// A few thousand small damages to a scene with every table. Each must give a scene or a refusal.
TEST_F(SceneRefusal, DamagedScenesAreScenesOrRefused) {
  const std::string whole =
      "format = 1\nunits = \"mm\"\ntitle = \"T\"\noverlap = \"carve\"\n[occupancy]\ncell = 2.5\n"
      "[tool]\nshape = \"ball\"\nradius = 3\nstiffness = 1e3\n[device]\nmodel = \"touch\"\nrate = 1000\n"
      "[hand]\nmass = 0.006\n[safety]\nmax_force = 3\n[material.a]\nyoung = 3e3\nstretch = [0.5, 1.5]\n"
      "[[rigid]]\nname = \"r\"\nprimitive = \"box\"\nsize = [1, 2, 3]\nrotation = [0, 90, 0]\n"
      "motion = \"free\"\nmass = 0.1\ninertia = [1e-4, 1e-4, 1e-4]\ngravity = [0, 0, -9.81]\n"
      "[[rigid]]\nname = \"v\"\nvolume = \"scene.toml\"\nrange = [1, 9]\n"
      "cut = [{ normal = [0, 0, 1], offset = 4 }]\nmotion = \"path\"\nspin = { axis = [0, 1, 0], rate = 90 "
      "}\n"
      "[[soft]]\nname = \"s\"\nformula = \"block\"\nsize = [20, 20, 10]\nspacing = 2\n"
      "layers = [{ thickness = 4, label = 2 }]\n"
      "inclusions = [{ shape = \"ball\", centre = [0, 0, 1], size = 4, label = 3 }]\n"
      "material = \"a\"\nmaterials = { \"2\" = \"a\" }\nanchors = { faces = [\"-z\"], labels = [2] }\n"
      "[path]\nkind = \"waypoints\"\npoints = [[0, 0, 20], [0, 0, 3, 0.5]]\nspeed = 40\n";
  ASSERT_NO_THROW((void)load(whole));
  std::mt19937 random(20240607);
  const auto below = [&random](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  const std::vector<std::string> pieces = {"[",      "]",          "{",    "}",     "\"",
                                           "'",      "=",          ",",    ".",     "\n",
                                           "-",      "inf",        "nan",  "1e400", "9223372036854775808",
                                           "\"\"\"", "\\",         "0",    "[[",    "]]",
                                           "\xFF",   "1979-05-27", "true", "#",     "\\u0000",
                                           "0x",     "_",          "\r",   "-0",    "1e-320"};
  std::size_t scenes = 0, refused = 0;
  constexpr std::size_t rounds = 4000;
  for (std::size_t round = 0; round < rounds; ++round) {
    std::string text = whole;
    const std::size_t damages = 1 + below(3);
    for (std::size_t i = 0; i < damages; ++i) {
      const std::size_t at = below(text.size());
      switch (below(8)) {
        case 0:
          text[at] = static_cast<char>(below(256));
          break;
        case 1:
          text.erase(at, 1 + below(12));
          break;
        case 2:
          text.insert(at, pieces[below(pieces.size())]);
          break;
        case 3:
          text.insert(at, text.substr(below(text.size()), 1 + below(60)));
          break;
        case 4:
          text.resize(std::max<std::size_t>(1, at));
          break;
        case 5:
        case 6: {
          const std::size_t digit = text.find_first_of("0123456789", at);
          if (digit != std::string::npos) text[digit] = static_cast<char>('0' + below(10));
          break;
        }
        default: {  // replaces a digit by a character that may be part of a number
          const std::size_t digit = text.find_first_of("0123456789", at);
          if (digit != std::string::npos) text.replace(digit, 1, pieces[below(pieces.size())]);
        }
      }
      if (text.empty()) text.push_back('\n');
    }
    try {
      const Scene scene = load(text);
      ++scenes;
      EXPECT_FALSE(scene.rigid.empty() && scene.soft.empty());
      EXPECT_TRUE(std::isfinite(scene.tool.radius_m) && scene.tool.radius_m > 0.0);
    } catch (const SceneError& error) {
      ++refused;
      EXPECT_NE(std::string(error.what()).find("; "), std::string::npos) << error.what();
    }
  }
  EXPECT_EQ(scenes + refused, rounds);
  EXPECT_GT(scenes, rounds / 50);
  EXPECT_GT(refused, rounds / 2);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

// The refusal has lines such as ":2:1: unknown key …", in the order of the file.
TEST_F(SceneRefusal, AllErrorsAreSaidInTheOrderOfTheFile) {
  const std::string said = refusal(
      "format = 1\ntitel = \"a\"\n"                                                  // 2
      "[tool]\nradius = -1\nstiffness = \"hard\"\n"                                  // 4, 5
      "[material.fat]\nyoung = 0\n"                                                  // 7
      "[[rigid]]\nname = \"a\"\nprimitive = \"sphere\"\nradius = 4\n"                // 10
      "[[soft]]\nname = \"b\"\nformula = \"block\"\nsize = [20, 20]\nspacing = 0\n"  // 15, 16
      "[path]\nkind = \"press\"\nfrom = 3\nto = [0, 0, 3]\n");                       // 19
  const std::vector<std::string> lines = lines_of(said);
  const std::vector<int> expected{2, 4, 5, 7, 10, 15, 16, 19};
  ASSERT_EQ(lines.size(), expected.size()) << said;
  for (std::size_t n = 0; n < lines.size(); ++n) {
    EXPECT_NE(lines[n].find(":" + std::to_string(expected[n]) + ":"), std::string::npos) << lines[n];
    EXPECT_NE(lines[n].find("; "), std::string::npos) << lines[n];
  }
}

TEST_F(SceneRefusal, WhatFollowsFromAnErrorIsNoErrorOfItsOwn) {
  struct Case {
    const char* what;
    std::string text;
    std::size_t errors;
  };
  const std::string head = "format = 1\n";
  for (const Case& c :
       {Case{"a misspelt key is not also missing",
             head + "[[rigid]]\nname = \"a\"\nprimitive = \"ball\"\nradus = 4\n" + path, 1},
        Case{"a material that is wrong is not also undefined",
             head + "[material.fat]\nyoung = 0\n" + block + "material = \"fat\"\n" + path, 1},
        Case{
            "names that are missing are not the same one",
            head +
                "[[rigid]]\nprimitive = \"ball\"\nradius = 4\n[[rigid]]\nprimitive = \"ball\"\nradius = 4\n" +
                path,
            2},
        Case{"two misspelt materials",
             head + "[material.fat]\nyoung = 1e4\n" + block + "material = \"fta\"\n" +
                 "[[soft]]\nname = \"c\"\nformula = \"block\"\nsize = 20\nspacing = 2\nmaterial = \"aft\"\n" +
                 path,
             2},
        Case{"no path and no objects", head, 2}}) {
    const std::string said = refusal(c.text);
    EXPECT_EQ(lines_of(said).size(), c.errors) << c.what << ": " << said;
  }
}

TEST_F(SceneRefusal, Latin1IsNamedWithItsLine) {
  const std::string said = refusal(
      "format = 1\n# fine\ntitle = \"Sch\xE4"
      "del\"\n" +
      block + path);
  EXPECT_NE(said.find(":3:13: "), std::string::npos) << said;
  EXPECT_NE(said.find("Latin-1"), std::string::npos) << said;
  EXPECT_NE(said.find("'\u00E4'"), std::string::npos) << said;
  EXPECT_NE(said.find("save the file as UTF-8"), std::string::npos) << said;
  // Latin-1 is also found in a comment. A text that is cut within a character is neither Latin-1 nor UTF-8.
  EXPECT_NE(refusal("format = 1 # f\xFCr\n").find(":1:15: "), std::string::npos);
  EXPECT_NE(refusal("format = 1 # \xE2\x82\n").find("not utf-8"), std::string::npos);
  EXPECT_EQ(refusal("format = 1\ntitle = \"Sch\u00E4del\"\n" + block + path), "");
}

}  // namespace
