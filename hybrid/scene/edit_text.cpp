// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/edit_text.h"

#include <algorithm>
#include <utility>

namespace hybrid {
namespace {

constexpr const char* kPlaceNotFound = "its place in the text was not found";

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

// Position behind a list or a table within a line, which begins at `at`. It may hold comments.
std::size_t brackets_end(std::string_view text, std::size_t at) {
  int depth = 0;
  for (std::size_t n = at; n < text.size();) {
    const char c = text[n];
    if (c == '#') {
      n = std::min(text.find('\n', n), text.size());
    } else if (c == '"' || c == '\'') {
      n = string_end(text, n);
    } else {
      depth += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
      ++n;
      if (depth == 0) return n;
    }
  }
  return text.size();
}

// Position behind a value: a string, a list, a table within a line, or a plain word or number.
std::size_t value_end(std::string_view text, std::size_t at) {
  if (at >= text.size()) return text.size();
  if (text[at] == '"' || text[at] == '\'') return string_end(text, at);
  if (text[at] == '[' || text[at] == '{') return brackets_end(text, at);
  return std::min(text.find_first_of(" \t\r\n,}]#", at), text.size());
}

// The line break of the line that begins at `at`.
const char* break_of(std::string_view text, std::size_t at) {
  const std::size_t end = text.find('\n', at);
  return end != std::string_view::npos && end > 0 && text[end - 1] == '\r' ? "\r\n" : "\n";
}

const TreeNode* table_within(const TreeNode& table, const std::string& key) {
  const TreeEntry* const entry = entry_of(table, key);
  return entry != nullptr && entry->value.kind == TreeNode::Kind::table ? &entry->value : nullptr;
}

const TreeNode* item_named(const TreeNode& root, const TextTable& table) {
  const TreeEntry* const all = entry_of(root, table.key);
  if (all == nullptr) return nullptr;
  for (const TreeNode& item : all->value.items) {
    const TreeEntry* const name = entry_of(item, "name");
    if (name != nullptr && name->value.text == table.name) return &item;
  }
  return nullptr;
}

// Null: there is no such table.
const TreeNode* find_table(const TreeNode& root, const TextTable& table) {
  const TreeNode* const whole = table.name.empty() ? table_within(root, table.key) : item_named(root, table);
  return whole == nullptr || table.part.empty() ? whole : table_within(*whole, table.part);
}

bool same(const TreeNode& a, const TreeNode& b) {
  if (a.kind != b.kind || a.text != b.text || a.integer != b.integer || a.boolean != b.boolean ||
      !(a.number == b.number || (a.number != a.number && b.number != b.number)) ||
      a.items.size() != b.items.size() || a.entries.size() != b.entries.size())
    return false;
  for (std::size_t n = 0; n < a.items.size(); ++n) {
    if (!same(a.items[n], b.items[n])) return false;
  }
  return std::ranges::all_of(a.entries, [&](const TreeEntry& entry) {
    const TreeEntry* const other = entry_of(b, entry.key);
    return other != nullptr && same(entry.value, other->value);
  });
}

// Takes the key out of the table and returns its value. If the table is then empty, and set() may have added
// it, takes out the table too.
TreeNode take(TreeNode& root, const TextTable& table, std::string_view key) {
  TreeNode value;
  if (const TreeNode* const found = find_table(root, table)) {
    auto& entries = const_cast<TreeNode*>(found)->entries;
    const auto entry = std::ranges::find(entries, key, &TreeEntry::key);
    if (entry != entries.end()) {
      value = std::move(entry->value);
      entries.erase(entry);
    }
    if (entries.empty() && table.name.empty() && table.part.empty())
      std::erase_if(root.entries, [&](const TreeEntry& e) { return e.key == table.key; });
  }
  return value;
}

// Does `after` read as `before`, with the key set to `value`?
bool only_set(TreeNode before, TreeNode after, const TextTable& table, std::string_view key,
              const TreeNode& value) {
  const TreeNode set = take(after, table, key);
  (void)take(before, table, key);
  return same(set, value) && same(before, after);
}

}  // namespace

SceneTextEditor::SceneTextEditor(std::string text, std::filesystem::path file)
    : text_(std::move(text)), file_(std::move(file)) {
  (void)parse_tree(text_, file_);
}

std::string SceneTextEditor::replaced(const TreeEntry& entry, const std::string& value) const {
  std::string changed = text_;
  const std::size_t at = byte_at(changed, entry.value.place);
  return changed.replace(at, value_end(changed, at) - at, value);
}

// The text with a new key in a table that exists; empty if the table has no place for it.
std::string SceneTextEditor::added(const TreeNode& table, std::string_view key,
                                   const std::string& value) const {
  std::string changed = text_;
  const TreeEntry* const name = entry_of(table, "name");
  const TreeEntry* const before =
      name != nullptr ? name : (table.entries.empty() ? nullptr : &table.entries.front());
  const std::size_t header = byte_at(text_, table.place);
  const bool has_header = header < text_.size() && text_[header] == '[';
  // Below this place the key gets a line of its own.
  std::size_t below = header, indent = line_begin(text_, header);
  if (before != nullptr && (name != nullptr || !has_header)) {
    const std::size_t place = byte_at(text_, before->place), begin = line_begin(text_, place);
    const std::size_t at = byte_at(text_, before->value.place), end = value_end(text_, at);
    if (text_.find_first_not_of(" \t", begin) != place)
      return changed.insert(end, ", " + std::string(key) + " = " + value);
    if (!has_header && name == nullptr) return {};  // dotted keys: the table has no place of its own
    below = end;
    indent = begin;
  } else if (!has_header) {
    return {};
  }
  const std::size_t first = text_.find_first_not_of(" \t", indent);
  const std::string line_break = break_of(text_, below);
  const std::size_t next = std::min(text_.find('\n', below), text_.size());
  const std::size_t at = next < text_.size() ? next + 1 - line_break.size() : next;
  return changed.insert(at,
                        line_break + text_.substr(indent, first - indent) + std::string(key) + " = " + value);
}

std::string SceneTextEditor::set(const TextTable& table, std::string_view key, const std::string& value) {
  const TreeNode root = parse_tree(text_, file_);
  const TreeNode* const found = find_table(root, table);
  if (found == nullptr && !(table.name.empty() && table.part.empty()))
    return "its table is not in the scene's text";
  std::string changed;
  if (found == nullptr) {
    const std::string line_break = break_of(text_, 0);
    changed = text_ + (text_.empty() || text_.back() == '\n' ? "" : line_break);
    changed +=
        line_break + "[" + table.key + "]" + line_break + std::string(key) + " = " + value + line_break;
  } else if (const TreeEntry* const entry = entry_of(*found, key)) {
    if (entry->value.kind == TreeNode::Kind::table) return "it is written as a table";
    changed = replaced(*entry, value);
  } else {
    changed = added(*found, key, value);
  }
  try {
    const TreeNode wanted = parse_tree("value = " + value, file_);
    if (changed.empty() ||
        !only_set(root, parse_tree(changed, file_), table, key, wanted.entries.front().value))
      return kPlaceNotFound;
  } catch (const SceneError&) {
    return kPlaceNotFound;
  }
  text_ = std::move(changed);
  return {};
}

bool SceneTextEditor::comment_above(const TextTable& table, const std::vector<std::string>& keys,
                                    std::string_view comment) {
  const TreeNode root = parse_tree(text_, file_);
  const TreeNode* const found = find_table(root, table);
  std::size_t first = text_.size();
  for (const std::string& key : keys) {
    const TreeEntry* const entry = found != nullptr ? entry_of(*found, key) : nullptr;
    if (entry != nullptr) first = std::min(first, byte_at(text_, entry->place));
  }
  if (first == text_.size()) return false;
  const std::size_t line = line_begin(text_, first), word = text_.find_first_not_of(" \t", line);
  const std::string whole = text_.substr(line, word - line) + std::string(comment) + break_of(text_, line);
  if (line >= whole.size() && text_.compare(line - whole.size(), whole.size(), whole) == 0) return true;
  std::string changed = text_;
  changed.insert(line, whole);
  try {
    if (!same(root, parse_tree(changed, file_))) return false;
  } catch (const SceneError&) {
    return false;
  }
  text_ = std::move(changed);
  return true;
}

// A line within a string may look like a comment. If its removal changes a value, all lines stay.
void SceneTextEditor::remove_comments(std::string_view begin) {
  std::string changed = text_without(begin);
  try {
    if (same(parse_tree(text_, file_), parse_tree(changed, file_))) text_ = std::move(changed);
  } catch (const SceneError&) {
    return;
  }
}

std::string SceneTextEditor::text_without(std::string_view comment) const {
  std::string out;
  for (std::size_t line = 0; line < text_.size();) {
    const std::size_t next = std::min(text_.find('\n', line), text_.size() - 1) + 1;
    const std::size_t word = std::min(text_.find_first_not_of(" \t", line), text_.size());
    if (text_.compare(word, comment.size(), comment) != 0) out.append(text_, line, next - line);
    line = next;
  }
  return out;
}

}  // namespace hybrid
