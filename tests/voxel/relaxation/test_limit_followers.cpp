// SPDX-License-Identifier: GPL-3.0-or-later
// Followers of given voxels, against a reference that searches voxel by voxel.
#include "voxel/relaxation/limit_followers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>

#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/chain/chainmail.h"
#include "voxel/lattice/voxel_links.h"

namespace {

using tests::Random;
using voxel::Displacement;
using voxel::Lattice;
using voxel::VoxelId;

constexpr float kSearched = 0.1F, kTight = 1e-4F;  // in spacings, as in the code under test
constexpr float kDirtyMotion = 1e-5F;
constexpr std::size_t kMostRoots = 64;

// Distance of the link between two neighbours along d from its nearer limit (m).
float room(const Lattice& lattice, const Displacement& state, VoxelId v, VoxelId w, int d, bool up,
           int axis) {
  const auto& u = state.u[static_cast<std::size_t>(axis)];
  const auto b = lattice.bounds(up ? v : w, d, axis);
  const float difference = u[w] - u[v];
  return std::min(difference - (up ? b[0] : -b[1]), (up ? b[1] : -b[0]) - difference);
}

float place_of(voxel::Relaxation& relaxation, const Displacement& state, VoxelId v, int axis) {
  glm::dvec3 rest = unconstrained_minimum(relaxation.couplings(), state, v);
  if (relaxation.shadow_busy())
    rest += link_compliance(relaxation.couplings(), v) * relaxation.multigrid().frozen_load(v, state);
  return voxel::clamp_to(link_interval(relaxation.couplings().lattice(), state, v, axis),
                         static_cast<float>(rest[axis]), state.u[static_cast<std::size_t>(axis)][v]);
}

// Reference. Moves the followers of `sources`, and returns the voxels that moved far enough to mark their
// rows dirty.
std::set<VoxelId> draw(voxel::Relaxation& relaxation, Displacement& state,
                       const std::vector<VoxelId>& sources, int axis, std::size_t& drawn) {
  const Lattice& lattice = relaxation.couplings().lattice();
  auto& u = state.u[static_cast<std::size_t>(axis)];
  std::set<VoxelId> known(sources.begin(), sources.end()), dirty;
  std::vector<VoxelId> carried = sources;
  const std::size_t most = sources.size() + voxel::LimitFollowers::kMaxFollowers;
  for (std::size_t head = 0; head < carried.size() && carried.size() < most; ++head) {
    for (int n = 0; n < 6; ++n) {
      const int d = n / 2;
      const bool up = n % 2 != 0;
      const VoxelId v = carried[head], w = up ? lattice.up(v, d) : lattice.down(v, d);
      if (!lattice.filled(w) || lattice.anchored(w) || known.contains(w) ||
          state.role[w] != Displacement::free)
        continue;
      const auto spacing = static_cast<float>(lattice.spacing_m()[d]);
      if (room(lattice, state, v, w, d, up, axis) > kSearched * spacing) continue;
      const float before = u[w];
      u[w] = place_of(relaxation, state, w, axis);
      if (std::abs(u[w] - before) > kDirtyMotion * spacing) dirty.insert(w);
      if (room(lattice, state, v, w, d, up, axis) > kTight * spacing) continue;
      known.insert(w);
      carried.push_back(w);
    }
  }
  drawn += carried.size() - sources.size();
  return dirty;
}

struct Counts {
  std::size_t drawn = 0, moved = 0, most = 0;
};

// Pushes some voxels of a lattice so far that others follow, then moves them back a little, and compares.
// `apart`: the object is relaxed by a shadow at the same time.
void compare(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options,
             const std::vector<std::size_t>& filled, bool apart, Random& random, Counts& counts) {
  const Lattice lattice(volume, options);
  Displacement state(lattice);
  voxel::Relaxation relaxation(lattice);
  voxel::ChainMail chain(lattice);
  const auto any = [&] {
    return tests::voxel_of(lattice, volume,
                           filled[static_cast<std::size_t>(random.below(static_cast<int>(filled.size())))]);
  };
  std::vector<VoxelId> sources;
  std::vector<glm::vec3> moves;
  for (int n = 1 + random.below(4); n > 0; --n) {
    const VoxelId v = any();
    if (lattice.anchored(v) || std::find(sources.begin(), sources.end(), v) != sources.end()) continue;
    glm::dvec3 move(0.0);
    for (int axis = 0; axis < 3; ++axis) move[axis] = random.between(-3.0, 3.0) * lattice.min_spacing_m();
    state.set(v, move);
    sources.push_back(v);
    moves.emplace_back(move);
  }
  if (sources.empty()) return;
  chain.settle(state, sources, moves, {});
  for (const voxel::RowId row : chain.moved_rows()) relaxation.mark_dirty(row);
  if (lattice.has_bricks()) relaxation.multigrid().renew_bricks(state, lattice.grid().rows());
  // Held voxels must not follow, so the sources at the surface and one other voxel are held.
  for (const VoxelId v : sources) {
    if (lattice.surface_number(v) != Lattice::kNoSurface) state.set_role(v, Displacement::held);
  }
  if (const VoxelId v = any(); lattice.surface_number(v) != Lattice::kNoSurface)
    state.set_role(v, Displacement::held);
  if (apart) {
    relaxation.leave_to_shadow();
    relaxation.assign_residual(state, {});
    for (const voxel::RowId row : chain.moved_rows()) relaxation.multigrid().freeze_residual(row, state, {});
  }
  const auto back = static_cast<float>(random.between(-0.05, 0.05));
  for (const VoxelId v : sources) {
    for (auto& axis : state.u) axis[v] += back * axis[v];
  }
  relaxation.multigrid().log().clear();

  Displacement simple = state;
  std::set<VoxelId> dirty;
  std::size_t drawn = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::size_t on_axis = 0;
    dirty.merge(draw(relaxation, simple, sources, axis, on_axis));
    drawn += on_axis;
    counts.most = std::max(counts.most, on_axis);
  }
  std::vector<VoxelId> moved;
  for (const std::size_t index : filled) {
    const VoxelId v = tests::voxel_of(lattice, volume, index);
    if (simple.at(v) != state.at(v)) moved.push_back(v);
  }
  voxel::LimitFollowers rows(lattice, kMostRoots);
  rows.move(relaxation, state, sources, kDirtyMotion);
  for (const std::size_t index : filled) {
    const VoxelId v = tests::voxel_of(lattice, volume, index);
    for (std::size_t axis = 0; axis < 3; ++axis)
      ASSERT_EQ(state.u[axis][v], simple.u[axis][v]) << "voxel " << v << ", axis " << axis;
  }
  for (const VoxelId v : dirty)
    EXPECT_TRUE(relaxation.multigrid().has(0, v / voxel::kRow, voxel::Multigrid::active));
  for (const VoxelId v : moved) EXPECT_TRUE(!apart || relaxation.multigrid().log().has(0, v / voxel::kRow));
  counts.drawn += drawn;
  counts.moved += moved.size();
}

std::ostream& operator<<(std::ostream& out, const Counts& counts) {
  return out << counts.drawn << " voxels drawn along, " << counts.most << " at most on an axis, "
             << counts.moved << " moved";
}

TEST(LimitFollowers, GoWhereTheyGoVoxelByVoxelInRandomScenes) {
  Random random(21);
  Counts counts;
  for (int n = 0; n < 400; ++n) {
    tests::RandomScene scene = tests::random_scene(random);
    for (auto& material : scene.options.materials) {
      if (n % 4 == 1) material.yield = random.between(0.02, 0.3);
      if (n % 4 == 2) material.bricks = random.below(2) != 0;
    }
    compare(scene.volume, scene.options, scene.filled, n % 8 < 4, random, counts);
  }
  std::cout << counts << '\n';
  EXPECT_GT(counts.drawn, 1000U);
  EXPECT_GT(counts.moved, 1000U);
}

TEST(LimitFollowers, GoOnFromRowToRow) {
  // Tests objects wider than a row of 32 voxels. They have one label (rows share springs) or three. Some
  // reach the largest number of followers.
  Random random(22);
  Counts counts;
  for (int n = 0; n < 100; ++n) {
    voxel::LabelVolume volume = tests::block({100, 9, 8}, glm::dvec3(1e-3));
    voxel::LatticeOptions options;
    for (std::size_t label = 1; label <= 3; ++label) {
      const double slack = n % 3 == 0 ? 0.01 : random.between(0.02, 0.1);
      options.materials[label] = {.young_Pa = random.between(1e3, 1e4),
                                  .poisson = 0.3,
                                  .stretch_min = 1.0 - slack,
                                  .stretch_max = 1.0 + slack,
                                  .shear = slack};
    }
    if (n % 2 != 0) {
      for (auto& label : volume.labels) label = static_cast<std::uint8_t>(1 + random.below(3));
    }
    if (n % 3 == 0) {
      options.anchor_voxels = {0};
    } else {
      options.anchor_faces = {"-z"};
    }
    std::vector<std::size_t> filled(volume.labels.size());
    for (std::size_t i = 0; i < filled.size(); ++i) filled[i] = i;
    compare(volume, options, filled, n % 4 < 2, random, counts);
  }
  std::cout << counts << '\n';
  EXPECT_GE(counts.most, voxel::LimitFollowers::kMaxFollowers);
}

}  // namespace
