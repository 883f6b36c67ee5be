// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compose/label_names.h"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string_view>

#include "hybrid/compose/tissue_table.h"
#include "hybrid/scene/table_reader.h"

namespace hybrid {
namespace {

constexpr std::size_t kMostBytes = 1U << 20;  // of a file of 255 names
constexpr std::size_t kMostListed = 40;       // names in a refusal

std::optional<int> whole_number(std::string_view text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '"'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string read_all(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) {
    throw ComposeError(fmt::format(
        "{}: there is no such file; give the table of label names (CSV: number, name)", file.string()));
  }
  if (std::filesystem::file_size(file, error) > kMostBytes) {
    throw ComposeError(fmt::format(
        "{}: more than 1 MB, which is no table of 255 names; give one with number, name in each row",
        file.string()));
  }
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw ComposeError(fmt::format("{}: cannot be read; look at its permissions", file.string()));
  return text.str();
}

void add_name(LabelNames& names, int label, std::string_view name, const std::string& where) {
  if (label == 0) return;  // empty space
  if (label < 0 || label > 255) {
    throw ComposeError(fmt::format("{}: label {} is not within 1 to 255; renumber the labels", where, label));
  }
  const auto [at, fresh] = names.try_emplace(label, name);
  if (!fresh && at->second != name) {
    throw ComposeError(fmt::format("{}: label {} is called \"{}\" and \"{}\"; keep one of the rows", where,
                                   label, at->second, name));
  }
}

LabelNames from_json(const std::filesystem::path& file, const std::string& text) {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  const std::string remedy =
      "give {\"labels\": [\"empty\", \"first\", …]} or {\"1\": \"first\", …}, or a CSV with number, name in "
      "a row";
  if (json.is_discarded()) throw ComposeError(fmt::format("{}: is no JSON; {}", file.string(), remedy));
  const auto& table = json.is_object() && json.contains("labels") ? json["labels"] : json;
  LabelNames names;
  if (table.is_array()) {
    for (std::size_t n = 0; n < table.size() && n < 256; ++n) {
      if (table[n].is_string() && !table[n].get_ref<const std::string&>().empty())
        add_name(names, static_cast<int>(n), table[n].get_ref<const std::string&>(), file.string());
    }
  } else if (table.is_object()) {
    for (const auto& [key, value] : table.items()) {
      const auto label = whole_number(key);
      if (label && value.is_string())
        add_name(names, *label, value.get_ref<const std::string&>(), file.string());
    }
  }
  if (names.empty()) throw ComposeError(fmt::format("{}: names no label; {}", file.string(), remedy));
  return names;
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

LabelNames read_label_names(const std::filesystem::path& file) {
  const std::string text = read_all(file);
  if (file.extension() == ".json") return from_json(file, text);
  LabelNames names;
  std::size_t row = 0;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    ++row;
    const std::string_view content = trimmed(line);
    if (content.empty() || content.front() == '#') continue;
    const std::size_t end = content.find_first_of(",;\t ");
    const auto label = whole_number(trimmed(content.substr(0, end)));
    if (!label && row == 1) continue;  // the heading
    std::string_view name = end == std::string_view::npos ? std::string_view{} : content.substr(end + 1);
    name = trimmed(name.substr(0, name.find_first_of(",;\t")));
    if (!label || name.empty()) {
      throw ComposeError(
          fmt::format("{}:{}: a row must begin with a whole number and a name, as in 5,liver; correct it",
                      file.string(), row));
    }
    add_name(names, *label, name, fmt::format("{}:{}", file.string(), row));
  }
  if (names.empty()) {
    throw ComposeError(fmt::format("{}: names no label; write a number and a name in each row, as in 5,liver",
                                   file.string()));
  }
  return names;
}

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
