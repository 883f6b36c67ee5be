// SPDX-License-Identifier: GPL-3.0-or-later
// The panel's chart of the force, and its list of watched numbers.
#include <algorithm>
#include <string>
#include <vector>

#include "hybrid/base/number_text.h"
#include "hybrid/view/view_settings.h"
#include "hybrid/window/controls.h"
#include "hybrid/window/panels.h"
#include "hybrid/window/watched_numbers.h"

namespace hybrid {

using namespace controls;

namespace {

constexpr int kDigits = 4;              // of a watched number
constexpr float kForceChart_em = 8.5F;  // height (unit: body text)

std::string words_of(double value, const std::string& unit) {
  return with_digits(value, kDigits) + (unit.empty() ? "" : " " + unit);
}

}  // namespace

void Panels::draw_force(const Pen& chart, const DrawnScene& scene, const PanelFrame& frame,
                        PanelResult& result) const {
  bool rest = frame.state.compares_with_rest, stacked = frame.state.stacked;
  if (has_soft(scene) && tick_box("compare with the force at rest", rest))
    result.actions.push_back({.verb = ViewVerb::rest, .numbers = {rest ? 1.0 : 0.0}});
  if (tick_box("stack the parts (A)", stacked))
    result.actions.push_back({.verb = ViewVerb::stack, .numbers = {stacked ? 1.0 : 0.0}});
  tip("Where the force comes from: each part along the direction of the force.\nBelow zero: what a part "
      "takes away");
  const PixelRect where = take_place(kForceChart_em * chart.em);
  if (stacked) {
    draw_force_parts(chart, where, frame.history);
  } else {
    draw_force_chart(chart, where, frame.history);
  }
}

void Panels::draw_watch(const Pen& pen, const PanelFrame& frame, PanelResult& result) const {
  const auto ask = [&](const std::string& name) {
    result.actions.push_back({.verb = ViewVerb::watch, .text = name});
  };
  for (const std::string& name : frame.state.watched) {
    const WatchedNumber* const number = watched_number_named(name);
    if (number == nullptr) continue;
    if (button(("x##" + name).c_str())) ask(name);
    tip("Watch it no longer");
    same_line();
    label_beside(pen, pen.fit(name, 7.0F * pen.em));
    const auto range = frame.history.range(number->of);
    write(range ? words_of(range->now, number->unit) + "  (" + words_of(range->least, {}) + " to " +
                      words_of(range->most, {}) + ")"
                : "no tick");
  }
  std::vector<std::string> others;
  for (const WatchedNumber& number : watched_numbers()) {
    if (std::ranges::find(frame.state.watched, number.name) == frame.state.watched.end())
      others.push_back(number.name);
  }
  label_beside(pen, "watch");
  if (const auto taken =
          choose("##watch", frame.state.watched.empty() ? "a number of the tick" : "another number", others))
    ask(others[*taken]);
}

}  // namespace hybrid
