// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/view_script.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "hybrid/window/watched_numbers.h"
#include "hybrid/window/window.h"
#include "hybrid/window/window_keys.h"

namespace hybrid {
namespace {

constexpr double kLeast_mm = 1e-3, kMost_mm = 1e6;  // of a spacing; scenes refuse others
constexpr std::size_t kScriptPlaces = 300;          // places of a difference of two models, if none are given

// The kinds of arguments that a command has.
enum class ScriptArguments : std::uint8_t {
  none,
  number,     // one number
  on_or_off,  // "on", "off", or nothing, which means the other state
  object,
  object_number,  // an object, and a number from 0 to 1
  edit,           // an object or "tool", a quantity, and a value in the panel's unit
  model,          // tissue, and "voxels" or "rigid"
  energy,         // tissue, and "six-link" or "trilinear"
  spacing,        // tissue, and millimetres
  young,          // a material, and pascals
  move,           // an object, and three numbers: millimetres
  difference,     // "off", or tissue, two models, millimetres, and a number of places, which may be left out
  look,           // "all", "contact", "x", "y" or "z"
  clip,           // "off", or an axis and a number
  slice,          // "off", or an axis, and a number or "off"
  colour,         // one of kTissueColours
  file,           // a file name; may be left out
  watched,        // the name of a number of the tick
  key,
  point,  // two numbers
  drag,   // four numbers, and a button, which may be left out
};
struct ScriptCommand {
  std::string_view name;
  ViewVerb verb;
  ScriptArguments arguments;
  std::string_view example;
};
constexpr std::array<ScriptCommand, 37> kScriptCommands{
    {{"pause", ViewVerb::pause, ScriptArguments::on_or_off, "pause on"},
     {"step", ViewVerb::step, ScriptArguments::none, "step"},
     {"rest", ViewVerb::rest, ScriptArguments::on_or_off, "rest on"},
     {"stack", ViewVerb::stack, ScriptArguments::on_or_off, "stack on"},
     {"watch", ViewVerb::watch, ScriptArguments::watched, "watch \"device x\""},
     {"speed", ViewVerb::speed, ScriptArguments::number, "speed 0.1"},
     {"restart", ViewVerb::restart, ScriptArguments::none, "restart"},
     {"edit", ViewVerb::edit, ScriptArguments::edit, "edit tool stiffness 600"},
     {"model", ViewVerb::change, ScriptArguments::model, "model brain rigid"},
     {"energy", ViewVerb::change, ScriptArguments::energy, "energy brain trilinear"},
     {"spacing", ViewVerb::change, ScriptArguments::spacing, "spacing brain 2.5"},
     {"young", ViewVerb::change, ScriptArguments::young, "young fat 3000"},
     {"move", ViewVerb::change, ScriptArguments::move, "move plate 0 0 2"},
     {"difference", ViewVerb::difference, ScriptArguments::difference, "difference brain as-is trilinear 3"},
     {"back", ViewVerb::look_back, ScriptArguments::number, "back 5"},
     {"go-on", ViewVerb::go_on, ScriptArguments::none, "go-on"},
     {"arrows", ViewVerb::arrows, ScriptArguments::on_or_off, "arrows on"},
     {"select", ViewVerb::select, ScriptArguments::object, "select bone"},
     {"show", ViewVerb::show, ScriptArguments::object, "show bone"},
     {"hide", ViewVerb::show, ScriptArguments::object, "hide bone"},
     {"opacity", ViewVerb::opacity, ScriptArguments::object_number, "opacity bone 0.3"},
     {"clip", ViewVerb::clip, ScriptArguments::clip, "clip x 0.5"},
     {"slice", ViewVerb::slice, ScriptArguments::slice, "slice y 0.4"},
     {"grey", ViewVerb::slice_grey, ScriptArguments::on_or_off, "grey on"},
     {"colour", ViewVerb::colour, ScriptArguments::colour, "colour strain"},
     {"look", ViewVerb::look, ScriptArguments::look, "look contact"},
     {"dark", ViewVerb::dark, ScriptArguments::on_or_off, "dark on"},
     {"panels", ViewVerb::panels, ScriptArguments::on_or_off, "panels off"},
     {"inset", ViewVerb::inset, ScriptArguments::on_or_off, "inset off"},
     {"picture", ViewVerb::screenshot, ScriptArguments::file, "picture view.png"},
     {"record", ViewVerb::save_recording, ScriptArguments::file, "record session.rec"},
     {"key", ViewVerb::key, ScriptArguments::key, "key space"},
     {"click", ViewVerb::click, ScriptArguments::point, "click 400 300"},
     {"drag", ViewVerb::drag, ScriptArguments::drag, "drag 400 300 500 350 right"},
     {"wheel", ViewVerb::wheel, ScriptArguments::number, "wheel 2"},
     {"save-scene", ViewVerb::save_scene, ScriptArguments::none, "save-scene"},
     {"quit", ViewVerb::quit, ScriptArguments::none, "quit"}}};

// The words of a line, without a comment at its end.
std::vector<std::string> words_of_line(std::string_view line) {
  std::vector<std::string> words;
  for (std::size_t at = 0; at < line.size();) {
    if (line[at] == ' ' || line[at] == '\t' || line[at] == '\r') {
      ++at;
    } else if (line[at] == '#') {
      break;
    } else if (line[at] == '"') {
      const std::size_t end = std::min(line.find('"', at + 1), line.size());
      words.emplace_back(line.substr(at + 1, end - at - 1));
      at = end + 1;
    } else {
      const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
      words.emplace_back(line.substr(at, end - at));
      at = end;
    }
  }
  return words;
}

class ScriptLine {
 public:
  ScriptLine(std::vector<std::string> words, std::string place, const DrawnScene& scene)
      : words_(std::move(words)), place_(std::move(place)), scene_(scene) {}

  [[nodiscard]] double time() const { return number(0, 0.0, 1e6); }
  [[nodiscard]] ViewAction action() const {
    const auto command =
        std::find_if(kScriptCommands.begin(), kScriptCommands.end(),
                     [this](const ScriptCommand& c) { return words_.size() > 1 && c.name == words_[1]; });
    if (command == kScriptCommands.end()) refuse_command();
    ViewAction action{.verb = command->verb};
    read_arguments(*command, action);
    if (command->name == "hide") action.numbers = {0.0};
    return action;
  }
  [[noreturn]] void refuse(const std::string& why) const { throw std::runtime_error(place_ + ": " + why); }

 private:
  [[noreturn]] void refuse_command() const {
    std::string names;
    for (const ScriptCommand& c : kScriptCommands) names += (names.empty() ? "" : ", ") + std::string(c.name);
    refuse((words_.size() > 1 ? "there is no command '" + words_[1] + "'" : "there is no command") +
           "; write a time and one of these: " + names);
  }

  [[noreturn]] void refuse_number() const {
    std::string names;
    for (const WatchedNumber& number : watched_numbers()) names += (names.empty() ? "" : ", ") + number.name;
    refuse("a tick has no number '" + words_[2] + "'; it has " + names);
  }
  [[nodiscard]] double number(std::size_t n, double low, double high) const {
    return number_in(n < words_.size() ? words_[n] : std::string(), low, high);
  }
  [[nodiscard]] double number_in(const std::string& word, double low, double high) const {
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !(value >= low && value <= high))
      refuse("'" + word + "' is no number that is allowed there" + example());
    return value;
  }
  [[nodiscard]] std::string example() const {
    for (const ScriptCommand& c : kScriptCommands) {
      if (words_.size() > 1 && c.name == words_[1]) return "; for example: " + std::string(c.example);
    }
    return "; a line begins with a time in seconds, for example: 1.5 pause on";
  }
  void expect(std::size_t least, std::size_t most) const {
    const std::size_t count = words_.size() - 2;
    if (count < least || count > most)
      refuse("'" + words_[1] + "' has " + std::to_string(count) + " arguments" + example());
  }

  [[nodiscard]] std::uint32_t object(std::size_t n, bool or_tool) const {
    if (or_tool && words_[n] == "tool") return Edit::kTool;
    std::string names;
    for (std::uint32_t o = 0; o < scene_.objects.size(); ++o) {
      if (scene_.objects[o].name == words_[n]) return o;
      names += (names.empty() ? "" : ", ") + scene_.objects[o].name;
    }
    refuse("there is no object '" + words_[n] + "'; the scene has " + (or_tool ? "tool, " : "") + names);
  }

  void read_edit(ViewAction& action) const {
    expect(3, 3);
    action.object = object(2, true);
    const auto quantity = quantity_named(words_[3]);
    std::string names;
    for (const EditableValue& value : scene_.editable) {
      if (value.object != action.object) continue;
      names += (names.empty() ? "" : ", ") + std::string(name_of(value.quantity));
      if (value.quantity != quantity) continue;
      action.quantity = value.quantity;
      const double unit = si_of_unit(value.quantity);
      action.numbers = {std::clamp(unit * number(4, value.range.low / unit, value.range.high / unit),
                                   value.range.low, value.range.high)};
      return;
    }
    refuse("'" + words_[2] + "' has no value '" + words_[3] + "' that can be edited" +
           (names.empty() ? "" : "; it has " + names));
  }

  // Only tissue has models.
  [[nodiscard]] std::string tissue(std::size_t n) const {
    const DrawnObject& named = scene_.objects[object(n, false)];
    if (!named.choices.tissue) refuse("'" + named.name + "' is no tissue, so it has one model only");
    return named.name;
  }
  [[nodiscard]] std::string material(std::size_t n) const {
    std::string names;
    for (const DrawnObject& drawn : scene_.objects) {
      for (const MaterialChoice& choice : drawn.choices.materials) {
        if (choice.name == words_[n]) return choice.name;
        names += (names.empty() ? "" : ", ") + choice.name;
      }
    }
    refuse("there is no material '" + words_[n] + "'" +
           (names.empty() ? std::string() : "; the scene has " + names));
  }

  void read_change(ScriptArguments kind, ViewAction& action) const {
    using ChangedKey = SceneChange::Key;
    constexpr double least_Pa = 1e-3, most_Pa = 1e13;  // as a scene's file
    SceneChange& change = action.change;
    const bool moves = kind == ScriptArguments::move;
    expect(moves ? 4 : 2, moves ? 4 : 2);
    change.name = moves ? scene_.objects[object(2, false)].name
                        : (kind == ScriptArguments::young ? material(2) : tissue(2));
    const auto second = [&](std::string_view first_word, std::string_view second_word) {
      if (words_[3] != first_word && words_[3] != second_word)
        refuse("'" + words_[3] + "' is not known there" + example());
      return words_[3] == second_word ? 1.0 : 0.0;
    };
    switch (kind) {
      case ScriptArguments::model:
        change.key = ChangedKey::model;
        change.value.x = second("voxels", "rigid");
        break;
      case ScriptArguments::energy:
        change.key = ChangedKey::energy;
        change.value.x = second("six-link", "trilinear");
        break;
      case ScriptArguments::spacing:
        change.key = ChangedKey::spacing;
        change.value.x = 1e-3 * number(3, kLeast_mm, kMost_mm);
        break;
      case ScriptArguments::young:
        change.key = ChangedKey::young;
        change.value.x = number(3, least_Pa, most_Pa);
        break;
      default:
        change.key = ChangedKey::move;
        for (int d = 0; d < 3; ++d)
          change.value[d] = 1e-3 * number(3 + static_cast<std::size_t>(d), -kMost_mm, kMost_mm);
    }
  }

  // A model: "as-is", or changes with "+" between them: an energy, "rigid", or a spacing in millimetres.
  [[nodiscard]] std::vector<SceneChange> model(std::size_t n, const std::string& object) const {
    std::vector<SceneChange> changes;
    if (words_[n] == "as-is") return changes;
    std::size_t at = 0;
    while (at <= words_[n].size()) {
      const std::size_t end = std::min(words_[n].find('+', at), words_[n].size());
      const std::string word = words_[n].substr(at, end - at);
      at = end + 1;
      SceneChange change{.name = object};
      if (word == "six-link" || word == "trilinear") {
        change.key = SceneChange::Key::energy;
        change.value.x = word == "trilinear" ? 1.0 : 0.0;
      } else if (word == "rigid" || word == "voxels") {
        change.value.x = word == "rigid" ? 1.0 : 0.0;
      } else {
        change.key = SceneChange::Key::spacing;
        change.value.x = 1e-3 * number_in(word, kLeast_mm, kMost_mm);
      }
      changes.push_back(change);
    }
    return changes;
  }

  void read_difference(ViewAction& action) const {
    if (words_.size() == 3 && words_[2] == "off") return;
    expect(4, 5);
    ModelComparison& comparison = action.comparison;
    comparison.object = tissue(2);
    comparison.a = model(3, comparison.object);
    comparison.b = model(4, comparison.object);
    comparison.depth_m = 1e-3 * number(5, kLeast_mm, kMost_mm);
    comparison.places = words_.size() > 6 ? static_cast<std::size_t>(number(6, 1.0, 1e6)) : kScriptPlaces;
  }

  [[nodiscard]] double axis(std::size_t n) const {
    static constexpr std::string_view axes = "xyz";
    const std::size_t axis = words_[n].size() == 1 ? axes.find(words_[n]) : std::string_view::npos;
    if (axis == std::string_view::npos)
      refuse("'" + words_[n] + "' is no axis; write x, y, z or off" + example());
    return static_cast<double>(axis);
  }

  void read_clip(ViewAction& action) const {
    expect(1, 2);
    action.numbers = {0.0};
    if (words_[2] != "off") action.numbers = {1.0, axis(2), number(3, 0.0, 1.0)};
  }

  void read_slice(ViewAction& action) const {
    expect(1, 2);
    if (words_[2] == "off") {
      expect(1, 1);
      action.numbers = {-1.0};
      return;
    }
    const bool off = words_.size() > 3 && words_[3] == "off";
    action.numbers = {axis(2), off ? -1.0 : number(3, 0.0, 1.0)};
  }

  void read_arguments(const ScriptCommand& command, ViewAction& action) const {
    const auto choose = [&](std::size_t n, std::initializer_list<std::string_view> choices) {
      const auto at = std::find(choices.begin(), choices.end(), words_[n]);
      if (at == choices.end()) refuse("'" + words_[n] + "' is not known there" + example());
      return static_cast<std::size_t>(at - choices.begin());
    };
    switch (command.arguments) {
      case ScriptArguments::none:
        expect(0, 0);
        break;
      case ScriptArguments::number:
        expect(1, 1);
        action.numbers = {number(2, -1e3, 1e3)};
        break;
      case ScriptArguments::on_or_off:
        expect(0, 1);
        if (words_.size() > 2) action.numbers = {choose(2, {"off", "on"}) == 1 ? 1.0 : 0.0};
        break;
      case ScriptArguments::object:
        expect(1, 1);
        action.object = object(2, command.verb == ViewVerb::select);
        break;
      case ScriptArguments::object_number:
        expect(2, 2);
        action.object = object(2, false);
        action.numbers = {number(3, 0.0, 1.0)};
        break;
      case ScriptArguments::edit:
        read_edit(action);
        break;
      case ScriptArguments::model:
      case ScriptArguments::energy:
      case ScriptArguments::spacing:
      case ScriptArguments::young:
      case ScriptArguments::move:
        read_change(command.arguments, action);
        break;
      case ScriptArguments::difference:
        read_difference(action);
        break;
      case ScriptArguments::look:
        expect(1, 1);
        choose(2, {"all", "contact", "x", "y", "z"});
        action.text = words_[2];
        break;
      case ScriptArguments::clip:
        read_clip(action);
        break;
      case ScriptArguments::slice:
        read_slice(action);
        break;
      case ScriptArguments::colour:
        expect(1, 1);
        if (const auto named = tissue_colour_named(words_[2])) {
          action.numbers = {static_cast<double>(*named)};
        } else {
          refuse("'" + words_[2] + "' is no colouring" + example());
        }
        break;
      case ScriptArguments::file:
        expect(0, 1);
        if (words_.size() > 2) action.text = words_[2];
        break;
      case ScriptArguments::watched:
        expect(1, 1);
        if (watched_number_named(words_[2]) == nullptr) refuse_number();
        action.text = words_[2];
        break;
      case ScriptArguments::key:
        expect(1, 1);
        if (!is_key(words_[2])) refuse("there is no key '" + words_[2] + "' that does anything" + example());
        action.text = words_[2];
        break;
      case ScriptArguments::point:
        expect(2, 2);
        action.numbers = {number(2, 0.0, 1e5), number(3, 0.0, 1e5)};
        break;
      case ScriptArguments::drag:
        expect(4, 5);
        for (std::size_t n = 2; n < 6; ++n) action.numbers.push_back(number(n, 0.0, 1e5));
        if (words_.size() > 6) {
          choose(6, {"left", "middle", "right"});
          action.text = words_[6];
        }
        break;
    }
  }

  std::vector<std::string> words_;
  std::string place_;
  const DrawnScene& scene_;
};

}  // namespace

ViewScript::ViewScript(const std::string& text, const std::string& file, const DrawnScene& scene) {
  for (const DrawnObject& object : scene.objects) objects_.push_back(object.name);
  std::size_t at = 0;
  for (std::size_t n = 1; at <= text.size(); ++n) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::vector<std::string> words = words_of_line(std::string_view(text).substr(at, end - at));
    at = end + 1;
    if (words.empty()) continue;
    const ScriptLine line(std::move(words), file + ":" + std::to_string(n), scene);
    const double t_s = line.time();
    if (!actions_.empty() && t_s < actions_.back().t_s)
      line.refuse("the time is before that of the line above; put the lines in order");
    const ViewAction action = line.action();
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
