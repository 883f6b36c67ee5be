// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/view_state.h"

#include <algorithm>

namespace hybrid {
namespace {

double number_of(const ViewAction& action, double otherwise = 0.0) {
  return action.numbers.empty() ? otherwise : action.numbers.front();
}

void set_or_flip(bool& value, const ViewAction& action) {
  value = action.numbers.empty() ? !value : action.numbers.front() != 0.0;
}

// Changes the look of an object, or of one of its materials.
template <class Change>
void change_look(ViewSettings& view, const ViewAction& action, const Change& change) {
  if (action.object == Edit::kTool) return;
  const std::size_t object = action.object;
  if (action.text.empty()) {
    if (view.looks.size() <= object) view.looks.resize(object + 1);
    change(view.looks[object]);
    return;
  }
  if (view.material_looks.size() <= object) view.material_looks.resize(object + 1);
  Look& look = view.material_looks[object][action.text];
  change(look);
  if (look == Look{}) view.material_looks[object].erase(action.text);
}

void move_slice(ViewSettings& view, const std::vector<double>& numbers) {
  if (numbers.size() < 2) {
    const bool on = !view.sliced();
    for (SlicePlane& slice : view.slices) slice.on = on;
    return;
  }
  SlicePlane& slice = view.slices[static_cast<std::size_t>(std::clamp(numbers[0], 0.0, 2.0))];
  slice.on = numbers[1] >= 0.0;
  if (slice.on) slice.share = std::min(numbers[1], 1.0);
}

void act_on_view(ViewState& state, const ViewAction& action) {
  ViewSettings& view = state.view;
  switch (action.verb) {
    case ViewVerb::show:
      change_look(view, action, [&](Look& look) { look.visible = number_of(action, 1.0) != 0.0; });
      break;
    case ViewVerb::opacity:
      change_look(view, action, [&](Look& look) {
        look.opacity = static_cast<float>(std::clamp(number_of(action), 0.0, 1.0));
      });
      break;
    case ViewVerb::wires:
      set_or_flip(view.wires, action);
      break;
    case ViewVerb::clip:
      set_or_flip(view.clip.on, action);
      break;
    case ViewVerb::clip_axis:
      view.clip.axis = std::clamp(static_cast<int>(number_of(action)), 0, 2);
      break;
    case ViewVerb::clip_place:
      view.clip.share = std::clamp(number_of(action), 0.0, 1.0);
      break;
    case ViewVerb::clip_side:
      view.clip.other_side = !view.clip.other_side;
      break;
    case ViewVerb::slice:
      move_slice(view, action.numbers);
      break;
    case ViewVerb::slice_grey:
      set_or_flip(view.grey, action);
      break;
    case ViewVerb::colour:
      view.colour = static_cast<TissueColour>(
          std::clamp(static_cast<int>(number_of(action, static_cast<double>(view.colour) + 1.0)), 0,
                     static_cast<int>(kTissueColours.size())) %
          static_cast<int>(kTissueColours.size()));
      break;
    case ViewVerb::dark:
      set_or_flip(view.dark, action);
      break;
    case ViewVerb::inset:
      set_or_flip(view.inset, action);
      break;
    default:
      break;
  }
}

void act_on_session(ViewState& state, const ViewAction& action) {
  switch (action.verb) {
    case ViewVerb::pause:
      set_or_flip(state.paused, action);
      break;
    case ViewVerb::step:
      state.paused = true;
      ++state.single_ticks;
      break;
    case ViewVerb::rest:
      set_or_flip(state.compares_with_rest, action);
      break;
    case ViewVerb::speed:
      state.speed = std::clamp(number_of(action, 1.0), kLeastSpeed, 1.0);
      break;
    case ViewVerb::restart:
      ++state.restarts;
      break;
    case ViewVerb::edit:
      state.edits.push_back({0, action.object, action.quantity, number_of(action)});
      break;
    case ViewVerb::look_back:
      state.back_s = std::max(number_of(action), 0.0);
      break;
    case ViewVerb::go_on:
      state.go_on = state.back_s > 0.0;
      break;
    case ViewVerb::change:
      state.changes.push_back(action.change);
      break;
    case ViewVerb::difference:
      state.comparison = action.comparison;
      if (!action.comparison.object.empty()) state.view.colour = TissueColour::difference;
      break;
    case ViewVerb::open:
      state.opened.emplace_back(action.text);
      break;
    case ViewVerb::screenshot:
      state.screenshot = action.text;
      break;
    case ViewVerb::save_recording:
      state.recording = action.text;
      break;
    case ViewVerb::save_scene:
      state.save_scene = true;
      break;
    case ViewVerb::reload:
      state.reload = true;
      break;
    default:
      break;
  }
}

}  // namespace

void go_to_scene(ViewState& state, const DrawnScene& before, const DrawnScene& after) {
  std::vector<Look> looks(after.objects.size());
  decltype(state.view.material_looks) material_looks(after.objects.size());
  std::uint32_t selected = Edit::kTool;
  for (std::uint32_t o = 0; o < after.objects.size(); ++o) {
    const auto same = std::ranges::find(before.objects, after.objects[o].name, &DrawnObject::name);
    if (same == before.objects.end()) continue;
    const auto old = static_cast<std::uint32_t>(same - before.objects.begin());
    looks[o] = state.view.look_of(old);
    if (state.view.separates_materials(old)) material_looks[o] = state.view.material_looks[old];
    if (state.selected == old) selected = o;
  }
  state.view.looks = std::move(looks);
  state.view.material_looks = std::move(material_looks);
  state.selected = selected;
  state.edits.clear();  // they name objects of the old scene
}

void act(ViewState& state, const ViewAction& action) {
  switch (action.verb) {
    case ViewVerb::select:
      state.selected = action.object;
      return;
    case ViewVerb::look:
      state.look = action.text;
      return;
    case ViewVerb::arrows:
      set_or_flip(state.moves, action);
      return;
    case ViewVerb::map:
      set_or_flip(state.map, action);
      return;
    case ViewVerb::trail:
      set_or_flip(state.trail, action);
      return;
    case ViewVerb::stack:
      set_or_flip(state.stacked, action);
      return;
    case ViewVerb::watch:
      if (std::erase(state.watched, action.text) == 0) state.watched.push_back(action.text);
      return;
    case ViewVerb::panels:
      set_or_flip(state.panels, action);
      return;
    case ViewVerb::quit:
      state.quit = true;
      return;
    default:
      act_on_view(state, action);
      act_on_session(state, action);
  }
}

}  // namespace hybrid
