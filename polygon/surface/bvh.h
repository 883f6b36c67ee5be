// SPDX-License-Identifier: GPL-3.0-or-later
// A bounding volume hierarchy of boxes (Embree 3) that finds the boxes near a point. This is the only part of
// the project that knows Embree. Embree works in floats, so boxes and radii are rounded outwards here and no
// box is missed.
#pragma once

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <limits>

#include "polygon/surface/rigid_surface.h"

// Embree's own types.
struct RTCDeviceTy;
struct RTCSceneTy;

namespace polygon {

inline float rounded_up(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) >= x ? f : std::nextafterf(f, std::numeric_limits<float>::infinity());
}

// Float radius that contains everything within `radius` of the true point.
inline float conservative(double radius, float float_error) {
  constexpr double kRelativeSlack = 1e-6;  // for the few roundings in Embree's box test, each at most 6e-8
  const double reach = (radius + static_cast<double>(float_error)) * (1.0 + kRelativeSlack) + 1e-30;
  return reach < kFurthestQuery ? rounded_up(reach) : std::numeric_limits<float>::infinity();
}

class Bvh {
 public:
  struct Box {
    glm::dvec3 low, high;
  };
  // Calls `box_of(i)` for each i below `count`, from several threads. Throws std::runtime_error if Embree
  // fails.
  Bvh(std::size_t count, const std::function<Box(std::uint32_t)>& box_of);
  Bvh(const Bvh&) = delete;
  Bvh& operator=(const Bvh&) = delete;
  Bvh(Bvh&&) = delete;
  Bvh& operator=(Bvh&&) = delete;
  ~Bvh();

  // Point and radius in floats.
  struct Query {
    float x = 0.0F, y = 0.0F, z = 0.0F, radius = 0.0F;
  };
  // Sets the query. Returns the distance of the float point from the true one, plus `slack`.
  static float set_query(const glm::dvec3& point, double radius, double slack, Query& query);
  // Called for each box that may come within the radius. It may reduce the radius, and returns whether it
  // did.
  using Visit = bool (*)(void* user, std::uint32_t box, float& radius);
  void visit_near(const Query& query, Visit visit, void* user) const noexcept;

  // Memory that Embree holds.
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  std::atomic<std::int64_t> embree_bytes_{0};
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* scene_ = nullptr;
};

}  // namespace polygon
