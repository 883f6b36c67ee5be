// SPDX-License-Identifier: GPL-3.0-or-later
// Forces between the objects of a scene: the force of each pair on one another, and the load of anchors.
// They are computed between ticks, from the present state alone, never within a tick.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "hybrid/world/world_state.h"

namespace hybrid {

// A soft object, and the other object of the pair.
struct ObjectPair {
  enum class Kind : std::uint8_t { rigid, soft, anchors } kind = Kind::anchors;
  std::uint32_t soft = 0;   // index into World::soft
  std::uint32_t other = 0;  // index into World::rigid or World::soft; 0 for anchors
  friend bool operator==(const ObjectPair&, const ObjectPair&) = default;
};

struct PairForce {
  ObjectPair pair;
  // Force of the other object on the soft one (scene's frame). Empty in three cases, in which the state does
  // not determine the force:
  // - links at their limits tie both the other object and a third one to the same voxels;
  // - links at their limits carry loads, and the forces on the tissue do not balance;
  // - an object has rigid blocks.
  std::optional<glm::dvec3> on_soft_N;
  bool through_limits = false;  // links at their limits may carry a part of the force
};

// All forces on a soft object from outside the object.
struct ForceBalance {
  glm::dvec3 hand_N{0.0};  // of the hand on the object (scene's frame)
  double largest_N = 0.0;  // largest of the forces on the object
  // Length of the sum of these forces: 0 for tissue at rest. It need not be 0 while tissue moves, because
  // tissue has no inertia. Empty where a force is unknown.
  std::optional<double> sum_N;
};

struct ForcesBetween {
  std::vector<PairForce> pairs;       // pairs that touch
  std::vector<ForceBalance> balance;  // [soft]
};
// Allocates.
[[nodiscard]] ForcesBetween forces_between(const World& world, const WorldState& state);

// The force of one pair over the sampled moments of a session.
struct PairCourse {
  ObjectPair pair;
  double max_N = 0.0, max_t_s = 0.0;
  std::optional<glm::dvec3> end_on_soft_N{};  // at the last sample; 0 if the pair does not touch then
  // Samples in which the pair touches, and those of them with a known force.
  std::uint64_t samples = 0, known_samples = 0;
  // [sample] force (N); 0: the pair does not touch; NaN: not known. Filled with ForcesCourse::keep_every.
  std::vector<double> every_N{};
};

struct ForcesCourse {
  bool keep_every = false;  // fill PairCourse::every_N
  std::uint64_t samples = 0;
  double end_t_s = 0.0;
  std::vector<PairCourse> pairs;          // pairs that touch at any sample, in the order of objects
  std::vector<ForceBalance> end_balance;  // [soft]
  void add(const ForcesBetween& now, double t_s);

 private:
  PairCourse& course_of(const ObjectPair& pair);
};

}  // namespace hybrid
