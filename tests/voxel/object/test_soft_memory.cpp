// SPDX-License-Identifier: GPL-3.0-or-later
// Memory of a soft object. Until it is touched, an object takes little more memory than its labels. It always
// takes as much as memory_bytes() reports.
#include <gtest/gtest.h>

#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/voxel/fixtures/lattice_scenes.h"
#include "tests/voxel/fixtures/process_memory.h"
#include "voxel/object/soft_object.h"

namespace {

using tests::block;
using tests::kMemoryIsOurs;
using tests::kReadingTakes;
using tests::own_bytes;
using tests::reading_takes_memory;
using voxel::LabelVolume;
using voxel::Lattice;
using voxel::LatticeOptions;
using voxel::SoftObject;

constexpr double kH = 1e-3;  // spacing (m)

struct Counted {
  std::unique_ptr<SoftObject> object;
  double voxels = 0.0;
  std::size_t before = 0;  // memory of the process before the object is made (bytes)

  Counted(const LabelVolume& volume, const LatticeOptions& options) : before(own_bytes()) {
    object = std::make_unique<SoftObject>(std::make_shared<Lattice>(volume, options));
    voxels = static_cast<double>(object->lattice().voxel_count());
  }
  [[nodiscard]] double counted() const { return static_cast<double>(own_bytes() - before) / voxels; }
  [[nodiscard]] double said() const { return static_cast<double>(object->memory_bytes()) / voxels; }
};

LatticeOptions four_tissues(const std::string& face) {
  LatticeOptions options;
  for (std::size_t label = 1; label < 5; ++label)
    options.materials[label].young_Pa = 2e3 * static_cast<double>(label);
  options.anchor_faces = {face};
  return options;
}

// 134 million voxels take one byte each. Everything else takes at most another 0.2 bytes per voxel.
TEST(SoftMemory, UntilItIsTouchedA512CubeTakes1Point2BytesAVoxel) {
  if (!kMemoryIsOurs) GTEST_SKIP() << "a sanitizer's own memory is counted";
  if (reading_takes_memory()) GTEST_SKIP() << kReadingTakes;
  LabelVolume volume = block({512, 512, 512}, glm::dvec3(kH));
  for (std::size_t n = 0; n < volume.labels.size(); ++n)
    volume.labels[n] = static_cast<std::uint8_t>(1 + n * 4 / volume.labels.size());
  const Counted cube(volume, four_tissues("-z"));
  EXPECT_LE(cube.counted(), 1.2);
  EXPECT_NEAR(cube.said(), cube.counted(), 0.005 * cube.counted());
}

// A smaller object takes up to 0.12 bytes per voxel more. Of these, 0.05 are for its larger share of surface
// voxels, at 4 bytes each, and the rest is for incomplete pages and rows. The anchored face, the mixture of
// tissues and anchored bone inside make no difference.
TEST(SoftMemory, NoAnchorAndNoTissueTakesMuch) {
  if (!kMemoryIsOurs) GTEST_SKIP() << "a sanitizer's own memory is counted";
  if (reading_takes_memory()) GTEST_SKIP() << kReadingTakes;
  for (const char* const kind : {"-x", "+y", "-z", "mixed", "bone"}) {
    const bool mixed = std::string(kind) == "mixed", bone = std::string(kind) == "bone";
    LabelVolume volume = block({256, 256, 256}, glm::dvec3(kH));
    tests::Random random(11);
    for (std::size_t n = 0; mixed && n < volume.labels.size(); ++n)
      volume.labels[n] = static_cast<std::uint8_t>(1 + random.below(4));
    for (int k = 80; bone && k < 180; ++k) {
      for (int j = 80; j < 180; ++j) {
        for (int i = 80; i < 180; ++i) volume.labels[volume.index(i, j, k)] = 2;
      }
    }
    LatticeOptions options = four_tissues(mixed || bone ? "-z" : kind);
    if (bone) options.anchor_labels = {2};
    const Counted cube(volume, options);
    EXPECT_LE(cube.counted(), 1.2 + 0.12) << kind;
    EXPECT_NEAR(cube.said(), cube.counted(), 0.02 * cube.counted()) << kind;
  }
}

TEST(SoftMemory, WhatItSaysIsWhatTheProcessTakesAlsoWhereItIsTouched) {
  if (!kMemoryIsOurs) GTEST_SKIP() << "a sanitizer's own memory is counted";
  for (const int edge :
       {64, 160}) {  // the small one takes all memory at construction, the large one on first access
    const LabelVolume volume = block({edge, edge, edge}, glm::dvec3(kH));
    const Counted cube(volume, four_tissues("-z"));
    EXPECT_NEAR(cube.said(), cube.counted(), 0.03 * cube.counted()) << edge;
    SoftObject& object = *cube.object;
    const double middle = 0.5 * (edge - 1) * kH;
    voxel::ToolInBody tool;
    tool.radius = 8.0 * kH;
    std::vector<voxel::VoxelId> near;
    near.reserve(SoftObject::kMaxTouched);
    for (int n = 1; n <= 8; ++n) {
      tool.centre = {middle, middle, (edge - 1) * kH + object.reach(tool.radius) - n * kH};
      near.clear();
      for (const voxel::VoxelId v : object.lattice().surface()) {
        if (glm::distance(object.position(v), tool.centre) < object.reach(tool.radius) + kH)
          near.push_back(v);
      }
      object.touch(near);
      object.push_out(tool);
      object.relax_near(tool, 2);
      object.relax_background(2'000'000);
    }
    EXPECT_NEAR(cube.said(), cube.counted(), 0.03 * cube.counted()) << edge;
  }
}

// A lattice that takes over a volume equals a lattice that copies the volume, and frees the volume's memory.
TEST(SoftMemory, AVolumeThatIsGivenAwayGivesItsMemoryBack) {
  LabelVolume volume = block({100, 90, 70}, glm::dvec3(kH));
  tests::Random random(12);
  for (std::uint8_t& label : volume.labels) label = static_cast<std::uint8_t>(random.below(5));
  const LatticeOptions options = four_tissues("-z");
  const Lattice kept(volume, options), given(LabelVolume(volume), options);
  ASSERT_EQ(kept.voxel_count(), given.voxel_count());
  for (std::size_t v = 0; v < kept.size(); ++v) {
    const auto id = static_cast<voxel::VoxelId>(v);
    ASSERT_EQ(kept.label(id), given.label(id));
    ASSERT_EQ(kept.anchored(id), given.anchored(id));
  }
  if (!kMemoryIsOurs) return;
  if (reading_takes_memory()) GTEST_SKIP() << "lattices are the same; what they take: " << kReadingTakes;
  LabelVolume large = block({256, 256, 256}, glm::dvec3(kH));
  const std::size_t before = own_bytes();
  const Lattice lattice(std::move(large), options);
  EXPECT_LT(static_cast<double>(own_bytes()), static_cast<double>(before) + 0.2 * (1 << 24));
}

}  // namespace
