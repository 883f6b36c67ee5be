// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>

#include "hybrid/tune/tune.h"

namespace hybrid {
namespace {

// Spacings of the sweep, as multiples of the scene's own. Finer voxels are not tried, because the truth has
// the scene's voxels.
constexpr std::array kScales{1.0, 1.125, 1.25, 1.5, 1.75, 2.0, 2.25, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0};
constexpr std::array kQuickScales{1.0, 1.25, 1.5, 2.0, 3.0, 5.0};  // factors with --quick
// Shares of the work in a tick that are tried. On nested patches every share below 2/3 is the same: one axis
// a tick, in turns.
constexpr std::array kLessWork{0.5, 0.25};
constexpr double kStep = 1.5;  // factor on the spacing of one object while the others stay

void add_new(std::vector<Setting>& settings, const Setting& setting) {
  if (std::ranges::find(settings, setting) == settings.end()) settings.push_back(setting);
}

Setting common(const std::vector<TunableObject>& objects, double scale, Energy energy) {
  Setting setting;
  for (const TunableObject& object : objects) {
    ObjectSetting one = scaled(object, scale);
    one.proxy = false;
    if (object.other_energy) one.energy = energy;
    setting.objects.push_back(one);
  }
  return setting;
}

}  // namespace

std::vector<Setting> common_settings(const std::vector<TunableObject>& objects, bool quick) {
  std::vector<Setting> settings{own_setting(objects)};
  const auto add_scale = [&](double scale) {
    for (const Energy energy : {Energy::six_link, Energy::trilinear})
      add_new(settings, common(objects, scale, energy));
  };
  if (quick) {
    std::ranges::for_each(kQuickScales, add_scale);
  } else {
    std::ranges::for_each(kScales, add_scale);
  }
  Setting rigid = own_setting(objects);
  for (std::size_t n = 0; n < objects.size(); ++n) {
    if (objects[n].other_model) rigid.objects[n].proxy = true;
  }
  add_new(settings, rigid);
  return settings;
}

std::vector<Setting> settings_with_less_work(const Setting& from, bool on_patches) {
  std::vector<Setting> settings;
  const auto add = [&](double work, int patch) {
    Setting setting = from;
    for (ObjectSetting& one : setting.objects) {
      if (one.proxy) continue;
      one.work = std::min(one.work, work);
      one.patch = std::min(one.patch, patch);
    }
    if (!(setting == from)) add_new(settings, setting);
  };
  if (on_patches) {
    for (const double work : {1.0, kLessWork.front()}) {
      add(work, kMostPatchMargin);
      add(work, kLeastPatchMargin);
    }
  } else {
    for (const double work : kLessWork) add(work, kMostPatchMargin);
  }
  return settings;
}

std::vector<Setting> settings_beside(const std::vector<TunableObject>& objects, const Setting& from) {
  std::vector<Setting> settings;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    const auto add = [&](const auto& change) {
      Setting setting = from;
      change(setting.objects[n]);
      if (!(setting == from)) add_new(settings, setting);
    };
    const double scale = scale_of(objects[n], from.objects[n]);
    for (const double step : {kStep, 1.0 / kStep}) {
      add([&](ObjectSetting& one) { one.spacing = scaled(objects[n], scale * step).spacing; });
    }
    if (objects[n].other_energy) {
      add([&](ObjectSetting& one) {
        one.energy = one.energy == Energy::trilinear ? Energy::six_link : Energy::trilinear;
      });
    }
    if (objects[n].other_model) {
      add([&](ObjectSetting& one) {
        one = objects[n].own;
        one.proxy = true;
      });
    }
  }
  return settings;
}

}  // namespace hybrid
