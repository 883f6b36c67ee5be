// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compose/label_names.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <string_view>

#include "hybrid/scene/table_reader.h"
#include "hybrid/scene/tissue_table.h"

namespace hybrid {
namespace {

constexpr std::size_t kMostListed = 40;  // greatest number of names in an error message

std::optional<int> whole_number(std::string_view text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string listed(const std::set<int>& labels, const LabelNames& names) {
  std::string text;
  std::size_t count = 0;
  for (const int label : labels) {
    if (count++ == kMostListed) return text + fmt::format(" and {} more", labels.size() - kMostListed);
    text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", names.at(label), label);
  }
  return text;
}

}  // namespace

std::set<int> chosen_labels(const std::vector<std::string>& words, const LabelNames& names,
                            const std::set<int>& present, const std::string& option) {
  std::set<int> chosen;
  for (const std::string& word : words) {
    const auto number = whole_number(word);
    std::set<int> known, with_voxels;
    for (const auto& [label, name] : names) {
      if (number ? label == *number : fits_pattern(name, word)) known.insert(label);
    }
    if (number && present.contains(*number)) known.insert(*number);
    for (const int label : known) {
      if (present.contains(label)) with_voxels.insert(label);
    }
    chosen.insert(with_voxels.begin(), with_voxels.end());
    if (!with_voxels.empty()) continue;
    if (!known.empty()) {
      throw ComposeError(fmt::format("{} {}: {} of this name has no voxel in this volume, which holds {}",
                                     option, word, known.size() == 1 ? "the label" : "every label",
                                     listed(present, names)));
    }
    std::vector<std::string_view> candidates;
    candidates.reserve(present.size());
    for (const int label : present) candidates.push_back(names.at(label));
    if (number || word.find_first_of("*?") != std::string::npos) {
      throw ComposeError(
          fmt::format("{} {}: no label fits; this volume holds {}", option, word, listed(present, names)));
    }
    throw ComposeError(
        fmt::format("{} {}: there is no label of this name; the nearest is \"{}\". This volume holds {}",
                    option, word, nearest_name(word, candidates), listed(present, names)));
  }
  return chosen;
}

}  // namespace hybrid
