// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/surface/primitives.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include "polygon/mesh/is_finite.h"
#include "polygon/surface/require_size.h"

namespace polygon {
namespace {

// Nearest point of the shape's surface, and whether the query point is inside.
struct SurfacePoint {
  glm::dvec3 point{0.0};
  bool inside = false;
};

struct Ball {
  double radius;
  [[nodiscard]] SurfacePoint closest(const glm::dvec3& p) const {
    const double length = glm::length(p);
    // At the centre every direction is equally near.
    const glm::dvec3 direction = length > 0.0 ? p / length : glm::dvec3(0.0, 0.0, 1.0);
    return {direction * radius, length < radius};
  }
  [[nodiscard]] glm::dvec3 extent() const { return glm::dvec3(radius); }
};

struct Box {
  glm::dvec3 half_size;
  [[nodiscard]] SurfacePoint closest(const glm::dvec3& p) const {
    const glm::dvec3 depth = half_size - glm::abs(p);
    if (!(depth.x > 0.0 && depth.y > 0.0 && depth.z > 0.0))
      return {glm::clamp(p, -half_size, half_size), false};
    int axis = 0;
    for (int i = 1; i < 3; ++i) {
      if (depth[i] < depth[axis]) axis = i;
    }
    glm::dvec3 on_face = p;
    on_face[axis] = std::copysign(half_size[axis], p[axis]);
    return {on_face, true};
  }
  [[nodiscard]] glm::dvec3 extent() const { return half_size; }
};

struct Capsule {
  double radius, half_length;
  [[nodiscard]] SurfacePoint closest(const glm::dvec3& p) const {
    const glm::dvec3 on_axis(0.0, 0.0, std::clamp(p.z, -half_length, half_length));
    const glm::dvec3 away = p - on_axis;
    const double length = glm::length(away);
    // On the axis every direction across it is equally near, at its ends too.
    const glm::dvec3 direction = length > 0.0 ? away / length : glm::dvec3(1.0, 0.0, 0.0);
    return {on_axis + direction * radius, length < radius};
  }
  [[nodiscard]] glm::dvec3 extent() const { return {radius, radius, radius + half_length}; }
};

struct Sheet {
  double half_size;
  [[nodiscard]] SurfacePoint closest(const glm::dvec3& p) const {
    return {{std::clamp(p.x, -half_size, half_size), std::clamp(p.y, -half_size, half_size), 0.0}, false};
  }
  [[nodiscard]] glm::dvec3 extent() const { return {half_size, half_size, 0.0}; }
};

template <typename Shape>
class PrimitiveSurface final : public RigidSurface {
 public:
  explicit PrimitiveSurface(const Shape& shape) : shape_(shape) {}

  [[nodiscard]] GatherResult gather(const glm::dvec3& point, double radius,
                                    std::span<NearPoint> out) const noexcept override {
    NearPoint found;
    if (!nearest(point, radius, found)) return {};
    if (out.empty()) return {0, false};
    out[0] = found;
    return {1, true};
  }

  [[nodiscard]] bool nearest(const glm::dvec3& point, double radius, NearPoint& out) const noexcept override {
    if (!is_finite(point) || !(radius >= 0.0)) return false;
    const SurfacePoint closest = shape_.closest(point);
    const double distance = closest.inside ? 0.0 : glm::length(point - closest.point);
    if (!(distance <= radius)) return false;
    out = {closest.point, distance, 0};
    return true;
  }

  // One convex element, exact from every side.
  [[nodiscard]] GatherResult survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                    std::span<ElementPlane> out) const noexcept override {
    NearPoint seen;
    if (!nearest(centre, radius, seen)) return {};
    if (out.empty()) return {0, false};
    seen = closest(0, view);
    const glm::dvec3 normal = seen.distance > 0.0 ? (view - seen.point) / seen.distance : glm::dvec3(0.0);
    out[0] = {normal, glm::dot(normal, seen.point), 0};
    return {1, true};
  }

  [[nodiscard]] NearPoint closest(std::uint32_t /*element*/,
                                  const glm::dvec3& point) const noexcept override {
    const SurfacePoint found = shape_.closest(point);
    return {found.point, found.inside ? 0.0 : glm::length(point - found.point), 0};
  }

  [[nodiscard]] glm::dvec3 face_normal(std::uint32_t /*element*/) const noexcept override {
    return glm::dvec3(0.0);
  }

  [[nodiscard]] std::array<std::uint32_t, 3> neighbours(std::uint32_t /*element*/) const noexcept override {
    return {kNoElement, kNoElement, kNoElement};
  }

  // Infinite, so that the element never counts as below a plane: no second element could take its place.
  [[nodiscard]] double support(std::uint32_t /*element*/,
                               const glm::dvec3& /*normal*/) const noexcept override {
    return std::numeric_limits<double>::infinity();
  }

  [[nodiscard]] glm::dvec3 shaded_normal(std::uint32_t /*element*/, const glm::dvec3& /*point*/,
                                         const glm::dvec3& away) const noexcept override {
    return away;  // a primitive's own normal is already smooth
  }

  [[nodiscard]] bool inside(const glm::dvec3& point) const noexcept override {
    return is_finite(point) && shape_.closest(point).inside;
  }
  [[nodiscard]] bool solid() const noexcept override { return !std::is_same_v<Shape, Sheet>; }

  [[nodiscard]] std::size_t element_count() const noexcept override { return 1; }
  [[nodiscard]] glm::dvec3 lower() const noexcept override { return -shape_.extent(); }
  [[nodiscard]] glm::dvec3 upper() const noexcept override { return shape_.extent(); }
  [[nodiscard]] std::size_t memory_bytes() const noexcept override { return sizeof(*this); }

 private:
  Shape shape_;
};

}  // namespace

std::unique_ptr<RigidSurface> make_ball_surface(double radius) {
  require_size("the ball's radius", radius);
  return std::make_unique<PrimitiveSurface<Ball>>(Ball{radius});
}

std::unique_ptr<RigidSurface> make_box_surface(const glm::dvec3& half_size) {
  require_size("the box's half size along x", half_size.x);
  require_size("the box's half size along y", half_size.y);
  require_size("the box's half size along z", half_size.z);
  return std::make_unique<PrimitiveSurface<Box>>(Box{half_size});
}

std::unique_ptr<RigidSurface> make_capsule_surface(double radius, double half_length) {
  require_size("the capsule's radius", radius);
  require_size("the capsule's half length", half_length, true);
  return std::make_unique<PrimitiveSurface<Capsule>>(Capsule{radius, half_length});
}

std::unique_ptr<RigidSurface> make_plane_surface(double half_size) {
  require_size("the plane's half size", half_size);
  return std::make_unique<PrimitiveSurface<Sheet>>(Sheet{half_size});
}

}  // namespace polygon
