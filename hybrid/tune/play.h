// SPDX-License-Identifier: GPL-3.0-or-later
// Plays a scene with one setting along a motion. A session at normal speed gives forces, times of ticks and
// size. A session from pose to pose, with tissue at rest in each, gives the forces of the truth.
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
  bool on_patches = false;  // an object is on nested patches
  std::vector<std::string> faults;
};

// Plays a session on an ideal device (on_ideal_device()) at a fixed step. `objects`: names of the objects
// whose contact counts as soft, even if they are rendered by the proxy. Throws SceneError, std::exception,
// and device::StopAsked after a signal.
Played play_setting(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                    const Progress& progress);

// The ticks in which a motion is stopped. All have an entry for each tick.
struct Poses {
  std::vector<bool> held;
  std::vector<bool> near;   // near a contact
  std::vector<bool> stops;  // the first tick of a stop, after which all stay at rest
};
// Poses of a motion that a session felt as `course`. They are at most `most` ticks near a contact in which
// something moves, evenly spread, and the stops near a contact. `bodies_move`: rigid bodies move even if the
// device does not, so that there are no stops.
Poses poses_along(const ForceCourse& course, double dt_s, bool bodies_move, int most);
// Every `n`-th pose in motion, and all stops.
Poses every_nth(const Poses& poses, std::size_t n);

// Forces of tissue at rest.
struct RestCourse {
  // at_rest is false in ticks in or near contact that are not held, because tissue lags behind the tool
  // there.
  ForceCourse course;
  // The same after half of the time that each pose was held.
  ForceCourse halfway;
  Poses poses;
};

// Plays a motion and stops it in each pose, until tissue is at rest; bodies do not move meanwhile. Where one
// of the objects is felt, the device moves `slower` times slower between the poses.
RestCourse play_to_rest(const Scene& scene, const std::vector<std::string>& objects, const Motion& motion,
                        const Poses& poses, int slower, const Progress& progress);

// The same motion, `speed` times faster and moved by `offset_m`.
Motion other_motion(const Motion& motion, double rate_hz, double speed, const glm::dvec3& offset_m);

}  // namespace hybrid
