// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/scene_text.h"

#include <optional>

#include "hybrid/base/number_text.h"
#include "hybrid/scene/edit_text.h"

namespace hybrid {
namespace {

constexpr int kSavedDigits = 6;  // digits of a saved number: far finer than a hand can tell

std::string saved_number(double value) {
  return with_digits(value, kSavedDigits);
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
  const TextTable object{"rigid", value.object};
  switch (value.quantity) {
    case EditedQuantity::coupling_stiffness:
      return editor.set(value.object.empty() ? TextTable{"tool"} : object, "stiffness",
                        saved_number(value.value));
    case EditedQuantity::max_force:
      return editor.set({"safety"}, "max_force", saved_number(value.value));
    case EditedQuantity::damping:
      return editor.set(object, "damping", saved_number(value.value));
    case EditedQuantity::static_friction:
    case EditedQuantity::dynamic_friction: {
      const auto text = friction_text(values, value.object);
      return text ? editor.set(object, "friction", *text) : "it has no friction";
    }
    case EditedQuantity::texture_height:
      return editor.set({"rigid", value.object, "texture"}, "height", saved_number(value.value / unit_m));
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
      out.left.push_back(what);
      out.left.back().append(" (").append(reason).append(")");
    }
  }
  out.text = editor.text();
  return out;
}

}  // namespace hybrid
