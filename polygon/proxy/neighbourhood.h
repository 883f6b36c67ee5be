// SPDX-License-Identifier: GPL-3.0-or-later
// The elements of one rigid object around the proxy, each with a plane that separates it from the proxy. The
// planes are kept from tick to tick.
//
// A separating plane stays valid for as long as the element stays where it is in the body: a point that
// satisfies the plane is clear of the element, and so is every straight step between two such points. So
// planes are made once and evaluated all together, at one dot product each. Only a violated plane is made
// anew, from the proxy's present position. The surface and its hierarchy are queried only when the proxy
// leaves the neighbourhood.
#pragma once

#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/surface/rigid_surface.h"

namespace polygon {

// Constraint on the ball's centre q (body frame): normal · q >= offset (unit: meter).
struct SeparatingPlane {
  glm::dvec3 normal{0.0};
  double offset = 0.0;

  bool operator==(const SeparatingPlane&) const = default;
};

class Neighbourhood {
 public:
  static constexpr std::uint32_t kCapacity = 768;               // elements; few enough for a fast scan
  static constexpr std::uint32_t kCrowdedCapacity = 16 * 1024;  // for places where many elements meet

  // Allocates all memory that will be used, for a surface of `elements` elements.
  explicit Neighbourhood(std::size_t elements = kCapacity);

  // Finds every element that may come within `radius` of a ball's centre, for centres within `margin` of
  // `centre`. Their planes face `view`, which must be at least `radius` away from all elements (body frame).
  // False if there are more than `most` (at most kCrowdedCapacity): ask again with a smaller margin.
  bool survey(const RigidSurface& surface, const glm::dvec3& centre, double margin, double radius,
              const glm::dvec3& view, std::uint32_t most = kCapacity) noexcept;
  void forget() noexcept { margin_ = -1.0; }

  // Distance (unit: meter) that a ball's centre may move from `point` before it can touch an element that is
  // not listed; negative outside the neighbourhood.
  [[nodiscard]] double margin_left(const glm::dvec3& point) const noexcept {
    return margin_ < 0.0 ? -1.0 : margin_ - glm::length(point - centre_);
  }
  [[nodiscard]] bool known() const noexcept { return margin_ >= 0.0; }
  [[nodiscard]] const glm::dvec3& centre() const noexcept { return centre_; }
  [[nodiscard]] double margin() const noexcept { return margin_; }
  [[nodiscard]] std::uint32_t size() const noexcept { return count_; }
  [[nodiscard]] std::uint32_t element(std::uint32_t i) const noexcept { return element_[i]; }

  // A plane that the straight step from `from` to `to` violates by more than `tolerance`; `from` itself
  // violates none.
  struct Violation {
    double fraction = 0.0;  // of the step, up to the plane
    std::uint32_t index = 0;
    bool fresh = false;  // the plane was made from `from`
  };
  [[nodiscard]] std::span<Violation> violated(const glm::dvec3& from, const glm::dvec3& to,
                                              double tolerance) noexcept;
  // Fraction of the step from `from` to `to` that lies before the plane; 0 if `from` is on the plane or
  // beyond.
  static double fraction_before(const SeparatingPlane& plane, const glm::dvec3& from,
                                const glm::dvec3& to) noexcept {
    const double room = glm::dot(plane.normal, from) - plane.offset;
    const double depth = plane.offset - glm::dot(plane.normal, to);
    return room > 0.0 ? room / (room + depth) : 0.0;
  }

  [[nodiscard]] SeparatingPlane plane(std::uint32_t i) const noexcept {
    return {{x_[i], y_[i], z_[i]}, offset_[i]};
  }
  void set_plane(std::uint32_t i, const SeparatingPlane& plane) noexcept;

  // Remakes every plane that `view` violates. Call it if the proxy reached `view`, where it touches nothing,
  // other than by a step within the planes.
  void refresh_planes(const RigidSurface& surface, const glm::dvec3& view, double radius,
                      double rounding) noexcept;

 private:
  glm::dvec3 centre_{0.0};
  double margin_ = -1.0;
  std::uint32_t count_ = 0;
  // One array per component, so that a scan vectorises.
  std::vector<double> x_, y_, z_, offset_, depth_;
  std::vector<std::uint32_t> element_;
  std::vector<ElementPlane> surveyed_;
  std::vector<Violation> violations_;
};

// The plane between an element and a ball of `radius` around `view`, perpendicular to the line to the
// element's closest point. It is tight whenever the contact is real.
SeparatingPlane separating_plane(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                                 double radius) noexcept;

// The plane of the element's own face, on the side of `view`. False if the element has none, or if the ball
// violates it by more than `rounding`.
bool separating_face_plane(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                           double radius, double rounding, SeparatingPlane& plane) noexcept;

}  // namespace polygon
