// SPDX-License-Identifier: GPL-3.0-or-later
// CompositeGrid in random bodies: shapes, anchors and tissues, against links and limits solved directly.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <utility>
#include <vector>

#include "tests/voxel/composite/body_on_grid.h"
#include "voxel/composite/grid.h"

namespace {

using tests::Body;
using tests::compare;
using tests::Difference;
using tests::kSpacing;
using tests::PressedSquare;
using voxel::CompositeGrid;
using Index3 = CompositeGrid::Index3;

constexpr int kEdge = 13;
constexpr double kPlay = 0.15;  // limits of links, as a share of the spacing
using Random = std::mt19937;

int between(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

struct Box {
  Index3 low{}, high{};  // both included
  [[nodiscard]] bool has(const Index3& p) const {
    for (std::size_t d = 0; d < 3; ++d) {
      if (p[d] < low[d] || p[d] > high[d]) return false;
    }
    return true;
  }
};

// A box of random sides: a lump, a plate or a rod.
Box random_box(Random& random, int thinnest, int widest) {
  Box box;
  for (std::size_t d = 0; d < 3; ++d) {
    const int side = between(random, thinnest, widest);
    box.low[d] = between(random, 0, kEdge - side);
    box.high[d] = box.low[d] + side - 1;
  }
  return box;
}

bool in_any(const std::vector<Box>& boxes, const Index3& p) {
  return std::any_of(boxes.begin(), boxes.end(), [&](const Box& box) { return box.has(p); });
}

// `share` is the depth of the press, relative to the depth at which `links` links below the square reach
// their limits.
struct RandomBody {
  std::vector<Box> holes, anchors;
  std::vector<std::pair<Box, int>> tissues;  // box, stiffness
  int stiffness = 1, links = kEdge - 1;
  double share = 0.0;

  [[nodiscard]] int tissue_at(const Index3& p) const {
    int at = stiffness;
    for (const auto& [box, own] : tissues) {
      if (box.has(p)) at = own;
    }
    return at;
  }
};

// Up to three holes beside the tissue below the square, up to two anchored boxes, and up to three boxes of
// other tissues.
RandomBody random_body(unsigned seed) {
  Random random(seed);
  RandomBody body;
  const int holes = between(random, 0, 3), anchors = between(random, 0, 2), tissues = between(random, 0, 3);
  const Box column{{4, 4, 0}, {8, 8, kEdge - 1}};
  for (int n = 0; n < holes; ++n) {
    const Box hole = random_box(random, 1, 7);
    bool meets = true;
    for (std::size_t d = 0; d < 3; ++d)
      meets = meets && hole.high[d] >= column.low[d] && hole.low[d] <= column.high[d];
    if (!meets) body.holes.push_back(hole);
  }
  for (int n = 0; n < anchors; ++n) {
    Box anchor = random_box(random, 1, 4);
    anchor.high[2] = std::min(anchor.high[2], 8);
    if (anchor.low[2] > anchor.high[2]) continue;
    body.links = std::min(body.links, kEdge - 1 - anchor.high[2]);
    body.anchors.push_back(anchor);
  }
  constexpr std::array<int, 5> kStiffness{1, 2, 5, 20, 60};
  body.stiffness = kStiffness[static_cast<std::size_t>(between(random, 0, 2))];
  for (int n = 0; n < tissues; ++n) {
    const Box box = random_box(random, 1, 9);
    body.tissues.emplace_back(box, kStiffness[static_cast<std::size_t>(between(random, 0, 4))]);
  }
  body.share = 0.01 * between(random, 5, 80);
  return body;
}

// In a body of one tissue some links at the ends of gaps and beside anchors exceed their limits. The grid's
// bounds do not prevent this.
TEST(CompositeGrid, RandomBodiesAreTheLatticeAtEquilibrium) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const RandomBody random = random_body(seed);
    const Body body(
        {kEdge, kEdge, kEdge}, kPlay, [&](const Index3& p) { return !in_any(random.holes, p); },
        [&](const Index3& p) { return p[2] == 0 || in_any(random.anchors, p); },
        [&](const Index3& p) { return random.tissue_at(p); });
    const PressedSquare patch{{6, 6, kEdge - 1}, 2, random.share * kPlay * random.links * kSpacing};
    const Difference d = compare(body, patch, CompositeGrid::kRefineAll);
    EXPECT_LT(d.force, 0.005) << "seed " << seed;
    EXPECT_LT(d.displacement, 0.04) << "seed " << seed;
  }
}

}  // namespace
