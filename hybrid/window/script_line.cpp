// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/script_line.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "hybrid/window/watched_numbers.h"
#include "hybrid/window/window_keys.h"

namespace hybrid {
namespace {

constexpr double kLeast_mm = 1e-3, kMost_mm = 1e6;  // of a spacing; scenes refuse others
constexpr std::size_t kScriptPlaces = 300;          // of a difference of two models

// The kinds of arguments that a command has.
enum class ScriptArguments : std::uint8_t {
  none,
  number,     // one number
  on_or_off,  // "on", "off", or nothing, which means the other state
  object,
  look_of,     // an object, a material of it or none, and for an opacity a number from 0 to 1
  edit,        // an object or "tool", a quantity, and a value in the panel's unit
  change,      // of the scene: ChangeArguments
  difference,  // "off", or tissue, two models, millimetres, and a number of places, which may be left out
  look,        // "all", "contact", "x", "y" or "z"
  clip,        // "off", or an axis and a number
  slice,       // "off", or an axis, and a number or "off"
  colour,      // one of kTissueColours
  file,        // a file name; may be left out
  watched,     // the name of a number of the tick
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
constexpr std::array<ScriptCommand, 46> kScriptCommands{
    {{"pause", ViewVerb::pause, ScriptArguments::on_or_off, "pause on"},
     {"step", ViewVerb::step, ScriptArguments::none, "step"},
     {"rest", ViewVerb::rest, ScriptArguments::on_or_off, "rest on"},
     {"stack", ViewVerb::stack, ScriptArguments::on_or_off, "stack on"},
     {"watch", ViewVerb::watch, ScriptArguments::watched, "watch \"device x\""},
     {"speed", ViewVerb::speed, ScriptArguments::number, "speed 0.1"},
     {"restart", ViewVerb::restart, ScriptArguments::none, "restart"},
     {"edit", ViewVerb::edit, ScriptArguments::edit, "edit tool stiffness 600"},
     {"model", ViewVerb::change, ScriptArguments::change, "model brain rigid"},
     {"energy", ViewVerb::change, ScriptArguments::change, "energy brain trilinear"},
     {"spacing", ViewVerb::change, ScriptArguments::change, "spacing brain 2.5"},
     {"young", ViewVerb::change, ScriptArguments::change, "young fat 3000"},
     {"poisson", ViewVerb::change, ScriptArguments::change, "poisson fat 0.45"},
     {"shortest", ViewVerb::change, ScriptArguments::change, "shortest fat 0.7"},
     {"longest", ViewVerb::change, ScriptArguments::change, "longest fat 1.3"},
     {"shear", ViewVerb::change, ScriptArguments::change, "shear fat 0.3"},
     {"radius", ViewVerb::change, ScriptArguments::change, "radius 3"},
     {"move", ViewVerb::change, ScriptArguments::change, "move plate 0 0 2"},
     {"difference", ViewVerb::difference, ScriptArguments::difference, "difference brain as-is trilinear 3"},
     {"back", ViewVerb::look_back, ScriptArguments::number, "back 5"},
     {"go-on", ViewVerb::go_on, ScriptArguments::none, "go-on"},
     {"arrows", ViewVerb::arrows, ScriptArguments::on_or_off, "arrows on"},
     {"select", ViewVerb::select, ScriptArguments::object, "select bone"},
     {"show", ViewVerb::show, ScriptArguments::look_of, "show bone"},
     {"hide", ViewVerb::show, ScriptArguments::look_of, "hide abdomen fat"},
     {"opacity", ViewVerb::opacity, ScriptArguments::look_of, "opacity bone 0.3"},
     {"map", ViewVerb::map, ScriptArguments::on_or_off, "map on"},
     {"trail", ViewVerb::trail, ScriptArguments::on_or_off, "trail on"},
     {"open", ViewVerb::open, ScriptArguments::file, "open scenes/cube.toml"},
     {"wires", ViewVerb::wires, ScriptArguments::on_or_off, "wires on"},
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

// The arguments of a change of the scene: its owner's name, and one number, one of two words, or for an
// object three numbers.
struct ChangeArguments {
  enum class Of : std::uint8_t { tissue, material, object, tool };
  std::string_view command;
  SceneChange::Key key;
  Of of;
  std::array<std::string_view, 2> words{};   // for 0 and 1; empty: numbers
  double low = 0.0, high = 0.0, unit = 1.0;  // of numbers, and the SI value of one; as scenes allow
};
constexpr double kMostShare = 1e6;  // of a link's length; scenes refuse larger ones
const std::array<ChangeArguments, 10> kChanges{
    {{"model", SceneChange::Key::model, ChangeArguments::Of::tissue, {"voxels", "rigid"}},
     {"energy", SceneChange::Key::energy, ChangeArguments::Of::tissue, {"six-link", "trilinear"}},
     {"spacing", SceneChange::Key::spacing, ChangeArguments::Of::tissue, {}, kLeast_mm, kMost_mm, 1e-3},
     {"young", SceneChange::Key::young, ChangeArguments::Of::material, {}, 1e-3, 1e13},
     {"poisson", SceneChange::Key::poisson, ChangeArguments::Of::material, {}, 0.0, std::nextafter(0.5, 0.0)},
     {"shortest",
      SceneChange::Key::shortest,
      ChangeArguments::Of::material,
      {},
      std::nextafter(0.0, 1.0),
      1.0},
     {"longest", SceneChange::Key::longest, ChangeArguments::Of::material, {}, 1.0, kMostShare},
     {"shear", SceneChange::Key::shear, ChangeArguments::Of::material, {}, 0.0, kMostShare},
     {"radius", SceneChange::Key::radius, ChangeArguments::Of::tool, {}, 0.0, kMost_mm, 1e-3},
     {"move", SceneChange::Key::move, ChangeArguments::Of::object, {}, -kMost_mm, kMost_mm, 1e-3}}};

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

  void read_look_of(const ScriptCommand& command, ViewAction& action) const {
    const std::size_t numbers = command.verb == ViewVerb::opacity ? 1 : 0;
    expect(1 + numbers, 2 + numbers);
    action.object = object(2, false);
    if (words_.size() == 4 + numbers) action.text = material_within(action.object, 3);
    if (numbers == 1) action.numbers = {number(words_.size() - 1, 0.0, 1.0)};
  }
  [[nodiscard]] std::string material_within(std::uint32_t object, std::size_t n) const {
    const std::vector<std::string>& materials = scene_.objects[object].inside.materials;
    if (std::ranges::find(materials, words_[n]) != materials.end()) return words_[n];
    std::string names;
    for (const std::string& name : materials) names += (names.empty() ? "; it has " : ", ") + name;
    refuse("'" + scene_.objects[object].name + "' has no material '" + words_[n] + "'" + names);
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

  void read_change(const ScriptCommand& command, ViewAction& action) const {
    const auto kind = std::ranges::find(kChanges, command.name, &ChangeArguments::command);
    const bool named = kind->of != ChangeArguments::Of::tool;
    const std::size_t values = kind->of == ChangeArguments::Of::object ? 3 : 1, first = named ? 3 : 2;
    expect(first - 2 + values, first - 2 + values);
    SceneChange& change = action.change;
    change.key = kind->key;
    if (kind->of == ChangeArguments::Of::tissue) change.name = tissue(2);
    if (kind->of == ChangeArguments::Of::material) change.name = material(2);
    if (kind->of == ChangeArguments::Of::object) change.name = scene_.objects[object(2, false)].name;
    for (std::size_t n = 0; n < values; ++n) {
      double& value = change.value[static_cast<glm::length_t>(n)];
      if (kind->words[0].empty()) {
        value = kind->unit * number(first + n, kind->low, kind->high);
      } else if (words_[first] == kind->words[0] || words_[first] == kind->words[1]) {
        value = words_[first] == kind->words[1] ? 1.0 : 0.0;
      } else {
        refuse("'" + words_[first] + "' is not known there" + example());
      }
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
      case ScriptArguments::look_of:
        read_look_of(command, action);
        break;
      case ScriptArguments::edit:
        read_edit(action);
        break;
      case ScriptArguments::change:
        read_change(command, action);
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
        expect(command.verb == ViewVerb::open ? 1 : 0, 1);
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

std::vector<std::string> words_of_script_line(std::string_view line) {
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

ReadScriptLine read_script_line(std::vector<std::string> words, const std::string& place,
                                const DrawnScene& scene) {
  const ScriptLine line(std::move(words), place, scene);
  return {line.time(), line.action()};
}

}  // namespace hybrid
