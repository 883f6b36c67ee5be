// SPDX-License-Identifier: GPL-3.0-or-later
// A tick through the C interface allocates nothing, takes no lock, throws nothing and reads no file, refused
// calls included. This program counts such calls of the shared library while its thread is watched.
#include <gtest/gtest.h>

#include <cstdlib>
#include <thread>

#include "tests/hybrid/fixtures/counted_calls.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/interface/c_session.h"

namespace {

using tests::calls;
using tests::Calls;
using tests::CSession;
using tests::line;
using tests::watched;

class CTickPath : public tests::SceneFile {
 protected:
  [[nodiscard]] std::filesystem::path soft() const {
    return write("soft.toml", "format = 1\n" + tests::block + tests::ball + tests::path);
  }
};

// The same holds on a thread that has never called the library.
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

}  // namespace
