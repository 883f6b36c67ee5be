// SPDX-License-Identifier: GPL-3.0-or-later
// Common parts of the tests of volume files: a folder for each test, and refusals as text.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>

#include "voxel/volume/read_volume.h"
#include "voxel/volume/write_volume.h"

namespace tests {

namespace fs = std::filesystem;

// A folder for the files of one test, removed at the test's end.
class VolumeFolder : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() /
              ("hybrid_volume_" + std::string(info->name()) + "_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  [[nodiscard]] fs::path in_folder(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] fs::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

 private:
  fs::path folder_;
};

inline std::string contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const voxel::VolumeError& error) {
    return error.what();
  }
  return {};
}

inline std::string refusal_of(const fs::path& path, const voxel::VolumeFileOptions& options = {}) {
  return refusal([&] { voxel::load_volume(path, options); });
}

#define EXPECT_SAYS(text, part) EXPECT_NE((text).find(part), std::string::npos) << (text)

// The centre of a voxel in the scene's frame (m).
inline glm::dvec3 place_of(const voxel::LabelVolume& v, int i, int j, int k) {
  return v.origin_m + v.rotation * (glm::dvec3(i, j, k) * v.spacing_m);
}

}  // namespace tests
