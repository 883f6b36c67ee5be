// SPDX-License-Identifier: GPL-3.0-or-later
// The window's keys: their names in scripts, and their actions. Uses no graphics library.
#pragma once

#include <optional>
#include <string_view>

#include "hybrid/window/view_state.h"

namespace hybrid {

// The line of help below the scene.
inline constexpr std::string_view kWindowHelp =
    "drag: orbit   wheel: zoom   right drag: pull the tool   space: pause   N: tick   F C X Y Z: views   "
    "K: clip   V: slices   M: colours   Tab: keys to panel   H: panel";

// Action of a key: "space", "escape", "[", "a" to "z", "0" to "9", …. `control`: the Ctrl key is held. Empty:
// the key has no action.
[[nodiscard]] std::optional<ViewAction> action_of_key(std::string_view key, bool control,
                                                      const ViewState& state);
// Is it the name of a key that a script may press?
[[nodiscard]] bool is_key(std::string_view key);

}  // namespace hybrid
