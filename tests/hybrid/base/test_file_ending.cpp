// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/base/file_ending.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <stdexcept>

namespace {

std::string refused(const std::filesystem::path& file) {
  try {
    hybrid::require_ending("--plot", file, {".svg"});
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return {};
}

TEST(FileEnding, IsReadInAnyCase) {
  EXPECT_EQ(hybrid::lower_ending("a/B.TOML"), ".toml");
  EXPECT_EQ(hybrid::lower_ending("a.b/c"), "");
  EXPECT_EQ(hybrid::lower_ending(".svg"), "");
}

TEST(FileEnding, SaysWhatAMeshIs) {
  for (const char* name : {"a.obj", "a.PLY", "a.stl.gz", "a.Off.GZ"}) EXPECT_TRUE(hybrid::is_mesh_name(name));
  for (const char* name : {"a.nii.gz", "a.gz", "a", "obj", "a.toml"})
    EXPECT_FALSE(hybrid::is_mesh_name(name));
}

TEST(FileEnding, OfAnotherFormatIsRefusedWithThoseThatWork) {
  for (const char* name : {"a.pdf", "a.PNG", "dir.svg/a.eps", "a.svg.gz"})
    EXPECT_NE(refused(name).find("use a name with .svg"), std::string::npos) << name;
  for (const char* name : {"a.svg", "a.SVG", "a", "-", "", "/dev/stdout"})
    EXPECT_EQ(refused(name), "") << name;
}

TEST(FileEnding, OfAPipeMayBeAny) {
  const std::filesystem::path pipe =
      std::filesystem::temp_directory_path() / ("hybrid-ending-" + std::to_string(::getpid()) + ".pipe");
  EXPECT_NE(refused(pipe), "");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(refused(pipe), "");
  std::filesystem::remove(pipe);
}

TEST(FileEnding, OfARecordingIsNoneThatOthersKnow) {
  EXPECT_NO_THROW(hybrid::require_ending_of_none("--record", "a.rec"));
  EXPECT_NO_THROW(hybrid::require_ending_of_none("--record", "a"));
  EXPECT_THROW(hybrid::require_ending_of_none("--record", "a.CSV"), std::runtime_error);
}

}  // namespace
