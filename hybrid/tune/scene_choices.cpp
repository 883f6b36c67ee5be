// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/scene_choices.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "hybrid/base/number_text.h"
#include "hybrid/scene/edit_text.h"
#include "hybrid/scene/read_scene_text.h"
#include "hybrid/tune/setting.h"

namespace hybrid {
namespace {

using Key = SceneChange::Key;

// Spacings that are offered (unit: the present one). A finer one costs up to eight times as much.
constexpr std::array kSpacingFactors{0.5, 2.0 / 3.0, 1.5, 2.0};
constexpr int kWrittenDigits = 6;  // digits of a number in the text: far finer than a hand can tell

// The objects that may be changed. They include objects that the scene renders as rigid, because these have
// voxels to return to.
std::vector<TunableObject> changeable_objects(const Scene& as_read) {
  Scene as_voxels = as_read;
  std::set<std::string> rigid;
  for (SoftDescription& soft : as_voxels.soft) {
    if (soft.model != SoftModel::proxy) continue;
    rigid.insert(soft.name);
    soft.model = SoftModel::voxels;
  }
  std::vector<TunableObject> objects = tunable_objects(as_voxels);
  for (TunableObject& object : objects)
    object.own.proxy = object.own.proxy || rigid.contains(object.own.object);
  return objects;
}

glm::dvec3 spacing_of(const TunableObject& object, const ObjectSetting& setting) {
  return setting.spacing == glm::dvec3(0.0) ? object.finest : setting.spacing;
}
double least(const glm::dvec3& v) {
  return std::min({v.x, v.y, v.z});
}
std::string spacing_words(const glm::dvec3& spacing_m) {
  const auto mm = [](double v) { return with_digits(1e3 * v, 3); };
  if (mm(spacing_m.x) == mm(spacing_m.y) && mm(spacing_m.y) == mm(spacing_m.z))
    return mm(spacing_m.x) + " mm";
  return mm(spacing_m.x) + " x " + mm(spacing_m.y) + " x " + mm(spacing_m.z) + " mm";
}

std::set<std::string> materials_of(const SoftDescription& soft) {
  std::set<std::string> names{soft.material};
  for (const auto& [label, name] : soft.materials) names.insert(name);
  return names;
}

std::string shared_with(const Scene& scene, const std::string& material, const std::string& object) {
  std::vector<std::string> others;
  for (const SoftDescription& soft : scene.soft) {
    if (soft.name != object && materials_of(soft).contains(material)) others.push_back(soft.name);
  }
  return fmt::format("{}", fmt::join(others, ", "));
}

void add_materials(const Scene& scene, const SoftDescription& soft, ObjectChoices& choices) {
  for (const std::string& name : materials_of(soft)) {
    const auto found = scene.materials.find(name);
    if (found == scene.materials.end()) {
      choices.note += std::string(choices.note.empty() ? "" : "; ") + "its material has no name in the scene";
    } else {
      const Material& material = found->second;
      choices.materials.push_back({.name = name,
                                   .young_Pa = material.young_Pa,
                                   .poisson = material.poisson,
                                   .shortest = material.stretch_min,
                                   .longest = material.stretch_max,
                                   .shear = material.shear,
                                   .shared_with = shared_with(scene, name, soft.name)});
    }
  }
}

ObjectChoices choices_of(const Scene& as_read, const TunableObject& object, const SoftDescription& soft) {
  const glm::dvec3 spacing = spacing_of(object, object.own);
  ObjectChoices choices{.tissue = true,
                        .as_rigid = object.own.proxy,
                        .trilinear = object.own.energy == Energy::trilinear,
                        .other_model = object.other_model,
                        .other_energy = object.other_energy,
                        .spacing_m = least(spacing) * as_read.unit_m,
                        .spacing_words = spacing_words(spacing * as_read.unit_m),
                        .note = object.note};
  glm::dvec3 last = spacing;
  for (const double factor : kSpacingFactors) {
    const glm::dvec3 other = spacing_of(object, scaled(object, factor));
    if (other == spacing || other == last) continue;
    choices.spacings.push_back({least(other) * as_read.unit_m, spacing_words(other * as_read.unit_m)});
    last = other;
  }
  add_materials(as_read, soft, choices);
  return choices;
}

std::string why_fixed_while_felt(const Scene& as_read) {
  if (as_read.real_device) return "fixed while it is felt with a real device";
  for (const RigidDescription& rigid : as_read.rigid) {
    if (!std::holds_alternative<std::monostate>(rigid.motion))
      return "fixed while it is felt, because \"" + rigid.name + "\" moves";
  }
  return {};
}

// ---- the text ----

void set(SceneTextEditor& editor, const TextTable& table, const std::string& key, const std::string& value) {
  const std::string why_not = editor.set(table, key, value);
  if (!why_not.empty())
    throw std::runtime_error(fmt::format("the key '{}' of \"{}\" cannot be changed in the scene's text: {}",
                                         key, table.part.empty() ? table.name : table.part, why_not));
}

std::string number(double value) {
  return with_digits(value, kWrittenDigits);
}

void change_tissue(SceneTextEditor& editor, const Scene& as_read, const SceneChange& change) {
  const auto objects = changeable_objects(as_read);
  const auto found = std::ranges::find(
      objects, change.name, [](const TunableObject& object) -> const auto& { return object.own.object; });
  if (found == objects.end())
    throw std::runtime_error("\"" + change.name + "\" is no tissue, so it has one model only");
  const TunableObject& object = *found;
  const TextTable table{"soft", change.name};
  if (change.key == Key::model) {
    if (!object.other_model) throw std::runtime_error("a punch is felt by voxels alone");
    set(editor, table, "model", change.value.x != 0.0 ? "\"proxy\"" : "\"voxels\"");
  } else if (change.key == Key::energy) {
    if (!object.other_energy) throw std::runtime_error("\"" + change.name + "\": " + object.note);
    set(editor, table, "energy",
        fmt::format("\"{}\"", energy_name(change.value.x != 0.0 ? Energy::trilinear : Energy::six_link)));
  } else {
    const double scale = change.value.x / (least(spacing_of(object, object.own)) * as_read.unit_m);
    const ObjectSetting setting = scaled(object, scale);
    if (setting.spacing != glm::dvec3(0.0)) set(editor, table, "spacing", spacing_text(setting.spacing));
  }
}

// The limits of a material's length are one key with two numbers.
void change_material(SceneTextEditor& editor, const Scene& as_read, const SceneChange& change) {
  const TextTable table{"material", "", change.name};
  const auto named = as_read.materials.find(change.name);
  const Material before = named != as_read.materials.end() ? named->second : Material{};
  const double x = change.value.x;
  switch (change.key) {
    case Key::young:
      return set(editor, table, "young", number(x));
    case Key::poisson:
      return set(editor, table, "poisson", number(x));
    case Key::shear:
      return set(editor, table, "shear", number(x));
    default:
      return set(editor, table, "stretch",
                 fmt::format("[{}, {}]", number(change.key == Key::shortest ? x : before.stretch_min),
                             number(change.key == Key::longest ? x : before.stretch_max)));
  }
}

bool is_of_material(Key key) {
  return key == Key::young || key == Key::poisson || key == Key::shortest || key == Key::longest ||
         key == Key::shear;
}

void move(SceneTextEditor& editor, const Scene& as_read, const SceneChange& change) {
  const auto move_in = [&](const auto& objects, const char* list) {
    for (const auto& object : objects) {
      if (object.name != change.name) continue;
      const glm::dvec3 to = (object.pose.position_m + change.value) / as_read.unit_m;
      set(editor, {list, change.name}, "position",
          fmt::format("[{}, {}, {}]", number(to.x), number(to.y), number(to.z)));
      return true;
    }
    return false;
  };
  if (!move_in(as_read.rigid, "rigid") && !move_in(as_read.soft, "soft"))
    throw std::runtime_error("there is no object \"" + change.name + "\"");
}

}  // namespace

void add_choices(const Scene& as_read, DrawnScene& drawn) {
  const std::string why_fixed = why_fixed_while_felt(as_read);
  for (const TunableObject& changeable : changeable_objects(as_read)) {
    const std::string& name = changeable.own.object;
    const auto soft = std::ranges::find(as_read.soft, name, &SoftDescription::name);
    for (DrawnObject& object : drawn.objects) {
      if (object.name == name) object.choices = choices_of(as_read, changeable, *soft);
    }
  }
  drawn.tool_choices = {.open = why_fixed.empty(), .radius_m = as_read.tool.radius_m, .note = why_fixed};
  for (DrawnObject& object : drawn.objects) {
    object.choices.open = why_fixed.empty();
    if (!why_fixed.empty()) object.choices.note = why_fixed;
  }
}

std::string changed_text(const std::string& text, const std::filesystem::path& file,
                         std::span<const SceneChange> changes) {
  SceneTextEditor editor(text, file);
  for (const SceneChange& change : changes) {
    const Scene as_read = read_scene_text(editor.text(), file);
    if (is_of_material(change.key)) {
      change_material(editor, as_read, change);
    } else if (change.key == Key::radius) {
      set(editor, {"tool"}, "radius", number(change.value.x / as_read.unit_m));
    } else if (change.key == Key::move) {
      move(editor, as_read, change);
    } else {
      change_tissue(editor, as_read, change);
    }
  }
  return editor.text();
}

std::string text_with_mesh(const std::string& text, const std::filesystem::path& file,
                           const std::filesystem::path& mesh) {
  const Scene as_read = read_scene_text(text, file);
  const auto is_taken = [&](const std::string& name) {
    return std::ranges::find(as_read.rigid, name, &RigidDescription::name) != as_read.rigid.end() ||
           std::ranges::find(as_read.soft, name, &SoftDescription::name) != as_read.soft.end();
  };
  const auto quoted = [](const std::string& words) {
    std::string out = "\"";
    for (const char c : words) {
      if (static_cast<unsigned char>(c) < 0x20)
        throw std::runtime_error("the name of the file has control characters");
      if (c == '"' || c == '\\') out += '\\';
      out += c;
    }
    return out + "\"";
  };
  std::filesystem::path stem = mesh.stem();
  if (!stem.extension().empty() && mesh.extension() == ".gz") stem = stem.stem();
  std::string name = stem.string();
  for (int n = 2; is_taken(name); ++n) name = stem.string() + " " + std::to_string(n);
  return text + (text.ends_with('\n') ? "" : "\n") + "\n[[rigid]]\nname = " + quoted(name) +
         "\nmesh = " + quoted(std::filesystem::absolute(mesh).string()) + "\n";
}

std::string in_words(const SceneChange& change) {
  const auto mm = [](double v) { return with_digits(1e3 * v, 3); };
  const double x = change.value.x;
  switch (change.key) {
    case Key::model:
      return change.name + (x != 0.0 ? ": as rigid" : ": by its voxels");
    case Key::energy:
      return change.name + ": " + energy_name(x != 0.0 ? Energy::trilinear : Energy::six_link);
    case Key::spacing:
      return change.name + ": voxels of " + mm(x) + " mm";
    case Key::young:
      return change.name + ": " + with_digits(1e-3 * x, 3) + " kPa";
    case Key::poisson:
      return change.name + ": Poisson's ratio " + with_digits(x, 3);
    case Key::shortest:
      return change.name + ": links at least " + with_digits(x, 3) + " of their length";
    case Key::longest:
      return change.name + ": links at most " + with_digits(x, 3) + " of their length";
    case Key::shear:
      return change.name + ": links slip by at most " + with_digits(x, 3);
    case Key::radius:
      return "tool: radius " + mm(x) + " mm";
    case Key::move:
      return change.name + ": moved by " + mm(x) + ", " + mm(change.value.y) + ", " + mm(change.value.z) +
             " mm";
  }
  return {};
}

}  // namespace hybrid
