// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/felt_error.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "hybrid/feel/just_noticeable.h"

namespace hybrid {
SettingError felt_error(const ForceCourse& course, const ForceCourse& reference, double floor_N, double dt_s,
                        std::size_t ticks) {
  TickDifferences moving, still;
  const std::size_t count = std::min({course.size(), reference.size(), ticks});
  for (std::size_t t = 0; t < count; ++t) {
    if (!reference[t].at_rest || (!course[t].soft && !reference[t].soft)) continue;
    const bool holds =
        t > 0 && glm::distance(course[t].device_m, course[t - 1].device_m) <= kStill_m_per_s * dt_s;
    const double jnd = jnd_of(course[t].force_N, reference[t].force_N, floor_N);
    (holds ? still : moving).add(jnd, static_cast<double>(t) * dt_s);
  }
  return {moving.result(), still.result()};
}

SettingError worse(const SettingError& a, const SettingError& b) {
  return {a.moving.p99_jnd >= b.moving.p99_jnd ? a.moving : b.moving,
          a.still.p99_jnd >= b.still.p99_jnd ? a.still : b.still};
}

}  // namespace hybrid
