// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/soft_convergence.h"

#include <array>
#include <glm/geometric.hpp>
#include <memory>

#include "hybrid/bench/soft_engines.h"
#include "voxel/baseline/thesis_chainmail.h"
#include "voxel/object/soft_object.h"

namespace hybrid::bench {
namespace {

constexpr float kPush =
    0.5e-3F;  // m; less than the slack, so that the push relaxes but starts no wave of the chain
constexpr double kRemedy = 0.2;  // factor on the thesis's movement: "some small value"

// An object of which one voxel is pushed.
struct Object {
  voxel::LabelVolume volume;
  voxel::LatticeOptions options;
  std::array<int, 3> pushed;
  voxel::ThesisChainMailOptions::Movement movement;
};

Object object_of(const std::array<int, 3>& dims, const std::array<int, 3>& pushed,
                 voxel::ThesisChainMailOptions::Movement movement) {
  Object object;
  object.volume.dims = dims;
  object.volume.spacing_m = glm::dvec3(kSoftSpacing_m);
  std::size_t voxels = 1;
  for (const int count : dims) voxels *= static_cast<std::size_t>(count);
  object.volume.labels.assign(voxels, 1);
  object.pushed = pushed;
  object.movement = movement;
  return object;
}

// The corner of a plate in which all other voxels are held. Each of its two links requires the same step, and
// the corner moves by the sum of both.
Object corner() {
  Object object = object_of({4, 4, 1}, {0, 0, 0}, voxel::ThesisChainMailOptions::Movement::sum);
  for (std::size_t n = 1; n < object.volume.labels.size(); ++n) object.options.anchor_voxels.push_back(n);
  return object;
}

// All voxels move at once, each to the mean of the places that its links require. So a voxel and its
// neighbours swing in turns. (If each moved by the sum, the relaxation would diverge.)
Object block() {
  Object object = object_of({15, 15, 8}, {7, 7, 7}, voxel::ThesisChainMailOptions::Movement::mean);
  object.options.anchor_faces = {"-z"};
  return object;
}

SettlingCurve of_classic(const Object& object, const char* name, double damping, int rounds) {
  voxel::ThesisChainMail classic(object.volume, object.options,
                                 {.movement = object.movement, .damping = damping});
  const auto pushed = classic.at(object.pushed[0], object.pushed[1], object.pushed[2]);
  const glm::vec3 by(0.0F, 0.0F, kPush);
  classic.move({&pushed, 1}, {&by, 1});
  SettlingCurve curve{name, {}};
  for (int n = 0; n <= rounds; ++n) {
    if (n > 0) classic.relax_all();
    curve.displacement.push_back(static_cast<double>(classic.displacement(pushed).z / kPush));
  }
  return curve;
}

SettlingCurve of_ours(const Object& object, int rounds) {
  voxel::SoftObject soft(std::make_shared<voxel::Lattice>(object.volume, object.options));
  const voxel::VoxelId pushed = soft.lattice().at(object.pushed[0], object.pushed[1], object.pushed[2]);
  soft.move(pushed, {0.0, 0.0, static_cast<double>(kPush)});
  SettlingCurve curve{"ours, a cycle a round", {}};
  for (int n = 0; n <= rounds; ++n) {
    if (n > 0) soft.relax_cycle();
    curve.displacement.push_back(soft.state().at(pushed).z / static_cast<double>(kPush));
  }
  return curve;
}

}  // namespace

std::vector<SettlingObject> measure_settling(int rounds) {
  std::vector<SettlingObject> all;
  const auto measure = [&](const char* name, const Object& object) {
    all.push_back(
        {name,
         {of_classic(object, "classic, undamped", 1.0, rounds),
          of_classic(object, "classic, a fifth of each step", kRemedy, rounds), of_ours(object, rounds)}});
  };
  measure("A corner of a plate, all else held: classic moves it by the sum of what its links ask", corner());
  measure("A voxel on top of a block: classic moves all at once to the mean of their neighbours", block());
  return all;
}

}  // namespace hybrid::bench
