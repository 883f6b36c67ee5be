// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/felt_error.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <vector>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/session.h"

namespace hybrid {
namespace {

struct JndsOfKind {
  std::vector<double> jnd;
  double max_jnd = -1.0, max_t_s = 0.0;

  void add(double value, double t_s) {
    jnd.push_back(value);
    if (value <= max_jnd) return;
    max_jnd = value;
    max_t_s = t_s;
  }
  [[nodiscard]] FeltError result() {
    const std::uint64_t ticks = jnd.size();
    const Percentiles p = percentiles(jnd);
    return {.ticks = ticks, .p50_jnd = p.p50, .p99_jnd = p.p99, .max_jnd = p.max, .max_t_s = max_t_s};
  }
};

}  // namespace

SettingError felt_error(const ForceCourse& course, const ForceCourse& reference, double floor_N, double dt_s,
                        std::size_t ticks) {
  JndsOfKind moving, still;
  const std::size_t count = std::min({course.size(), reference.size(), ticks});
  for (std::size_t t = 0; t < count; ++t) {
    if (!course[t].soft && !reference[t].soft) continue;
    const bool holds =
        t > 0 && glm::distance(course[t].device_m, course[t - 1].device_m) <= kStill_m_per_s * dt_s;
    const double jnd = jnd_of(course[t].force_N, reference[t].force_N, floor_N);
    (holds ? still : moving).add(jnd, static_cast<double>(t) * dt_s);
  }
  return {moving.result(), still.result()};
}

}  // namespace hybrid
