// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/length_unit.h"

#include <array>
#include <cctype>
#include <cmath>
#include <sstream>

namespace voxel {
namespace {

struct MetricPrefix {
  const char* letter;
  const char* word;
  double factor;
};
constexpr std::array<MetricPrefix, 7> kPrefixes{{{"", "", 1.0},
                                                 {"k", "kilo", 1e3},
                                                 {"d", "deci", 1e-1},
                                                 {"c", "centi", 1e-2},
                                                 {"m", "milli", 1e-3},
                                                 {"u", "micro", 1e-6},
                                                 {"n", "nano", 1e-9}}};

struct OtherUnit {
  const char* word;
  double unit_m;
};
constexpr std::array<OtherUnit, 9> kOtherUnits{{{"in", 0.0254},
                                                {"inch", 0.0254},
                                                {"inches", 0.0254},
                                                {"ft", 0.3048},
                                                {"foot", 0.3048},
                                                {"feet", 0.3048},
                                                {"micron", 1e-6},
                                                {"microns", 1e-6},
                                                {"mcm", 1e-6}}};

// Lower case, without quotes and blanks. The micro sign and the Greek mu, in UTF-8 or Latin-1, become 'u'.
std::string plain_unit(const std::string& word) {
  std::string out;
  for (std::size_t n = 0; n < word.size(); ++n) {
    const auto c = static_cast<unsigned char>(word[n]);
    const auto after = n + 1 < word.size() ? static_cast<unsigned char>(word[n + 1]) : 0U;
    if ((c == 0xc2U && after == 0xb5U) || (c == 0xceU && after == 0xbcU)) {
      out.push_back('u');
      ++n;
    } else if (c == 0xb5U) {
      out.push_back('u');
    } else if (c != '"' && c != '\'' && std::isspace(c) == 0) {
      out.push_back(static_cast<char>(std::tolower(c)));
    }
  }
  return out;
}

}  // namespace

std::optional<double> length_unit_m(const std::string& word) {
  const std::string unit = plain_unit(word);
  for (const OtherUnit& other : kOtherUnits) {
    if (unit == other.word) return other.unit_m;
  }
  for (const MetricPrefix& prefix : kPrefixes) {
    if (unit == std::string(prefix.letter) + "m") return prefix.factor;
    for (const char* meter : {"meter", "meters", "metre", "metres"}) {
      if (unit == std::string(prefix.word) + meter) return prefix.factor;
    }
  }
  return std::nullopt;
}

std::string unit_in_words(double unit_m) {
  for (const MetricPrefix& prefix : kPrefixes) {
    if (std::abs(prefix.factor - unit_m) <= 1e-9 * unit_m) return std::string(prefix.letter) + "m";
  }
  std::ostringstream text;
  text << unit_m << " m";
  return text.str();
}

}  // namespace voxel
