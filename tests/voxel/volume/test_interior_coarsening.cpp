// SPDX-License-Identifier: GPL-3.0-or-later
// Brute-force checks of the guarantees of thinning: connected pieces stay connected, no surface changes, and
// no tool gets behind a surface.
#include "voxel/volume/interior_coarsening.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <random>
#include <stdexcept>
#include <string>

namespace {

using voxel::LabelVolume;
using voxel::ThinningOptions;

constexpr std::uint8_t kTissue = 1, kBone = 2, kOtherBone = 7;

LabelVolume volume_of(std::array<int, 3> dims, const std::function<int(int, int, int)>& label) {
  LabelVolume v;
  v.dims = dims;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) v.labels.push_back(static_cast<std::uint8_t>(label(i, j, k)));
    }
  }
  return v;
}

ThinningOptions thick(std::vector<std::uint8_t> labels, int every, int shell) {
  return {.labels = std::move(labels), .every = every, .shell = shell, .tool_radius_m = 1e-3};
}

// [voxel] number of its connected piece of chosen voxels, by flood fill; -1 for voxels that are not chosen.
std::vector<int> pieces(const LabelVolume& v, const std::function<bool(std::uint8_t)>& chosen) {
  std::vector<int> piece(v.labels.size(), -1);
  int count = 0;
  const auto dim = [&](int a) { return v.dims[static_cast<std::size_t>(a)]; };
  for (std::size_t start = 0; start < piece.size(); ++start) {
    if (piece[start] >= 0 || !chosen(v.labels[start])) continue;
    std::vector<std::size_t> stack{start};
    piece[start] = count;
    while (!stack.empty()) {
      const std::size_t at = stack.back();
      stack.pop_back();
      const auto nx = static_cast<std::size_t>(dim(0)), ny = static_cast<std::size_t>(dim(1));
      const glm::ivec3 p(at % nx, at / nx % ny, at / (nx * ny));
      for (int d = 0; d < 6; ++d) {
        glm::ivec3 q = p;
        q[d / 2] += d % 2 == 0 ? 1 : -1;
        if (q[d / 2] < 0 || q[d / 2] >= dim(d / 2)) continue;
        const std::size_t to = v.index(q.x, q.y, q.z);
        if (piece[to] >= 0 || !chosen(v.labels[to])) continue;
        piece[to] = count;
        stack.push_back(to);
      }
    }
    ++count;
  }
  return piece;
}

bool filled(std::uint8_t label) {
  return label != 0;
}

void expect_promises(const LabelVolume& before, const ThinningOptions& options) {
  const voxel::Thinned thinned = voxel::thin_labels(before, options);
  const LabelVolume& after = thinned.volume;
  ASSERT_EQ(after.dims, before.dims);
  const auto is_stiff = [&](std::uint8_t label) {
    return std::find(options.labels.begin(), options.labels.end(), label) != options.labels.end();
  };
  std::size_t stiff = 0, removed = 0;
  for (int k = 0; k < before.dims[2]; ++k) {
    for (int j = 0; j < before.dims[1]; ++j) {
      for (int i = 0; i < before.dims[0]; ++i) {
        const std::uint8_t was = before.labels[before.index(i, j, k)];
        const std::uint8_t is = after.labels[after.index(i, j, k)];
        stiff += is_stiff(was);
        removed += was != 0 && is == 0;
        bool at_surface = !is_stiff(was);
        for (int d = 0; d < 27 && !at_surface; ++d) {
          const int a = i + d % 3 - 1, b = j + d / 3 % 3 - 1, c = k + d / 9 - 1;
          const bool outside =
              a < 0 || b < 0 || c < 0 || a >= before.dims[0] || b >= before.dims[1] || c >= before.dims[2];
          at_surface = outside || !is_stiff(before.labels[before.index(a, b, c)]);
        }
        if (at_surface) {
          ASSERT_EQ(is, was) << "the surface changed at " << i << ' ' << j << ' ' << k;
        } else {
          ASSERT_TRUE(is == 0 || is == was || is == thinned.strut_label[was]);
        }
      }
    }
  }
  EXPECT_EQ(thinned.stiff, stiff);
  EXPECT_EQ(thinned.removed, removed);
  // Two remaining voxels are connected if and only if they were connected before.
  const std::vector<int> whole = pieces(before, filled), left = pieces(after, filled);
  std::vector<int> whole_of(before.labels.size(), -1), left_of(before.labels.size(), -1);
  for (std::size_t n = 0; n < left.size(); ++n) {
    if (left[n] < 0) continue;
    const auto l = static_cast<std::size_t>(left[n]), w = static_cast<std::size_t>(whole[n]);
    if (whole_of[l] < 0) whole_of[l] = whole[n];
    if (left_of[w] < 0) left_of[w] = left[n];
    ASSERT_EQ(whole_of[l], whole[n]);
    ASSERT_EQ(left_of[w], left[n]) << "a piece came loose";
  }
}

TEST(Thinning, WhatHangsTogetherStillDoes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int scene = 0; scene < 40; ++scene) {
    // Balls of bone in tissue or in empty space. The balls have holes of many sizes.
    std::vector<glm::dvec4> balls, holes;
    for (int n = 0; n < 4; ++n)
      balls.emplace_back(30 * unit(random), 25 * unit(random), 28 * unit(random), 5 + 8 * unit(random));
    for (int n = 0; n < 12; ++n)
      holes.emplace_back(30 * unit(random), 25 * unit(random), 28 * unit(random), 0.6 + 3 * unit(random));
    const int around = scene % 2 == 0 ? kTissue : 0, within = scene % 3 == 0 ? kTissue : 0;
    const auto in = [](const std::vector<glm::dvec4>& all, int i, int j, int k) {
      return std::any_of(all.begin(), all.end(), [&](const glm::dvec4& b) {
        return glm::length(glm::dvec3(b) - glm::dvec3(i, j, k)) < b.w;
      });
    };
    const LabelVolume v = volume_of({30, 25, 28}, [&](int i, int j, int k) {
      if (!in(balls, i, j, k)) return around;
      if (in(holes, i, j, k)) return within;
      return static_cast<int>(i < 15 ? kBone : kOtherBone);
    });
    for (const int every : {2, 3, 5, 9}) {
      for (const int shell : {1, 2}) expect_promises(v, thick({kBone, kOtherBone}, every, shell));
    }
  }
}

TEST(Thinning, TheWallOfASmallCavityIsHeld) {
  // This cavity lies where no strut of a coarse frame passes.
  const LabelVolume v = volume_of({41, 41, 41}, [](int i, int j, int k) {
    return glm::length(glm::dvec3(i, j, k) - glm::dvec3(8.0)) < 1.2 ? 0 : kBone;
  });
  const voxel::Thinned thinned = voxel::thin_labels(v, thick({kBone}, 16, 1));
  EXPECT_GT(thinned.joined, 0U);
  expect_promises(v, thick({kBone}, 16, 1));
}

TEST(Thinning, LeavesTheShareThatTheFrameHas) {
  const LabelVolume v = volume_of({64, 64, 64}, [](int, int, int) { return kBone; });
  for (const int n : {2, 3, 4, 8}) {
    const voxel::Thinned thinned = voxel::thin_labels(v, thick({kBone}, n, 1));
    // The frame has rows along each axis where both other coordinates are multiples of n. In the outermost
    // layers of the inside, one such coordinate is enough.
    std::size_t frame = 0;
    for (int k = 1; k < 63; ++k) {
      for (int j = 1; j < 63; ++j) {
        for (int i = 1; i < 63; ++i) {
          const auto on = [n](int c) { return c % n == 0; };
          const auto outermost = [](int c) { return c == 1 || c == 62; };
          const bool row = (on(i) && on(j)) || (on(j) && on(k)) || (on(k) && on(i));
          const bool line = (outermost(i) && (on(j) || on(k))) || (outermost(j) && (on(k) || on(i))) ||
                            (outermost(k) && (on(i) || on(j)));
          frame += row || line ? 1 : 0;
        }
      }
    }
    EXPECT_EQ(std::size_t{62 * 62 * 62} - thinned.removed, frame) << n;
    EXPECT_EQ(thinned.joined, 0U);
  }
}

// Whether the centre of a ball tool can get from outside into the place of a removed voxel. Places are
// sampled at half a spacing. `tool` is the ball's radius in spacings.
bool gets_behind(const LabelVolume& before, const LabelVolume& after, double tool) {
  const int margin = 4;
  LabelVolume space;  // 1: free for the tool's centre
  for (std::size_t a = 0; a < 3; ++a) space.dims[a] = 2 * (before.dims[a] + 2 * margin);
  const auto nx = space.dims[0], ny = space.dims[1], nz = space.dims[2];
  space.labels.assign(
      static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz), 1);
  const double reach = tool + 0.5;  // in spacings
  const int look = static_cast<int>(std::ceil(2.0 * reach));
  for (int k = 0; k < after.dims[2]; ++k) {
    for (int j = 0; j < after.dims[1]; ++j) {
      for (int i = 0; i < after.dims[0]; ++i) {
        if (after.labels[after.index(i, j, k)] == 0) continue;
        for (int c = -look; c <= look; ++c) {
          for (int b = -look; b <= look; ++b) {
            for (int a = -look; a <= look; ++a) {
              const int x = 2 * (i + margin) + a, y = 2 * (j + margin) + b, z = 2 * (k + margin) + c;
              if (x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz) continue;
              if (0.5 * std::sqrt(static_cast<double>(a * a + b * b + c * c)) < reach - 1e-9)
                space.labels[space.index(x, y, z)] = 0;
            }
          }
        }
      }
    }
  }
  const std::vector<int> piece = pieces(space, filled);
  const int outside = piece[0];
  for (int k = 0; k < before.dims[2]; ++k) {
    for (int j = 0; j < before.dims[1]; ++j) {
      for (int i = 0; i < before.dims[0]; ++i) {
        if (before.labels[before.index(i, j, k)] == 0) continue;
        if (piece[space.index(2 * (i + margin), 2 * (j + margin), 2 * (k + margin))] == outside) return true;
      }
    }
  }
  return false;
}

TEST(Thinning, NoToolGetsBehindTheSurface) {
  const auto bone = [](int i, int j, int k) {
    const double r = glm::length(glm::dvec3(i, j, k) - glm::dvec3(9.5));
    return r < 9.0 && glm::length(glm::dvec3(i, j, k) - glm::dvec3(17.0, 9.5, 9.5)) > 4.0 ? kBone : 0;
  };
  const LabelVolume v = volume_of({20, 20, 20}, bone);
  // Radius of the smallest tool that is allowed at rest: half the diagonal of a face less half a voxel (in
  // spacings).
  const double tool = 0.5 * std::sqrt(2.0) - 0.5 + 1e-6;
  for (const int every : {2, 4, 7}) {
    ThinningOptions options = thick({kBone}, every, 1);
    options.tool_radius_m = tool * 1e-3;
    EXPECT_FALSE(gets_behind(v, voxel::thin_labels(v, options).volume, tool)) << every;
    options.tool_radius_m = tool * 1e-3 - 2e-9;
    EXPECT_THROW(voxel::thin_labels(v, options), std::invalid_argument);
  }
  // Counter-check of gets_behind(): through a hole in the shell, the tool gets behind it.
  LabelVolume open = voxel::thin_labels(v, thick({kBone}, 7, 1)).volume;
  for (int k = 0; k < 20; ++k) {
    for (int j = 8; j < 12; ++j) {
      for (int i = 8; i < 12; ++i) open.labels[open.index(i, j, k)] = 0;
    }
  }
  EXPECT_TRUE(gets_behind(v, open, tool));
}

TEST(Thinning, WhatCannotBeIsRefusedInWords) {
  const LabelVolume v = volume_of({9, 9, 9}, [](int, int, int) { return kBone; });
  const auto said = [](const LabelVolume& volume, const ThinningOptions& options) {
    try {
      voxel::thin_labels(volume, options);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(said(v, thick({kBone}, 3, 1)), "");
  EXPECT_NE(said(v, thick({kBone}, 1, 1)).find("every"), std::string::npos);
  EXPECT_NE(said(v, thick({kBone}, 3, 0)).find("shell"), std::string::npos);
  EXPECT_NE(said(v, thick({kTissue}, 3, 1)).find("no voxel"), std::string::npos);
  ThinningOptions needle = thick({kBone}, 3, 1);
  needle.tool_radius_m = 0.5e-3;
  EXPECT_EQ(said(v, needle), "");
  needle.stretch_max = 1.6;  // the same needle with a shell that can be stretched
  EXPECT_NE(said(v, needle).find("fits between"), std::string::npos);
  const LabelVolume full = volume_of({16, 16, 2}, [](int i, int j, int) { return i + 16 * j; });
  EXPECT_NE(said(full, thick({kBone}, 3, 1)).find("labels"), std::string::npos);
}

}  // namespace
