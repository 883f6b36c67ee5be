// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces from labels, the largest piece and grown labels, against brute force and exact volumes.
#include "hybrid/geometry/surface_nets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <iostream>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/hybrid/fixtures/label_volumes.h"

namespace {

using polygon::TriangleMesh;
using tests::ball;
using tests::cell_volume;
using tests::count;
using tests::empty_volume;
using tests::filled;
using tests::noise;
using tests::refusal;
using tests::signed_volume;
using voxel::LabelVolume;

// Expects a closed, oriented manifold. Each directed edge and its opposite occur once, so an edge has two
// triangles. The triangles of each vertex form one fan, so a walk from edge to edge meets all of them.
void expect_manifold(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t>
      next;  // third vertex of the triangle at a directed edge
  std::vector<std::size_t> triangles_at(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t n = 0; n < 3; ++n) {
      ASSERT_TRUE(next.emplace(std::pair{t[n], t[(n + 1) % 3]}, t[(n + 2) % 3]).second)
          << "an edge used twice";
      ++triangles_at[t[n]];
    }
  }
  std::vector<bool> seen(mesh.vertices.size());
  for (const auto& [edge, third] : next) {
    ASSERT_TRUE(next.contains({edge.second, edge.first})) << "an open edge";
    if (seen[edge.first]) continue;
    seen[edge.first] = true;
    std::size_t steps = 0;
    std::uint32_t rim = edge.second;
    do {  // triangle (v, rim, third); the fan's next triangle starts at v → third
      rim = next.at({edge.first, rim});
      ++steps;
    } while (rim != edge.second && steps <= triangles_at[edge.first]);
    ASSERT_EQ(steps, triangles_at[edge.first]) << "a vertex with two fans";
  }
}

// ---- surface_from_labels

TEST(LabelSurface, OneVoxelIsItsCube) {
  const LabelVolume volume =
      filled(empty_volume(1, 1, 1, {1.0, 2.0, 3.0}), [](int, int, int) { return true; });
  const TriangleMesh mesh = hybrid::surface_from_labels(volume, 0);
  EXPECT_EQ(mesh.vertices.size(), 8U);
  EXPECT_EQ(mesh.triangles.size(), 12U);
  expect_manifold(mesh);
  EXPECT_DOUBLE_EQ(signed_volume(mesh), 6.0);
  for (const glm::dvec3& p : mesh.vertices) {
    EXPECT_DOUBLE_EQ(std::abs(p.x), 0.5);
    EXPECT_DOUBLE_EQ(std::abs(p.y), 1.0);
    EXPECT_DOUBLE_EQ(std::abs(p.z), 1.5);
  }
}

TEST(LabelSurface, WithoutSmoothingTheVolumeIsThatOfTheVoxels) {
  const LabelVolume volume = ball(24, 0.0105, {1e-3, 1e-3, 1.5e-3});
  const TriangleMesh mesh = hybrid::surface_from_labels(volume, 0);
  expect_manifold(mesh);
  const double expected = static_cast<double>(count(volume)) * cell_volume(volume);
  EXPECT_NEAR(signed_volume(mesh), expected, 1e-9 * expected);
}

TEST(LabelSurface, BallKeepsItsVolumeAndRadiusWhenSmoothed) {
  for (const double radius : {5.0, 10.0, 20.0}) {
    const int n = static_cast<int>(2 * radius) + 6;
    const LabelVolume volume = ball(n, radius, glm::dvec3(1.0));
    const double expected = static_cast<double>(count(volume));
    for (const int passes : {1, 2, 5, 10, 20}) {
      const TriangleMesh mesh = hybrid::surface_from_labels(volume, passes);
      expect_manifold(mesh);
      EXPECT_NEAR(signed_volume(mesh), expected, 0.04 * expected) << radius << ' ' << passes;
      double worst = 0.0;
      double sum = 0.0;
      for (const glm::dvec3& p : mesh.vertices) {
        const double error = std::abs(glm::length(p - 0.5 * (n - 1)) - radius);
        worst = std::max(worst, error);
        sum += error * error;
      }
      EXPECT_LT(worst, 1.0) << radius << ' ' << passes;  // in spacings
      const double rms = std::sqrt(sum / static_cast<double>(mesh.vertices.size()));
      EXPECT_LT(rms, passes < 5 ? 0.4 : 0.25) << radius << ' ' << passes;
    }
  }
}

// ---- surface_from_intensities

// A ball as in a blurred scan: the intensity rises gradually from 0 outside to 1,000 inside.
struct ScannedBall {
  LabelVolume volume;
  std::vector<float> intensities;
  glm::dvec3 middle{0.0};
};
constexpr double kThreshold = 300.0;

ScannedBall scanned_ball(double radius, const glm::dvec3& spacing, double noise_of, unsigned seed) {
  const int n = static_cast<int>(std::ceil(2.0 * radius / std::min({spacing.x, spacing.y, spacing.z}))) + 8;
  ScannedBall scan{
      empty_volume(n, n, n, spacing), {}, 0.5 * (n - 1) * spacing + glm::dvec3(0.31, -0.17, 0.23)};
  std::mt19937 random(seed);
  std::normal_distribution<double> noise_now(0.0, 1.0);
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        // The intensity is linear near the surface. On the surface it is the threshold.
        const double depth = radius - glm::length(glm::dvec3(i, j, k) * spacing - scan.middle);
        const double intensity =
            std::clamp(kThreshold + 500.0 * depth, 0.0, 1000.0) + noise_of * noise_now(random);
        scan.intensities.push_back(static_cast<float>(intensity));
        if (scan.intensities.back() >= kThreshold) scan.volume.labels[scan.volume.index(i, j, k)] = 1;
      }
    }
  }
  return scan;
}

double rms_off_ball(const TriangleMesh& mesh, const ScannedBall& scan, double radius) {
  double sum = 0.0;
  for (const glm::dvec3& p : mesh.vertices) {
    const double off = glm::length(p - scan.middle) - radius;
    sum += off * off;
  }
  return std::sqrt(sum / static_cast<double>(mesh.vertices.size()));
}

// Surfaces of smoothed labels exceed this bound.
TEST(IntensitySurface, IsWithinATenthOfASpacingOfTheBall) {
  constexpr double kAllowed = 0.1;
  const auto infinite = std::numeric_limits<double>::infinity();
  for (const double radius : {4.3, 10.0, 17.7}) {
    for (const glm::dvec3& spacing : {glm::dvec3(1.0), glm::dvec3(1.0, 1.0, 1.5)}) {
      const ScannedBall scan = scanned_ball(radius, spacing, 0.0, 1);
      for (const int passes : {0, 10}) {
        const TriangleMesh mesh =
            hybrid::surface_from_intensities(scan.volume, {scan.intensities, kThreshold, infinite}, passes);
        expect_manifold(mesh);
        const double rms = rms_off_ball(mesh, scan, radius);
        const double of_labels = rms_off_ball(hybrid::surface_from_labels(scan.volume, passes), scan, radius);
        EXPECT_LT(rms, kAllowed) << radius << ' ' << spacing.z << ' ' << passes;
        std::cout << "radius " << radius << ", " << spacing.z << " along z, " << passes << " passes: " << rms
                  << " from intensities, " << of_labels << " from labels (spacings, rms)\n";
      }
    }
  }
}

// The noise is a tenth of the step between bone and tissue, as in a low-dose scan.
TEST(IntensitySurface, NoiseIsSmoothedAndTheBallStays) {
  const ScannedBall scan = scanned_ball(10.0, glm::dvec3(1.0), 100.0, 3);
  LabelVolume piece = scan.volume;
  hybrid::keep_largest_piece(piece, true);
  const TriangleMesh mesh = hybrid::surface_from_intensities(
      piece, {scan.intensities, kThreshold, std::numeric_limits<double>::infinity()}, 10);
  expect_manifold(mesh);
  EXPECT_LT(rms_off_ball(mesh, scan, 10.0), 0.2);
}

// The solid is a shell between two spheres. On the inner sphere the intensity passes the upper end.
TEST(IntensitySurface, PassesTheEndOfTheRangeThatIsThere) {
  ScannedBall scan = scanned_ball(10.0, glm::dvec3(1.0), 0.0, 1);
  constexpr double kInner = 6.0;
  for (std::size_t n = 0; n < scan.intensities.size(); ++n) {
    const auto row = static_cast<std::size_t>(scan.volume.dims[0]);
    const std::size_t i = n % row, j = n / row % row, k = n / (row * row);
    const glm::dvec3 p(i, j, k);
    const double depth = kInner - glm::length(p - scan.middle);
    if (depth > -1.0) scan.intensities[n] = static_cast<float>(2000.0 + 500.0 * std::min(depth, 1.0));
    scan.volume.labels[n] = scan.intensities[n] >= kThreshold && scan.intensities[n] <= 2000.0F ? 1 : 0;
  }
  const TriangleMesh mesh =
      hybrid::surface_from_intensities(scan.volume, {scan.intensities, kThreshold, 2000.0}, 0);
  expect_manifold(mesh);
  for (const glm::dvec3& p : mesh.vertices) {
    const double r = glm::length(p - scan.middle);
    EXPECT_LT(std::min(std::abs(r - 10.0), std::abs(r - kInner)), 0.6) << r;
  }
}

// The surface of a mask with two values lies half way between voxels, like the surface of its labels. The
// same holds where the intensities do not pass an end of the range.
TEST(IntensitySurface, OfAMaskLiesHalfWay) {
  const LabelVolume block = filled(empty_volume(9, 8, 7), [](int i, int j, int k) {
    return i >= 2 && i <= 6 && j >= 3 && j <= 5 && k >= 1 && k <= 4;
  });
  const std::vector<float> mask(block.labels.begin(), block.labels.end());
  const std::vector<float> nothing(block.labels.size(), 7.0F);  // all intensities are within the range
  for (const hybrid::IntensityRange& range :
       {hybrid::IntensityRange{mask, 0.5, 255.5}, hybrid::IntensityRange{nothing, 5.0, 9.0}}) {
    const TriangleMesh mesh = hybrid::surface_from_intensities(block, range, 0);
    expect_manifold(mesh);
    glm::dvec3 low(9.0), high(0.0);
    for (const glm::dvec3& p : mesh.vertices) low = glm::min(low, p), high = glm::max(high, p);
    EXPECT_LT(glm::distance(low, {1.5, 2.5, 0.5}) + glm::distance(high, {6.5, 5.5, 4.5}), 1e-12);
  }
  EXPECT_NE(refusal([&] { (void)hybrid::surface_from_intensities(block, {{}, 5.0, 9.0}, 0); }), "");
}

TEST(LabelSurface, SmoothingKeepsEachVertexInItsCell) {
  const LabelVolume volume = noise(12, 11, 10, 0.4, 7);
  const TriangleMesh rough = hybrid::surface_from_labels(volume, 0);
  const TriangleMesh smooth = hybrid::surface_from_labels(volume, 30);
  ASSERT_EQ(rough.vertices.size(), smooth.vertices.size());
  for (std::size_t v = 0; v < rough.vertices.size(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(std::floor(rough.vertices[v][axis]), std::floor(smooth.vertices[v][axis]));
    }
  }
}

TEST(LabelSurface, IsManifoldForEveryNeighbourhoodOfEightAndForNoise) {
  for (unsigned bits = 0; bits < 256; ++bits) {
    const LabelVolume volume = filled(empty_volume(2, 2, 2), [&](int i, int j, int k) {
      return ((bits >> (i + 2 * j + 4 * k)) & 1U) != 0;
    });
    expect_manifold(hybrid::surface_from_labels(volume, 0));
  }
  for (unsigned bits = 0; bits < 4096; ++bits) {  // all patterns of the 12 voxels of two cells that share a
                                                  // face; the voxels around them are solid or empty
    for (const bool shell : {false, true}) {
      const LabelVolume volume = filled(empty_volume(4, 4, 5), [&](int i, int j, int k) {
        if (i < 1 || i > 2 || j < 1 || j > 2 || k < 1 || k > 3) return shell;
        return ((bits >> ((i - 1) + 2 * (j - 1) + 4 * (k - 1))) & 1U) != 0;
      });
      expect_manifold(hybrid::surface_from_labels(volume, 0));
      if (HasFatalFailure()) FAIL() << bits << ' ' << shell;
    }
  }
  for (unsigned seed = 0; seed < 60; ++seed) {
    const LabelVolume volume = noise(9, 8, 7, 0.1 + 0.8 * seed / 60.0, seed);
    for (const int passes : {0, 3}) {
      const TriangleMesh mesh = hybrid::surface_from_labels(volume, passes);
      expect_manifold(mesh);
      EXPECT_GT(signed_volume(mesh), 0.0);
    }
  }
}

TEST(LabelSurface, NoTwoVerticesCoincide) {
  for (const int passes : {0, 1, 8}) {
    TriangleMesh mesh = hybrid::surface_from_labels(noise(10, 10, 10, 0.5, 3), passes);
    const auto less = [](const glm::dvec3& a, const glm::dvec3& b) {
      return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z};
    };
    std::sort(mesh.vertices.begin(), mesh.vertices.end(), less);
    EXPECT_EQ(std::adjacent_find(mesh.vertices.begin(), mesh.vertices.end()), mesh.vertices.end()) << passes;
  }
}

TEST(LabelSurface, EmptyVolumesGiveEmptyMeshes) {
  EXPECT_TRUE(hybrid::surface_from_labels({}, 2).empty());
  EXPECT_TRUE(hybrid::surface_from_labels(empty_volume(4, 4, 4), 2).empty());
  LabelVolume wrong = empty_volume(4, 4, 4);
  wrong.labels.pop_back();
  EXPECT_NE(refusal([&] { hybrid::surface_from_labels(wrong, 0); }).find("63 labels"), std::string::npos);
}

// ---- keep_largest_piece

// The slow and simple reference: flood fill with an explicit stack.
std::vector<int> pieces_by_flood(const LabelVolume& volume, bool empty, std::vector<std::size_t>& sizes) {
  std::vector<int> piece(volume.labels.size(), -1);
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      for (int i = 0; i < volume.dims[0]; ++i) {
        const auto wanted = [&](std::size_t at) {
          return (volume.labels[at] == 0) == empty && piece[at] < 0;
        };
        if (!wanted(volume.index(i, j, k))) continue;
        const int number = static_cast<int>(sizes.size());
        sizes.push_back(0);
        std::vector<std::array<int, 3>> stack{{i, j, k}};
        piece[volume.index(i, j, k)] = number;
        while (!stack.empty()) {
          const std::array<int, 3> at = stack.back();
          stack.pop_back();
          ++sizes.back();
          for (std::size_t axis = 0; axis < 3; ++axis) {
            for (const int step : {-1, 1}) {
              std::array<int, 3> to = at;
              to[axis] += step;
              if (to[axis] < 0 || to[axis] >= volume.dims[axis]) continue;
              const std::size_t index = volume.index(to[0], to[1], to[2]);
              if (!wanted(index)) continue;
              piece[index] = number;
              stack.push_back(to);
            }
          }
        }
      }
    }
  }
  return piece;
}

TEST(KeepLargestPiece, AgreesWithAFloodFill) {
  for (unsigned seed = 0; seed < 80; ++seed) {
    LabelVolume volume = noise(11, 9, 10, 0.2 + 0.7 * seed / 80.0, seed);
    std::vector<std::size_t> sizes;
    const std::vector<int> piece = pieces_by_flood(volume, false, sizes);
    const int largest = static_cast<int>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
    LabelVolume expected = volume;
    for (std::size_t n = 0; n < piece.size(); ++n) expected.labels[n] = piece[n] == largest ? 1 : 0;
    LabelVolume kept = volume;
    hybrid::keep_largest_piece(kept, false);
    EXPECT_EQ(kept.labels, expected.labels) << seed;

    std::vector<std::size_t> holes;
    const std::vector<int> hole = pieces_by_flood(expected, true, holes);
    std::vector<bool> open(holes.size());
    for (int k = 0; k < 10; ++k) {
      for (int j = 0; j < 9; ++j) {
        for (int i = 0; i < 11; ++i) {
          const int number = hole[expected.index(i, j, k)];
          const bool border = i == 0 || j == 0 || k == 0 || i == 10 || j == 8 || k == 9;
          if (number >= 0 && border) open[static_cast<std::size_t>(number)] = true;
        }
      }
    }
    for (std::size_t n = 0; n < hole.size(); ++n) {
      if (hole[n] >= 0 && !open[static_cast<std::size_t>(hole[n])]) expected.labels[n] = 1;
    }
    hybrid::keep_largest_piece(volume, true);
    EXPECT_EQ(volume.labels, expected.labels) << seed;
  }
}

TEST(KeepLargestPiece, KeepsLabelsAndNeedsNoMaterial) {
  LabelVolume volume = empty_volume(6, 1, 1);
  volume.labels = {3, 4, 5, 0, 9, 9};
  hybrid::keep_largest_piece(volume, true);
  EXPECT_EQ(volume.labels, (std::vector<std::uint8_t>{3, 4, 5, 0, 0, 0}));
  LabelVolume nothing = empty_volume(3, 3, 3);
  hybrid::keep_largest_piece(nothing, true);
  EXPECT_EQ(count(nothing), 0U);
  LabelVolume none;
  hybrid::keep_largest_piece(none, true);
}

TEST(GrowLabels, AgreesWithBruteForceOnAnyLattice) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (unsigned seed = 0; seed < 40; ++seed) {
    LabelVolume volume = noise(7, 6, 5, 0.02 + 0.1 * unit(random), seed);
    if (count(volume) == 0) continue;
    volume.spacing_m = {0.5 + unit(random), 0.5 + unit(random), 0.5 + unit(random)};
    volume.origin_m = {1.0, -2.0, 3.0};
    volume.rotation = glm::angleAxis(0.7, glm::normalize(glm::dvec3(1.0, 2.0, 3.0)));
    for (auto& label : volume.labels) label = label != 0 ? 5 : 0;
    const double distance = 2.5 * unit(random);
    const LabelVolume grown = hybrid::grow_labels(volume, distance);
    std::vector<glm::dvec3> sources;
    for (int k = 0; k < 5; ++k) {
      for (int j = 0; j < 6; ++j) {
        for (int i = 0; i < 7; ++i) {
          if (volume.labels[volume.index(i, j, k)] == 0) continue;
          sources.push_back(volume.origin_m + volume.rotation * (glm::dvec3(i, j, k) * volume.spacing_m));
        }
      }
    }
    bool at_border = false;
    for (int k = 0; k < grown.dims[2]; ++k) {
      for (int j = 0; j < grown.dims[1]; ++j) {
        for (int i = 0; i < grown.dims[0]; ++i) {
          const glm::dvec3 p = grown.origin_m + grown.rotation * (glm::dvec3(i, j, k) * grown.spacing_m);
          double nearest = std::numeric_limits<double>::infinity();
          for (const glm::dvec3& s : sources) nearest = std::min(nearest, glm::length(p - s));
          const int label = grown.labels[grown.index(i, j, k)];
          if (std::abs(nearest - distance) < 1e-5) continue;
          ASSERT_EQ(label, nearest < 1e-9 ? 5 : nearest <= distance ? 1 : 0) << nearest << ' ' << distance;
          at_border = at_border || (label != 0 && i == 0);
        }
      }
    }
    // Growing again by 0 adds nothing.
    EXPECT_EQ(count(hybrid::grow_labels(grown, 0.0)), count(grown));
    for (int axis = 0; axis < 3; ++axis) {
      const int steps = static_cast<int>(std::floor(distance / volume.spacing_m[axis]));
      EXPECT_LE(grown.dims[static_cast<std::size_t>(axis)],
                volume.dims[static_cast<std::size_t>(axis)] + 2 * steps);
    }
  }
}

TEST(GrowLabels, OneVoxelBecomesABall) {
  const LabelVolume one = filled(empty_volume(1, 1, 1, glm::dvec3(1e-3)), [](int, int, int) { return true; });
  const LabelVolume grown = hybrid::grow_labels(one, 20e-3);
  EXPECT_EQ(grown.dims,
            (std::array{41, 41, 41}));  // voxels with centres exactly at the distance are included
  EXPECT_EQ(grown.labels[grown.index(0, 20, 20)], 1);
  const double exact = 4.0 / 3.0 * std::numbers::pi * 8000.0;
  EXPECT_NEAR(static_cast<double>(count(grown)), exact, 0.01 * exact);
  EXPECT_NEAR(grown.origin_m.x, -20e-3, 1e-15);
}

TEST(GrowLabels, RefusesWhatCannotBe) {
  const LabelVolume one = filled(empty_volume(1, 1, 1, glm::dvec3(1e-3)), [](int, int, int) { return true; });
  EXPECT_NE(refusal([&] { hybrid::grow_labels(one, -1.0); }), "");
  EXPECT_NE(refusal([&] { hybrid::grow_labels(one, std::numeric_limits<double>::quiet_NaN()); }), "");
  EXPECT_NE(refusal([&] { hybrid::grow_labels(one, 1e6); }).find("voxels"), std::string::npos);
  EXPECT_NE(refusal([&] { hybrid::grow_labels(one, 1e300); }), "");
  EXPECT_EQ(count(hybrid::grow_labels(empty_volume(3, 3, 3), 1e300)), 0U);
}

TEST(LabelSurface, SevenMillionVoxelsTakeAboutASecond) {
  const LabelVolume volume = ball(192, 90.0, glm::dvec3(1.0));
  const auto timed = [&](const char* what, const auto& call) {
    const auto start = std::chrono::steady_clock::now();
    call();
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    RecordProperty(what, std::to_string(seconds));
    std::cout << what << ' ' << seconds << " s\n";
    return seconds;
  };
  TriangleMesh mesh;
  double total = timed("surface", [&] { mesh = hybrid::surface_from_labels(volume, 5); });
  LabelVolume kept = volume;
  total += timed("pieces", [&] { hybrid::keep_largest_piece(kept, true); });
  total += timed("grow", [&] { hybrid::grow_labels(volume, 5.0); });
  total += timed("voxelise", [&] { hybrid::voxelise_mesh(mesh, glm::dvec3(1.0), 1, 10'000'000); });
  EXPECT_LT(total,
            60.0);  // seconds; wide enough for sanitizers and shared machines
}

}  // namespace
