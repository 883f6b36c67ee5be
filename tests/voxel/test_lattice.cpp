// SPDX-License-Identifier: GPL-3.0-or-later
// The lattice against closed forms: two half links in series, the area a link stands for, and a brute-force
// surface.
#include "voxel/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <string>

#include "tests/voxel/lattice_scenes.h"

namespace {

using tests::block;
using tests::elastic;
using tests::made_of;
using tests::Random;
using tests::random_scene;
using tests::voxel_at;
using tests::voxel_of;
using voxel::LabelVolume;
using voxel::Lattice;
using voxel::LatticeOptions;
using voxel::LinkMaterial;
using voxel::VoxelId;

std::string refusal(const LabelVolume& volume, const LatticeOptions& options) {
  try {
    const Lattice lattice(volume, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

// Half a link of length h/2 and area A has stiffness modulus·A/(h/2); two of them in series.
double series(double a, double b, double area, double h) {
  const double ka = a * area / (h / 2), kb = b * area / (h / 2);
  return ka * kb / (ka + kb);
}

double shear_modulus(const LinkMaterial& m) {
  return m.young_Pa / (4.0 * (1.0 - m.poisson * m.poisson));
}

TEST(Lattice, SpringsAreTwoHalfLinksInSeries) {
  Random random(1);
  for (int n = 0; n < 40; ++n) {
    const auto scene = random_scene(random);
    const Lattice lattice(scene.volume, scene.options);
    const glm::dvec3 h = scene.volume.spacing_m;
    for (const std::size_t index : scene.filled) {
      const VoxelId v = voxel_of(lattice, scene.volume, index);
      for (int d = 0; d < 3; ++d) {
        const VoxelId w = v + static_cast<VoxelId>(lattice.stride(d));
        double along = 0.0, across = 0.0;
        if (lattice.filled(w)) {
          const LinkMaterial &a = scene.options.materials[lattice.label(v)],
                             &b = scene.options.materials[lattice.label(w)];
          const double area = h.x * h.y * h.z / h[d];
          along = series(a.young_Pa, b.young_Pa, area, h[d]);
          across = series(shear_modulus(a), shear_modulus(b), area, h[d]);
        }
        for (int axis = 0; axis < 3; ++axis) {
          const double expected = axis == d ? along : across;
          EXPECT_NEAR(static_cast<double>(lattice.springs().stiffness(axis, d)[v]), expected,
                      1e-6 * expected);
        }
      }
    }
  }
}

TEST(Lattice, AnUnequalSpacingIsTheSameMaterial) {
  // A bar of n links, pulled at its ends, has stiffness E·A/L whatever the spacing along and across it.
  for (const glm::dvec3& h :
       {glm::dvec3(1e-3), glm::dvec3(2e-3, 1e-3, 0.5e-3), glm::dvec3(0.3e-3, 1e-3, 4e-3)}) {
    for (int d = 0; d < 3; ++d) {
      std::array<int, 3> dims{1, 1, 1};
      dims[static_cast<std::size_t>(d)] = 6;
      const Lattice lattice(block(dims, h), made_of(elastic(8e3, 0.3)));
      const double area = h.x * h.y * h.z / h[d], length = 5 * h[d];
      double compliance = 0.0;
      VoxelId v = voxel_at(lattice, 0, 0, 0);
      for (int n = 0; n < 5; ++n, v += static_cast<VoxelId>(lattice.stride(d))) {
        compliance += 1.0 / static_cast<double>(lattice.springs().stiffness(d, d)[v]);
      }
      EXPECT_NEAR(1.0 / compliance, 8e3 * area / length, 1e-6 * 8e3 * area / length);
    }
  }
}

TEST(Lattice, LimitsOfALinkAreTheMeanOfItsTwoHalves) {
  Random random(2);
  for (int n = 0; n < 40; ++n) {
    const auto scene = random_scene(random);
    const Lattice lattice(scene.volume, scene.options);
    const glm::dvec3 h = scene.volume.spacing_m;
    for (const std::size_t index : scene.filled) {
      const VoxelId v = voxel_of(lattice, scene.volume, index);
      for (int d = 0; d < 3; ++d) {
        const VoxelId w = v + static_cast<VoxelId>(lattice.stride(d));
        if (!lattice.filled(w)) continue;
        const LinkMaterial &a = scene.options.materials[lattice.label(v)],
                           &b = scene.options.materials[lattice.label(w)];
        // Each half link may become min·h/2 short and max·h/2 long, and slip by shear·h/2.
        const double low = (a.stretch_min + b.stretch_min) * h[d] / 2 - h[d],
                     high = (a.stretch_max + b.stretch_max) * h[d] / 2 - h[d],
                     slip = (a.shear + b.shear) * h[d] / 2;
        const double rounding = 1e-6 * h[d];
        for (int axis = 0; axis < 3; ++axis) {
          const auto bounds = lattice.bounds(v, d, axis);
          EXPECT_NEAR(static_cast<double>(bounds[0]), axis == d ? low : -slip, rounding);
          EXPECT_NEAR(static_cast<double>(bounds[1]), axis == d ? high : slip, rounding);
          EXPECT_LE(bounds[0], 0.0F);
          EXPECT_GE(bounds[1], 0.0F);
        }
        const auto& tightest = lattice.tightest(d);
        EXPECT_GE(tightest.along_low, lattice.limit(v, d).along_low);
        EXPECT_LE(tightest.along_high, lattice.limit(v, d).along_high);
        EXPECT_LE(tightest.across, lattice.limit(v, d).across);
      }
    }
  }
}

TEST(Lattice, TheSurfaceIsWhatMissesANeighbour) {
  Random random(3);
  for (int n = 0; n < 60; ++n) {
    const auto scene = random_scene(random);
    const Lattice lattice(scene.volume, scene.options);
    const auto& volume = scene.volume;
    const auto filled = [&](int i, int j, int k) {
      return i >= 0 && j >= 0 && k >= 0 && i < volume.dims[0] && j < volume.dims[1] && k < volume.dims[2] &&
             volume.labels[volume.index(i, j, k)] != 0;
    };
    std::set<VoxelId> expected;
    for (int k = 0; k < volume.dims[2]; ++k) {
      for (int j = 0; j < volume.dims[1]; ++j) {
        for (int i = 0; i < volume.dims[0]; ++i) {
          if (!filled(i, j, k)) continue;
          const bool inside = filled(i - 1, j, k) && filled(i + 1, j, k) && filled(i, j - 1, k) &&
                              filled(i, j + 1, k) && filled(i, j, k - 1) && filled(i, j, k + 1);
          if (!inside) expected.insert(voxel_at(lattice, i, j, k));
          const glm::dvec3 rest = lattice.rest(voxel_at(lattice, i, j, k));
          EXPECT_EQ(rest, glm::dvec3(i, j, k) * volume.spacing_m);
        }
      }
    }
    const std::set<VoxelId> found(lattice.surface().begin(), lattice.surface().end());
    EXPECT_EQ(found, expected);
    EXPECT_EQ(found.size(), lattice.surface().size());
    EXPECT_EQ(lattice.voxel_count(), scene.filled.size());
  }
}

TEST(Lattice, AnchorsByFaceLabelAndVoxel) {
  LabelVolume volume = block({5, 4, 6}, glm::dvec3(1e-3));
  // The outermost layer is that of the voxels, not of the volume around them.
  for (int j = 0; j < 4; ++j) {
    for (int i = 0; i < 5; ++i) volume.labels[volume.index(i, j, 0)] = 0;
  }
  volume.labels[volume.index(2, 2, 4)] = 9;
  const auto anchored = [&](const LatticeOptions& options) {
    const Lattice lattice(volume, options);
    std::set<std::array<int, 3>> result;
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      const auto v = static_cast<VoxelId>(i);
      if (!lattice.anchored(v)) continue;
      const auto c = lattice.coordinates(v);
      result.insert({c[0] - 1, c[1] - 1, c[2] - 1});
      for (const auto& inverse : lattice.springs().inverse_diagonal) EXPECT_EQ(inverse[v], 0.0F);
    }
    EXPECT_EQ(result.size(), lattice.anchored_count());
    return result;
  };
  const auto where = [&](auto condition) {
    std::set<std::array<int, 3>> result;
    for (int k = 1; k < 6; ++k) {
      for (int j = 0; j < 4; ++j) {
        for (int i = 0; i < 5; ++i) {
          if (condition(i, j, k)) result.insert({i, j, k});
        }
      }
    }
    return result;
  };
  LatticeOptions options = made_of(LinkMaterial{}, "-z");
  EXPECT_EQ(anchored(options), where([](int, int, int k) { return k == 1; }));
  options.anchor_faces = {"+x", "-y"};
  EXPECT_EQ(anchored(options), where([](int i, int j, int) { return i == 4 || j == 0; }));
  options.anchor_faces = {};
  options.anchor_labels = {9};
  EXPECT_EQ(anchored(options), (std::set<std::array<int, 3>>{{2, 2, 4}}));
  options.anchor_labels = {};
  options.anchor_voxels = {volume.index(1, 2, 3), volume.index(4, 3, 5),
                           volume.index(0, 0, 0)};  // the last is empty
  EXPECT_EQ(anchored(options), (std::set<std::array<int, 3>>{{1, 2, 3}, {4, 3, 5}}));
}

TEST(Lattice, RefusesInWords) {
  const LabelVolume volume = block({3, 3, 3}, glm::dvec3(1e-3));
  EXPECT_EQ(refusal(volume, made_of(LinkMaterial{})), "");
  EXPECT_NE(refusal(volume, made_of(LinkMaterial{}, nullptr)).find("anchor"), std::string::npos);
  EXPECT_NE(refusal(volume, made_of(LinkMaterial{}, "bottom")).find("-x"), std::string::npos);
  EXPECT_NE(refusal(block({3, 3, 3}, glm::dvec3(1e-3), 0), made_of(LinkMaterial{})).find("without a voxel"),
            std::string::npos);
  LatticeOptions elsewhere = made_of(LinkMaterial{}, nullptr);
  elsewhere.anchor_labels = {7};
  EXPECT_NE(refusal(volume, elsewhere).find("anchor"), std::string::npos);

  // Its size is looked at before a byte is allocated or a label read.
  LabelVolume huge;
  huge.dims = {2000, 2000, 2000};
  EXPECT_NE(refusal(huge, made_of(LinkMaterial{})).find("coarser"), std::string::npos);
  for (const double bad : {0.0, -1e-3, std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_NE(refusal(block({3, 3, 3}, {1e-3, bad, 1e-3}), made_of(LinkMaterial{})).find("spacing"),
              std::string::npos);
  }

  const double nan = std::nan("");
  const auto with = [](auto change) {
    LinkMaterial m;
    change(m);
    return m;
  };
  struct Row {
    LinkMaterial material;
    const char* says;
  };
  const Row rows[] = {
      {with([](LinkMaterial& m) { m.young_Pa = 0.0; }), "Young"},
      {with([](LinkMaterial& m) { m.young_Pa = -1.0; }), "Young"},
      {with([&](LinkMaterial& m) { m.young_Pa = nan; }), "Young"},
      {with([](LinkMaterial& m) { m.poisson = 0.5; }), "Poisson"},
      {with([](LinkMaterial& m) { m.poisson = -0.1; }), "Poisson"},
      {with([&](LinkMaterial& m) { m.poisson = nan; }), "Poisson"},
      {with([](LinkMaterial& m) { m.stretch_min = 0.0; }), "least stretch"},
      {with([](LinkMaterial& m) { m.stretch_min = 1.1; }), "least stretch"},
      {with([&](LinkMaterial& m) { m.stretch_min = nan; }), "least stretch"},
      {with([](LinkMaterial& m) { m.stretch_max = 0.9; }), "greatest stretch"},
      {with([&](LinkMaterial& m) { m.stretch_max = nan; }), "greatest stretch"},
      {with([](LinkMaterial& m) { m.shear = -0.1; }), "shear"},
      {with([&](LinkMaterial& m) { m.shear = nan; }), "shear"},
  };
  for (const Row& row : rows) {
    const std::string text = refusal(volume, made_of(row.material));
    EXPECT_NE(text.find(row.says), std::string::npos) << text;
    EXPECT_NE(text.find("label 1"), std::string::npos) << text;
  }
  // A material that no voxel is made of is nobody's business.
  LatticeOptions unused = made_of(LinkMaterial{});
  unused.materials[2].young_Pa = -1.0;
  EXPECT_EQ(refusal(volume, unused), "");
}

}  // namespace
