// SPDX-License-Identifier: GPL-3.0-or-later
// Scene files that a test writes, in a folder of their own, and the pieces they are made of.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <system_error>

#include "hybrid/scene.h"

namespace tests {

inline const std::filesystem::path source_folder = HYBRID_SOURCE_DIR;

// A folder of its own for the files that a test writes.
class SceneFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    std::random_device seed;
    folder_ = std::filesystem::temp_directory_path() /
              ("hybrid-scene-" + std::string(test->name()) + "-" + std::to_string(seed()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::error_code none;
    std::filesystem::remove(folder_ / name,
                            none);  // some file systems wait for the disk when a file is overwritten
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  hybrid::Scene load(const std::string& text) const { return hybrid::load_scene(write("scene.toml", text)); }
  // What the refusal says after "scene.toml", or an empty text when nothing is refused.
  std::string refusal(const std::string& text) const {
    try {
      (void)load(text);
    } catch (const hybrid::SceneError& error) {
      const std::string what = error.what();
      const std::size_t at = what.find("scene.toml");
      return at == std::string::npos ? what : what.substr(at + 10);
    }
    return {};
  }

  std::filesystem::path folder_;
};

inline const std::string block =
    "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [20, 20, 10]\nspacing = 2\n";
inline const std::string path = "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, 3]\n";
inline const std::string ball = "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 4\n";

}  // namespace tests
