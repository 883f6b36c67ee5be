// SPDX-License-Identifier: GPL-3.0-or-later
// The controls of the panel. This header needs no library of controls; panels.cpp implements it with one.
// Each control of a panel has its own `id`. Text after "##" in an `id` is not shown.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>

#include "hybrid/view/layout.h"
#include "hybrid/view/text_painter.h"

namespace hybrid::controls {

// Reserves a place for a chart. The next control is below it.
[[nodiscard]] PixelRect take_place(float height);
// Writes a label at the left; the next control comes beside it.
void label_beside(const Pen& pen, const std::string& words);
// A tick box with a colour and a name, in place of the label.
void tick_beside(const Pen& pen, const std::string& words, const glm::vec3& colour, bool& on);
// A square of a colour.
void swatch(const Pen& pen, const glm::vec3& colour);
// Writes a label in a line of controls.
void label(const std::string& words);
void same_line();
// Controls between begin_fixed(true) and end_fixed() do not react.
void begin_fixed(bool fixed);
void end_fixed();

// Returns true if it was pressed. `width` (pixels): 0 for that of the words.
bool button(const char* id, float width = 0.0F);
bool tick_box(const char* id, bool& on);
bool radio(const char* id, bool on);
// A list, which shows `shown` while it is closed. Returns the choice that was taken.
std::optional<std::size_t> choose(const char* id, const std::string& shown,
                                  std::span<const std::string> choices);
struct Slid {
  bool changed = false;  // in this frame
  bool held = false;     // the user holds the slider
  bool let_go = false;   // the user let go of it in this frame, after a change
};
// `format`: format of the number, as for printf().
Slid slide(const char* id, float& value, float low, float high, const std::string& format,
           bool logarithmic = false);
// A tip for the last control, shown while the pointer is on it and holds nothing.
void tip(const std::string& words);

// Text that is broken into lines.
void write(const std::string& words, bool pale = false);
// Rows of three columns, the last two at the right.
void write_rows(const Pen& pen, const char* id, std::span<const std::array<std::string, 3>> rows);

// Width that is left for a control, and the gap between two (pixels).
float free_width();
float gap();

}  // namespace hybrid::controls
