// SPDX-License-Identifier: GPL-3.0-or-later
// The contacts of a trace: the times at which the tool touched anything, the depth, and the times between.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "hybrid/plot/axis.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Stretches of time in which a bit of `mask` is set. A tick counts until the next tick.
Intervals contact_intervals(std::span<const TraceRow> rows, std::uint32_t mask);

// Sum of the intervals' lengths (s).
double duration(const Intervals& intervals);

// One press or stroke of the hand. The tool may lift off for a moment within it.
struct Contact {
  double from_s = 0.0, to_s = 0.0;
  double most_N = 0.0;              // largest force
  glm::dvec3 start_m{0.0};          // position of the device at first touch
  glm::dvec3 into{0.0, 0.0, -1.0};  // unit vector opposite to the largest force
  // The device moves farther across `into` than along it. Depth then says little about the place of the tool.
  bool stroke = false;

  // Travel of the device since the first touch, along `into` (m).
  [[nodiscard]] double depth_m(const glm::dvec3& device_m) const;
};

// The contacts, in order of time. Their forces and directions come from `rows`, their times from `touched`
// (s).
std::vector<Contact> contacts_of(std::span<const TraceRow> rows, const Intervals& touched);

// The contacts with the largest forces, at most `most` of them, in order of time.
std::vector<Contact> most_felt(std::vector<Contact> contacts, std::size_t most);

// The rows of a contact. The times of all rows ascend.
std::span<const TraceRow> rows_in(std::span<const TraceRow> rows, const Contact& contact);

// The path length of the device from the first row to each row (m). A movement back and forth of less than
// the step of a device's encoder adds nothing.
std::vector<double> path_length_m(std::span<const TraceRow> rows);

// All intervals of both, in order; overlapping ones are merged.
Intervals merged(Intervals a, const Intervals& b);

// Stretches within [from_s, to_s] without contact that a time axis need not show at full length. Some time
// before and after each contact does not count.
Intervals long_in_the_air(const Intervals& touched, double from_s, double to_s);

}  // namespace hybrid
