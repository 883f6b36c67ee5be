// SPDX-License-Identifier: GPL-3.0-or-later
// What a rigid object tells the proxy about itself near a point: half-spaces that are safe to move in.
//
// For the closest point c of a *convex* element (a triangle, a ball, a box) to the ball's centre p, the
// half-space {q : n·(q − c) ≥ r}, n = (p − c)/|p − c|, contains no point nearer to the element than r: a
// straight step inside the intersection of such half-spaces never touches any element that was gathered. An
// element that was not gathered is further than the gather radius, so a step shorter than
// (gather radius − r) cannot reach it either. That is why the sweep cannot tunnel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

namespace polygon {

// Closest point of one convex element of an object, seen from a query point, both in the body frame.
struct NearPoint {
  glm::dvec3 point{0.0};      // (unit: meter)
  double distance = 0.0;      // from the query point, >= 0 (unit: meter)
  std::uint32_t element = 0;  // triangle index; 0 for a primitive
};

// The better of two nearest points, so that which is found first does not matter.
[[nodiscard]] inline bool nearer(const NearPoint& a, const NearPoint& b) {
  return a.distance < b.distance || (a.distance == b.distance && a.element < b.element);
}

// An element as seen from a point: it lies wholly behind a plane across some way to the point, not always the
// shortest.
struct SeenElement {
  glm::dvec3 normal{0.0};  // unit, towards the point; zero when the point lies on the element
  double reach = 0.0;      // max over the element of normal · x (unit: meter)
  std::uint32_t element = 0;
};

struct GatherResult {
  std::uint32_t count = 0;  // entries written to the output, sorted by element
  bool complete = true;     // false: the output was too small; ask again with a smaller radius
};

inline constexpr std::uint32_t kNoElement = 0xffffffffU;

// An object that can be asked which of its elements lie within a radius. Queries are const, take no
// lock, allocate nothing and never throw.
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

  // What lies around a place: every element that comes within `radius` of `centre`, and perhaps others nearly
  // so near, by geometry alone and not by how they are found, each as seen from `view`. In no order.
  // complete = false: the output was too small, and is worthless.
  [[nodiscard]] virtual GatherResult survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                            std::span<SeenElement> out) const noexcept = 0;

  // The closest point of one element.
  [[nodiscard]] virtual NearPoint closest(std::uint32_t element, const glm::dvec3& point) const noexcept = 0;

  // Unit normal of a flat element; zero where there is none to be had.
  [[nodiscard]] virtual glm::dvec3 face_normal(std::uint32_t element) const noexcept = 0;

  // max over the element of normal · x: an element is below a plane when this is at most the plane's offset.
  [[nodiscard]] virtual double support(std::uint32_t element, const glm::dvec3& normal) const noexcept = 0;

  // The elements on the other side of a flat element's edges; kNoElement where there is none, or several.
  [[nodiscard]] virtual std::array<std::uint32_t, 3> neighbours(std::uint32_t element) const noexcept = 0;

  // Unit normal interpolated over the mesh's vertex normals at a point of an element (Phong 1975; for touch:
  // Morgenbesser & Srinivasan 1996), on the side where `away` points; exact for smooth primitives.
  [[nodiscard]] virtual glm::dvec3 shaded_normal(std::uint32_t element, const glm::dvec3& point,
                                                 const glm::dvec3& away) const noexcept = 0;

  // Is the point inside the solid? Always false for an open sheet.
  [[nodiscard]] virtual bool inside(const glm::dvec3& point) const noexcept = 0;

  // Has it an inside?
  [[nodiscard]] virtual bool solid() const noexcept = 0;

  // Elements are numbered below this; not every number need be in use.
  [[nodiscard]] virtual std::size_t element_count() const noexcept = 0;

  // Body-frame bounds (unit: meter).
  [[nodiscard]] virtual glm::dvec3 lower() const noexcept = 0;
  [[nodiscard]] virtual glm::dvec3 upper() const noexcept = 0;

  [[nodiscard]] virtual std::size_t memory_bytes() const noexcept = 0;
};

}  // namespace polygon
