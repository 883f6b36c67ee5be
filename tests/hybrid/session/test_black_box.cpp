// SPDX-License-Identifier: GPL-3.0-or-later
// The black box keeps the last two seconds tick by tick. It is written after a fault, and also after a crash
// of the program.
#include "hybrid/session/black_box.h"

#include <gtest/gtest.h>
#include <signal.h>  // NOLINT(modernize-deprecated-headers): raise(), signal() of POSIX

#include <cmath>
#include <fstream>
#include <limits>
#include <string>

#include "device/paths/path_file.h"
#include "hybrid/session/session.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using device::DeviceFault;
using hybrid::BlackBoxFile;
using hybrid::BlackBoxRow;

constexpr double kRate_hz = 1000.0;
constexpr std::uint64_t kRoom = 2000;

class BlackBox : public tests::SceneFile {
 protected:
  [[nodiscard]] std::filesystem::path file() const { return folder_ / "fault.csv"; }
  // The written file as a path; x is the tick number.
  [[nodiscard]] device::Trajectory kept() const { return device::read_trajectory({.file = file()}); }
};

BlackBoxRow row(std::uint64_t tick) {
  BlackBoxRow row;
  row.tick = tick;
  row.felt.device_m.x = static_cast<double>(tick);
  return row;
}

TEST_F(BlackBox, WithoutAFaultThereIsNoFile) {
  BlackBoxFile kept(kRate_hz, file());
  for (std::uint64_t tick = 0; tick < 3 * kRoom; ++tick) kept.box().add(row(tick));
  EXPECT_EQ(kept.save_on_fault(), "");
  EXPECT_FALSE(std::filesystem::exists(file()));
}

TEST_F(BlackBox, KeepsWhatLedToAFaultAndWhatCameOfIt) {
  constexpr std::uint64_t at = 5432;
  BlackBoxFile kept_box(kRate_hz, file());
  for (std::uint64_t tick = 0; tick < 10'000; ++tick) {
    BlackBoxRow next = row(tick);
    if (tick >= at && tick % 7 == at % 7) next.reported = DeviceFault::late;
    kept_box.box().add(next);
  }
  EXPECT_NE(kept_box.save_on_fault().find("'late' at 5.432 s"), std::string::npos)
      << kept_box.save_on_fault();
  const device::Trajectory path = kept();
  ASSERT_EQ(path.t_s.size(), kRoom);
  constexpr std::uint64_t first = at + kRoom / 4 + 1 - kRoom;
  for (std::size_t n = 0; n < kRoom; ++n) {
    EXPECT_EQ(path.position_m[n].x, static_cast<double>(first + n));
    EXPECT_NEAR(path.t_s[n], 1e-3 * static_cast<double>(n), 1e-9);  // the times of a path begin at 0
  }
}

TEST_F(BlackBox, OfAShortSessionAllIsKept) {
  BlackBoxFile kept_box(kRate_hz, file());
  for (std::uint64_t tick = 0; tick < 100; ++tick) {
    BlackBoxRow next = row(tick);
    if (tick == 99) next.reported = DeviceFault::lost;
    kept_box.box().add(next);
  }
  EXPECT_NE(kept_box.save_on_fault().find("'lost' at 0.099 s"), std::string::npos);
  EXPECT_EQ(kept().t_s.size(), 100U);
}

TEST_F(BlackBox, SaysEachKindOfFaultAndTheFirstOfThem) {
  const auto said = [](auto&& spoil) {
    hybrid::BlackBox box(kRate_hz);
    for (std::uint64_t tick = 0; tick < 20; ++tick) {
      BlackBoxRow next = row(tick);
      if (tick == 10) spoil(next);
      box.add(next);
    }
    return box.fault().value_or("");
  };
  EXPECT_NE(said([](BlackBoxRow& r) { r.nonfinite = 1; }).find("a number that is none"), std::string::npos);
  EXPECT_NE(said([](BlackBoxRow& r) { r.reported = DeviceFault::warm_motors; }).find("'warm_motors'"),
            std::string::npos);
  EXPECT_NE(said([](BlackBoxRow& r) { r.faults |= hybrid::fault_infeasible; }).find("no room"),
            std::string::npos);
}

TEST_F(BlackBox, APlaceThatIsNoneIsInTheFileAndTheFileIsStillAPath) {
  BlackBoxFile kept_box(kRate_hz, file());
  for (std::uint64_t tick = 0; tick < 10; ++tick) {
    BlackBoxRow next = row(tick);
    if (tick == 5) next.reported_m = glm::dvec3(std::numeric_limits<double>::quiet_NaN(), 1e300, -1.0);
    next.nonfinite = tick >= 5 ? 1 : 0;
    kept_box.box().add(next);
  }
  EXPECT_NE(kept_box.save_on_fault(), "");
  std::ifstream in(file());
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  EXPECT_NE(text.find("nan,1e+300,-1,"), std::string::npos);
  EXPECT_EQ(kept().t_s.size(), 10U);
}

TEST_F(BlackBox, TheLongestRowFits) {
  BlackBoxFile kept_box(kRate_hz, file());
  BlackBoxRow next;
  constexpr double longest = -1.2345678901234567e-300;
  next.tick = std::numeric_limits<std::uint64_t>::max();
  next.nonfinite = next.tick;
  next.faults = next.felt.contacts = std::numeric_limits<std::uint32_t>::max();
  next.reported = DeviceFault::not_calibrated;
  next.reported_m = next.felt.device_m = next.felt.proxy_m = next.felt.force_N = glm::dvec3(longest);
  next.felt.rigid_N = next.felt.soft_N = glm::dvec3(1.2345678901234567e300);
  next.late_us = -1.2345678e-30F;
  next.felt.tick_us = longest;
  next.felt.stage_us.fill(-1.2345678e-30F);
  kept_box.box().add(next);
  EXPECT_NE(kept_box.save_on_fault(), "");
  std::ifstream in(file());
  std::string header, line, rest;
  ASSERT_TRUE(std::getline(in, header) && std::getline(in, line));
  EXPECT_FALSE(std::getline(in, rest));
  EXPECT_EQ(std::count(line.begin(), line.end(), ','), std::count(header.begin(), header.end(), ','));
}

TEST_F(BlackBox, WhatCannotBeWrittenIsSaidBeforeTheSessionOrAfterTheFault) {
  EXPECT_THROW(BlackBoxFile(kRate_hz, folder_ / "no such folder" / "fault.csv"), std::runtime_error);
  std::filesystem::create_directory(folder_ / "goes");
  BlackBoxFile kept_box(kRate_hz, folder_ / "goes" / "fault.csv");
  std::filesystem::remove(folder_ / "goes");
  BlackBoxRow next = row(0);
  next.reported = DeviceFault::lost;
  kept_box.box().add(next);
  EXPECT_THROW((void)kept_box.save_on_fault(), std::runtime_error);
}

// Removes other signal handlers. A sanitizer's handler would report the crash and end the program.
void die_of_it() {
  for (const int number : {SIGSEGV, SIGABRT}) signal(number, SIG_DFL);
}

// A child process crashes, and its black box is written.
TEST_F(BlackBox, ACrashWritesIt) {
  EXPECT_EXIT(
      {
        die_of_it();
        BlackBoxFile kept_box(kRate_hz, file());
        for (std::uint64_t tick = 0; tick < kRoom + 50; ++tick) kept_box.box().add(row(tick));
        raise(SIGSEGV);
      },
      ::testing::KilledBySignal(SIGSEGV), "");
  ASSERT_EQ(kept().t_s.size(), kRoom);
  EXPECT_EQ(kept().position_m.front().x, 50.0);
}

// On a crash, the newest OnCrash object acts first. So the motors are switched off before the black box is
// written. A crash within one action does not stop the others.
TEST_F(BlackBox, ActsOnACrashGoBackwardsAndOneThatCrashesLeavesTheOthers) {
  EXPECT_EXIT(
      {
        die_of_it();
        BlackBoxFile kept_box(kRate_hz, file());
        kept_box.box().add(row(7));
        const device::OnCrash second([](void* /*user*/) noexcept { raise(SIGSEGV); }, nullptr);
        raise(SIGABRT);
      },
      ::testing::KilledBySignal(SIGSEGV), "");
  EXPECT_EQ(kept().t_s.size(), 1U);
}

TEST_F(BlackBox, ASessionPutsEveryTickIntoIt) {
  const hybrid::Scene scene = load(
      "format = 1\n[[rigid]]\nname = \"plate\"\nprimitive = \"plane\"\nsize = 100\n"
      "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, -2]\n");
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  BlackBoxFile kept_box(scene.rate_hz, file());
  const hybrid::SessionResult result =
      hybrid::run_session(scene, built, {.seconds = 0.5, .progress = {}, .black_box = &kept_box.box()});
  BlackBoxRow end = row(result.ticks);
  end.reported = DeviceFault::lost;
  kept_box.box().add(end);
  EXPECT_NE(kept_box.save_on_fault(), "");
  const device::Trajectory path = kept();
  ASSERT_EQ(path.t_s.size(), result.ticks + 1);
  for (std::size_t n = 0; n < result.ticks; ++n) EXPECT_EQ(path.position_m[n], result.rows[n].device_m);
}

TEST(KeepBox, OnlyWhatCannotBeRunAgainIsKeptUnasked) {
  EXPECT_EQ(hybrid::open_black_box_file({}, "folder/scene.toml", false, kRate_hz), nullptr);
  EXPECT_NE(hybrid::open_black_box_file("asked.csv", "scene.toml", false, kRate_hz), nullptr);
  const auto live = hybrid::open_black_box_file({}, "folder/scene.toml", true, kRate_hz);
  ASSERT_NE(live, nullptr);
  BlackBoxRow lost;
  lost.reported = DeviceFault::lost;
  live->box().add(lost);
  EXPECT_NE(live->save_on_fault().find("scene-fault.csv"), std::string::npos);
  std::filesystem::remove("scene-fault.csv");
}

}  // namespace
