// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/table_reader.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <system_error>
#include <utility>

#include "hybrid/scene/ranges.h"

namespace hybrid {
namespace {

// Far beyond any scene. The product of three such lengths stays within the range of a double.
constexpr double largest_length_m = 1e9;

constexpr std::string_view unit_names[] = {"m", "cm", "mm", "um"};
constexpr double unit_values_m[] = {1.0, 1e-2, 1e-3, 1e-6};

bool is_number(const TreeNode& node) {
  return node.kind == TreeNode::Kind::integer || node.kind == TreeNode::Kind::real;
}

bool contains(std::span<const std::string_view> names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool found_at(const SceneSource& source, SourcePlace place) {
  return source.errors != nullptr &&
         std::any_of(source.errors->begin(), source.errors->end(), [place](const ReaderError& error) {
           return error.place.line == place.line && error.place.column == place.column;
         });
}

}  // namespace

void SceneSource::refuse(SourcePlace place, const std::string& what, const std::string& remedy) const {
  throw ReaderError(file, place, words(what, "; ", remedy));
}

void SceneSource::keep(const ReaderError& error) const {
  constexpr std::size_t kMost = 100;  // a file with more errors is no scene at all
  if (errors == nullptr || errors->size() >= kMost) throw error;
  errors->push_back(error);
}

Quantity SceneSource::length() const {
  return {words("a length in ", unit_name), "10", unit_m, -largest_length_m, largest_length_m};
}
Quantity SceneSource::size() const {
  return {words("a length above 0 in ", unit_name), "5", unit_m, kSmallestSize_m, largest_length_m};
}
Quantity SceneSource::distance() const {
  return {words("a length of 0 or more in ", unit_name), "2", unit_m, 0.0, largest_length_m};
}
Quantity SceneSource::speed() const {
  return {words("a speed above 0 in ", unit_name, "/s"), in_words(0.05 / unit_m), unit_m, 1e-9,
          largest_length_m};
}

const std::map<std::string, double>& length_units() {
  static const std::map<std::string, double> units = [] {
    std::map<std::string, double> all;
    for (std::size_t n = 0; n < std::size(unit_names); ++n) all.emplace(unit_names[n], unit_values_m[n]);
    return all;
  }();
  return units;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  a = a.substr(0, 64);
  b = b.substr(0, 64);
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same ? 0U : 1U)});
      const bool swapped =
          i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = last;
    last = row;
  }
  return last[b.size()];
}

std::string_view nearest_name(std::string_view name, std::span<const std::string_view> candidates) {
  std::string_view nearest;
  std::size_t least = 0;
  for (const std::string_view candidate : candidates) {
    const std::size_t distance = edit_distance(name, candidate);
    if (nearest.empty() || distance < least) {
      nearest = candidate;
      least = distance;
    }
  }
  return nearest;
}

std::string joined(std::span<const std::string_view> names) {
  std::string out;
  for (const std::string_view name : names) {
    if (!out.empty()) out += ", ";
    out += name;
  }
  return out;
}

TableReader::TableReader(const SceneSource& source, const TreeNode& table, SourcePlace place,
                         std::string what)
    : source_(source), table_(table), place_(place), what_(std::move(what)) {
  if (table.kind != TreeNode::Kind::table) {
    source_.refuse(place, words(what_, " must be a table, and is ", kind_in_words(table.kind)),
                   "write its keys in a table of their own, e.g. { key = value }");
  }
}

void TableReader::allow(std::span<const std::string_view> keys, std::span<const UnsupportedKey> later,
                        std::span<const std::string_view> elsewhere, std::string_view condition) const {
  for (const TreeEntry& entry : table_.entries) {
    if (contains(keys, entry.key)) continue;
    try {
      refuse_key(entry, keys, later, elsewhere, condition);
    } catch (const ReaderError& error) {
      has_unknown_ = true;
      if (!found_at(source_, error.place)) source_.keep(error);  // allow() may be called twice for a table
    }
  }
}

void TableReader::refuse_key(const TreeEntry& entry, std::span<const std::string_view> keys,
                             std::span<const UnsupportedKey> later,
                             std::span<const std::string_view> elsewhere, std::string_view condition) const {
  const auto is_later = [&entry](const UnsupportedKey& key) { return key.name == entry.key; };
  if (const auto found = std::find_if(later.begin(), later.end(), is_later); found != later.end()) {
    source_.refuse(entry.place, words(in_quotes(entry.key), " in ", what_, " is not supported yet"),
                   std::string(found->meanwhile));
  }
  if (contains(elsewhere, entry.key)) {
    source_.refuse(entry.place,
                   words(in_quotes(entry.key), " in ", what_, " has no meaning with ", condition),
                   words("remove it, or correct ", condition, " (keys here: ", joined(keys), ")"));
  }
  if (keys.empty())
    source_.refuse(entry.place, words("unknown key ", in_quotes(entry.key), " in ", what_), "remove it");
  source_.refuse(entry.place, words("unknown key ", in_quotes(entry.key), " in ", what_),
                 words("did you mean '", nearest_name(entry.key, keys), "'? Known here: ", joined(keys)));
}

const TreeEntry* TableReader::find(std::string_view key) const {
  const auto has_key = [key](const TreeEntry& entry) { return entry.key == key; };
  const auto found = std::find_if(table_.entries.begin(), table_.entries.end(), has_key);
  return found == table_.entries.end() ? nullptr : &*found;
}

const TreeEntry& TableReader::require(std::string_view key, std::string_view example) const {
  const TreeEntry* entry = find(key);
  if (entry == nullptr) {
    source_.refuse(place_, words("the key ", in_quotes(key), " is missing in ", what_),
                   words("add ", key, " = ", example));
  }
  return *entry;
}

SourcePlace TableReader::place_of(std::string_view key) const {
  const TreeEntry* entry = find(key);
  return entry == nullptr ? place_ : entry->place;
}

void TableReader::refuse(std::string_view key, const std::string& what, const std::string& remedy) const {
  source_.refuse(place_of(key), what, remedy);
}

void TableReader::wrong_type(SourcePlace place, const std::string& name, TreeNode::Kind found,
                             std::string_view wanted, const std::string& example) const {
  source_.refuse(place, words(name, " in ", what_, " must be ", wanted, ", and is ", kind_in_words(found)),
                 words("write e.g. ", example));
}

double TableReader::number_at(const TreeNode& node, SourcePlace place, const std::string& name,
                              const Quantity& quantity) const {
  if (!is_number(node)) wrong_type(place, name, node.kind, quantity.what, quantity.example);
  const double value = node.number * quantity.scale;
  // Written so that NaN is refused too.
  if (!(value >= quantity.lower && value <= quantity.upper)) {
    const std::string bounds = words(" (", in_words(quantity.lower / quantity.scale), " to ",
                                     in_words(quantity.upper / quantity.scale), ")");
    source_.refuse(place, words(name, " in ", what_, " is ", in_words(node.number)),
                   words("it must be ", quantity.what, bounds, ", e.g. ", quantity.example));
  }
  return value;
}

double TableReader::number(std::string_view key, const Quantity& quantity,
                           std::optional<double> fallback) const {
  if (fallback && !has(key)) return *fallback;
  return value_or(key, fallback.value_or(quantity.lower), [&] {
    const TreeEntry& entry = require(key, quantity.example);
    return number_at(entry.value, entry.place, in_quotes(key), quantity);
  });
}

glm::dvec3 TableReader::vector_at(const TreeEntry& entry, const Quantity& quantity) const {
  const std::string& e = quantity.example;
  const std::string example = words(entry.key, " = [", e, ", ", e, ", ", e, "]");
  if (entry.value.kind != TreeNode::Kind::array) {
    wrong_type(entry.place, in_quotes(entry.key), entry.value.kind, "a list of three numbers", example);
  }
  const std::vector<TreeNode>& items = entry.value.items;
  if (items.size() != 3) {
    source_.refuse(entry.place, words(in_quotes(entry.key), " in ", what_, " has ", items.size(), " numbers"),
                   words("give three, one an axis: ", example));
  }
  glm::dvec3 out{0.0};
  for (glm::length_t axis = 0; axis < 3; ++axis) {
    const TreeNode& item = items[static_cast<std::size_t>(axis)];
    const std::string name = words(in_quotes(entry.key), " (", std::string(1, "xyz"[axis]), ")");
    out[axis] = number_at(item, item.place, name, quantity);
  }
  return out;
}

glm::dvec3 TableReader::vector(std::string_view key, const Quantity& quantity,
                               std::optional<glm::dvec3> fallback) const {
  if (fallback && !has(key)) return *fallback;
  const std::string& e = quantity.example;
  return value_or(key, fallback.value_or(glm::dvec3(quantity.lower)),
                  [&] { return vector_at(require(key, words("[", e, ", ", e, ", ", e, "]")), quantity); });
}

glm::dvec3 TableReader::number_or_vector(std::string_view key, const Quantity& quantity,
                                         std::optional<glm::dvec3> fallback) const {
  if (fallback && !has(key)) return *fallback;
  return value_or(key, fallback.value_or(glm::dvec3(quantity.lower)), [&] {
    const TreeEntry& entry = require(key, quantity.example);
    if (entry.value.kind == TreeNode::Kind::array) return vector_at(entry, quantity);
    return glm::dvec3(number_at(entry.value, entry.place, in_quotes(key), quantity));
  });
}

std::int64_t TableReader::integer(std::string_view key, std::int64_t lower, std::int64_t upper,
                                  std::optional<std::int64_t> fallback) const {
  if (fallback && !has(key)) return *fallback;
  const std::string example = std::to_string(fallback.value_or(std::max<std::int64_t>(lower, 1)));
  return value_or(key, fallback.value_or(lower), [&] {
    const TreeEntry& entry = require(key, example);
    if (entry.value.kind != TreeNode::Kind::integer) {
      wrong_type(entry.place, in_quotes(key), entry.value.kind, "a whole number", words(key, " = ", example));
    }
    if (entry.value.integer < lower || entry.value.integer > upper) {
      source_.refuse(entry.place, words(in_quotes(key), " in ", what_, " is ", entry.value.integer),
                     words("it must be a whole number from ", lower, " to ", upper));
    }
    return entry.value.integer;
  });
}

bool TableReader::boolean(std::string_view key, bool fallback) const {
  const TreeEntry* entry = find(key);
  if (entry == nullptr) return fallback;
  return value_or(key, fallback, [&] {
    if (entry->value.kind != TreeNode::Kind::boolean) {
      wrong_type(entry->place, in_quotes(key), entry->value.kind, "true or false", words(key, " = true"));
    }
    return entry->value.boolean;
  });
}

std::string TableReader::text(std::string_view key, std::string_view example) const {
  return value_or(key, std::string(example), [&] { return text_or_refuse(key, example); });
}

std::string TableReader::text_or_refuse(std::string_view key, std::string_view example) const {
  std::string shown = "\"";
  shown.append(example).append("\"");
  const TreeEntry& entry = require(key, shown);
  if (entry.value.kind != TreeNode::Kind::string) {
    wrong_type(entry.place, in_quotes(key), entry.value.kind, "text in quotes", words(key, " = ", shown));
  }
  if (entry.value.text.find('\0') != std::string::npos) {
    source_.refuse(entry.place, words(in_quotes(key), " in ", what_, " holds a zero character"), "remove it");
  }
  return entry.value.text;
}

std::size_t TableReader::choice(std::string_view key, std::span<const std::string_view> options,
                                std::optional<std::size_t> fallback,
                                std::span<const UnsupportedKey> later) const {
  if (fallback && !has(key)) return *fallback;
  const std::string value = text_or_refuse(key, options.front());
  const auto found = std::find(options.begin(), options.end(), value);
  if (found != options.end()) return static_cast<std::size_t>(found - options.begin());
  const std::string said = words(key, " = \"", printable(value, 60), "\" in ", what_);
  for (const UnsupportedKey& option : later) {
    if (option.name == value)
      refuse(key, words(said, " is not supported yet"), std::string(option.meanwhile));
  }
  const std::string_view nearest = nearest_name(value, options);
  const bool alike = 2 * edit_distance(value, nearest) <= std::max(value.size(), nearest.size());
  refuse(key, words(said, " is unknown"),
         alike ? words("did you mean \"", nearest, "\"? Known here: ", joined(options))
               : words("use one of: ", joined(options)));
}

double TableReader::unit(std::string_view key, double fallback_m) const {
  if (!has(key)) return fallback_m;
  return value_or(key, fallback_m, [&] { return unit_values_m[choice(key, unit_names)]; });
}

std::filesystem::path TableReader::file(std::string_view key, bool may_be_folder) const {
  return value_or(key, std::filesystem::path(), [&] { return file_or_refuse(key, may_be_folder); });
}

std::filesystem::path TableReader::file_or_refuse(std::string_view key, bool may_be_folder) const {
  const std::string value = text_or_refuse(key, may_be_folder ? "head.nii.gz" : "bone.ply");
  if (value.empty()) refuse(key, words(in_quotes(key), " in ", what_, " is empty"), "name a file there");
  std::filesystem::path path = value;
  if (path.is_relative()) path = source_.file.parent_path() / path;
  std::error_code failed;
  const auto status = std::filesystem::status(path, failed);
  std::string name = "'";
  name.append(printable(path.string(), 300)).append("'");
  if (!std::filesystem::exists(status)) {
    const bool unreadable = failed && failed != std::errc::no_such_file_or_directory;
    refuse(key,
           words(in_quotes(key), " in ", what_, " names ", name, ", which ",
                 (unreadable ? words("cannot be reached (", failed.message(), ")") : "does not exist")),
           "correct it; a path is relative to the folder of the scene file");
  }
  if (!may_be_folder && std::filesystem::is_directory(status)) {
    refuse(key, words(in_quotes(key), " in ", what_, " names the folder ", name), "name a file in it");
  }
  const bool usable = std::filesystem::is_regular_file(status) || std::filesystem::is_directory(status);
  if (!usable) refuse(key, words(name, " is not an ordinary file"), "name an ordinary file");
  return path;
}

const TreeNode& TableReader::list(std::string_view key, std::string_view example) const {
  const TreeEntry& entry = require(key, example);
  const std::string shown = words(key, " = ", example);
  if (entry.value.kind != TreeNode::Kind::array) {
    wrong_type(entry.place, in_quotes(key), entry.value.kind, "a list", shown);
  }
  if (entry.value.items.empty()) {
    source_.refuse(entry.place, words(in_quotes(key), " in ", what_, " is an empty list"),
                   words("write e.g. ", shown, ", or remove the key"));
  }
  return entry.value;
}

TableReader TableReader::table(std::string_view key) const {
  const TreeEntry& entry = require(key, "{ ... }");
  if (entry.value.kind != TreeNode::Kind::table) {
    wrong_type(entry.place, in_quotes(key), entry.value.kind, "a table", words(key, " = { key = value }"));
  }
  return {source_, entry.value, entry.place, words(in_quotes(key), " of ", what_)};
}

std::vector<TableReader> TableReader::tables(std::string_view key, std::string_view example) const {
  std::vector<TableReader> out;
  std::size_t index = 0;
  for (const TreeNode& item : list(key, example).items) {
    const std::string name = words(in_quotes(key), " (entry ", ++index, ")");
    if (item.kind != TreeNode::Kind::table) {
      wrong_type(item.place, name, item.kind, "a table", words(key, " = ", example));
    }
    out.emplace_back(source_, item, item.place, words(name, " of ", what_));
  }
  return out;
}

std::vector<std::int64_t> TableReader::integers(std::string_view key, std::int64_t lower, std::int64_t upper,
                                                std::string_view example) const {
  std::vector<std::int64_t> out;
  for (const TreeNode& item : list(key, example).items) {
    if (item.kind != TreeNode::Kind::integer) {
      wrong_type(item.place, words("an entry of ", in_quotes(key)), item.kind, "a whole number",
                 words(key, " = ", example));
    }
    if (item.integer < lower || item.integer > upper) {
      source_.refuse(item.place, words("an entry of ", in_quotes(key), " in ", what_, " is ", item.integer),
                     words("it must be from ", lower, " to ", upper));
    }
    out.push_back(item.integer);
  }
  return out;
}

std::pair<double, double> TableReader::range(std::string_view key) const {
  const TreeNode& bounds = list(key, "[100, 2000]");
  if (bounds.items.size() != 2) {
    refuse(key, words(in_quotes(key), " in ", what_, " has ", bounds.items.size(), " numbers"),
           words("give two, the least and the greatest: ", key, " = [100, 2000]"));
  }
  const Quantity any{"a finite number", "100", 1.0, -1e300, 1e300};
  const double low =
      number_at(bounds.items[0], bounds.items[0].place, words(in_quotes(key), " (least)"), any);
  const double high =
      number_at(bounds.items[1], bounds.items[1].place, words(in_quotes(key), " (greatest)"), any);
  if (low > high) {
    refuse(key,
           words(in_quotes(key), " in ", what_, " runs from ", in_words(low), " down to ", in_words(high)),
           "put the smaller number first");
  }
  return {low, high};
}

}  // namespace hybrid
