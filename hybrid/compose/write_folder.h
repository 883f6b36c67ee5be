// SPDX-License-Identifier: GPL-3.0-or-later
// The folder that `compose` writes. Existing files are overwritten only if the user asks for it. All files
// are first written into a subfolder and put in place at the end. So a scene that fails, or a killed process,
// leaves the folder as it was.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace hybrid {

class ComposeFolder {
 public:
  // Makes the folder if it is missing. Throws ComposeError: the folder holds a scene and `force` is false,
  // the path is a file, or nothing can be written there.
  ComposeFolder(std::filesystem::path folder, bool force);
  // Removes the files that keep() did not put in place.
  ~ComposeFolder();
  ComposeFolder(const ComposeFolder&) = delete;
  ComposeFolder& operator=(const ComposeFolder&) = delete;
  ComposeFolder(ComposeFolder&&) = delete;
  ComposeFolder& operator=(ComposeFolder&&) = delete;

  // The path to which a file of this name is to be written until keep(). Throws ComposeError if the file
  // exists and `force` is false.
  std::filesystem::path claim(const std::string& name);
  void write_text(const std::string& name, const std::string& text);
  // Removes a file that write_text() wrote.
  void drop(const std::string& name);
  // Copies an input file. If the input is the target file itself, it stays as it is.
  void copy(const std::filesystem::path& from, const std::string& name);
  // A name for a file or object, made by name_letters(). It differs from all names given out before by more
  // than case, because some file systems ignore case.
  std::string unused_name(const std::string& wanted);
  // Puts all files in place. Throws ComposeError.
  void keep();

  // The folder of the files until keep(), and the path of the scene after it.
  [[nodiscard]] const std::filesystem::path& staging() const { return staging_; }
  [[nodiscard]] std::filesystem::path scene() const { return folder_ / "scene.toml"; }

 private:
  std::filesystem::path folder_, staging_;
  bool force_ = false, made_ = false;
  std::vector<std::string> written_;
  std::set<std::string> names_;  // in small letters
};

// The text with its letters and digits of ASCII, '-' and printable characters beyond ASCII, and with '_' for
// all others. Cut to 48 bytes.
std::string name_letters(std::string_view text);

}  // namespace hybrid
