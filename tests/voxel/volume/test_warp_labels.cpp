// SPDX-License-Identifier: GPL-3.0-or-later
// Labels that are moved by displacements with known results.
#include "voxel/volume/warp_labels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <stdexcept>

namespace {

using voxel::LabelVolume;

constexpr std::size_t kMost = 1'000'000;

LabelVolume random_labels(std::array<int, 3> dims, unsigned seed) {
  std::mt19937 random(seed);
  LabelVolume v;
  v.dims = dims;
  v.spacing_m = {1e-3, 2e-3, 0.5e-3};
  v.origin_m = {0.1, 0.2, -0.3};
  v.rotation = glm::normalize(glm::dquat(0.8, 0.1, 0.5, -0.2));
  v.labels.resize(static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                  static_cast<std::size_t>(dims[2]));
  for (auto& label : v.labels) label = static_cast<std::uint8_t>(random() % 4);
  return v;
}

using Field = std::function<glm::dvec3(int i, int j, int k)>;  // (unit: meter)

LabelVolume warp(const LabelVolume& v, const Field& field, std::size_t most = kMost) {
  return voxel::warp_labels(
      voxel::frame_of(v),
      [&](int k, std::span<std::uint8_t> out) {
        std::copy_n(v.labels.begin() + static_cast<std::ptrdiff_t>(v.index(0, 0, k)), out.size(),
                    out.begin());
      },
      [&](int k, std::span<glm::vec3> out) {
        for (int j = 0; j < v.dims[1]; ++j) {
          for (int i = 0; i < v.dims[0]; ++i) out[v.index(i, j, 0)] = glm::vec3(field(i, j, k));
        }
      },
      most);
}

// The label at a place in the scene's frame; 0 outside the volume.
int label_at(const LabelVolume& v, const glm::dvec3& place) {
  const glm::dvec3 c = glm::round(glm::conjugate(v.rotation) * (place - v.origin_m) / v.spacing_m);
  for (int a = 0; a < 3; ++a) {
    if (c[a] < 0.0 || c[a] >= v.dims[static_cast<std::size_t>(a)]) return 0;
  }
  return v.labels[v.index(static_cast<int>(c.x), static_cast<int>(c.y), static_cast<int>(c.z))];
}
glm::dvec3 place_of(const LabelVolume& v, int i, int j, int k) {
  return v.origin_m + v.rotation * (glm::dvec3(i, j, k) * v.spacing_m);
}

TEST(WarpedLabels, AtRestNothingChanges) {
  const LabelVolume v = random_labels({7, 5, 6}, 1);
  const LabelVolume w = warp(v, [](int, int, int) { return glm::dvec3(0.0); });
  EXPECT_EQ(w.dims, v.dims);
  EXPECT_EQ(w.labels, v.labels);
  EXPECT_EQ(w.origin_m, v.origin_m);
  EXPECT_EQ(w.rotation, v.rotation);
}

TEST(WarpedLabels, AUniformShiftMovesLabelsByThatManyVoxels) {
  const LabelVolume v = random_labels({7, 5, 6}, 2);
  for (const glm::ivec3 way : {glm::ivec3(1, 0, 0), glm::ivec3(-2, 3, 0), glm::ivec3(4, -1, -6)}) {
    const LabelVolume w = warp(v, [&](int, int, int) { return glm::dvec3(way) * v.spacing_m; });
    for (std::size_t a = 0; a < 3; ++a) EXPECT_EQ(w.dims[a], v.dims[a] + std::abs(way[static_cast<int>(a)]));
    std::size_t filled = 0, expected = 0;
    for (const auto label : w.labels) filled += label != 0;
    for (int k = 0; k < v.dims[2]; ++k) {
      for (int j = 0; j < v.dims[1]; ++j) {
        for (int i = 0; i < v.dims[0]; ++i) {
          const int label = v.labels[v.index(i, j, k)];
          expected += label != 0;
          EXPECT_EQ(label_at(w, place_of(v, i + way.x, j + way.y, k + way.z)), label);
        }
      }
    }
    EXPECT_EQ(filled, expected);
  }
}

TEST(WarpedLabels, StretchedAndShearedTissueHasNoHole) {
  LabelVolume v = random_labels({12, 12, 12}, 3);
  std::fill(v.labels.begin(), v.labels.end(), std::uint8_t{1});
  const std::array<glm::dmat3, 3> gradients{
      glm::dmat3(0.6, 0, 0, 0, 0.6, 0, 0, 0, 0.6),                 // every link 1.6 times as long
      glm::dmat3(0.5, 0.5, -0.4, 0.3, 0.2, 0.3, -0.3, 0.4, -0.3),  // stretch and shear
      glm::dmat3(0, 1.4, 0, 0, 0, 1.2, 0, 0, 0)};                  // shear by more than the block's thickness
  for (const glm::dmat3& gradient : gradients) {
    const glm::dmat3 map = glm::dmat3(1.0) + gradient;  // in units of voxels
    const LabelVolume w = warp(
        v, [&](int i, int j, int k) { return gradient * glm::dvec3(i, j, k) * v.spacing_m; }, 10 * kMost);
    // The image of the block is a parallelepiped. Exactly the voxels with their centres inside it are filled.
    const glm::dmat3 back = glm::inverse(map);
    const glm::dvec3 shift = glm::conjugate(v.rotation) * (w.origin_m - v.origin_m) /
                             v.spacing_m;  // offset of the enlarged lattice, in voxels
    std::size_t inside = 0;
    for (int k = 0; k < w.dims[2]; ++k) {
      for (int j = 0; j < w.dims[1]; ++j) {
        for (int i = 0; i < w.dims[0]; ++i) {
          const glm::dvec3 rest = back * (glm::dvec3(i, j, k) + shift);
          // The outermost half voxel moves with its voxel, not by the map. So it is not tested.
          bool core = true, far = false;
          for (int a = 0; a < 3; ++a) {
            core = core && rest[a] > 0.0 && rest[a] < 11.0;
            far = far || rest[a] < -3.0 || rest[a] > 14.0;
          }
          const int label = w.labels[w.index(i, j, k)];
          if (core) {
            EXPECT_EQ(label, 1);
          }
          if (far) {
            EXPECT_EQ(label, 0);
          }
          inside += core;
        }
      }
    }
    const double expected = glm::determinant(map) * 11.0 * 11.0 * 11.0;
    EXPECT_NEAR(static_cast<double>(inside), expected, 0.15 * expected);
  }
}

TEST(WarpedLabels, ADentTakesLabelsAlongAndEmptySpaceFollows) {
  // Two layers. In the middle, the upper layer is pressed into the lower one by up to two and a half voxels.
  LabelVolume v = random_labels({20, 20, 20}, 4);
  v.spacing_m = glm::dvec3(1e-3);
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) v.labels[v.index(i, j, k)] = k < 10 ? 1 : 2;
    }
  }
  const auto dent = [](double x, double y, double z) {
    return -2.5 * std::exp(-((x - 9.5) * (x - 9.5) + (y - 9.5) * (y - 9.5)) / 30.0) * z / 19.5;
  };
  const LabelVolume w =
      warp(v, [&](int i, int j, int k) { return glm::dvec3(0.0, 0.0, 1e-3 * dent(i, j, k)); });
  ASSERT_EQ(w.dims, v.dims);
  std::size_t wrong = 0;
  for (int j = 0; j < 20; ++j) {
    for (int i = 0; i < 20; ++i) {
      const double top = 19.5 + dent(i, j, 19.5), border = 9.5 + dent(i, j, 9.5);
      for (int k = 0; k < 20; ++k) {
        const int expected = k < border ? 1 : k < top ? 2 : 0;
        if (std::min(std::abs(k - border), std::abs(k - top)) < 0.1)
          continue;  // too close to a border to decide
        wrong += w.labels[w.index(i, j, k)] != expected;
      }
    }
  }
  EXPECT_EQ(wrong, 0U);
}

TEST(WarpedLabels, WhatCannotBeIsRefused) {
  const LabelVolume v = random_labels({3, 3, 3}, 5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(warp(v, [&](int, int, int) { return glm::dvec3(nan, 0.0, 0.0); }), std::runtime_error);
  EXPECT_THROW(warp(v, [&](int, int, int) { return glm::dvec3(1e3, 1e3, 1e3); }), std::runtime_error);
}

}  // namespace
