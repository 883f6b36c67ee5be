// SPDX-License-Identifier: GPL-3.0-or-later
// Boxes in a bounding volume hierarchy, Embree 3's, that says which of them lie near a point. The only part
// of the project that knows Embree, which works in floats: so boxes and radii are rounded outwards here, and
// nothing is missed.
#pragma once

#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <limits>

// Embree's own, of its header.
struct RTCDeviceTy;
struct RTCSceneTy;

namespace polygon {

inline constexpr double kFurthestQuery = 1e18;  // (unit: meter) its square still is a float

inline float rounded_up(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) >= x ? f : std::nextafterf(f, std::numeric_limits<float>::infinity());
}

// Float radius that is sure to reach what lies within `radius` of the true point.
inline float conservative(double radius, float float_error) {
  constexpr double kRelativeSlack = 1e-6;  // of the few roundings in Embree's box test, each at most 6e-8
  const double reach = (radius + static_cast<double>(float_error)) * (1.0 + kRelativeSlack) + 1e-30;
  return reach < kFurthestQuery ? rounded_up(reach) : std::numeric_limits<float>::infinity();
}

class BoxTree {
 public:
  struct Box {
    glm::dvec3 low, high;
  };
  // `box_of(i)` for each i below `count`, asked from several threads. Throws std::runtime_error when Embree
  // fails.
  BoxTree(std::size_t count, const std::function<Box(std::uint32_t)>& box_of);
  BoxTree(const BoxTree&) = delete;
  BoxTree& operator=(const BoxTree&) = delete;
  BoxTree(BoxTree&&) = delete;
  BoxTree& operator=(BoxTree&&) = delete;
  ~BoxTree();

  // Where it is asked.
  struct Query {
    float x = 0.0F, y = 0.0F, z = 0.0F, radius = 0.0F;
  };
  // Points the query, and returns how far the float point lies from the true one, and the slack.
  static float aim(const glm::dvec3& point, double radius, double slack, Query& query);
  // Called for each box that may come within the radius; may make that smaller, and returns whether it did.
  using Visit = bool (*)(void* asker, std::uint32_t box, float& radius);
  void ask(const Query& query, Visit visit, void* asker) const noexcept;

  // What Embree took.
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  std::atomic<std::int64_t> embree_bytes_{0};
  RTCDeviceTy* device_ = nullptr;
  RTCSceneTy* scene_ = nullptr;
};

}  // namespace polygon
