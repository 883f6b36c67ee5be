// SPDX-License-Identifier: GPL-3.0-or-later
// The lattice and its couplings, against the voxels around each link one by one, against closed forms, and
// against a brute-force surface.
#include "voxel/lattice/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/lattice/level_stiffness.h"
#include "voxel/object/validate.h"

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
using voxel::LevelStiffness;
using voxel::LinkMaterial;
using voxel::RowId;
using voxel::VoxelId;
using voxel::VoxelSprings;

std::string refusal(const LabelVolume& volume, const LatticeOptions& options) {
  try {
    const Lattice lattice(volume, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

TEST(Lattice, SpringsAreThoseOfTheLinksAroundThem) {
  Random random(1);
  for (int n = 0; n < 40; ++n) {
    const auto scene = random_scene(random);
    const Lattice lattice(scene.volume, scene.options);
    const glm::dvec3 h = scene.volume.spacing_m;
    for (const std::size_t index : scene.filled) {
      const VoxelId v = voxel_of(lattice, scene.volume, index);
      for (int d = 0; d < 3; ++d) {
        voxel::LinkModuli m;
        if (lattice.filled(lattice.up(v, d)))
          m = tests::moduli_of(lattice, scene.options, lattice.coordinates(v), static_cast<std::size_t>(d));
        for (int axis = 0; axis < 3; ++axis) {
          const double expected = (axis == d ? m.along_Pa : m.across_Pa) * h.x * h.y * h.z / (h[d] * h[d]);
          EXPECT_NEAR(static_cast<double>(lattice.spring(v, d).on(axis, d)), expected, 1e-6 * expected);
        }
      }
    }
  }
}

// A volume with many kinds of row. Some lie inside one label. In others, labels meet in the middle, at one
// end or only along the edges. There is also a hole.
LabelVolume wide_volume() {
  LabelVolume volume = block({140, 11, 9}, {1e-3, 1.2e-3, 0.9e-3});
  for (int k = 0; k < 9; ++k) {
    for (int j = 0; j < 11; ++j) {
      for (int i = 0; i < 140; ++i) {
        std::uint8_t& label = volume.labels[volume.index(i, j, k)];
        if (k > 6) label = 2;
        if (i == 63 && j == 4 && k == 4) label = 3;
        if (i > 90 && j > 5 && (i + j + k) % 7 == 0) label = 4;
        if (i > 100 && i < 104 && j > 2) label = 0;
      }
    }
  }
  return volume;
}

// Springs read by the row or by the voxel equal the lattice's springs to the last bit, in whatever order rows
// are prepared. A coarse link is half as stiff as the four links below it together.
TEST(Lattice, CouplingsAreItsSpringsOnEveryLevel) {
  LatticeOptions options = made_of(elastic(1e4, 0.3));
  options.materials[2] = elastic(5e3, 0.45);
  options.materials[3] = elastic(1e6, 0.0);
  options.materials[4] = elastic(2e3, 0.2);
  const Lattice lattice(wide_volume(), options);
  // In `known`, all rows of all levels are prepared. In `unknown`, rows are prepared only by the queries.
  std::vector<std::unique_ptr<LevelStiffness>> known, unknown;
  for (int level = 0; level < 4; ++level) {
    for (auto* levels : {&known, &unknown})
      levels->push_back(
          std::make_unique<LevelStiffness>(lattice, level == 0 ? nullptr : levels->back().get()));
    for (RowId row = 0; row < known.back()->grid().rows(); ++row) known.back()->prepare(row);
  }
  std::size_t uniform = 0;
  for (RowId row = 0; row < lattice.grid().rows(); ++row) {
    if (!known[0]->prepare(row)) {
      EXPECT_EQ(lattice.filled_in(row), 0);
      continue;
    }
    uniform += known[0]->uniform(row) ? 1 : 0;
    for (VoxelId i = 0; i < voxel::kRow; ++i) {
      const VoxelId v = row * voxel::kRow + i;
      if (!lattice.filled(v)) continue;
      const VoxelSprings expected = lattice.springs_of(v), found = known[0]->springs_of(v);
      EXPECT_EQ(unknown[0]->find_springs(v).up, expected.up) << v;
      EXPECT_EQ(unknown[0]->find_springs(v).inverse, expected.inverse) << v;
      EXPECT_EQ(found.up, expected.up) << v;
      EXPECT_EQ(found.down, expected.down) << v;
      EXPECT_EQ(found.inverse, expected.inverse) << v;
      for (int axis = 0; axis < 3; ++axis) {
        const voxel::RowSprings springs = known[0]->springs(row, axis);
        for (std::size_t d = 0; d < 3; ++d) {
          EXPECT_EQ(springs.up[d][i], expected.up[d].on(axis, static_cast<int>(d)));
          EXPECT_EQ(springs.down[d][i], expected.down[d].on(axis, static_cast<int>(d)));
        }
      }
    }
  }
  EXPECT_GT(uniform, 20U);

  const auto& dims = lattice.grid().dims;
  for (int level = 1; level < 4; ++level) {
    const auto ul = static_cast<std::size_t>(level);
    const voxel::Grid& g = known[ul]->grid();
    const int size = 1 << level;
    // `known` has all rows of this level. `alone` prepares only the queried rows of this level.
    LevelStiffness alone(lattice, unknown[ul - 1].get());
    const auto sum_of = [&](const std::array<int, 3>& cell, std::size_t d) {
      double sum = 0.0;
      std::array<int, 3> at{};
      at[d] = (cell[d] + 1) * size - 1;
      if (at[d] + 1 >= dims[d]) return sum;
      const std::size_t p = (d + 1) % 3, q = (d + 2) % 3;
      for (at[p] = cell[p] * size; at[p] < std::min((cell[p] + 1) * size, dims[p]); ++at[p]) {
        for (at[q] = cell[q] * size; at[q] < std::min((cell[q] + 1) * size, dims[q]); ++at[q])
          sum += static_cast<double>(
              lattice.spring(lattice.at(at[0], at[1], at[2]), static_cast<int>(d)).across);
      }
      return sum;
    };
    for (int k = 0; k < g.dims[2]; ++k) {
      for (int j = 0; j < g.dims[1]; ++j) {
        for (int i = 0; i < g.dims[0]; ++i) {
          const VoxelSprings unwritten = alone.find_springs(g.at(i, j, k)),
                             found = known[ul]->springs_of(g.at(i, j, k)),
                             again = alone.springs_of(g.at(i, j, k)),
                             written = alone.find_springs(g.at(i, j, k));
          for (const VoxelSprings& other : {unwritten, written}) {
            EXPECT_EQ(found.up, other.up);
            EXPECT_EQ(found.down, other.down);
            EXPECT_EQ(found.inverse, other.inverse);
          }
          EXPECT_EQ(found.up, again.up);
          EXPECT_EQ(found.down, again.down);
          EXPECT_EQ(found.inverse, again.inverse);
          for (std::size_t d = 0; d < 3; ++d) {
            const double sum = sum_of({i, j, k}, d) / size;
            EXPECT_NEAR(static_cast<double>(found.up[d].across), sum, 1e-6 * sum);
          }
        }
      }
    }
  }
}

TEST(Lattice, AnUnequalSpacingIsTheSameMaterial) {
  // A bar of n links that is pulled at its ends has the stiffness E·A/L, whatever the spacings along and
  // across it.
  for (const glm::dvec3& h :
       {glm::dvec3(1e-3), glm::dvec3(2e-3, 1e-3, 0.5e-3), glm::dvec3(0.3e-3, 1e-3, 4e-3)}) {
    for (int d = 0; d < 3; ++d) {
      std::array<int, 3> dims{1, 1, 1};
      dims[static_cast<std::size_t>(d)] = 6;
      const Lattice lattice(block(dims, h), made_of(elastic(8e3, 0.3)));
      const double area = h.x * h.y * h.z / h[d], length = 5 * h[d];
      double compliance = 0.0;
      VoxelId v = voxel_at(lattice, 0, 0, 0);
      for (int n = 0; n < 5; ++n, v = lattice.up(v, d)) {
        compliance += 1.0 / static_cast<double>(lattice.spring(v, d).on(d, d));
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
        const VoxelId w = lattice.up(v, d);
        if (!lattice.filled(w)) continue;
        const LinkMaterial &a = scene.options.materials[lattice.label(v)],
                           &b = scene.options.materials[lattice.label(w)];
        // Each half link may shorten to min·h/2, lengthen to max·h/2, and slip sideways by shear·h/2.
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
  // The anchored layer is the outermost layer of voxels, not of the volume, which is larger.
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
      result.insert(c);
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_EQ(lattice.springs_of(v).inverse[static_cast<std::size_t>(axis)], 0.0F);
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
                           volume.index(0, 0, 0)};  // the last voxel is empty
  EXPECT_EQ(anchored(options), (std::set<std::array<int, 3>>{{1, 2, 3}, {4, 3, 5}}));
}

// Rows with no anchors, with only anchors, and with some anchors, in random order.
TEST(Lattice, KnowsEachAnchor) {
  tests::Random random(21);
  for (int n = 0; n < 12; ++n) {
    LabelVolume volume = block({70, 23, 19}, glm::dvec3(1e-3));
    const double filled = n % 3 == 0 ? 1.0 : 0.7;
    for (std::uint8_t& label : volume.labels) label = random.unit() < filled ? 1 : 0;
    std::vector<bool> expected(volume.labels.size());
    LatticeOptions options = made_of(LinkMaterial{}, nullptr);
    const auto anchor = [&](int i, int j, int k) {
      const std::size_t at = volume.index(i, j, k);
      options.anchor_voxels.push_back(at);
      expected[at] = volume.labels[at] != 0;
    };
    for (int k = 0; k < 19; ++k) {
      for (int j = 0; j < 23; ++j) {
        const double share = random.unit() < 0.4 ? 0.0 : random.unit() < 0.5 ? 1.0 : 0.2;
        for (int i = 0; i < 70; ++i) {
          if (random.unit() < share) anchor(i, j, k);
        }
      }
    }
    const Lattice lattice(volume, options);
    for (int k = 0; k < 19; ++k) {
      for (int j = 0; j < 23; ++j) {
        for (int i = 0; i < 70; ++i) {
          const VoxelId v = lattice.at(i, j, k);
          const std::size_t at = volume.index(i, j, k);
          ASSERT_EQ(lattice.anchored(v), expected[at]);
          ASSERT_EQ((lattice.anchored_lanes(v / voxel::kRow) >> v % voxel::kRow & 1U) != 0, expected[at]);
          ASSERT_EQ((lattice.filled_lanes(v / voxel::kRow) >> v % voxel::kRow & 1U) != 0,
                    volume.labels[at] != 0);
        }
      }
    }
    EXPECT_EQ(voxel::validate(lattice), "");
  }
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

  // The volume's size is checked before memory is allocated and before labels are read.
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
      {with([](LinkMaterial& m) { m.yield = 0.0; }), "yield"},
      {with([&](LinkMaterial& m) { m.yield = nan; }), "yield"},
      {with([&](LinkMaterial& m) { m.shear = nan; }), "shear"},
  };
  for (const Row& row : rows) {
    const std::string text = refusal(volume, made_of(row.material));
    EXPECT_NE(text.find(row.says), std::string::npos) << text;
    EXPECT_NE(text.find("label 1"), std::string::npos) << text;
  }
  // A material that no voxel has is not checked.
  LatticeOptions unused = made_of(LinkMaterial{});
  unused.materials[2].young_Pa = -1.0;
  EXPECT_EQ(refusal(volume, unused), "");
}

}  // namespace
