// SPDX-License-Identifier: GPL-3.0-or-later
// The interface through which the proxy queries a rigid object: the convex elements near a point, and
// half-spaces that are safe to move in.
//
// Let c be the closest point of a *convex* element (a triangle, a ball, a box) to the ball's centre p, and n
// = (p − c)/|p − c|. The half-space {q : n·(q − c) ≥ r} contains no point nearer to the element than r. So a
// straight step inside the intersection of such half-spaces touches no gathered element. An element that was
// not gathered is further away than the gather radius, so a step shorter than (gather radius − r) cannot
// reach it. Therefore the sweep cannot tunnel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

namespace polygon {

// Closest point of one convex element to a query point, both in the body frame.
struct NearPoint {
  glm::dvec3 point{0.0};      // (unit: meter)
  double distance = 0.0;      // from the query point, >= 0 (unit: meter)
  std::uint32_t element = 0;  // triangle index; 0 for a primitive
};

// Order of nearest points: by distance, then by element, so that the order of visits does not matter.
[[nodiscard]] inline bool nearer(const NearPoint& a, const NearPoint& b) {
  return a.distance < b.distance || (a.distance == b.distance && a.element < b.element);
}

// One element and a plane between it and a viewpoint: normal · x <= support for every point x of the element.
// The plane need not be the one through the closest point.
struct ElementPlane {
  glm::dvec3 normal{0.0};  // unit, towards the viewpoint; zero if the viewpoint lies on the element
  double support = 0.0;    // max over the element of normal · x (unit: meter)
  std::uint32_t element = 0;
};

struct GatherResult {
  std::uint32_t count = 0;  // entries written to the output, sorted by element
  bool complete = true;     // false: the output was too small; ask again with a smaller radius
};

inline constexpr std::uint32_t kNoElement = 0xffffffffU;

// A query point further than this from the mesh finds nothing (unit: meter). Its square still fits a float.
inline constexpr double kFurthestQuery = 1e18;

// An object that consists of convex elements. Queries are const and noexcept, take no lock and allocate
// nothing.
class RigidSurface {
 public:
  RigidSurface() = default;
  RigidSurface(const RigidSurface&) = delete;
  RigidSurface& operator=(const RigidSurface&) = delete;
  RigidSurface(RigidSurface&&) = delete;
  RigidSurface& operator=(RigidSurface&&) = delete;
  virtual ~RigidSurface() = default;

  // Every element whose distance to `point` (body frame) is at most `radius` (unit: meter).
  [[nodiscard]] virtual GatherResult gather(const glm::dvec3& point, double radius,
                                            std::span<NearPoint> out) const noexcept = 0;

  // The nearest element within `radius`; false when there is none.
  [[nodiscard]] virtual bool nearest(const glm::dvec3& point, double radius,
                                     NearPoint& out) const noexcept = 0;

  // Every element that comes within `radius` of `centre`, each with a plane that faces `view`. It may include
  // elements slightly further away, but the set depends on geometry alone. The order is undefined. complete
  // == false: the output was too small, and its contents are undefined.
  [[nodiscard]] virtual GatherResult survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                            std::span<ElementPlane> out) const noexcept = 0;

  // The closest point of one element.
  [[nodiscard]] virtual NearPoint closest(std::uint32_t element, const glm::dvec3& point) const noexcept = 0;

  // Unit normal of a flat element; zero if it has none.
  [[nodiscard]] virtual glm::dvec3 face_normal(std::uint32_t element) const noexcept = 0;

  // max over the element of normal · x. An element is below a plane if the maximum is at most the plane's
  // offset.
  [[nodiscard]] virtual double support(std::uint32_t element, const glm::dvec3& normal) const noexcept = 0;

  // The elements across a flat element's edges; kNoElement if there is none or more than one.
  [[nodiscard]] virtual std::array<std::uint32_t, 3> neighbours(std::uint32_t element) const noexcept = 0;

  // Unit normal interpolated from the mesh's vertex normals at a point of an element (Phong 1975; for touch:
  // Morgenbesser & Srinivasan 1996), on the side of `away`. For smooth primitives it is exact.
  [[nodiscard]] virtual glm::dvec3 shaded_normal(std::uint32_t element, const glm::dvec3& point,
                                                 const glm::dvec3& away) const noexcept = 0;

  // Whether the point is inside the solid; always false for an open sheet.
  [[nodiscard]] virtual bool inside(const glm::dvec3& point) const noexcept = 0;

  // Whether the object has an inside.
  [[nodiscard]] virtual bool solid() const noexcept = 0;

  // Element numbers are below this; not every number need be in use.
  [[nodiscard]] virtual std::size_t element_count() const noexcept = 0;

  // Body-frame bounds (unit: meter).
  [[nodiscard]] virtual glm::dvec3 lower() const noexcept = 0;
  [[nodiscard]] virtual glm::dvec3 upper() const noexcept = 0;

  [[nodiscard]] virtual std::size_t memory_bytes() const noexcept = 0;
};

}  // namespace polygon
