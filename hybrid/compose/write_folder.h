// SPDX-License-Identifier: GPL-3.0-or-later
// The folder that `compose` writes: nothing in it is overwritten unasked, and a scene that fails leaves
// nothing behind.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hybrid {

class ComposeFolder {
 public:
  // Makes the folder where it is missing. Throws ComposeError: it holds a scene and `force` is false, it is a
  // file, or nothing can be written into it.
  ComposeFolder(std::filesystem::path folder, bool force);
  // Removes what was written, unless keep() was called.
  ~ComposeFolder();
  ComposeFolder(const ComposeFolder&) = delete;
  ComposeFolder& operator=(const ComposeFolder&) = delete;
  ComposeFolder(ComposeFolder&&) = delete;
  ComposeFolder& operator=(ComposeFolder&&) = delete;

  // The path of a file of this name, which is about to be written. Throws ComposeError: it exists, and
  // `force` is false.
  std::filesystem::path claim(const std::string& name);
  void write_text(const std::string& name, const std::string& text);
  // Takes a file away again that write_text() wrote.
  void drop(const std::string& name);
  // A copy of an input; nothing where it is that very file.
  void copy(const std::filesystem::path& from, const std::string& name);
  // A name for a file or object, of letters, digits, '-', '_' alone and not given out before.
  std::string unused_name(const std::string& wanted);
  void keep() { kept_ = true; }

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }
  [[nodiscard]] std::filesystem::path scene() const { return folder_ / "scene.toml"; }

 private:
  std::filesystem::path folder_;
  bool force_ = false, kept_ = false, made_ = false;
  std::vector<std::filesystem::path> fresh_;  // files that were not there before
  std::vector<std::string> names_;
};

}  // namespace hybrid
