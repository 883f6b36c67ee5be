// SPDX-License-Identifier: GPL-3.0-or-later
// A tick through the C interface allocates nothing, takes no lock, throws nothing and reads no file, refused
// calls included. This program counts such calls of the shared library while its thread is watched. It also
// measures the cost of a call.
#include <gtest/gtest.h>
#include <time.h>  // NOLINT(modernize-deprecated-headers): clock_gettime() is POSIX

#include <algorithm>
#include <cstdlib>
#include <thread>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/session.h"
#include "tests/hybrid/fixtures/counted_calls.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/interface/c_session.h"

namespace {

using tests::calls;
using tests::Calls;
using tests::CSession;
using tests::expect_ok;
using tests::line;
using tests::watched;

class CTickPath : public tests::SceneFile {
 protected:
  [[nodiscard]] std::filesystem::path soft() const {
    return write("soft.toml", "format = 1\n" + tests::block + tests::ball + tests::path);
  }
  [[nodiscard]] std::filesystem::path rigid() const {
    return write("rigid.toml",
                 "format = 1\n[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 20\n"
                 "[path]\nkind = \"press\"\nfrom = [0, 0, 40]\nto = [0, 0, 10]\n");
  }
};

// Also on a thread that never called the library before.
TEST_F(CTickPath, ATickAllocatesLocksAndThrowsNothing) {
  if (COUNTS_CALLS == 0) GTEST_SKIP() << "skipped: sanitizers replace the functions that are counted";
  for (const std::uint32_t relaxation : {HYBRID_RELAX_IN_CALL, HYBRID_RELAX_THREAD, HYBRID_RELAX_TICK}) {
    const CSession session(soft(), {.relaxation = relaxation, .recorded_ticks = 2000, .with_error = 1});
    session.begin({0.0, 0.0, 0.02});
    const auto path_m = line({0.0, 0.0, 0.02}, {0.0, 0.0, 0.003}, 400);
    std::vector<hybrid_felt> felt(path_m.size());
    felt.front().size = sizeof(hybrid_felt);
    Calls found;
    std::size_t failed = 0;
    bool touched = false;
    std::thread([&] {
      watched = true;
      for (const glm::dvec3& at_m : path_m) {
        failed += hybrid_tick(session.get(), &at_m.x, nullptr, 1e-3, &felt.front()) != HYBRID_OK ? 1 : 0;
        touched = touched || felt.front().contact_count > 0;
      }
      failed += hybrid_play(session.get(), &path_m.front().x, path_m.size(), 1e-3, felt.data()) != HYBRID_OK
                    ? 1
                    : 0;
      failed += hybrid_tick(session.get(), nullptr, nullptr, 1e-3, nullptr) == HYBRID_NULL_ARGUMENT ? 0 : 1;
      failed +=
          hybrid_tick(session.get(), &path_m.front().x, nullptr, -1.0, nullptr) == HYBRID_BAD_VALUE ? 0 : 1;
      failed += hybrid_tick(nullptr, nullptr, nullptr, 1e-3, nullptr) == HYBRID_NULL_ARGUMENT ? 0 : 1;
      watched = false;
      found = calls;
    }).join();
    EXPECT_EQ(failed, 0U);
    EXPECT_TRUE(touched);
    EXPECT_EQ(found, Calls{}) << "relaxation " << relaxation;
  }
}

// Processor time of this thread.
double processor_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

// The same ticks through the interface and directly, in processor time. The least times of many rounds are
// compared, because other programs disturb them; the bound is loose for the same reason.
TEST_F(CTickPath, ACallCostsLittleBesideATick) {
  const auto file = rigid();
  const hybrid::Scene scene = hybrid::load_scene(file);
  const hybrid::BuiltScene built = hybrid::build_scene(scene);
  const CSession session(file);
  const glm::dvec3 start(0.0, 0.0, 0.04);
  hybrid::begin_session(scene, *built.world, *built.state, start);
  session.begin(start);
  const hybrid::ScopedFlushToZero flushed;
  std::vector<double> direct_us, through_us, played_us;
  hybrid_felt felt{.size = sizeof felt};
  constexpr int kTicks = 1000;
  for (int round = 0; round < 101; ++round) {
    const auto path_m = line({0.001 * round, 0.0, 0.04}, {0.0, 0.0, 0.019}, kTicks);
    std::vector<hybrid_felt> all(path_m.size());
    all.front().size = sizeof(hybrid_felt);
    const double t0 = processor_us();
    double sum = 0.0;
    for (const glm::dvec3& at_m : path_m)
      sum += hybrid::haptic_tick(*built.world, *built.state, {.position_m = at_m}, 1e-3).force_N.z;
    const double t1 = processor_us();
    for (const glm::dvec3& at_m : path_m) {
      (void)hybrid_tick(session.get(), &at_m.x, nullptr, 1e-3, &felt);
      sum -= felt.force_N[2];
    }
    const double t2 = processor_us();
    expect_ok(hybrid_play(session.get(), &path_m.front().x, path_m.size(), 1e-3, all.data()));
    const double t3 = processor_us();
    direct_us.push_back((t1 - t0) / kTicks);
    through_us.push_back((t2 - t1) / kTicks);
    played_us.push_back((t3 - t2) / kTicks);
    EXPECT_TRUE(std::isfinite(sum));
  }
  const double direct = *std::ranges::min_element(direct_us), through = *std::ranges::min_element(through_us),
               played = *std::ranges::min_element(played_us);
  std::printf("a tick: direct %.3f us, hybrid_tick() %.3f us, hybrid_play() %.3f us\n", direct, through,
              played);
  constexpr double kMostCost_us = 1.0;
  EXPECT_LT(through, direct + kMostCost_us);
  EXPECT_LT(played, direct + kMostCost_us);
}

}  // namespace
