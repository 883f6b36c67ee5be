// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/view/offered_scenes.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <system_error>

#include "hybrid/base/file_ending.h"
#include "hybrid/base/whole_file.h"

namespace hybrid {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostRecent = 8;

// The list of recent scenes, one path a line; empty: there is no home for it (XDG Base Directory).
fs::path recent_file() {
  const char* const state = std::getenv("XDG_STATE_HOME");
  const char* const home = std::getenv("HOME");
  if (state != nullptr && *state == '/') return fs::path(state) / "hybrid" / "recent";
  if (home != nullptr && *home == '/') return fs::path(home) / ".local/state/hybrid/recent";
  return {};
}

std::string text_or_nothing(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<fs::path> recent_paths() {
  std::vector<fs::path> paths;
  std::ifstream in(recent_file());
  for (std::string line; std::getline(in, line) && paths.size() < kMostRecent;) {
    std::error_code missing;
    if (!line.empty() && fs::is_regular_file(line, missing)) paths.emplace_back(line);
  }
  return paths;
}

}  // namespace

std::string first_comment(const std::string& text) {
  if (text.empty() || text[0] != '#') return {};
  std::string line = text.substr(1, text.find('\n') - 1);
  line.erase(0, line.find_first_not_of(" \t"));
  return line;
}

std::vector<OfferedScene> shipped_scenes() {
  std::error_code none;
  const fs::path program = fs::read_symlink("/proc/self/exe", none);
  std::vector<OfferedScene> scenes;
  for (const fs::path& folder : {program.parent_path().parent_path() / "share/hybrid/scenes",
                                 program.parent_path().parent_path().parent_path() / "scenes"}) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none)) {
      if (lower_ending(entry.path()) == ".toml")
        scenes.push_back({entry.path(), first_comment(text_or_nothing(entry.path()))});
    }
    if (!scenes.empty()) break;
  }
  std::ranges::sort(scenes, {}, &OfferedScene::file);
  return scenes;
}

std::vector<OfferedScene> recent_scenes() {
  std::vector<OfferedScene> scenes;
  for (const fs::path& path : recent_paths()) scenes.push_back({path, first_comment(text_or_nothing(path))});
  return scenes;
}

void note_recent_scene(const fs::path& file) try {
  const fs::path list = recent_file();
  if (list.empty()) return;
  const fs::path whole = fs::absolute(file).lexically_normal();
  if (whole.string().find('\n') != std::string::npos) return;  // a line holds one path
  std::string text = whole.string() + "\n";
  std::size_t count = 1;
  for (const fs::path& path : recent_paths()) {
    if (path != whole && count++ < kMostRecent) text += path.string() + "\n";
  }
  fs::create_directories(list.parent_path());
  save_text(list, text);
} catch (const std::exception&) {
  // A read-only home is no reason to end a session.
}

}  // namespace hybrid
