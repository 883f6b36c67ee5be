// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/panel_words.h"

#include "hybrid/base/number_text.h"

namespace hybrid {

std::string object_name(const DrawnScene& scene, std::uint32_t object) {
  if (object == Edit::kTool) return "tool";
  return object < scene.objects.size() ? scene.objects[object].name : std::string();
}

std::string number_format(float shown) {
  return shown >= 99.95F ? "%.0f" : shown >= 9.995F ? "%.1f" : shown >= 0.9995F ? "%.2f" : "%.3g";
}

std::string tick_time_text(double us) {
  return us < 1000.0 ? with_digits(us, 3) + " µs" : with_digits(1e-3 * us, 3) + " ms";
}

std::string words_of_value(EditedQuantity quantity, bool of_tool) {
  switch (quantity) {
    case EditedQuantity::coupling_stiffness:
      return of_tool ? "coupling" : "stiffness";
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

std::vector<ModelOption> model_options(const DrawnObject& tissue) {
  using Key = SceneChange::Key;
  const ObjectChoices& choices = tissue.choices;
  const auto energy_words = [](bool trilinear) { return std::string(trilinear ? "trilinear" : "six-link"); };
  std::vector<ModelOption> options{
      {"as it is: " + (choices.as_rigid ? std::string("rigid")
                                        : energy_words(choices.trilinear) + ", " + choices.spacing_words)}};
  const auto add = [&](const std::string& words, Key key, double value) {
    options.push_back({words, {{key, tissue.name, glm::dvec3(value, 0.0, 0.0)}}});
  };
  if (choices.as_rigid) {
    if (choices.other_model) add("by its voxels", Key::model, 0.0);
    return options;
  }
  if (choices.other_energy) add(energy_words(!choices.trilinear), Key::energy, choices.trilinear ? 0.0 : 1.0);
  for (const SpacingChoice& other : choices.spacings) add(other.words, Key::spacing, other.spacing_m);
  if (choices.other_model) add("as rigid", Key::model, 1.0);
  return options;
}

}  // namespace hybrid
