// SPDX-License-Identifier: GPL-3.0-or-later
// A temporary folder. It is deleted together with the object.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <string_view>
#include <system_error>

namespace hybrid {

class ScratchFolder {
 public:
  explicit ScratchFolder(std::string_view what)
      : path_(std::filesystem::temp_directory_path() / fmt::format("hybrid-{}-{}", what, ::getpid())) {
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code none;
    std::filesystem::remove_all(path_, none);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ScratchFolder(ScratchFolder&&) = delete;
  ScratchFolder& operator=(ScratchFolder&&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace hybrid
