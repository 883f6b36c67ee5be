// SPDX-License-Identifier: GPL-3.0-or-later
// What a sweep sees of the rigid objects around the proxy: which are near, how far that is known, and what
// stands in a straight way. Kept from tick to tick in WorldState; asked of the map and the meshes only where
// it ends.
#pragma once

#include <cstdint>
#include <span>

#include "hybrid/world/world_state.h"

namespace hybrid {

inline constexpr double look_cells = 8.0;  // how far beyond the ball the map is asked, in its cells

// Which objects a sweep minds.
struct Scope {
  enum class Kind : std::uint8_t { all, only, all_but };
  Kind kind = Kind::all;
  std::uint32_t object = 0;
};

class Surroundings {
 public:
  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;

  Surroundings(const World& world, WorldState& state, Scope scope) noexcept
      : world_(world),
        state_(state),
        scope_(scope),
        radius_(world.contact_radius_m()),
        rounding_(world.rounding_m) {}

  // The proxy is at `from`, by another way than the last sweep's: a plane between it and an element may have
  // it on the wrong side.
  void see_afresh(const glm::dvec3& from) noexcept;

  // From now on seen from `point`: looks where what is known does not cover it, or ended the last way. False
  // when too many elements meet there.
  bool look_from(const glm::dvec3& point) noexcept;
  // Seen from `point`, which is known to be covered.
  void stand_at(const glm::dvec3& point) noexcept { point_ = point; }

  // Of the straight way to q, the part within everything that was looked at.
  double clear_part(const glm::dvec3& q) noexcept;
  // Did the end of what is known cut the last way that was asked about? The next look goes further there.
  [[nodiscard]] bool ended() const noexcept { return ended_ != 0 || look_ended_; }
  void forget_end() noexcept {
    ended_ = 0;
    look_ended_ = false;
  }

  // The element that the first `part` of the way to q meets first, with the plane that says so; object
  // kNobody when that is clear. `held` are planes that hold the proxy anyway: what is behind one of them is
  // no obstacle of its own.
  ProxyPlane first_in_the_way(const glm::dvec3& q, double part, std::span<const ProxyPlane> held) noexcept;

  // The whole straight way to q, as far as it was looked at.
  bool is_clear(const glm::dvec3& q, std::span<const ProxyPlane> held) noexcept {
    return clear_part(q) == 1.0 && first_in_the_way(q, 1.0, held).object == kNobody;
  }

  // Is the object near, and minded?
  [[nodiscard]] bool asked(std::uint32_t o) const noexcept {
    if (scope_.kind == Scope::Kind::only) return o == scope_.object;
    if (scope_.kind == Scope::Kind::all_but && o == scope_.object) return false;
    return (state_.look_mask & OccupancyMap::rigid_bit(o)) != 0;
  }
  [[nodiscard]] std::uint32_t surveys() const noexcept { return surveys_; }

 private:
  bool survey(std::uint32_t o, const glm::dvec3& view, bool moving) noexcept;
  void adapt_margin(RigidState& near) const noexcept;
  void first_of(std::uint32_t o, const glm::dvec3& q, double part, std::span<const ProxyPlane> held,
                ProxyPlane& first, double& soonest) noexcept;
  [[nodiscard]] bool covered(ProxyPlane& candidate, std::span<const ProxyPlane> held) const noexcept;

  const World& world_;
  WorldState& state_;
  const Scope scope_;
  const double radius_, rounding_;
  glm::dvec3 point_{0.0};      // where everything is seen from
  glm::dvec3 direction_{0.0};  // of the last way asked about, unit
  std::uint32_t ended_ = 0;    // 1 + the object whose neighbourhood ended the way
  bool look_ended_ = false;    // the map's look ended it
  double look_cells_ = look_cells;
  std::uint32_t surveys_ = 0;
};

}  // namespace hybrid
