// SPDX-License-Identifier: GPL-3.0-or-later
// The source tree as text, for tests that check rules of the sources.
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace tests {

struct SourceFile {
  std::string path;  // from the root, with '/'
  std::vector<std::string> lines;
};

inline std::vector<std::string> lines_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

inline bool is_header(const SourceFile& file) {
  return file.path.ends_with(".h") || file.path.ends_with(".hpp");
}
inline bool is_cpp(const SourceFile& file) {
  return is_header(file) || file.path.ends_with(".cpp") || file.path.ends_with(".c");
}
inline bool is_in(const SourceFile& file, std::string_view folder) {
  return file.path.starts_with(std::string(folder).append("/"));
}

// Whether a person wrote the file: sources, build files, scripts, scenes and documents. Data are left out.
inline bool is_text(const std::filesystem::path& file) {
  static const std::set<std::string> kEndings{".cpp",  ".c",   ".h",    ".hpp", ".cmake", ".sh", ".md",
                                              ".toml", ".txt", ".json", ".yml", ".yaml",  ".py"};
  const std::filesystem::path folder = file.parent_path().filename();
  return kEndings.contains(file.extension().string()) || folder == ".ci" || file.filename() == ".clang-tidy";
}

inline std::vector<SourceFile> read_tree() {
  const std::filesystem::path root = HYBRID_SOURCE_DIR;
  std::vector<SourceFile> files;
  const auto add = [&](const std::filesystem::directory_entry& entry) {
    if (!entry.is_regular_file() || !is_text(entry.path())) return;
    files.push_back({entry.path().lexically_relative(root).generic_string(), lines_of(entry.path())});
  };
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(root)) add(entry);
  for (const char* folder :
       {"polygon", "voxel", "device", "hybrid", "interface", "scenes", "tests", "cmake", ".ci"}) {
    if (!std::filesystem::is_directory(root / folder)) continue;
    for (const std::filesystem::directory_entry& entry :
         std::filesystem::recursive_directory_iterator(root / folder))
      add(entry);
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.path < b.path; });
  return files;
}

inline const std::vector<SourceFile>& tree() {
  static const std::vector<SourceFile> files = read_tree();
  return files;
}

inline std::string place(const SourceFile& file, std::size_t line) {
  return file.path + ":" + std::to_string(line + 1) + ": ";
}

}  // namespace tests
