// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/felt_stiffness.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

constexpr double kGap_s = 0.02;           // a shorter loss of contact does not end the contact for a hand
constexpr std::size_t kFewestTicks = 10;  // least number of ticks for a slope

}  // namespace

std::optional<TickRange> first_contact(const ForceCourse& course, double floor_N, double dt_s) {
  const auto gap = static_cast<std::size_t>(std::lround(kGap_s / dt_s));
  std::optional<TickRange> contact;
  bool felt = false;
  for (std::size_t t = 0; t < course.size(); ++t) {
    if (!course[t].soft) continue;
    if (contact && t >= contact->end + gap) {
      if (felt) return contact;
      contact.reset();
    }
    if (!contact) contact = TickRange{t, t};
    contact->end = t + 1;
    felt = felt || glm::length(course[t].force_N) > floor_N;
  }
  if (!felt) contact.reset();
  return contact;
}

std::optional<double> felt_stiffness(const ForceCourse& course, const std::vector<double>& depth_m,
                                     const TickRange& contact) {
  double n = 0.0, d = 0.0, f = 0.0, dd = 0.0, df = 0.0, deepest_m = 0.0;
  for (std::size_t t = contact.begin; t < std::min({contact.end, course.size(), depth_m.size()}); ++t) {
    if (!(depth_m[t] > deepest_m)) continue;
    deepest_m = depth_m[t];
    const double force_N = glm::length(course[t].force_N);
    n += 1.0;
    d += depth_m[t];
    f += force_N;
    dd += depth_m[t] * depth_m[t];
    df += depth_m[t] * force_N;
  }
  const double spread = n * dd - d * d;
  if (n < static_cast<double>(kFewestTicks) || !(spread > 0.0)) return {};
  return (n * df - d * f) / spread;
}

std::optional<StiffnessMatch> match_stiffness(const ForceCourse& reference, const ForceCourse& proxy,
                                              double own_N_per_m, const TickRange& contact, double dt_s) {
  const std::size_t end = std::min({contact.end, reference.size(), proxy.size()});
  double along = 0.0, square = 0.0;
  for (std::size_t t = contact.begin; t < end; ++t) {
    along += glm::dot(reference[t].force_N, proxy[t].force_N);
    square += glm::dot(proxy[t].force_N, proxy[t].force_N);
  }
  if (!(along > 0.0) || !(square > 0.0)) return {};
  const double factor = along / square;
  StiffnessMatch match{.stiffness_N_per_m = factor * own_N_per_m,
                       .from_s = static_cast<double>(contact.begin) * dt_s,
                       .to_s = static_cast<double>(end) * dt_s};
  double left = 0.0;
  for (std::size_t t = contact.begin; t < end; ++t) {
    const double off_N = glm::length(reference[t].force_N - factor * proxy[t].force_N);
    left += off_N * off_N;
    match.max_N = std::max(match.max_N, off_N);
    match.depth_m = std::max(match.depth_m, glm::length(proxy[t].force_N) / own_N_per_m);
    match.force_N = std::max(match.force_N, glm::length(reference[t].force_N));
  }
  match.rms_N = std::sqrt(left / static_cast<double>(end - contact.begin));
  return match;
}

nlohmann::ordered_json to_json(const StiffnessMatch& match) {
  return {{"stiffness_N_per_m", match.stiffness_N_per_m},
          {"rms_N", match.rms_N},
          {"max_N", match.max_N},
          {"depth_m", match.depth_m},
          {"force_N", match.force_N},
          {"from_s", match.from_s},
          {"to_s", match.to_s}};
}

}  // namespace hybrid
