// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/view_script.h"

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "hybrid/window/script_line.h"
#include "hybrid/window/window.h"

namespace hybrid {

ViewScript::ViewScript(const std::string& text, const std::string& file, const DrawnScene& scene) {
  for (const DrawnObject& object : scene.objects) objects_.push_back(object.name);
  std::size_t at = 0;
  for (std::size_t n = 1; at <= text.size(); ++n) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::vector<std::string> words = words_of_script_line(std::string_view(text).substr(at, end - at));
    at = end + 1;
    if (words.empty()) continue;
    const std::string place = file + ":" + std::to_string(n);
    const auto [t_s, action] = read_script_line(std::move(words), place, scene);
    if (!actions_.empty() && t_s < actions_.back().t_s)
      throw std::runtime_error(place + ": the time is before that of the line above; put the lines in order");
    if (action.verb == ViewVerb::clip && action.numbers.size() == 3) {
      actions_.push_back({t_s, {.verb = ViewVerb::clip_axis, .numbers = {action.numbers[1]}}});
      actions_.push_back({t_s, {.verb = ViewVerb::clip_place, .numbers = {action.numbers[2]}}});
    }
    if (action.verb == ViewVerb::slice && action.numbers.size() == 1) {
      for (const double axis : {0.0, 1.0, 2.0})
        actions_.push_back({t_s, {.verb = ViewVerb::slice, .numbers = {axis, -1.0}}});
      continue;
    }
    actions_.push_back({t_s, action});
  }
}

std::vector<ViewAction> ViewScript::due(double t_s) {
  std::vector<ViewAction> actions;
  for (; next_ < actions_.size() && actions_[next_].t_s <= t_s; ++next_)
    actions.push_back(actions_[next_].action);
  return actions;
}

void ViewScript::play(double t_s, Window& window) {
  for (ViewAction& action : due(t_s)) {
    if (action.object < objects_.size()) {  // its number may have changed since the script was read
      const auto& objects = window.scene().objects;
      const auto at = std::ranges::find(objects, objects_[action.object], &DrawnObject::name);
      if (at == objects.end()) continue;
      action.object = static_cast<std::uint32_t>(at - objects.begin());
    }
    window.act(action);
  }
}

}  // namespace hybrid
