// SPDX-License-Identifier: GPL-3.0-or-later
// The rigid objects around the proxy, for a sweep (proxy_sweep.h): which objects are near, in which range
// this is known, and which element a straight way meets first. This knowledge is kept from tick to tick in
// WorldState. The map and the meshes are queried only when the proxy leaves the known range.
//
// Terms: a *survey* queries one object for all elements that the proxy may touch while it moves by at most
// the *margin*. Each element gets a plane between it and the *viewpoint*, a place of the proxy
// (polygon::Neighbourhood). Planes that bound the present step are *held*.
#pragma once

#include <cstdint>
#include <span>

#include "hybrid/world/world_state.h"

namespace hybrid {

inline constexpr double kQueryCells = 8.0;  // range of a map query beyond the ball, in the map's cells

// The objects that a sweep takes into account.
struct Scope {
  enum class Kind : std::uint8_t { all, only, all_but };
  Kind kind = Kind::all;
  std::uint32_t object = 0;
};

class ProxySurroundings {
 public:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;

  ProxySurroundings(const World& world, WorldState& state, Scope scope) noexcept
      : world_(world),
        state_(state),
        scope_(scope),
        radius_(world.contact_radius_m()),
        rounding_(world.rounding_m) {}

  // Call it if something other than the last sweep moved the proxy to `from`: the proxy may be on the wrong
  // side of kept planes.
  void renew_planes(const glm::dvec3& from) noexcept;

  // Makes `point` the viewpoint. Queries again if the known range does not cover the point, or if it ended
  // the last way. False if too many elements meet there.
  bool survey_from(const glm::dvec3& point) noexcept;
  // Makes `point`, which is known to be covered, the viewpoint.
  void set_viewpoint(const glm::dvec3& point) noexcept { point_ = point; }

  // The fraction of the straight way to q within the range that is known.
  double known_fraction(const glm::dvec3& q) noexcept;
  // Did the range of knowledge cut the last way? The next query then goes further in that direction.
  [[nodiscard]] bool range_cut_way() const noexcept { return cutting_object_ != 0 || query_cut_way_; }
  void forget_cut() noexcept {
    cutting_object_ = 0;
    query_cut_way_ = false;
  }

  // The element that the first `part` of the way to q meets first, with its plane. `object` is kNobody if
  // there is none. `held`: the proxy's active planes. An element behind one of them is no obstacle of its
  // own.
  ProxyPlane first_in_the_way(const glm::dvec3& q, double part, std::span<const ProxyPlane> held) noexcept;

  // Is the whole straight way to q known and clear?
  bool is_clear(const glm::dvec3& q, std::span<const ProxyPlane> held) noexcept {
    return known_fraction(q) == 1.0 && first_in_the_way(q, 1.0, held).object == kNobody;
  }

  // Is the object near, and in scope?
  [[nodiscard]] bool in_scope(std::uint32_t o) const noexcept {
    if (scope_.kind == Scope::Kind::only) return o == scope_.object;
    if (scope_.kind == Scope::Kind::all_but && o == scope_.object) return false;
    return (state_.look_mask & OccupancyMap::rigid_bit(o)) != 0;
  }
  [[nodiscard]] std::uint32_t surveys() const noexcept { return surveys_; }
  // Elements listed and planes renewed so far, weighted by their cost (unit: elements listed).
  [[nodiscard]] std::uint32_t work() const noexcept { return work_; }

 private:
  struct Reach {
    glm::dvec3 centre{0.0};  // body frame
    double margin = 0.0;
  };
  [[nodiscard]] Reach reach_of(const RigidState& near, const glm::dvec3& view, bool moving) const noexcept;
  [[nodiscard]] std::uint64_t near_objects() noexcept;
  bool survey(std::uint32_t o, const glm::dvec3& view, bool moving) noexcept;
  [[nodiscard]] double good_count(double margin_m) const noexcept;
  void adapt_margin(RigidState& near) const noexcept;
  void first_in_object(std::uint32_t o, const glm::dvec3& q, double part, std::span<const ProxyPlane> held,
                       ProxyPlane& first, double& soonest) noexcept;
  [[nodiscard]] bool is_covered(ProxyPlane& candidate, std::span<const ProxyPlane> held) const noexcept;

  const World& world_;
  WorldState& state_;
  const Scope scope_;
  const double radius_, rounding_;
  glm::dvec3 point_{0.0};             // the viewpoint
  glm::dvec3 direction_{0.0};         // of the last way, unit
  std::uint32_t cutting_object_ = 0;  // 1 + the object whose neighbourhood cut the last way
  bool query_cut_way_ = false;        // the range of the map's query cut it
  double query_cells_ = kQueryCells;
  std::uint32_t surveys_ = 0, work_ = 0;
};

}  // namespace hybrid
