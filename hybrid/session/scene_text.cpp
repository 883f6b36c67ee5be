// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/scene_text.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "hybrid/base/number_text.h"
#include "hybrid/scene/toml_tree.h"

namespace hybrid {
namespace {

constexpr int kSavedDigits = 6;       // digits of a saved number: far finer than a hand can tell
constexpr double kSameNumber = 1e-5;  // relative difference up to which two numbers are the same

// The end of the value that begins at `at`. The value is a number, or a list on one line.
std::size_t end_of_value(const std::string& text, std::size_t at) {
  if (at < text.size() && text[at] == '[') return std::min(text.find(']', at), text.size() - 1) + 1;
  return std::min(text.find_first_not_of("0123456789+-._eExXabcdfinoABCDF", at), text.size());
}

std::string saved_number(double value) {
  return with_digits(value, kSavedDigits);
}

// Editor of one text. It parses the text anew for each change, because a change moves what follows.
class SceneTextEditor {
 public:
  SceneTextEditor(std::string text, const std::filesystem::path& file)
      : text_(std::move(text)), file_(file) {}

  [[nodiscard]] const std::string& text() const { return text_; }
  // Sets `key` of a table. Returns an empty text on success, otherwise the reason. `table` finds the table in
  // the root, or returns null if there is none. Then `header` starts the table at the end of the text.
  template <class Find>
  std::string set(const Find& table, std::string_view header, std::string_view key,
                  const std::string& value) {
    const TreeNode root = parse_tree(text_, file_);
    const TreeNode* found = table(root);
    if (found == nullptr && header.empty()) return "its table is not in the scene's text";
    std::string changed = text_;
    if (found == nullptr) {
      if (!changed.empty() && changed.back() != '\n') changed += '\n';
      changed += "\n" + std::string(header) + "\n" + std::string(key) + " = " + value + "\n";
    } else if (const TreeEntry* entry = entry_of(*found, key); entry != nullptr) {
      if (entry->value.kind == TreeNode::Kind::table) return "it is written as a table";
      const std::size_t at = byte_at(changed, entry->value.place);
      changed.replace(at, end_of_value(changed, at) - at, value);
    } else {
      const std::size_t at = byte_at(changed, found->place);
      if (at >= changed.size() || changed[at] != '[') return "its table is written within a line";
      const std::size_t end = std::min(changed.find('\n', at), changed.size());
      changed.insert(end, "\n" + std::string(key) + " = " + value);
    }
    return accept(std::move(changed), table, key, value);
  }

 private:
  // Keeps the new text only if `key` reads as `value` in it.
  template <class Find>
  std::string accept(std::string changed, const Find& table, std::string_view key, const std::string& value) {
    try {
      const TreeNode root = parse_tree(changed, file_);
      const TreeNode* const found = table(root);
      const TreeEntry* const entry = found != nullptr ? entry_of(*found, key) : nullptr;
      const TreeNode wanted = parse_tree("value = " + value, file_);
      if (entry == nullptr || !same(entry->value, wanted.entries.front().value))
        return "its place in the text was not found";
    } catch (const SceneError&) {
      return "its place in the text was not found";
    }
    text_ = std::move(changed);
    return {};
  }
  static bool same(const TreeNode& a, const TreeNode& b) {
    if (a.items.size() != b.items.size()) return false;
    for (std::size_t n = 0; n < a.items.size(); ++n) {
      if (!same(a.items[n], b.items[n])) return false;
    }
    return std::abs(a.number - b.number) <= kSameNumber * std::abs(b.number);
  }

  std::string text_;
  const std::filesystem::path& file_;
};

const TreeNode* table_named(const TreeNode& root, std::string_view name) {
  const TreeEntry* entry = entry_of(root, name);
  return entry != nullptr && entry->value.kind == TreeNode::Kind::table ? &entry->value : nullptr;
}

const TreeNode* rigid_named(const TreeNode& root, std::string_view name) {
  const TreeEntry* all = entry_of(root, "rigid");
  if (all == nullptr) return nullptr;
  for (const TreeNode& item : all->value.items) {
    const TreeEntry* entry = entry_of(item, "name");
    if (entry != nullptr && entry->value.text == name) return &item;
  }
  return nullptr;
}

// The two coefficients of friction share one key.
std::optional<std::string> friction_text(std::span<const ValueInScene> values, const std::string& object) {
  std::optional<double> at_rest, sliding;
  for (const ValueInScene& value : values) {
    if (value.object != object) continue;
    if (value.quantity == EditedQuantity::static_friction) at_rest = value.value;
    if (value.quantity == EditedQuantity::dynamic_friction) sliding = value.value;
  }
  if (!at_rest || !sliding) return {};
  if (*at_rest == *sliding) return saved_number(*at_rest);
  return "[" + saved_number(*at_rest) + ", " + saved_number(*sliding) + "]";
}

std::string write_value(SceneTextEditor& editor, std::span<const ValueInScene> values,
                        const ValueInScene& value, double unit_m) {
  const auto in_rigid = [&value](const TreeNode& root) { return rigid_named(root, value.object); };
  const auto table = [](const char* name) {
    return [name](const TreeNode& root) { return table_named(root, name); };
  };
  switch (value.quantity) {
    case EditedQuantity::coupling_stiffness:
      return editor.set(table("tool"), "[tool]", "stiffness", saved_number(value.value));
    case EditedQuantity::max_force:
      return editor.set(table("safety"), "[safety]", "max_force", saved_number(value.value));
    case EditedQuantity::damping:
      return editor.set(in_rigid, "", "damping", saved_number(value.value));
    case EditedQuantity::static_friction:
    case EditedQuantity::dynamic_friction: {
      const auto text = friction_text(values, value.object);
      return text ? editor.set(in_rigid, "", "friction", *text) : "it has no friction";
    }
    case EditedQuantity::texture_height: {
      const auto texture = [&](const TreeNode& root) {
        const TreeNode* object = rigid_named(root, value.object);
        return object != nullptr ? table_named(*object, "texture") : nullptr;
      };
      return editor.set(texture, "", "height", saved_number(value.value / unit_m));
    }
    case EditedQuantity::tissue_factor:
      break;
  }
  return "objects may share a material: change its 'young' by hand";
}

}  // namespace

EditedText write_values(const std::string& text, const std::filesystem::path& file, double unit_m,
                        std::span<const ValueInScene> values) {
  SceneTextEditor editor(text, file);
  EditedText out;
  for (const ValueInScene& value : values) {
    if (value.value == value.in_scene) continue;
    const std::string what =
        (value.object.empty() ? "tool" : value.object) + ": " + std::string(name_of(value.quantity));
    const std::string reason = write_value(editor, values, value, unit_m);
    if (reason.empty()) {
      out.changed.push_back(what);
    } else {
      out.left.push_back(what + " (" + reason + ")");
    }
  }
  out.text = editor.text();
  return out;
}

}  // namespace hybrid
