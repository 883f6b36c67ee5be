// SPDX-License-Identifier: GPL-3.0-or-later
// The driver's library may be missing or incomplete in several ways. Each error names a remedy.
#include "device/phantom/libhd.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "device/phantom/hd_errors.h"
#include "tests/device/phantom/phantom_rig.h"

namespace {

using testing::HasSubstr;
using tests::refusal;

class Environment {
 public:
  explicit Environment(const char* value) { setenv("HYBRID_LIBHD", value, 1); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;
  Environment(Environment&&) = delete;
  Environment& operator=(Environment&&) = delete;
  ~Environment() { unsetenv("HYBRID_LIBHD"); }
};

TEST(LibHd, TheWholeOneLoadsByPathAndByEnvironment) {
  EXPECT_NE(device::load_libhd(FAKE_LIBHD).call.init_device, nullptr);
  const Environment named(FAKE_LIBHD);
  EXPECT_EQ(device::load_libhd().file, FAKE_LIBHD);
}

TEST(LibHd, WithNoneInstalledItSaysWhatToInstall) {
  unsetenv("HYBRID_LIBHD");
  const std::string words = refusal([] { (void)device::load_libhd(); });
  if (words.empty()) GTEST_SKIP() << "skipped: this machine has a libHD";
  EXPECT_THAT(words, HasSubstr("no PHANToM driver found"));
  EXPECT_THAT(words, HasSubstr("libHD.so, libHD.so.3.4, libHD.so.3.0"));
  EXPECT_THAT(words, HasSubstr("install"));
  EXPECT_THAT(words, HasSubstr("HYBRID_LIBHD="));
}

TEST(LibHd, ANamedOneThatIsNotThereIsNotReplacedByAnother) {
  const Environment named("/nowhere/libHD.so");
  const std::string words = refusal([] { (void)device::load_libhd(); });
  EXPECT_THAT(words, HasSubstr("/nowhere/libHD.so (named by HYBRID_LIBHD)"));
  EXPECT_THAT(words, HasSubstr("correct the path"));
  // An explicit file takes precedence over the environment.
  EXPECT_EQ(device::load_libhd(FAKE_LIBHD).file, FAKE_LIBHD);
}

TEST(LibHd, AMissingFunctionIsNamed) {
  const std::string words = refusal([] { (void)device::load_libhd(FAKE_LIBHD_WITHOUT_SCHEDULE); });
  EXPECT_THAT(words, HasSubstr("lacks hdScheduleAsynchronous;"));
  EXPECT_THAT(words, HasSubstr("install OpenHaptics"));
}

TEST(LibHd, AMissingDriverIsNamed) {
  const std::string words = refusal([] { (void)device::load_libhd(FAKE_LIBHD_NEEDS_DRIVER); });
  EXPECT_THAT(words, HasSubstr("libPhantomIOLib42.so"));
  EXPECT_THAT(words, HasSubstr("install the device's driver too"));
}

TEST(LibHd, WhatIsNoLibraryIsRefused) {
  const std::string file = testing::TempDir() + "no-library.so";
  std::ofstream(file) << "this is text, and longer than the header of a library would be, by a good measure";
  EXPECT_THAT(refusal([&] { (void)device::load_libhd(file); }), HasSubstr("install it again"));
}

TEST(HdErrors, EachHasItsNameAndARemedy) {
  for (const unsigned code :
       {0x100U, 0x101U, 0x102U, 0x103U, 0x104U, 0x200U, 0x201U, 0x202U, 0x203U, 0x204U, 0x300U,
        0x301U, 0x302U, 0x303U, 0x304U, 0x400U, 0x401U, 0x402U, 0x500U, 0x501U, 0x600U, 0x12345U}) {
    const device::HdErrorText& text = device::hd_error_text(code);
    EXPECT_FALSE(text.what.empty()) << code;
    EXPECT_GT(text.remedy.size(), 10U) << code;
    EXPECT_EQ(text.name.starts_with("HD_"), code != 0x12345U) << code;
    EXPECT_NE(text.fault, device::DeviceFault::none) << code;
  }
  EXPECT_EQ(device::hd_error_text(0).outcome, device::HdOutcome::none);
  // Sessions recover only from faults that the hand or a setting can remedy.
  for (const unsigned code : {0x200U, 0x201U, 0x202U, 0x203U, 0x204U}) {
    EXPECT_EQ(device::hd_error_text(code).outcome, device::HdOutcome::rest) << code;
  }
  for (const unsigned code : {0x104U, 0x300U, 0x302U, 0x402U, 0x600U, 0x12345U}) {
    EXPECT_EQ(device::hd_error_text(code).outcome, device::HdOutcome::ended) << code;
  }
  EXPECT_THAT(device::hd_error_in_words({0x302, -17, 0}),
              HasSubstr("HD_COMM_ERROR (0x302, internal code -17)"));
}

}  // namespace
