// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/world/edits.h"

#include <algorithm>
#include <array>

#include "hybrid/feel/height_texture.h"

namespace hybrid {
namespace {

// Factor on Young's modulus. In the table of tissues the stiffest is 700 times as stiff as the softest.
constexpr AllowedRange kFactorRange{1e-3, 1e3};
// Ranges of sliders. Most go from a tenth of the scene's value to ten times that value. Friction above 1.5
// and damping above 20 N s/m are no longer felt as such, so their sliders end there unless the scene's value
// is larger.
constexpr double kUsualFactor = 10.0;
constexpr AllowedRange kUsualFriction{0.0, 1.5}, kUsualDamping_N_s_per_m{0.0, 20.0};

struct QuantityWords {
  std::string_view name, unit;
  double si = 1.0;
};
constexpr std::array<QuantityWords, kEditedQuantities> kQuantityWords{{{"stiffness", "N/m"},
                                                                       {"max-force", "N"},
                                                                       {"static-friction", ""},
                                                                       {"dynamic-friction", ""},
                                                                       {"damping", "N s/m"},
                                                                       {"texture-height", "mm", 1e-3},
                                                                       {"tissue-factor", ""}}};

const QuantityWords& words_of(EditedQuantity quantity) noexcept {
  return kQuantityWords[static_cast<std::size_t>(quantity)];
}

bool stands_alone(const World& world, const WorldState& state, std::uint32_t soft) noexcept {
  const auto has = [soft](const std::array<std::uint32_t, 2>& pair) {
    return pair[0] == soft || pair[1] == soft;
  };
  const auto free = [](const RigidObject& object) { return object.motion.kind() == RigidMotion::Kind::free; };
  return !state.soft[soft]->lattice().has_plasticity() &&
         std::none_of(world.soft_pairs.begin(), world.soft_pairs.end(), has) &&
         std::none_of(world.rigid.begin(), world.rigid.end(), free);
}

std::optional<AllowedRange> range_of_tool(const World& world, EditedQuantity quantity) noexcept {
  if (quantity == EditedQuantity::coupling_stiffness) return kCouplingRange_N_per_m;
  if (quantity == EditedQuantity::max_force)
    return AllowedRange{kMaxForceRange_N.low, world.limits.max_force_N};
  return {};
}

std::optional<AllowedRange> range_of_rigid(const RigidObject& object, EditedQuantity quantity) noexcept {
  switch (quantity) {
    case EditedQuantity::coupling_stiffness:
      if (object.feel.stiffness_N_per_m == 0.0) return {};
      return kCouplingRange_N_per_m;
    case EditedQuantity::static_friction:
    case EditedQuantity::dynamic_friction:
      return kFrictionRange;
    case EditedQuantity::damping:
      return kDampingRange_N_s_per_m;
    case EditedQuantity::texture_height:
      if (object.feel.texture == nullptr) return {};
      return AllowedRange{kSmallestSize_m, kMostTextureHeight * object.feel.texture->mapping().size_m};
    default:
      return {};
  }
}

void set_feel(SurfaceFeel& feel, EditedQuantity quantity, double value) noexcept {
  switch (quantity) {
    case EditedQuantity::coupling_stiffness:
      feel.stiffness_N_per_m = value;
      break;
    case EditedQuantity::static_friction:
      feel.static_friction = value;
      feel.dynamic_friction = std::min(feel.dynamic_friction, value);
      break;
    case EditedQuantity::dynamic_friction:
      feel.dynamic_friction = value;
      feel.static_friction = std::max(feel.static_friction, value);
      break;
    case EditedQuantity::damping:
      feel.damping_N_s_per_m = value;
      break;
    case EditedQuantity::texture_height:
      feel.texture_share = value / feel.texture->mapping().height_m;
      break;
    default:
      break;
  }
}

double value_in_feel(const SurfaceFeel& feel, EditedQuantity quantity) noexcept {
  switch (quantity) {
    case EditedQuantity::coupling_stiffness:
      return feel.stiffness_N_per_m;
    case EditedQuantity::static_friction:
      return feel.static_friction;
    case EditedQuantity::dynamic_friction:
      return feel.dynamic_friction;
    case EditedQuantity::damping:
      return feel.damping_N_s_per_m;
    default:
      return feel.texture != nullptr ? feel.texture_share * feel.texture->mapping().height_m : 0.0;
  }
}

AllowedRange usual_range(const EditableValue& value) noexcept {
  switch (value.quantity) {
    case EditedQuantity::static_friction:
    case EditedQuantity::dynamic_friction:
      return {kUsualFriction.low, std::max(kUsualFriction.high, value.in_scene)};
    case EditedQuantity::damping:
      return {kUsualDamping_N_s_per_m.low, std::max(kUsualDamping_N_s_per_m.high, value.in_scene)};
    default:
      return {std::max(value.range.low, value.in_scene / kUsualFactor),
              std::min(value.range.high, value.in_scene * kUsualFactor)};
  }
}

}  // namespace

std::optional<AllowedRange> edit_range(const World& world, const WorldState& state, std::uint32_t object,
                                       EditedQuantity quantity) noexcept {
  if (object == Edit::kTool) return range_of_tool(world, quantity);
  if (object < world.rigid.size()) return range_of_rigid(world.rigid[object], quantity);
  const auto soft = static_cast<std::uint32_t>(object - world.rigid.size());
  if (quantity != EditedQuantity::tissue_factor || soft >= world.soft.size()) return {};
  return stands_alone(world, state, soft) ? std::optional(kFactorRange) : std::nullopt;
}

double edited_value(const World& world, const WorldState& state, std::uint32_t object,
                    EditedQuantity quantity) noexcept {
  if (object == Edit::kTool) {
    return quantity == EditedQuantity::coupling_stiffness ? tool_stiffness_N_per_m(world, state)
                                                          : max_force_N(world, state);
  }
  if (object < world.rigid.size()) return value_in_feel(feel_of(world, state, object), quantity);
  return state.edited.tissue_factor[object - world.rigid.size()];
}

std::vector<EditableValue> editable_values(const World& world, const WorldState& state) {
  std::vector<EditableValue> values;
  const auto add = [&](std::uint32_t object) {
    for (std::uint32_t q = 0; q < kEditedQuantities; ++q) {
      const auto quantity = static_cast<EditedQuantity>(q);
      const auto range = edit_range(world, state, object, quantity);
      if (!range) continue;
      EditableValue value{.object = object, .quantity = quantity, .range = *range};
      value.in_scene = edited_value(world, state, object, quantity);
      value.logarithmic = range->low > 0.0;
      value.usual = usual_range(value);
      values.push_back(value);
    }
  };
  add(Edit::kTool);
  for (std::uint32_t o = 0; o < world.object_count(); ++o) add(o);
  return values;
}

bool apply_edit(const World& world, WorldState& state, const Edit& edit) noexcept {
  const auto range = edit_range(world, state, edit.object, edit.quantity);
  if (!range || !range->has(edit.value)) return false;
  EditedValues& edited = state.edited;
  if (edit.object == Edit::kTool && edit.quantity == EditedQuantity::coupling_stiffness) {
    edited.coupling_N_per_m = edit.value;
  } else if (edit.quantity == EditedQuantity::max_force) {
    edited.max_force_N = edit.value;
  } else if (edit.quantity == EditedQuantity::tissue_factor) {
    const std::size_t soft = edit.object - world.rigid.size();
    // The reaction of the last tick belongs to the tissue before the edit, so it is scaled too.
    const double change = edit.value / edited.tissue_factor[soft];
    state.reactions[soft].force_N *= change;
    state.reactions[soft].stiffness_N_per_m *= change;
    edited.tissue_factor[soft] = edit.value;
  } else {
    std::optional<SurfaceFeel>& feel = edited.feel[edit.object];
    if (!feel) feel = world.rigid[edit.object].feel;
    set_feel(*feel, edit.quantity, edit.value);
  }
  return true;
}

void apply_edits_of_tick(const World& world, WorldState& state, std::span<const Edit> edits,
                         std::uint64_t tick, std::size_t& next) noexcept {
  for (; next < edits.size() && edits[next].tick <= tick; ++next) apply_edit(world, state, edits[next]);
}

std::string_view name_of(EditedQuantity quantity) noexcept {
  return words_of(quantity).name;
}
std::string_view unit_of(EditedQuantity quantity) noexcept {
  return words_of(quantity).unit;
}
double si_of_unit(EditedQuantity quantity) noexcept {
  return words_of(quantity).si;
}

std::optional<EditedQuantity> quantity_named(std::string_view name) noexcept {
  for (std::size_t q = 0; q < kEditedQuantities; ++q) {
    if (kQuantityWords[q].name == name) return static_cast<EditedQuantity>(q);
  }
  return {};
}

}  // namespace hybrid
