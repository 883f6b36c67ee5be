// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/edit_scene.h"

#include <fmt/format.h>

#include <stdexcept>

#include "hybrid/base/number_text.h"
#include "hybrid/scene/edit_text.h"

namespace hybrid {
namespace {

struct Wanted {
  std::string key, value;
};

// The keys whose value differs from that in the file.
std::vector<Wanted> wanted_of(const TunableObject& object, const ObjectSetting& setting) {
  std::vector<Wanted> wanted;
  if (setting.proxy != object.own.proxy)
    wanted.push_back({"model", setting.proxy ? "\"proxy\"" : "\"voxels\""});
  if (setting.proxy) return wanted;
  if (setting.spacing != object.own.spacing && setting.spacing != glm::dvec3(0.0))
    wanted.push_back({"spacing", spacing_text(setting.spacing)});
  if (setting.energy != object.own.energy)
    wanted.push_back({"energy", fmt::format("\"{}\"", energy_name(setting.energy))});
  if (setting.work != object.own.work) wanted.push_back({"work", with_digits(setting.work, kSpacingDigits)});
  if (setting.patch != object.own.patch) wanted.push_back({"patch", std::to_string(setting.patch)});
  return wanted;
}

// Sets keys of one table. Returns false if the text cannot be edited.
bool set_keys(SceneTextEditor& editor, const TextTable& table, const std::vector<Wanted>& wanted,
              const std::string& comment) {
  std::vector<std::string> keys;
  for (const Wanted& w : wanted) {
    if (!editor.set(table, w.key, w.value).empty()) return false;
    keys.push_back(w.key);
  }
  return editor.comment_above(table, keys, comment);
}

}  // namespace

std::string edited_scene(std::string_view text, const std::filesystem::path& file,
                         const std::vector<TunableObject>& objects, const Setting& setting,
                         const std::string& reason, std::string_view mark) {
  SceneTextEditor editor{std::string(text), file};
  bool good = true, any = false;
  const auto set = [&](const TextTable& table, const std::vector<Wanted>& wanted) {
    if (wanted.empty() || !good) return;
    if (!any) editor.remove_comments(mark);  // the new reasons replace those of an earlier choice
    any = true;
    good = set_keys(editor, table, wanted, std::string(mark) + reason);
  };
  for (std::size_t n = 0; n < objects.size(); ++n)
    set({"soft", objects[n].own.object}, wanted_of(objects[n], setting.objects.at(n)));
  if (setting.coupling_N_per_m) set({"tool"}, {{"stiffness", coupling_text(*setting.coupling_N_per_m)}});
  if (good) return editor.text();
  throw std::runtime_error(
      fmt::format("{}: its text cannot be edited safely; write these lines yourself:\n{}", file.string(),
                  as_toml(setting)));
}

}  // namespace hybrid
