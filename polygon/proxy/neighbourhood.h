// SPDX-License-Identifier: GPL-3.0-or-later
// What a proxy knows of one rigid object around it, carried from tick to tick: for each element near, a plane
// that separates the element from where the proxy was seen.
//
// A plane that has an element wholly on one side, and the proxy's ball on the other, stays a true statement
// about the element for as long as the element stays where it is in the body: a place that fulfils it is
// clear of the element, whenever and however the proxy gets there on a straight way. So planes are made once,
// kept, and asked all together (one product a plane); only one that stands in the way is made anew, from
// where the proxy is now. The surface itself, and the hierarchy in it, is asked only when the proxy leaves
// the neighbourhood.
#pragma once

#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/surface/rigid_surface.h"

namespace polygon {

// The ball's centre q (body frame) must satisfy normal · q >= offset (unit: meter).
struct SeparatingPlane {
  glm::dvec3 normal{0.0};
  double offset = 0.0;

  bool operator==(const SeparatingPlane&) const = default;
};

class Neighbourhood {
 public:
  static constexpr std::uint32_t kCapacity = 768;       // elements that are read in a row in no time
  static constexpr std::uint32_t kCrowded = 16 * 1024;  // where so many meet that no margin is small enough

  // Allocates what it ever will, for a surface of so many elements.
  explicit Neighbourhood(std::size_t elements = kCapacity);

  // Every element that may come nearer than `radius` to a centre within `margin` of `centre`, with planes
  // seen from `view` (body frame), which is at least `radius` from all of them. False when they are too many:
  // ask again with a smaller margin, or, round the pole of a fan, for a crowd.
  bool survey(const RigidSurface& surface, const glm::dvec3& centre, double margin, double radius,
              const glm::dvec3& view, bool crowded = false) noexcept;
  void forget() noexcept { margin_ = -1.0; }

  // How far from `point` a ball's centre may go before an element that is not here could touch it; negative
  // when outside.
  [[nodiscard]] double room(const glm::dvec3& point) const noexcept {
    return margin_ < 0.0 ? -1.0 : margin_ - glm::length(point - centre_);
  }
  [[nodiscard]] bool known() const noexcept { return margin_ >= 0.0; }
  [[nodiscard]] const glm::dvec3& centre() const noexcept { return centre_; }
  [[nodiscard]] double margin() const noexcept { return margin_; }
  [[nodiscard]] std::uint32_t size() const noexcept { return count_; }
  [[nodiscard]] std::uint32_t element(std::uint32_t i) const noexcept { return element_[i]; }

  // What a straight way from `from`, which breaks no plane, to `to` would break by more than `tolerance`.
  struct Broken {
    double part = 0.0;  // of the way, up to the plane
    std::uint32_t index = 0;
    bool fresh = false;  // the plane was made from `from`
  };
  [[nodiscard]] std::span<Broken> broken(const glm::dvec3& from, const glm::dvec3& to,
                                         double tolerance) noexcept;
  // Of the way from `from` to `to`, the part before a plane; 0 when `from` lies on it or beyond.
  static double part_before(const SeparatingPlane& plane, const glm::dvec3& from,
                            const glm::dvec3& to) noexcept {
    const double room = glm::dot(plane.normal, from) - plane.offset;
    const double depth = plane.offset - glm::dot(plane.normal, to);
    return room > 0.0 ? room / (room + depth) : 0.0;
  }

  [[nodiscard]] SeparatingPlane plane(std::uint32_t i) const noexcept {
    return {{x_[i], y_[i], z_[i]}, offset_[i]};
  }
  void set_plane(std::uint32_t i, const SeparatingPlane& plane) noexcept;

  // Makes anew, from `view`, which touches nothing, all planes that say otherwise: when the proxy did not
  // come here by a way that they allowed.
  void see_from(const RigidSurface& surface, const glm::dvec3& view, double radius, double rounding) noexcept;

 private:
  glm::dvec3 centre_{0.0};
  double margin_ = -1.0;
  std::uint32_t count_ = 0;
  // One array a component: a scan reads them in a row.
  std::vector<double> x_, y_, z_, offset_, depth_;
  std::vector<std::uint32_t> element_;
  std::vector<SeenElement> seen_;
  std::vector<Broken> broken_;
};

// A plane between an element and a ball of `radius` around `view`, across the way to the element's closest
// point: tight whenever the contact is real.
SeparatingPlane separate(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                         double radius) noexcept;

// The element's own plane, on the side of `view`; false when it has none, or the ball is not clear of it.
bool separate_flatly(const RigidSurface& surface, std::uint32_t element, const glm::dvec3& view,
                     double radius, double rounding, SeparatingPlane& plane) noexcept;

}  // namespace polygon
