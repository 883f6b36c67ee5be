// SPDX-License-Identifier: GPL-3.0-or-later
// Files are written completely or not at all, whatever kind of file their name leads to.
#include "hybrid/base/whole_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <thread>

namespace {

namespace fs = std::filesystem;

using hybrid::WholeFile;

class WholeFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("hybrid-whole-" + std::to_string(::getpid()) + "-" +
                                           testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  static std::string text_of(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  [[nodiscard]] std::ptrdiff_t entries() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }

  fs::path folder_;
};

TEST_F(WholeFiles, TheNameIsThereOnceAllIsWritten) {
  const fs::path fresh = folder_ / "fresh.txt", old = write("old.txt", "what was there");
  for (const fs::path& file : {fresh, old}) {
    WholeFile out(file);
    out.write("new ");
    EXPECT_NE(text_of(file), "new ");
    out.write("text");
    out.keep();
    EXPECT_EQ(text_of(file), "new text");
  }
  EXPECT_EQ(entries(), 2);
}

TEST_F(WholeFiles, WhatIsNotKeptLeavesWhatWasThere) {
  const fs::path old = write("old.txt", "what was there");
  {
    WholeFile out(old);
    out.write(std::string(1'000'000, 'x'));
  }
  WholeFile(folder_ / "fresh.txt").write("x");
  EXPECT_EQ(text_of(old), "what was there");
  EXPECT_EQ(entries(), 1);
}

TEST_F(WholeFiles, AKilledProcessLeavesWhatWasThere) {
  const fs::path old = write("old.txt", "what was there");
  const pid_t child = fork();
  if (child == 0) {
    WholeFile out(old);
    out.write(std::string(1'000'000, 'x'));
    std::fflush(out.stream());
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(text_of(old), "what was there");
  EXPECT_EQ(entries(), 1) << "where the file system has no files without a name, one is left";
}

TEST_F(WholeFiles, AFullDiskIsSaidAndLeavesWhatWasThere) {
  const fs::path old = write("old.txt", "what was there");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{20'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);  // simulates a full disk
  std::string said;
  try {
    hybrid::save_text(old, std::string(100'000, 'x'));
  } catch (const std::runtime_error& e) {
    said = e.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, ignored);
  EXPECT_EQ(said.find(old.string() + ": could not be written to its end"), 0U) << said;
  EXPECT_EQ(text_of(old), "what was there");
  EXPECT_EQ(entries(), 1);
  if (fs::exists("/dev/full")) {
    EXPECT_THROW(hybrid::save_text("/dev/full", "x"), std::runtime_error);
  }
}

TEST_F(WholeFiles, LinksStayAndTheirTargetIsReplaced) {
  fs::create_directory(folder_ / "other");
  write("other/target.txt", "old");
  fs::create_symlink("other/target.txt", folder_ / "link");
  fs::create_symlink("link", folder_ / "link-to-link");
  fs::create_symlink("other/not-there-yet.txt", folder_ / "dangling");
  hybrid::save_text(folder_ / "link-to-link", "new");
  hybrid::save_text(folder_ / "dangling", "fresh");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "link-to-link"));
  EXPECT_EQ(text_of(folder_ / "other/target.txt"), "new");
  EXPECT_EQ(text_of(folder_ / "other/not-there-yet.txt"), "fresh");
  fs::create_symlink("round", folder_ / "about");
  fs::create_symlink("about", folder_ / "round");
  EXPECT_THROW(hybrid::save_text(folder_ / "round", "x"), std::runtime_error);
}

TEST_F(WholeFiles, PipesAndOpenDescriptorsAreWrittenTo) {
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { read = text_of(pipe); });
  hybrid::save_text(pipe, "through the pipe");
  reader.join();
  EXPECT_EQ(read, "through the pipe");
  EXPECT_TRUE(fs::is_fifo(pipe));

  const fs::path file = write("open.txt", "");
  const int descriptor = open(file.c_str(), O_WRONLY | O_APPEND);
  ASSERT_GE(descriptor, 0);
  for (const std::string folder : {"/dev/fd/", "/proc/self/fd/"})
    hybrid::save_text(folder + std::to_string(descriptor), "a line\n");
  close(descriptor);
  EXPECT_EQ(text_of(file), "a line\na line\n");
}

TEST_F(WholeFiles, PermissionsStay) {
  const fs::path old = write("old.txt", "x");
  fs::permissions(old, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  hybrid::save_text(old, "y");
  EXPECT_EQ(fs::status(old).permissions(),
            fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
}

TEST_F(WholeFiles, AreRefusedBeforeTheWork) {
  EXPECT_NO_THROW(hybrid::require_writable(folder_ / "a/b/c.txt"));
  EXPECT_TRUE(fs::is_directory(folder_ / "a/b"));
  EXPECT_FALSE(fs::exists(folder_ / "a/b/c.txt"));
  EXPECT_THROW(hybrid::require_writable(folder_), std::runtime_error);
  const fs::path file = write("file", "x");
  EXPECT_THROW(hybrid::require_writable(file / "below.txt"), std::runtime_error);
  EXPECT_NO_THROW(hybrid::require_writable("-"));
  EXPECT_EQ(text_of(file), "x");
}

}  // namespace
