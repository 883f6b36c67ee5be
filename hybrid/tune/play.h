// SPDX-License-Identifier: GPL-3.0-or-later
// Plays a scene with one setting along a motion: forces, times of ticks, size. Plays it slowly for the truth.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hybrid/session/session.h"

namespace hybrid {

struct Motion {
  std::shared_ptr<const device::Path> path;
  std::uint64_t ticks = 0;  // of a session
};

// The scene's own path, and the half second after it that a session has.
Motion scene_motion(const Scene& scene);

struct Played {
  ForceCourse course;           // the force of the coupling: what damping and texture add is the same in all
  std::vector<double> tick_us;  // processor time of each tick
  std::uint64_t memory_bytes = 0, soft_voxels = 0;
  double load_s = 0.0;
  std::vector<std::string> faults;
};

// A session on an ideal device (on_ideal_device()), at a fixed step. `objects`: names of the objects whose
// contact counts as soft, also where they are felt through the proxy. Throws SceneError, std::exception; and
// device::StopAsked when a signal came.
Played play_setting(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                    const Progress& progress);

// The same session played so many times slower wherever one of the objects is felt (compare_with_slow_run());
// elsewhere as it is.
ForceCourse play_slowly(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                        int slower, const Progress& progress);

// The motion 1.5 times faster and moved by `offset_m`: one on which nothing was chosen.
Motion other_motion(const Motion& motion, double rate_hz, const glm::dvec3& offset_m);
inline constexpr double kOtherSpeed = 1.5;

}  // namespace hybrid
