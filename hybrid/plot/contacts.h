// SPDX-License-Identifier: GPL-3.0-or-later
// The contacts of a trace: when the tool touched anything, how deep, and the time between.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "hybrid/plot/axis.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Stretches with a set bit of `mask`. A contact lasts from its tick to the next tick.
Intervals contact_intervals(std::span<const TraceRow> rows, std::uint32_t mask);

// Sum of the lengths (s).
double duration(const Intervals& intervals);

// One press of the hand: the tool may lift off for a moment within it.
struct Contact {
  double from_s = 0.0, to_s = 0.0;
  double most_N = 0.0;              // largest force
  glm::dvec3 start_m{0.0};          // the device at first touch
  glm::dvec3 into{0.0, 0.0, -1.0};  // unit: against the largest force

  // How far the device went since the first touch, along `into` (m).
  [[nodiscard]] double depth_m(const glm::dvec3& device_m) const;
};

// In order of time. Force and directions are those of `rows`, stretches those of `touched` (s).
std::vector<Contact> contacts_of(std::span<const TraceRow> rows, const Intervals& touched);

// The most felt contacts, at most `most`, in order of time.
std::vector<Contact> most_felt(std::vector<Contact> contacts, std::size_t most);

// Both, in order, overlaps merged.
Intervals merged(Intervals a, const Intervals& b);

// Stretches within [from_s, to_s] without contact that a time axis need not show at full length. A little of
// the time before and after each contact is kept.
Intervals long_in_the_air(const Intervals& touched, double from_s, double to_s);

}  // namespace hybrid
