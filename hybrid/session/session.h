// SPDX-License-Identifier: GPL-3.0-or-later
// A haptic session: a built scene, a device, and ticks until the path ends. One scene builder and one session
// serve the program, the tests and the benchmarks.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "device/loop/haptic_device.h"
#include "device/loop/servo_loop.h"
#include "device/paths/path.h"
#include "hybrid/base/histogram.h"
#include "hybrid/build/build_world.h"
#include "hybrid/build/load_scene.h"
#include "hybrid/session/black_box.h"
#include "hybrid/session/clearance.h"
#include "hybrid/session/felt_materials.h"
#include "hybrid/session/force_error.h"
#include "hybrid/session/forces_between.h"
#include "hybrid/snapshot/snapshot.h"
#include "hybrid/tick/tick.h"
#include "hybrid/world/edits.h"

namespace hybrid {

// Percentiles of `values`; all are zero if `values` is empty. Reorders `values`.
Percentiles percentiles(std::vector<double>& values);

// One tick of a recording: the input, and the running hash of all forces up to and including this tick.
struct RecordedTick {
  glm::dvec3 device_m{0.0};
  std::uint64_t hash = 0;
  device::DeviceFault fault = device::DeviceFault::none;
  std::uint64_t arrived = 0;    // one bit for each soft object whose asynchronous result arrived in this tick
  std::uint8_t work_share = 0;  // WorkShare::steps()
};
// Call before a replayed tick. Restores the inputs that depended on the machine: the results that arrived,
// and the work budget.
void restore_tick_timing(const RecordedTick& tick, WorldState& state) noexcept;

inline constexpr double kFrames_per_s = 30.0;  // of a session's video

struct SessionOptions {
  std::optional<double> seconds;  // default: length of the path plus half a second; a real device: a minute
  bool realtime = false;          // true: paced by a real timer. False: fixed-step, as fast as possible
  // A real device, which always runs in real time. It must be open and placed in the scene, with the tool
  // outside all rigid objects. Null: the scene's simulated device.
  device::HapticDevice* real_device = nullptr;
  bool keep_rows = true;  // trace rows and per-object forces
  // Keep every input (48 bytes a tick). With neither inputs nor rows, memory does not grow.
  bool keep_recording = true;
  bool keep_clearance = false;  // keep distances between objects, at about a thousand moments
  // Greatest number of moments, evenly spread, at which the forces between objects are computed. They are
  // also computed at the end; in real time, only there.
  int between_samples = 0;
  bool between_every_tick = false;  // at every tick instead, and keep each pair's force; not in real time
  bool keep_picture = false;        // keep the snapshot with the most contact
  std::shared_ptr<const AskedPoints> picture_points{};  // points whose displacements snapshots carry
  // Called kFrames_per_s times a second of the session, by the thread that runs it; not in real time. Must
  // not throw.
  std::function<void(const Snapshot&)> on_frame{};
  // Compare the force of each tick in which something soft is in contact with that of a slow run
  // (force_error.h). `reference`: how carefully the slow run is played. In real time nothing is compared.
  bool measure_error = false;
  Reference reference = Reference::quick;
  // Clocks, counters and path begin as if this many ticks had passed, so that a soft start is over. The
  // forces do not depend on this number.
  std::uint64_t start_ticks = 0;
  Progress progress;
  // Relax tissue away from the contact asynchronously; in real time, on a separate thread.
  bool async_relaxation = false;
  bool relaxation_thread = true;  // false: submitted states are never relaxed; for benchmarks
  // How often the relaxation thread publishes surfaces for drawing.
  double surfaces_hz = 0.0;
  BlackBox* black_box = nullptr;               // every tick is added to it
  std::shared_ptr<const device::Path> path{};  // path of the hand; null: the scene's path
  std::vector<Edit> edits{};  // in order of their ticks; edits without effect are not kept in the result
};

struct SessionResult {
  std::uint64_t ticks = 0, contact_ticks = 0, deadline_misses = 0;
  std::uint64_t planned_ticks = 0;  // greater than `ticks` if a signal or the device ended the session
  double dt_s = 0.0;
  std::uint64_t state_hash = 0;
  std::vector<TraceRow> rows;
  std::vector<std::vector<double>> object_force_N;        // [object][row]
  ClearanceCourse clearance;                              // filled with keep_clearance, if anything is soft
  ForcesCourse between;                                   // filled with between_samples
  std::vector<std::uint64_t> object_contact_ticks;        // [object]
  std::vector<double> object_max_force_N;                 // [object]
  std::vector<std::vector<FeltMaterial>> felt_materials;  // [soft object][material]
  LatencyHistogram tick_us;
  std::array<LatencyHistogram, kStages> stage_us;
  double max_force_N = 0.0, rms_force_N = 0.0;
  ForceError error;
  std::optional<Snapshot> moment;       // filled with keep_picture
  std::vector<RecordedTick> recording;  // filled with keep_recording
  std::vector<Edit> edits{};            // the edits that were applied
  // Position of device and proxy when the session began. The device may be elsewhere at the first tick.
  glm::dvec3 start_m{0.0};
  std::string device_name;
  device::ServoEnd end = device::ServoEnd::finished;
  std::vector<std::string> device_messages;  // events of the device, each with its remedy
  std::vector<std::string> path_notes;       // findings of the path's reader: gaps, repeated times
  std::string realtime_note;                 // the priority that was granted, in words
  // Delay with which the machine woke the loop. It is no part of a tick's time.
  Percentiles late_us;
  // CPU time of the ticks, and of asynchronous relaxation. In real time a thread spends the time of
  // relaxation. Otherwise it is the time of the work that such a thread would have done.
  double servo_s = 0.0, relaxation_s = 0.0;
  std::uint64_t async_results = 0;  // asynchronous results that ticks applied
  // Work budget of the contact in real time: the least share in any tick, and the number of ticks with less
  // than the whole budget.
  double least_work_share = 1.0;
  std::uint64_t ticks_with_less_work = 0;
};

// Adds notes on keys of the scene that have no effect with this kind of relaxation.
void note_relaxation(const Scene& scene, BuiltScene& built, bool async_relaxation);

// Runs the scene's path to its end on its device, or until a signal (StopOnSignal). After a signal the result
// covers the ticks so far, and `end` says so. Throws SceneError if the tool starts inside something rigid.
SessionResult run_session(const Scene& scene, BuiltScene& built, const SessionOptions& options);

// The parts of run_session(), for callers that drive the loop themselves.
std::shared_ptr<const device::Path> scene_path(const Scene& scene);
std::unique_ptr<device::HapticDevice> scene_device(const Scene& scene,
                                                   std::shared_ptr<const device::Path> path);
// Starts the proxy or throws SceneError.
void begin_session(const Scene& scene, const World& world, WorldState& state, const glm::dvec3& device_m);

// The row of tick number `tick`. Call right after that tick.
BlackBoxRow black_box_row(const device::ServoInput& input, const TickResult& felt, std::uint64_t tick,
                          const WorldState& state) noexcept;

// Hashes. The running hash covers proxy, force and contacts. The final hash also covers every displacement,
// the pose and motion of every rigid body, and the state of the force limits.
inline constexpr std::uint64_t kHashBegin = 0xCBF29CE484222325ULL;
std::uint64_t hash_tick(std::uint64_t before, const TickResult& tick) noexcept;
std::uint64_t hash_state(std::uint64_t before, const WorldState& state) noexcept;

}  // namespace hybrid
