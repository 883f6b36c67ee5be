// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the files in which programs store the names of labels.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "hybrid/base/letters.h"
#include "hybrid/compose/label_names.h"
#include "hybrid/compose/label_rows.h"
#include "polygon/files/file_bytes.h"

namespace hybrid {
namespace {

constexpr std::uintmax_t kMostBytes = 1U << 20;  // ten times the size of FreeSurfer's table of all its labels
constexpr int kMostLabel = 255;                  // the highest label of a volume

// Position of the first byte that is not UTF-8; npos if there is none.
std::size_t first_outside_utf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = character_at(text, at);
    if (length == 0) return at;
    at += length;
  }
  return std::string_view::npos;
}

std::size_t line_at(std::string_view text, std::size_t place) {
  return 1 +
         static_cast<std::size_t>(std::count(
             text.begin(), text.begin() + static_cast<std::ptrdiff_t>(std::min(place, text.size())), '\n'));
}

// UTF-8 text without its byte-order mark, and with "\n" at the end of each line.
std::string read_text(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) {
    throw ComposeError(fmt::format(
        "{}: is a folder; give the table of label names itself (CSV: number, name)", file.string()));
  }
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
  std::ostringstream bytes;
  if (in.peek() != std::ifstream::traits_type::eof()) bytes << in.rdbuf();
  if (!in.is_open() || in.bad())
    throw ComposeError(fmt::format("{}: cannot be read; look at its permissions", file.string()));
  std::string text = std::move(bytes).str();
  const std::string_view other = polygon::other_kind(text);
  if (!other.empty()) throw ComposeError(fmt::format("{}: {}", file.string(), other));
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    throw ComposeError(fmt::format("{}: is UTF-16 text; save it as UTF-8", file.string()));
  }
  if (text.find('\0') != std::string::npos) {
    throw ComposeError(
        fmt::format("{}: is not text; give a table of label names (CSV, TSV, text or JSON)", file.string()));
  }
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  for (std::size_t at = text.find('\r'); at != std::string::npos; at = text.find('\r', at)) {
    if (text.compare(at, 2, "\r\n") == 0) {
      text.erase(at, 1);
    } else {
      text[at] = '\n';
    }
  }
  const std::size_t bad = first_outside_utf8(text);
  if (bad != std::string::npos) {
    throw ComposeError(
        fmt::format("{}:{}: is not UTF-8 text (byte 0x{:02X}; Latin-1 or Windows-1252, perhaps); save it as "
                    "UTF-8, as with "
                    "iconv -f WINDOWS-1252 -t UTF-8 {} > utf8{}",
                    file.string(), line_at(text, bad), static_cast<unsigned char>(text[bad]),
                    file.filename().string(), file.extension().string()));
  }
  return text;
}

// Collects names. A volume has labels up to 255, so names of higher labels are skipped.
class NameTable {
 public:
  explicit NameTable(const std::filesystem::path& file) : file_(file.string()) {}

  void add(long long label, std::string_view name, const std::string& where) {
    if (label < 0)
      throw ComposeError(fmt::format("{}: label {} is below 0; renumber the labels", where, label));
    if (label == 0 || name.empty()) return;  // label 0 is empty space; a label without a name is skipped
    if (label > kMostLabel) {
      if (beyond_ == 0) beyond_ = label;
      return;
    }
    if (!is_printable(name)) {
      throw ComposeError(fmt::format(
          "{}: the name of label {} holds a character that cannot be printed; write the name anew", where,
          label));
    }
    const auto [at, fresh] = names_.try_emplace(static_cast<int>(label), name);
    if (!fresh && at->second != name) {
      throw ComposeError(fmt::format("{}: label {} is called \"{}\" and \"{}\"; keep one of them", where,
                                     label, at->second, name));
    }
  }

  LabelNames names(const std::string& remedy) && {
    if (!names_.empty()) return std::move(names_);
    if (beyond_ > 0) {
      throw ComposeError(
          fmt::format("{}: names no label from 1 to 255, which a volume can have (the first is {}); "
                      "renumber the labels",
                      file_, beyond_));
    }
    throw ComposeError(fmt::format("{}: names no label; {}", file_, remedy));
  }

 private:
  std::string file_;
  LabelNames names_;
  long long beyond_ = 0;
};

using NameJson = nlohmann::json;

std::optional<long long> number_in(const NameJson& value) {
  if (value.is_number_integer()) return value.get<long long>();
  if (value.is_string()) return whole_number_of(value.get_ref<const std::string&>());
  if (value.is_number_float()) return whole_number_of(fmt::format("{}", value.get<double>()));
  return std::nullopt;
}

// The value of the first of these keys that `read` can convert.
template <typename Read>
auto member(const NameJson& object, std::initializer_list<const char*> keys, Read&& read) {
  decltype(read(object)) found;
  for (const char* key : keys) {
    if (!found && object.contains(key)) found = read(object[key]);
  }
  return found;
}

// Reads {"liver": 1}, {"1": "liver"}, and nnU-Net's regions {"tumour": [2, 3]}. A label without a name of its
// own gets the name of the smallest region that contains it.
void add_members(const NameJson& table, NameTable& names, const std::string& where) {
  std::set<long long> named;
  std::map<long long, std::pair<std::size_t, std::string>> by_region;
  for (const auto& [key, value] : table.items()) {
    const auto number_key = whole_number_of(key);
    const auto label = number_in(value.is_array() && value.size() == 1 ? value[0] : value);
    if (number_key && value.is_string()) {
      names.add(*number_key, value.get_ref<const std::string&>(), where);
    } else if (label) {
      names.add(*label, key, where);
      named.insert(*label);
    } else if (value.is_array()) {
      for (const NameJson& item : value) {
        const auto in_region = number_in(item);
        if (!in_region) continue;
        const auto [at, fresh] = by_region.try_emplace(*in_region, value.size(), key);
        if (!fresh && value.size() < at->second.first) at->second = {value.size(), key};
      }
    }
  }
  for (const auto& [label, region] : by_region) {
    if (!named.contains(label)) names.add(label, region.second, where);
  }
}

// Reads ["empty", "liver"], or a list of objects, each with a number and a name.
void add_items(const NameJson& table, NameTable& names, const std::string& where) {
  for (std::size_t n = 0; n < table.size(); ++n) {
    const NameJson& item = table[n];
    if (item.is_string()) names.add(static_cast<long long>(n), item.get_ref<const std::string&>(), where);
    if (!item.is_object()) continue;
    const auto label = member(item, {"index", "id", "value", "label", "labelID"}, number_in);
    const auto name = member(item, {"name", "Name", "label", "SegmentLabel"}, [](const NameJson& v) {
      return v.is_string() ? std::optional(v.get<std::string>()) : std::nullopt;
    });
    if (label && name) names.add(*label, *name, where);
  }
}

// Parses, and refuses an object that has a key twice. Most readers of JSON keep only one of the two values.
NameJson parse_json(const std::string& text, const std::string& file) {
  std::vector<std::set<std::string>> keys;  // keys of each object that is not closed yet
  return NameJson::parse(text, [&](int, NameJson::parse_event_t event, NameJson& value) {
    if (event == NameJson::parse_event_t::object_start) keys.emplace_back();
    if (event == NameJson::parse_event_t::object_end) keys.pop_back();
    if (event == NameJson::parse_event_t::key && !keys.back().insert(value.get<std::string>()).second) {
      throw ComposeError(
          fmt::format("{}: has the key {} twice in an object; keep one of them", file, value.dump()));
    }
    return true;
  });
}

LabelNames from_json(const std::filesystem::path& file, const std::string& text) {
  const std::string remedy =
      "give {\"labels\": {\"liver\": 1, …}} as in dataset.json of nnU-Net, {\"1\": \"liver\", …}, a list of "
      "names, "
      "or a CSV with number, name in a row";
  NameJson json;
  try {
    json = parse_json(text, file.string());
  } catch (const NameJson::parse_error& error) {
    throw ComposeError(fmt::format("{}:{}: is no JSON; {}", file.string(),
                                   line_at(text, error.byte > 0 ? error.byte - 1 : 0), remedy));
  } catch (const NameJson::exception&) {  // a number too large to be stored; the parser gives no place
    throw ComposeError(fmt::format("{}: holds a number that is too large; {}", file.string(), remedy));
  }
  const NameJson* table = &json;
  for (const char* key : {"labels", "LabelMap"}) {  // LabelMap: BIDS
    if (table == &json && json.is_object() && json.contains(key)) table = &json[key];
  }
  NameTable names(file);
  if (table->is_array()) add_items(*table, names, file.string());
  if (table->is_object()) add_members(*table, names, file.string());
  return std::move(names).names(remedy);
}

}  // namespace

LabelNames read_label_names(const std::filesystem::path& file) {
  const std::string text = read_text(file);
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".json") return from_json(file, text);
  NameTable names(file);
  for (const LabelRow& row : label_rows(text, file.string()))
    names.add(row.label, row.name, fmt::format("{}:{}", file.string(), row.line));
  return std::move(names).names("write a number and a name in each row, as in 5,liver");
}

}  // namespace hybrid
