// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/search_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/common.hpp>

namespace hybrid {
namespace {

constexpr double kSideways = 0.5;        // radii of the tool by which a motion is moved
constexpr double kStaysInContact = 0.5;  // share of the contact that a moved motion must keep

}  // namespace

std::size_t felt_ticks(const ForceCourse& course) {
  return static_cast<std::size_t>(std::ranges::count_if(course, &CourseTick::soft));
}

std::uint64_t part_of(const ForceCourse& course, double share) {
  const double most = share * static_cast<double>(felt_ticks(course));
  std::size_t seen = 0;
  std::uint64_t ticks = 1;
  for (std::size_t t = 0; t < course.size(); ++t) {
    seen += course[t].soft ? 1 : 0;
    if (static_cast<double>(seen) <= most) ticks = t + 1;
  }
  return ticks;
}

SearchMotion moved_motion(const SearchMotion& own, const Scene& scene, double side, double speed) {
  glm::dvec3 force(0.0);
  for (const CourseTick& tick : own.truth) {
    if (tick.soft) force += tick.force_N;
  }
  force = glm::abs(force);
  glm::dvec3 axis(0.0);
  axis[force.x <= std::min(force.y, force.z) ? 0 : force.y <= force.z ? 1 : 2] = 1.0;
  const glm::dvec3 offset_m = side * kSideways * scene.tool.radius_m * axis + glm::dvec3(0.0);  // no -0
  const std::string faster = speed == 1.0 ? "" : fmt::format("{} times faster, ", speed);
  return {.motion = other_motion(own.motion, scene.rate_hz, speed, offset_m),
          .words = fmt::format("the path {}moved by ({:.3g}, {:.3g}, {:.3g}) mm", faster, 1e3 * offset_m.x,
                               1e3 * offset_m.y, 1e3 * offset_m.z),
          .truth = {}};
}

bool stays_in_contact(const SearchMotion& moved, const SearchMotion& own, double speed) {
  return static_cast<double>(felt_ticks(moved.truth)) * speed >=
         kStaysInContact * static_cast<double>(felt_ticks(own.truth));
}

}  // namespace hybrid
