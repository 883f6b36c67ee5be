// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a column's name: its quantity and its unit. Words are matched whole, so "yaw" is not y.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace device {

enum class Dimension : std::uint8_t { time, length, force, other };

struct Unit {
  Dimension dimension = Dimension::other;
  double in_si = 1.0;
};
// The unit of a text such as "ms", "msec", "µm", "inch" or "m/s" (Dimension::other). Upper case is accepted
// where it cannot mean another unit ("MM", but not "Mm"). Empty: the unit is not known.
std::optional<Unit> unit_in(std::string_view text);

// The rank of tx, ty, tz as a position. In a file with forces they are torques.
inline constexpr int kTranslationRank = 3;

enum class Quantity : std::uint8_t { other, time, position, force, strength };

struct ColumnName {
  Quantity quantity = Quantity::other;
  std::size_t axis = 0;           // of a position or a force: 0 to 2
  std::string of_what{};          // words that tell several columns of a quantity apart: "giver" in giver_fx
  int rank = 0;                   // the lowest rank is taken: "x" before "pos_x" before "tool_x"
  std::optional<double> in_si{};  // SI value of the stated unit; empty: the name states none
  std::string unknown_unit{};     // text in the place of a unit that is no known unit
};
ColumnName read_column_name(std::string_view name);

// The words of a name in lower case, joined by '_': "giver_force" for "Giver Force".
std::string joined_words(std::string_view name);

// The units that a name may state, for messages.
std::string_view known_units(Quantity quantity);

}  // namespace device
