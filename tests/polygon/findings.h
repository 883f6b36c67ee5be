// SPDX-License-Identifier: GPL-3.0-or-later
// Looking things up in what a check or a repair reported.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "polygon/mesh.h"

namespace tests {

inline const polygon::Finding* find_finding(const std::vector<polygon::Finding>& findings,
                                            const std::string& id) {
  for (const polygon::Finding& f : findings) {
    if (f.id.starts_with(id)) return &f;
  }
  return nullptr;
}

inline std::size_t count_of(const std::vector<polygon::Finding>& findings, const std::string& id) {
  const polygon::Finding* found = find_finding(findings, id);
  return found != nullptr ? found->count : 0;
}

// "M03 87, M05 25": what was reported, short enough for a table.
inline std::string in_short(const std::vector<polygon::Finding>& findings) {
  std::string text;
  for (const polygon::Finding& f : findings) {
    text += (text.empty() ? "" : ", ") + f.id.substr(0, 3) + " " + std::to_string(f.count);
  }
  return text;
}

}  // namespace tests
