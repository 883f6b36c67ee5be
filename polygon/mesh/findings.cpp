// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/mesh/findings.h"

#include <glm/common.hpp>
#include <sstream>

namespace polygon {

std::string point_in_words(const glm::dvec3& p) {
  std::ostringstream text;
  text.precision(7);
  text << '(' << p.x + 0.0 << ", " << p.y + 0.0 << ", " << p.z + 0.0 << ") m";  // + 0.0 avoids "-0"
  return text.str();
}

void FindingTally::add(const glm::dvec3& where, std::optional<std::uint32_t> triangle) {
  if (count++ == 0) {
    place = {.first_m = where, .lower_m = where, .upper_m = where, .triangle = triangle};
  } else {
    place.lower_m = glm::min(place.lower_m, where);
    place.upper_m = glm::max(place.upper_m, where);
  }
}

void add_finding(std::vector<Finding>& findings, const char* id, Severity severity, const FindingTally& found,
                 const std::string& text) {
  if (found.count == 0) return;
  const FindingPlace& place = found.place;
  std::string where = found.count == 1 ? " (at " : " (first: ";
  if (place.triangle) where += "triangle " + std::to_string(*place.triangle) + ", ";
  where += point_in_words(place.first_m);
  if (found.count > 1 && place.lower_m != place.upper_m) {
    where += "; all: " + point_in_words(place.lower_m) + " to " + point_in_words(place.upper_m);
  }
  findings.push_back({id, severity, found.count, text + where + ")", place});
}

}  // namespace polygon
