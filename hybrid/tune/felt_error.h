// SPDX-License-Identifier: GPL-3.0-or-later
// The difference between two sessions along one motion, in JND. Only ticks count in which at least one of the
// two sessions feels something soft, and in which the reference is at rest.
#pragma once

#include <cstddef>

#include "hybrid/compare/compare_scenes.h"
#include "hybrid/session/force_error.h"

namespace hybrid {

using FeltError = ScenesDifference;

struct SettingError {
  FeltError moving, still;  // moving: the device is faster than kStill_m_per_s
  [[nodiscard]] double worst_jnd() const {
    return moving.p99_jnd > still.p99_jnd ? moving.p99_jnd : still.p99_jnd;
  }
};

// The worse of two errors by their p99, for each kind of ticks.
SettingError worse(const SettingError& a, const SettingError& b);

// `ticks`: number of ticks, from the start, that count. The JND is that of the reference's force.
SettingError felt_error(const ForceCourse& course, const ForceCourse& reference, double floor_N, double dt_s,
                        std::size_t ticks = static_cast<std::size_t>(-1));

}  // namespace hybrid
