// SPDX-License-Identifier: GPL-3.0-or-later
// The keys of the rows of `hybrid bench`: those that identify a row, and figures by their kind.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace hybrid::bench {

enum class KeyKind : std::uint8_t {
  identity,  // of the measurement: rows are matched by it
  detail,    // identity as well, but a reader knows the row without it; may be absent
  exact,     // the same in every run of a build: a count, an error, bytes
  measured,  // differs from run to run: a time, or a figure that depends on one
  context,   // of the run, such as how often something was repeated; not compared
};

struct ReportKey {
  std::string_view name;  // "pose_us.p99" is a member of an object
  KeyKind kind = KeyKind::exact;
  // Of an exact figure: the key that says of how many ticks it is. Where that differs between runs, because
  // the time was up, the figure does too.
  std::string_view basis{};
  std::string_view measured_case{};  // of an exact figure of `soft`: the case in which it depends on time
};

// Exact figures stand in the order in which they matter to a user: wrong answers, errors, work, memory.
// Empty: no such suite.
std::span<const ReportKey> keys_of(std::string_view suite);

}  // namespace hybrid::bench
