// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of values while a session runs. An edit belongs to a tick: it is applied before that tick, on the
// servo thread, and is part of a recording.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hybrid/scene/ranges.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

// The order is part of the recording's format: append only.
enum class EditedQuantity : std::uint32_t {
  coupling_stiffness,  // N/m, of the tool, or of a rigid object that has a stiffness of its own
  max_force,           // N; at most World::limits, which is at most the device's (greatest_force_N())
  static_friction,     // of a rigid object; a larger dynamic_friction is lowered to it
  dynamic_friction,    // of a rigid object; a smaller static_friction is raised to it
  damping,             // N s/m, of a rigid object
  texture_height,      // m, of a rigid object with a texture
  tissue_factor,       // of a soft object: factor on Young's modulus as the tool feels it
};
inline constexpr std::size_t kEditedQuantities = 7;

struct Edit {
  static constexpr std::uint32_t kTool = 0xFFFFFFFFU;

  std::uint64_t tick = 0;        // ticks since the session began
  std::uint32_t object = kTool;  // index: rigid objects first, then soft ones; kTool: the tool
  EditedQuantity quantity = EditedQuantity::coupling_stiffness;
  double value = 0.0;  // SI
  bool operator==(const Edit&) const = default;
};
static_assert(sizeof(Edit) == 24 && std::is_trivially_copyable_v<Edit>, "a record of queue and recording");

// One value that may be edited.
struct EditableValue {
  std::uint32_t object = Edit::kTool;
  EditedQuantity quantity = EditedQuantity::coupling_stiffness;
  AllowedRange range{};      // allowed values
  AllowedRange usual{};      // range of a slider, within `range`
  double in_scene = 0.0;     // the scene's value
  bool logarithmic = false;  // scale of a slider
};

// All values that may be edited: of the tool, then object by object. A soft object has none if it may meet
// another soft object, if the scene has a free body, or if its tissue is plastic. Then forces other than the
// reaction on the tool would have to scale as well.
[[nodiscard]] std::vector<EditableValue> editable_values(const World& world, const WorldState& state);

// Range of a value; empty: the object has no such value.
[[nodiscard]] std::optional<AllowedRange> edit_range(const World& world, const WorldState& state,
                                                     std::uint32_t object, EditedQuantity quantity) noexcept;
// The present value; the object must have it.
[[nodiscard]] double edited_value(const World& world, const WorldState& state, std::uint32_t object,
                                  EditedQuantity quantity) noexcept;

// Applies an edit between two ticks. False, and nothing changes, if the object has no such value or the value
// is out of range. Allocates nothing, never throws.
bool apply_edit(const World& world, WorldState& state, const Edit& edit) noexcept;
// Applies the edits of `tick` and of earlier ticks. `next`: index of the first edit that was not applied yet.
void apply_edits_of_tick(const World& world, WorldState& state, std::span<const Edit> edits,
                         std::uint64_t tick, std::size_t& next) noexcept;

// Name of a quantity in scripts ("stiffness", "static-friction", …), and the unit in which people write it.
[[nodiscard]] std::string_view name_of(EditedQuantity quantity) noexcept;
[[nodiscard]] std::string_view unit_of(EditedQuantity quantity) noexcept;
// SI value of one unit_of(quantity).
[[nodiscard]] double si_of_unit(EditedQuantity quantity) noexcept;
[[nodiscard]] std::optional<EditedQuantity> quantity_named(std::string_view name) noexcept;

}  // namespace hybrid
