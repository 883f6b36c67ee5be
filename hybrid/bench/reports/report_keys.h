// SPDX-License-Identifier: GPL-3.0-or-later
// The keys of the rows of `hybrid bench`: those that identify a row, and figures by their kind.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace hybrid::bench {

enum class KeyKind : std::uint8_t {
  identity,  // identifies the measurement: rows are matched by it
  detail,    // as identity, but a reader knows the row without it; may be absent
  exact,     // the same in every run of a build: a count, an error, bytes
  measured,  // differs from run to run: a time, or a figure that depends on a time
  context,   // describes the run, such as the number of repeats; not compared
};

struct ReportKey {
  std::string_view name;  // "pose_us.p99" is a member of object "pose_us"
  KeyKind kind = KeyKind::exact;
  // For an exact figure: the key of the number of ticks that it covers. If that number differs between runs,
  // because time ran out, the figure differs too.
  std::string_view basis{};
  // For an exact figure of suite soft: the case in which it depends on time.
  std::string_view measured_case{};
};

// The keys of a suite. Exact figures are in the order in which they matter to a user: wrong answers, errors,
// work, memory. Empty: there is no such suite.
std::span<const ReportKey> keys_of(std::string_view suite);

}  // namespace hybrid::bench
