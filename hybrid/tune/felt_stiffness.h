// SPDX-License-Identifier: GPL-3.0-or-later
// The stiffness that a hand feels at a contact, and the coupling's stiffness that fits it best.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "hybrid/session/force_error.h"

namespace hybrid {

// Just noticeable differences of the compliance, as shares. With the finger on the surface it is 15 %, and
// through a rigid tool more than three times as much (Bergmann Tiest & Kappers, IEEE Trans. Haptics 2(4):189,
// 2009).
inline constexpr double kStiffnessJndFinger = 0.15, kStiffnessJndTool = 0.45;
// Smallest angle between two forces that a hand notices by touch alone (Barbagli, Salisbury, Ho, Spence &
// Tan, ACM Trans. Applied Perception 3(2), 2006). With vision of the contact it is 18.4 degrees.
inline constexpr double kDirectionJnd_deg = 25.6;

// Ticks from `begin` up to, but not including, `end`.
struct TickRange {
  std::size_t begin = 0, end = 0;
};

// The first contact of the ticks with the flag CourseTick::soft whose force exceeds `floor_N`. Gaps of up to
// 20 ms belong to it. Empty if there is none.
std::optional<TickRange> first_contact(const ForceCourse& course, double floor_N, double dt_s);

// Slope of the force's size over the depth (N/m) while the tool goes deeper for the first time. It is fitted
// by least squares to the ticks of the contact that are deeper than all before. `depth_m` has an entry for
// each tick. Empty: there are fewer than ten such ticks, or their depth does not change.
std::optional<double> felt_stiffness(const ForceCourse& course, const std::vector<double>& depth_m,
                                     const TickRange& contact);

// The stiffness K for which a proxy's force is nearest to a reference. The path of the proxy on a rigid
// surface does not depend on K. So the force is proportional to K, and the least squares have a closed form.
struct StiffnessMatch {
  double stiffness_N_per_m = 0.0;
  double rms_N = 0.0, max_N = 0.0;  // of the difference that the fit leaves
  double depth_m = 0.0;             // greatest depth of the contact
  double force_N = 0.0;             // greatest force of the reference in the contact
  double from_s = 0.0, to_s = 0.0;
};
// `proxy`: forces of a proxy whose coupling has the stiffness `own_N_per_m`. Empty: it feels nothing in the
// contact, or the forces point away from each other.
std::optional<StiffnessMatch> match_stiffness(const ForceCourse& reference, const ForceCourse& proxy,
                                              double own_N_per_m, const TickRange& contact, double dt_s);

nlohmann::ordered_json to_json(const StiffnessMatch& match);

}  // namespace hybrid
