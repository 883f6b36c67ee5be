// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/panel_words.h"

namespace hybrid {

std::string object_name(const DrawnScene& scene, std::uint32_t object) {
  if (object == Edit::kTool) return "tool";
  return object < scene.objects.size() ? scene.objects[object].name : std::string();
}

std::string number_format(float shown) {
  return shown >= 99.95F ? "%.0f" : shown >= 9.995F ? "%.1f" : shown >= 0.9995F ? "%.2f" : "%.3g";
}

std::string words_of_value(EditedQuantity quantity) {
  switch (quantity) {
    case EditedQuantity::coupling_stiffness:
      return "coupling";
    case EditedQuantity::max_force:
      return "force limit";
    case EditedQuantity::static_friction:
      return "friction at rest";
    case EditedQuantity::dynamic_friction:
      return "friction sliding";
    case EditedQuantity::damping:
      return "damping";
    case EditedQuantity::texture_height:
      return "texture height";
    case EditedQuantity::tissue_factor:
      return "stiffness, times";
  }
  return {};
}

}  // namespace hybrid
