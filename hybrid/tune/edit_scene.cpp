// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/edit_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "hybrid/scene/toml_tree.h"

namespace hybrid {
namespace {

struct Wanted {
  std::string key, value;
};

// A change of the text: `remove` bytes from `at` on are replaced by `add`.
struct TextEdit {
  std::size_t at = 0, remove = 0;
  std::string add;
};

std::size_t line_begin(std::string_view text, std::size_t at) {
  const std::size_t before = at == 0 ? std::string_view::npos : text.rfind('\n', at - 1);
  return before == std::string_view::npos ? 0 : before + 1;
}

// Position behind a string that begins at `at`, including its closing quotes. TOML has four kinds of strings.
std::size_t string_end(std::string_view text, std::size_t at) {
  const char quote = text[at];
  const std::string three(3, quote);
  const bool multiline = text.substr(at, 3) == three;
  std::size_t n = at + (multiline ? 3 : 1);
  while (n < text.size()) {
    if (quote == '"' && text[n] == '\\') {
      n += 2;
    } else if (multiline ? text.substr(n, 3) == three : text[n] == quote) {
      return n + (multiline ? 3 : 1);
    } else {
      ++n;
    }
  }
  return text.size();
}

// Position behind a value: a string, an array (which may hold comments), or a plain word or number.
std::size_t value_end(std::string_view text, std::size_t at) {
  if (text[at] == '"' || text[at] == '\'') return string_end(text, at);
  if (text[at] != '[') return std::min(text.find_first_of(" \t\r\n,}]#", at), text.size());
  int depth = 0;
  for (std::size_t n = at; n < text.size();) {
    const char c = text[n];
    if (c == '#') {
      n = std::min(text.find('\n', n), text.size());
    } else if (c == '"' || c == '\'') {
      n = string_end(text, n);
    } else {
      depth += c == '[' ? 1 : c == ']' ? -1 : 0;
      ++n;
      if (depth == 0) return n;
    }
  }
  return text.size();
}

const TreeNode& table_of(const TreeNode& root, const std::string& object) {
  const TreeEntry* soft = entry_of(root, "soft");
  if (soft != nullptr) {
    for (const TreeNode& table : soft->value.items) {
      const TreeEntry* name = entry_of(table, "name");
      if (name != nullptr && name->value.text == object) return table;
    }
  }
  throw std::runtime_error(fmt::format("no [[soft]] table has name = \"{}\"; give it one", object));
}

// The keys whose value differs from that in the file.
std::vector<Wanted> wanted_of(const TunableObject& object, const ObjectSetting& setting) {
  std::vector<Wanted> wanted;
  if (setting.proxy != object.own.proxy)
    wanted.push_back({"model", setting.proxy ? "\"proxy\"" : "\"voxels\""});
  if (setting.proxy) return wanted;
  if (setting.spacing != object.own.spacing && setting.spacing != glm::dvec3(0.0))
    wanted.push_back({"spacing", spacing_text(setting.spacing)});
  if (setting.energy != object.own.energy)
    wanted.push_back({"energy", fmt::format("\"{}\"", energy_name(setting.energy))});
  return wanted;
}

class Editor {
 public:
  Editor(std::string_view text, const TreeNode& root) : text_(text), root_(root) {}

  void set(const std::string& object, const std::vector<Wanted>& wanted, const std::string& reason) {
    const TreeNode& table = table_of(root_, object);
    std::size_t first = text_.size();
    for (const Wanted& w : wanted) {
      const TreeEntry* entry = entry_of(table, w.key);
      const std::size_t at = entry != nullptr ? replace(*entry, w) : add(table, w);
      first = std::min(first, at);
    }
    give_reason(line_begin(text_, first), reason);
  }

  // Returns the edited text. The reasons of an earlier choice are removed, because the new ones replace them.
  std::string result() {
    if (edits_.empty()) return std::string(text_);
    for (std::size_t line = 0; line < text_.size();) {
      const std::size_t next = std::min(text_.find('\n', line), text_.size() - 1) + 1;
      const std::size_t word = text_.find_first_not_of(" \t", line);
      if (word < next && text_.substr(word).starts_with(kReasonMark))
        edits_.push_back({line, next - line, {}});
      line = next;
    }
    std::ranges::stable_sort(edits_, {}, &TextEdit::at);
    std::string out;
    std::size_t at = 0;
    for (const TextEdit& edit : edits_) {
      out.append(text_.substr(at, edit.at - at)).append(edit.add);
      at = edit.at + edit.remove;
    }
    return out.append(text_.substr(at));
  }

 private:
  std::size_t replace(const TreeEntry& entry, const Wanted& wanted) {
    const std::size_t at = byte_at(text_, entry.value.place);
    edits_.push_back({at, value_end(text_, at) - at, wanted.value});
    return at;
  }

  // Adds a key below the line of the object's name; in an inline table, behind the name.
  std::size_t add(const TreeNode& table, const Wanted& wanted) {
    const TreeEntry& name = *entry_of(table, "name");
    const std::size_t at = byte_at(text_, name.value.place), end = value_end(text_, at);
    const std::size_t key = byte_at(text_, name.place), begin = line_begin(text_, key);
    const std::string_view indent = text_.substr(begin, key - begin);
    if (indent.find_first_not_of(" \t") != std::string_view::npos) {
      edits_.push_back({end, 0, fmt::format(", {} = {}", wanted.key, wanted.value)});
      return at;
    }
    const std::size_t next = std::min(text_.find('\n', end), text_.size());
    const bool returns = next > 0 && next < text_.size() && text_[next - 1] == '\r';
    edits_.push_back({next - (returns ? 1 : 0), 0,
                      fmt::format("{}{}{} = {}", returns ? "\r\n" : "\n", indent, wanted.key, wanted.value)});
    return at;
  }

  void give_reason(std::size_t line, const std::string& reason) {
    if (std::ranges::find(reasons_, line) != reasons_.end()) return;  // two inline tables on one line
    reasons_.push_back(line);
    const std::size_t first = text_.find_first_not_of(" \t", line);
    const std::string_view indent = text_.substr(line, std::min(first, text_.size()) - line);
    const std::size_t end = text_.find('\n', line);
    const bool returns = end != std::string_view::npos && end > 0 && text_[end - 1] == '\r';
    edits_.push_back(
        {line, 0, fmt::format("{}{}{}{}", indent, kReasonMark, reason, returns ? "\r\n" : "\n")});
  }

  std::string_view text_;
  const TreeNode& root_;
  std::vector<TextEdit> edits_;
  std::vector<std::size_t> reasons_;  // beginnings of the lines that have a reason
};

bool same(const TreeNode& a, const TreeNode& b) {
  if (a.kind != b.kind || a.text != b.text || a.integer != b.integer || a.boolean != b.boolean ||
      !(a.number == b.number || (a.number != a.number && b.number != b.number)) ||
      a.items.size() != b.items.size() || a.entries.size() != b.entries.size())
    return false;
  for (std::size_t n = 0; n < a.items.size(); ++n) {
    if (!same(a.items[n], b.items[n])) return false;
  }
  return std::ranges::all_of(a.entries, [&](const TreeEntry& entry) {
    const TreeEntry* other = entry_of(b, entry.key);
    return other != nullptr && same(entry.value, other->value);
  });
}

// Removes the keys from the object's table and returns their values.
std::vector<TreeNode> take(TreeNode& root, const std::string& object, const std::vector<Wanted>& wanted) {
  std::vector<TreeNode> values;
  auto& entries = const_cast<TreeNode&>(table_of(root, object)).entries;
  for (const Wanted& w : wanted) {
    const auto found = std::ranges::find(entries, w.key, &TreeEntry::key);
    values.push_back(found == entries.end() ? TreeNode{} : found->value);
    if (found != entries.end()) entries.erase(found);
  }
  return values;
}

}  // namespace

std::string edited_scene(std::string_view text, const std::filesystem::path& file,
                         const std::vector<TunableObject>& objects, const Setting& setting,
                         const std::string& reason) {
  TreeNode before = parse_tree(text, file);
  Editor editor(text, before);
  std::vector<std::pair<std::string, std::vector<Wanted>>> all;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    std::vector<Wanted> wanted = wanted_of(objects[n], setting.objects.at(n));
    if (wanted.empty()) continue;
    editor.set(objects[n].own.object, wanted, reason);
    all.emplace_back(objects[n].own.object, std::move(wanted));
  }
  std::string edited = editor.result();
  TreeNode after = parse_tree(edited, file);
  bool good = true;
  for (const auto& [object, wanted] : all) {
    const std::vector<TreeNode> values = take(after, object, wanted);
    (void)take(before, object, wanted);
    for (std::size_t n = 0; n < wanted.size(); ++n) {
      const TreeNode right = parse_tree("value = " + wanted[n].value, file);
      good = good && same(values[n], right.entries.front().value);
    }
  }
  if (good && same(before, after)) return edited;
  throw std::runtime_error(
      fmt::format("{}: its text cannot be edited safely; write these lines yourself:\n{}", file.string(),
                  as_toml(setting)));
}

}  // namespace hybrid
