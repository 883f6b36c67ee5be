// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/toml_tree.h"

#include <algorithm>
#include <fstream>
#include <system_error>
#include <tuple>
#include <utility>

#include "hybrid/base/letters.h"
#include "hybrid/base/number_text.h"
#include "hybrid/scene/toml_prescan.h"

// On some malformed files (for example with a header "[=") toml++ 3.3 fails an assertion instead of reporting
// an error. Without assertions its behaviour is then undefined. Here a failed assertion becomes an error of
// the file.
namespace {
struct ParserGaveUp {};
[[noreturn]] void give_up() {
  throw ParserGaveUp{};
}
}  // namespace
#undef NDEBUG
#define TOML_ASSERT(expr) (static_cast<bool>(expr) ? static_cast<void>(0) : give_up())
// Bounds the nesting of values. With most_key_parts, this keeps the recursion of parser, conversion and
// destructors shallow enough for any stack.
#define TOML_MAX_NESTED_VALUES 32
#define TOML_HEADER_ONLY 1
#define TOML_ENABLE_FORMATTERS 0
#include <toml++/toml.h>

namespace hybrid {
namespace {

SourcePlace place_of(const toml::source_region& region) {
  return {static_cast<std::uint32_t>(region.begin.line), static_cast<std::uint32_t>(region.begin.column)};
}

TreeNode convert(const toml::node& node) {
  TreeNode out;
  out.place = place_of(node.source());
  if (const auto* table = node.as_table()) {
    out.kind = TreeNode::Kind::table;
    out.entries.reserve(table->size());
    for (const auto& [key, value] : *table) {
      out.entries.push_back({std::string(key.str()), place_of(key.source()), convert(value)});
    }
    std::stable_sort(out.entries.begin(), out.entries.end(), [](const TreeEntry& a, const TreeEntry& b) {
      return std::tie(a.place.line, a.place.column) < std::tie(b.place.line, b.place.column);
    });
  } else if (const auto* array = node.as_array()) {
    out.kind = TreeNode::Kind::array;
    out.items.reserve(array->size());
    for (const auto& item : *array) out.items.push_back(convert(item));
  } else if (const auto* string = node.as_string()) {
    out.kind = TreeNode::Kind::string;
    out.text = string->get();
  } else if (const auto* integer = node.as_integer()) {
    out.kind = TreeNode::Kind::integer;
    out.integer = integer->get();
    out.number = static_cast<double>(integer->get());
  } else if (const auto* real = node.as_floating_point()) {
    out.kind = TreeNode::Kind::real;
    out.number = real->get();
  } else if (const auto* boolean = node.as_boolean()) {
    out.kind = TreeNode::Kind::boolean;
    out.boolean = boolean->get();
  } else {
    out.kind = TreeNode::Kind::date;
  }
  return out;
}

std::string remedy_for(std::string_view description) {
  const auto says = [description](std::string_view word) {
    return description.find(word) != std::string_view::npos;
  };
  if (says("redefine")) {
    return "keep one of the two; several objects are written [[rigid]] or [[soft]], with two brackets";
  }
  if (says("utf-8") || says("UTF-8")) return "save the file as UTF-8 text";
  if (says("nest")) return "no value of a scene is nested deeper than a list of points";
  return "correct the TOML there: one key = value a line, text in \"quotes\", lists in [brackets]";
}

// The parser's message, without the parts that concern its authors alone.
std::string_view said_by(std::string_view description) {
  if (description.starts_with("Error while parsing ")) {
    const std::size_t colon = description.find(": ");
    if (colon != std::string_view::npos) description.remove_prefix(colon + 2);
  }
  return description.substr(0, description.find(" (TOML_"));
}

bool parser_gives_up(std::string_view text) {
  try {
    (void)toml::parse(text);
  } catch (const toml::parse_error&) {
    return false;
  } catch (const ParserGaveUp&) {
    return true;
  }
  return false;
}

// The parser reads from front to back. So the shortest prefix of the text that the parser rejects ends at the
// error.
SourcePlace where_parser_gives_up(std::string_view text) {
  std::size_t good = 0, bad = text.size();
  while (bad - good > 1) {
    const std::size_t middle = good + (bad - good) / 2;
    (parser_gives_up(text.substr(0, middle)) ? bad : good) = middle;
  }
  return place_in_text(text, good);
}

}  // namespace

const TreeEntry* entry_of(const TreeNode& table, std::string_view key) {
  const auto found = std::ranges::find(table.entries, key, &TreeEntry::key);
  return found == table.entries.end() ? nullptr : &*found;
}

std::size_t byte_at(std::string_view text, SourcePlace place) {
  std::size_t at = 0;
  for (std::uint32_t line = 1; line < place.line && at < text.size(); ++line)
    at = std::min(text.find('\n', at), text.size() - 1) + 1;
  for (std::uint32_t column = 1; column < place.column && at < text.size(); ++column) {
    ++at;
    while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U) ++at;
  }
  return at;
}

std::string_view kind_in_words(TreeNode::Kind kind) {
  switch (kind) {
    case TreeNode::Kind::table:
      return "a table";
    case TreeNode::Kind::array:
      return "a list";
    case TreeNode::Kind::string:
      return "a string";
    case TreeNode::Kind::integer:
      return "a whole number";
    case TreeNode::Kind::real:
      return "a number with a fraction";
    case TreeNode::Kind::boolean:
      return "true or false";
    case TreeNode::Kind::date:
      return "a date or time";
  }
  return "a value";
}

std::string printable(std::string_view text, std::size_t longest) {
  std::string out;
  std::size_t at = 0;
  while (at < text.size() && out.size() < longest) {
    const std::size_t length = printable_at(text, at);
    out += length > 0 ? text.substr(at, length) : "?";
    at += std::max<std::size_t>(character_at(text, at), 1);
  }
  if (at < text.size()) out += "...";
  return out;
}

std::string in_words(double number) {
  return with_digits(number, 6);
}

std::string in_quotes(std::string_view name) {
  std::string out = "'";
  out += printable(name, 60);
  out += '\'';
  return out;
}

TreeNode parse_tree(std::string_view text, const std::filesystem::path& file) {
  prescan_scene_text(text, file);
  try {
    const toml::table table = toml::parse(text);
    return convert(table);
  } catch (const ParserGaveUp&) {
    throw SceneError(file, where_parser_gives_up(text), words("no key can stand here; ", remedy_for("")));
  } catch (const toml::parse_error& error) {
    const std::string_view description = error.description();
    throw SceneError(file, place_of(error.source()),
                     words(printable(said_by(description)), "; ", remedy_for(description)));
  }
}

TreeNode read_tree(const std::filesystem::path& file) {
  std::error_code failed;
  const auto status = std::filesystem::status(file, failed);
  if (status.type() == std::filesystem::file_type::none) {
    throw SceneError(file, {},
                     words("cannot be reached: ", failed.message(), "; check path and permissions"));
  }
  if (!std::filesystem::exists(status)) {
    throw SceneError(file, {}, "there is no such file; correct the path");
  }
  if (std::filesystem::is_directory(status)) {
    throw SceneError(file, {}, "this is a folder; give the .toml file of a scene");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw SceneError(file, {}, "this is not an ordinary file; give the .toml file of a scene");
  }
  const auto bytes = std::filesystem::file_size(file, failed);
  if (failed)
    throw SceneError(file, {}, words("cannot be read: ", failed.message(), "; check its permissions"));
  if (bytes > most_scene_bytes) {
    throw SceneError(file, {},
                     words("the file has ", bytes, " bytes, and a scene at most ", most_scene_bytes,
                           "; name meshes and volumes by their file instead"));
  }
  std::ifstream in(file, std::ios::binary);
  std::string text(static_cast<std::size_t>(bytes), '\0');
  if (in) in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in) throw SceneError(file, {}, "cannot be read; check its permissions");
  return parse_tree(text, file);
}

}  // namespace hybrid
