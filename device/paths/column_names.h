// SPDX-License-Identifier: GPL-3.0-or-later
// What a column's name says: its quantity and its unit. Words are matched whole: yaw is no y.
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
// The unit of a text such as "ms", "msec", "µm", "inch" or "m/s" (the last of another dimension). Upper case
// is taken where it cannot mean another unit ("MM", not "Mm"). Empty: not known.
std::optional<Unit> unit_in(std::string_view text);

// The rank of tx, ty, tz as a position: torques, where the file has forces.
inline constexpr int kTranslationRank = 3;

enum class Quantity : std::uint8_t { other, time, position, force, strength };

struct ColumnName {
  Quantity quantity = Quantity::other;
  std::size_t axis = 0;   // of a position and a force: 0 to 2
  std::string of_what{};  // words that tell apart several of a quantity: "giver" of giver_fx
  int rank = 0;           // of several, the lowest is taken: "x" before "pos_x" before "tool_x"
  std::optional<double> in_si{};
  std::string unknown_unit{};  // the name states it, and it is no known unit of the quantity
};
ColumnName read_column_name(std::string_view name);

// The words of a name in lower case, parted by '_': "Giver Force" as "giver_force".
std::string joined_words(std::string_view name);

// The units that a name may state, for messages.
std::string_view known_units(Quantity quantity);

}  // namespace device
