// SPDX-License-Identifier: GPL-3.0-or-later
// The forces between objects balance at rest: hand, rigid objects, other tissue and anchors sum up to nothing
// on each soft object. They push and do not pull, and to compute them changes nothing.
#include "hybrid/session/forces_between.h"

#include <algorithm>
#include <filesystem>
#include <glm/geometric.hpp>

#include <fmt/format.h>
#include "tests/hybrid/fixtures/touch.h"

namespace {

using Kind = hybrid::ObjectPair::Kind;

std::optional<glm::dvec3> force(const hybrid::ForcesBetween& forces, const hybrid::ObjectPair& pair) {
  for (const hybrid::PairForce& f : forces.pairs) {
    if (f.pair == pair) return f.on_soft_N;
  }
  return std::nullopt;
}

struct HeldStill {
  const char* scene;
  glm::dvec3 above_m, pressed_m;
};

class ForcesBetweenAtRest : public testing::TestWithParam<HeldStill> {
 protected:
  static hybrid::Scene scene() {
    hybrid::Scene scene =
        hybrid::load_scene(std::string(HYBRID_SOURCE_DIR) + "/scenes/" + GetParam().scene + ".toml");
    return scene;
  }
};

TEST_P(ForcesBetweenAtRest, SumUpToNothing) {
  for (const bool async_relaxation : {false, true}) {
    tests::Touch touch(scene(), GetParam().above_m, async_relaxation);
    touch.go(GetParam().pressed_m, 4e-5, 3000);
    const std::uint64_t before = hybrid::hash_state(hybrid::kHashBegin, touch.state());
    const hybrid::ForcesBetween forces = hybrid::forces_between(touch.world(), touch.state());
    EXPECT_EQ(before, hybrid::hash_state(hybrid::kHashBegin, touch.state()));
    ASSERT_EQ(forces.balance.size(), touch.state().soft.size());
    double largest_N = 0.0;
    for (std::size_t o = 0; o < forces.balance.size(); ++o) {
      const hybrid::ForceBalance& balance = forces.balance[o];
      ASSERT_TRUE(balance.sum_N.has_value()) << touch.world().soft[o].name;
      EXPECT_LE(*balance.sum_N, std::max(0.01 * balance.largest_N, 1e-4)) << touch.world().soft[o].name;
      largest_N = std::max(largest_N, balance.largest_N);
    }
    EXPECT_GT(largest_N, 0.1);
    for (const hybrid::PairForce& f : forces.pairs) {
      fmt::print("{} {} soft {} kind {} other {}: {}\n", GetParam().scene, async_relaxation, f.pair.soft,
                 int(f.pair.kind), f.pair.other,
                 f.on_soft_N
                     ? fmt::format("{:.4f} {:.4f} {:.4f}", f.on_soft_N->x, f.on_soft_N->y, f.on_soft_N->z)
                     : "?");
    }
    for (const auto& b : forces.balance)
      fmt::print("  hand {:.4f} {:.4f} {:.4f} largest {:.4f} sum {:.5f}\n", b.hand_N.x, b.hand_N.y,
                 b.hand_N.z, b.largest_N, b.sum_N.value_or(-1));
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, ForcesBetweenAtRest,
                         testing::Values(HeldStill{"tissue-on-bone", {0.0, 0.0, 0.022}, {0.0, 0.0, 0.0135}},
                                         HeldStill{"tissue-on-bone", {0.0, 0.0, 0.022}, {0.0, 0.0, 0.0155}},
                                         HeldStill{"cleft", {0.001, 0.0, 0.010}, {0.001, 0.0, -0.008}},
                                         HeldStill{"edge-of-bone", {0.010, 0.0, 0.012}, {0.010, 0.0, 0.002}},
                                         HeldStill{"edge-of-bone", {0.001, 0.0, 0.012}, {0.001, 0.0, 0.0015}},
                                         HeldStill{"two-soft", {0.0, 0.0, 0.035}, {0.0, 0.0, 0.013}},
                                         HeldStill{"two-soft", {0.0, 0.0, 0.035}, {0.006, 0.003, 0.016}},
                                         HeldStill{"layers", {0.0, 0.0, 0.035}, {0.0, 0.0, 0.016}}));

}  // namespace
