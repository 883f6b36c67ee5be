// SPDX-License-Identifier: GPL-3.0-or-later
// Plays a scene with one setting along a motion, at normal speed (forces, times of ticks, size) or slowly
// (forces for the truth).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "hybrid/session/session.h"

namespace hybrid {

struct Motion {
  std::shared_ptr<const device::Path> path;
  std::uint64_t ticks = 0;  // length of a session
};

// The scene's own path, and half a second after it, as in a session.
Motion scene_motion(const Scene& scene);

struct Played {
  ForceCourse course;           // forces of the coupling; damping and texture would add the same to all
  std::vector<double> tick_us;  // processor time of each tick
  std::uint64_t memory_bytes = 0, soft_voxels = 0;
  double load_s = 0.0;
  std::vector<std::string> faults;
};

// Plays a session on an ideal device (on_ideal_device()) at a fixed step. `objects`: names of the objects
// whose contact counts as soft, even if they are rendered by the proxy. Throws SceneError, std::exception,
// and device::StopAsked after a signal.
Played play_setting(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                    const Progress& progress);

// Plays the same session `slower` times slower wherever one of the objects is felt (compare_with_slow_run()),
// and at normal speed elsewhere.
ForceCourse play_slowly(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                        int slower, const Progress& progress);

// The same motion, 1.5 times faster and moved by `offset_m`. It serves to confirm the choice, because no
// setting was chosen on it.
Motion other_motion(const Motion& motion, double rate_hz, const glm::dvec3& offset_m);
inline constexpr double kOtherSpeed = 1.5;  // factor on the speed of the motion

}  // namespace hybrid
