// SPDX-License-Identifier: GPL-3.0-or-later
// The folder that `compose` writes: nothing in it is overwritten unasked. All is written into a folder within
// it first and put in place at the end, so a scene that fails, or a kill, leaves what was there.
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
  // Removes what was not kept.
  ~ComposeFolder();
  ComposeFolder(const ComposeFolder&) = delete;
  ComposeFolder& operator=(const ComposeFolder&) = delete;
  ComposeFolder(ComposeFolder&&) = delete;
  ComposeFolder& operator=(ComposeFolder&&) = delete;

  // Where a file of this name is to be written for now. Throws ComposeError: it exists, and `force` is false.
  std::filesystem::path claim(const std::string& name);
  void write_text(const std::string& name, const std::string& text);
  // Takes a file away again that write_text() wrote.
  void drop(const std::string& name);
  // A copy of an input; where it is that very file, it stays as it is.
  void copy(const std::filesystem::path& from, const std::string& name);
  // A name for a file or object, of letters, digits, '-', '_' alone and not given out before.
  std::string unused_name(const std::string& wanted);
  // Puts everything in place. Throws ComposeError.
  void keep();

  // Where the files are until keep(), and where the scene is after it.
  [[nodiscard]] const std::filesystem::path& staging() const { return staging_; }
  [[nodiscard]] std::filesystem::path scene() const { return folder_ / "scene.toml"; }

 private:
  std::filesystem::path folder_, staging_;
  bool force_ = false, made_ = false;
  std::vector<std::string> written_;
  std::vector<std::string> names_;
};

}  // namespace hybrid
