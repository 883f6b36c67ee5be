// SPDX-License-Identifier: GPL-3.0-or-later
// The published virtual proxy with constraint planes (Ruspini, Kolarov & Khatib, The haptic display of
// complex graphical environments, SIGGRAPH 1997, the part on moving the proxy). Open haptic libraries use it
// under the name "finger proxy". It is a peer for benchmarks, written from the paper, and shares no code with
// the product's proxy.
//
// The proxy, a ball, moves straight to the goal until it meets a triangle. The plane of contact becomes a
// constraint. The next goal is the nearest place to the device that all constraints allow, at most three at a
// time. One pass ends when the proxy reaches such a goal, or meets a fourth triangle. The paper repeats
// passes while the servo loop has time. The libraries do one pass in a tick.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

#include "polygon/reference/triangle_tree.h"

namespace polygon {

struct FingerOptions {
  double radius_m = 0.0;     // of the ball; 0: a point
  std::uint32_t passes = 1;  // most passes in a step
};

struct FingerStep {
  glm::dvec3 point{0.0};     // the proxy (body frame)
  std::uint32_t sweeps = 0;  // straight ways that were tried
  // True: the goal is reached, or the last pass left the proxy in its place.
  bool settled = false;
};

// The proxy keeps this much more than its radius from the triangles (unit: the longest edge of the mesh's
// box), so that rounding puts no triangle behind it.
inline constexpr double kFingerGap = 1e-7;

// Moves the proxy from `from`, a free place, as far towards `goal` as the passes bring it (body frame).
[[nodiscard]] FingerStep finger_step(const TriangleTree& tree, const FingerOptions& options,
                                     const glm::dvec3& from, const glm::dvec3& goal) noexcept;

}  // namespace polygon
