// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the source tree and checks the rules that keep its parts separate. A violated rule is reported with
// its file and line.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/source_tree.h"

namespace {

namespace fs = std::filesystem;
using namespace tests;

constexpr std::array kParts{"polygon", "voxel", "device", "hybrid", "interface"};
constexpr std::array kFolders{"polygon", "voxel", "device", "hybrid", "interface", "scenes", "tests"};

// The file that a line includes; empty if the line is not an #include.
std::string included_by(std::string_view line) {
  const auto skip = [&](std::string_view word) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    if (!line.starts_with(word)) return false;
    line.remove_prefix(word.size());
    return true;
  };
  if (!skip("#") || !skip("include") || !(skip("<") || skip("\""))) return {};
  return std::string(line.substr(0, line.find_first_of(">\"")));
}

// Calls found(file, line index, included file) for each #include.
template <typename Found>
void for_each_include(const Found& found) {
  for (const SourceFile& file : tree()) {
    if (!is_cpp(file)) continue;
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string included = included_by(file.lines[i]);
      if (!included.empty()) found(file, i, included);
    }
  }
}

TEST(HouseRules, IncludesAreRecognised) {
  EXPECT_EQ(included_by("#include <CGAL/a.h>"), "CGAL/a.h");
  EXPECT_EQ(included_by("  # include \"voxel/b.h\"  // why"), "voxel/b.h");
  EXPECT_EQ(included_by("// #include <CGAL/a.h>"), "");
  EXPECT_EQ(included_by("#define include <x>"), "");
  EXPECT_EQ(included_by("#"), "");
}

TEST(HouseRules, TheTreeIsThere) {
  for (const char* part : kParts) {
    const bool some = std::any_of(tree().begin(), tree().end(),
                                  [&](const auto& file) { return is_in(file, part) && is_cpp(file); });
    EXPECT_TRUE(some) << "no sources in " << HYBRID_SOURCE_DIR << "/" << part;
  }
}

TEST(HouseRules, PolygonVoxelAndDeviceKnowNothingOfOneAnotherNorOfHybrid) {
  for_each_include([](const SourceFile& file, std::size_t line, const std::string& included) {
    for (const char* part : {"polygon", "voxel", "device"}) {
      if (!is_in(file, part)) continue;
      for (const char* other : kParts) {
        if (std::string_view(other) == part) continue;
        EXPECT_FALSE(included.starts_with(std::string(other).append("/")))
            << place(file, line) << part << "/ includes " << included
            << ": what needs both belongs in hybrid/";
      }
      EXPECT_EQ(included.find("../"), std::string::npos)
          << place(file, line) << included << ": name a header by its folder, as in \"" << part
          << "/name.h\"";
    }
  });
}

// ---- Rooms are the folders of a part. A room may include only certain others. ----

struct Room {
  const char* name;
  std::vector<const char*> below;  // rooms that this room may include, and all rooms that those may include
};

const std::map<std::string, std::vector<Room>>& rooms() {
  static const std::map<std::string, std::vector<Room>> kRooms{
      {"polygon",
       {{"mesh", {}},
        {"surface", {"mesh"}},
        {"repair", {"surface"}},
        {"files", {"repair"}},
        {"proxy", {"files"}},
        {"reference", {"proxy"}}}},
      {"voxel",
       {{"volume", {}},
        {"lattice", {"volume"}},
        {"fem", {"lattice"}},
        {"chain", {"lattice"}},
        {"composite", {"fem"}},
        {"baseline", {"lattice"}},
        {"multigrid", {"fem"}},
        {"relaxation", {"multigrid"}},
        {"object", {"relaxation", "chain", "composite", "baseline"}}}},
      {"device", {{"loop", {}}, {"paths", {}}, {"simulated", {"loop", "paths"}}, {"phantom", {"simulated"}}}},
      {"hybrid",
       {{"base", {}},
        {"geometry", {"base"}},
        {"feel", {"base"}},
        {"map", {"base"}},
        {"scene", {"geometry", "feel", "map"}},
        {"world", {"scene"}},
        {"tick/proxy", {"world"}},
        {"tick/bodies", {"tick/proxy"}},
        {"tick/tissue", {"tick/bodies"}},
        {"tick", {"tick/tissue"}},
        {"build", {"tick"}},
        {"snapshot", {"build"}},
        {"reference", {"snapshot"}},
        {"session", {"reference"}},
        {"view/gl", {}},
        {"view/tissue", {"snapshot", "view/gl"}},
        {"view", {"view/tissue"}},
        {"plot", {"session", "view"}},
        {"page", {"plot"}},
        {"compare", {"session", "view"}},
        {"tune", {"compare", "page"}},
        {"models", {"tune"}},
        {"compose", {"session", "view"}},
        {"window", {"view", "reference"}},
        {"stress", {"session", "view"}},
        {"bench/reports", {}},
        {"bench/scenes", {"models"}},
        {"bench", {"plot", "compare", "compose", "stress"}},
        {"bench/thesis", {"bench", "page"}},
        {"stability", {"plot", "compare", "compose", "stress"}},
        {"validate", {"page", "compare"}},
        {"study", {"tune", "compose"}},
        {"program/help", {"scene"}},
        {"program/view", {"models", "window"}},
        {"program",
         {"bench", "bench/reports", "bench/scenes", "bench/thesis", "program/help", "program/view",
          "stability", "study", "validate"}}}},
      {"interface", {{"", {}}, {"examples", {}}}},
  };
  return kRooms;
}

// Part and room of a path: "hybrid" and "tick/proxy" for "hybrid/tick/proxy/name.h". Both are empty if the
// path belongs to no part.
std::pair<std::string, std::string> room_of(const std::string& path) {
  const std::size_t first = path.find('/'), last = path.rfind('/');
  if (first == std::string::npos || !rooms().contains(path.substr(0, first))) return {};
  return {path.substr(0, first), last == first ? "" : path.substr(first + 1, last - first - 1)};
}

// Whether the room may include the other one; false also for a room that does not exist.
bool may_include(const std::string& part, const std::string& room, const std::string& other) {
  if (room == other) return true;
  for (const Room& candidate : rooms().at(part)) {
    if (room != candidate.name) continue;
    return std::any_of(candidate.below.begin(), candidate.below.end(),
                       [&](const char* below) { return may_include(part, below, other); });
  }
  return false;
}

TEST(HouseRules, EverySourceLiesInARoom) {
  for (const SourceFile& file : tree()) {
    if (!is_cpp(file)) continue;
    const auto [part, room] = room_of(file.path);
    if (part.empty()) continue;
    const auto& known = rooms().at(part);
    EXPECT_TRUE(
        std::any_of(known.begin(), known.end(), [&room = room](const Room& r) { return room == r.name; }))
        << file.path << ":1: " << part << "/" << room << " is no room of " << part
        << ": move the file into one, or add the room to the table in this test, with the rooms below it";
  }
}

TEST(HouseRules, RoomsIncludeOnlyRoomsBelowThem) {
  for_each_include([](const SourceFile& file, std::size_t line, const std::string& included) {
    const auto [part, room] = room_of(file.path);
    const auto [other_part, other] = room_of(included);
    if (part.empty() || part != other_part) return;
    EXPECT_TRUE(may_include(part, room, other))
        << place(file, line) << part << "/" << room << " includes " << included
        << ", which is not below it: move "
        << "what both need into a room below both, or hand it in from above (an argument, a callback)";
  });
}

TEST(HouseRules, TestsMirrorTheRooms) {
  for (const SourceFile& file : tree()) {
    if (!is_cpp(file) || !is_in(file, "tests")) continue;
    const auto [part, room] = room_of(file.path.substr(std::string_view("tests/").size()));
    if (part.empty() || room == "fixtures" || room == "phantom/fake_libhd") continue;
    const auto& known = rooms().at(part);
    EXPECT_TRUE(
        std::any_of(known.begin(), known.end(), [&room = room](const Room& r) { return room == r.name; }))
        << file.path << ":1: tests of a room lie in the folder of its name; what several share, in fixtures/";
  }
}

constexpr std::size_t kMostLines = 450, kMostSources = 40;

TEST(HouseRules, FilesAndRoomsAreSmallEnoughToKnow) {
  std::map<std::string, std::size_t> sources;
  for (const SourceFile& file : tree()) {
    if (!is_cpp(file)) continue;
    EXPECT_LE(file.lines.size(), kMostLines)
        << file.path << ":" << kMostLines << ": split it into files of one notion each";
    ++sources[fs::path(file.path).parent_path().generic_string()];
  }
  for (const auto& [folder, count] : sources)
    EXPECT_LE(count, kMostSources) << folder << " has more sources than can be known: split the room";
}

TEST(HouseRules, OnlyInterfaceAndTestsIncludeHybridFromOutside) {
  for_each_include([](const SourceFile& file, std::size_t line, const std::string& included) {
    if (!included.starts_with("hybrid/")) return;
    EXPECT_TRUE(is_in(file, "hybrid") || is_in(file, "interface") || is_in(file, "tests"))
        << place(file, line) << "includes " << included;
  });
}

// Examples are programs of users, so they may include only the public header.
TEST(HouseRules, NothingIncludesTheInterfaceButItselfAndTests) {
  for_each_include([](const SourceFile& file, std::size_t line, const std::string& included) {
    const bool example = is_in(file, "interface/examples");
    const bool allowed =
        !included.starts_with("interface/") || (is_in(file, "interface") && !example) || is_in(file, "tests");
    EXPECT_TRUE(allowed) << place(file, line) << "includes " << included;
    EXPECT_FALSE(example && included.starts_with("hybrid/")) << place(file, line) << "includes " << included;
  });
}

TEST(HouseRules, NoPartIncludesATest) {
  for_each_include([](const SourceFile& file, std::size_t line, const std::string& included) {
    if (!included.starts_with("tests/")) return;
    EXPECT_TRUE(is_in(file, "tests")) << place(file, line) << "includes " << included;
  });
}

// A library that only two files include can be replaced. A library that a header includes is everywhere.
TEST(HouseRules, HeavyLibrariesStayInFewFilesAndOutOfHeaders) {
  const std::array kHeavy{"CGAL/", "embree3/", "OpenMesh/",  "itk",        "gdcm",
                          "GLFW/", "imgui",    "epoxy/gl.h", "epoxy/egl.h"};
  std::map<std::string, std::set<std::string>> users;
  for_each_include([&](const SourceFile& file, std::size_t line, const std::string& included) {
    for (const char* library : kHeavy) {
      if (!included.starts_with(library)) continue;
      EXPECT_FALSE(is_header(file)) << place(file, line) << "a header includes " << included
                                    << ": keep it in the .cpp, behind the part's own types";
      if (!is_in(file, "tests")) users[library].insert(file.path);
    }
  });
  for (const auto& [library, files] : users) {
    std::string list;
    for (const std::string& file : files) list += "\n  " + file;
    // CGAL may be in more files, because it also serves as the exact reference and as the tree in common use.
    // ImGui is in two rooms, because it draws the text of pictures and the window's panel.
    const std::size_t most = library == "CGAL/" ? 5 : library == "imgui" ? 3 : 2;
    EXPECT_LE(files.size(), most) << library << " is included in more than " << most << " files:" << list;
  }
}

TEST(HouseRules, EverySourceFileNamesItsLicence) {
  constexpr std::string_view kLine = "SPDX-License-Identifier: GPL-3.0-or-later";
  for (const SourceFile& file : tree()) {
    const fs::path path = file.path;
    const bool source = is_cpp(file) || path.extension() == ".cmake" || path.extension() == ".sh" ||
                        path.extension() == ".py" || path.filename() == "CMakeLists.txt" ||
                        path.parent_path() == ".ci";
    if (!source) continue;
    bool found = false;
    for (std::size_t i = 0; i < std::min<std::size_t>(3, file.lines.size()); ++i) {
      found = found || file.lines[i].find(kLine) != std::string::npos;
    }
    EXPECT_TRUE(found) << file.path << ":1: must begin with '" << kLine << "' in a comment";
  }
}

TEST(HouseRules, NoTextNamesAPlaceOnSomeonesMachine) {
  // The words are joined from halves, so that this file does not contain them.
  const std::array<std::string, 3> kForbidden{
      std::string("/wo").append("rk/"), std::string("/ho").append("me/"), std::string("/Use").append("rs/")};
  for (const SourceFile& file : tree()) {
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      for (const std::string& word : kForbidden) {
        EXPECT_EQ(file.lines[i].find(word), std::string::npos)
            << place(file, i) << "names " << word << ": use a path from the project's root";
      }
    }
  }
}

// Whether `word` stands in the code of a line: not in a comment at its end, nor within a longer word.
bool has_word(std::string_view line, std::string_view word) {
  const auto is_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  line = line.substr(0, line.find("//"));
  for (std::size_t at = line.find(word); at != std::string_view::npos; at = line.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_word(line[at - 1])) && (end == line.size() || !is_word(line[end]))) return true;
  }
  return false;
}

TEST(HouseRules, WordsAreFoundInCode) {
  EXPECT_TRUE(has_word("f(Image());", "Image"));
  EXPECT_TRUE(has_word("SectionImage a = Image", "Image"));
  EXPECT_FALSE(has_word("SectionImage a;  // an Image", "Image"));
}

// The name that a line such as `using polygon::Mesh;` declares; empty if there is none.
std::string_view declared_by(std::string_view line) {
  if (!line.starts_with("using ") || !line.ends_with(";")) return {};
  line.remove_prefix(6);
  line.remove_suffix(1);
  if (line.find_first_of(" =") != std::string_view::npos) return {};  // a namespace, an enum or an alias
  return line.substr(line.rfind(':') + 1);
}

// clang-tidy's check for unused using-declarations does not look into the batches of tests/tidy.sh. A header
// may declare names for those who include it.
TEST(HouseRules, EachUsingDeclarationIsUsed) {
  for (const SourceFile& file : tree()) {
    if (!is_cpp(file) || is_header(file)) continue;
    for (std::size_t i = 0; i < file.lines.size(); ++i) {
      const std::string_view word = declared_by(file.lines[i]);
      if (word.empty()) continue;
      const auto uses =
          std::ranges::count_if(file.lines, [&](const std::string& other) { return has_word(other, word); });
      EXPECT_GT(uses, 1) << place(file, i) << word << " is not used; delete the line";
    }
  }
}

TEST(HouseRules, PartsKeepWhatWasDecided) {
  for (const char* part : kParts) {
    const fs::path decisions = fs::path(HYBRID_SOURCE_DIR) / part / "DECISIONS.md";
    EXPECT_TRUE(fs::is_regular_file(decisions))
        << part << "/DECISIONS.md is missing: what was tried and rejected, with its figures";
  }
}

TEST(HouseRules, EveryFolderExplainsItself) {
  for (const char* folder : kFolders) {
    const fs::path readme = fs::path(HYBRID_SOURCE_DIR) / folder / "README.md";
    EXPECT_TRUE(fs::is_regular_file(readme)) << folder << "/README.md is missing";
  }
}

TEST(HouseRules, EverySceneBeginsWithWhatItShows) {
  for (const SourceFile& file : tree()) {
    if (!is_in(file, "scenes") || !file.path.ends_with(".toml")) continue;
    EXPECT_TRUE(!file.lines.empty() && file.lines.front().starts_with("#"))
        << file.path << ":1: must begin with a comment that says what the scene shows";
  }
}

}  // namespace
