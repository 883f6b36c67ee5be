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

// Percentiles of `values`; all zero when there are none. Reorders them.
Percentiles percentiles(std::vector<double>& values);

// One tick of a recording: its input, and the running hash of all forces up to and including it.
struct RecordedTick {
  glm::dvec3 device_m{0.0};
  std::uint64_t hash = 0;
  device::DeviceFault fault = device::DeviceFault::none;
  std::uint64_t arrived = 0;    // bit per soft object whose asynchronous result arrived in this tick
  std::uint8_t work_share = 0;  // WorkShare::steps()
};
// Call before a replayed tick: restores the inputs that depended on the machine (arrival of results, work
// budget).
void restore_tick_timing(const RecordedTick& tick, WorldState& state) noexcept;

struct SessionOptions {
  std::optional<double> seconds;  // default: the path's length and half a second; a real device: a minute
  bool realtime = false;          // paced by a real timer; else fixed-step, as fast as it goes
  // A real device: open, placed in the scene, the tool outside all rigid objects; always in real time. Null:
  // the scene's simulated device.
  device::HapticDevice* real_device = nullptr;
  bool keep_rows = true;        // trace rows and per-object forces
  bool keep_recording = true;   // every input, 48 bytes a tick: without it and the rows memory stays flat
  bool keep_clearance = false;  // distances between objects, at a thousand moments
  // Most moments, evenly spread, at which the forces between objects are computed, beside the end. In real
  // time the end alone.
  int between_samples = 0;
  bool keep_picture = false;  // keep the snapshot with the most contact
  // Most ticks whose force is compared with that of a slow run (force_error.h), evenly spread. The slow run
  // takes up to kSlower times as long as the session. None in real time.
  int reference_samples = 0;
  // Clocks, counters and path begin as after this many ticks, when a soft start is over. The forces do not
  // depend on it.
  std::uint64_t start_ticks = 0;
  Progress progress;
  // Tissue away from the contact is relaxed asynchronously: in real time on a thread of its own.
  bool async_relaxation = false;
  bool relaxation_thread = true;               // false: submitted states are never relaxed; for benchmarks
  double surfaces_hz = 0.0;                    // how often that thread publishes surfaces for drawing
  BlackBox* black_box = nullptr;               // every tick is added to it
  std::shared_ptr<const device::Path> path{};  // of the hand; null: the scene's path
  std::vector<Edit> edits{};  // in order of their ticks; those without effect are not kept in the result
};

struct SessionResult {
  std::uint64_t ticks = 0, contact_ticks = 0, deadline_misses = 0;
  std::uint64_t planned_ticks = 0;  // more than `ticks` where a signal or the device ended the session
  double dt_s = 0.0;
  std::uint64_t state_hash = 0;
  std::vector<TraceRow> rows;
  std::vector<std::vector<double>> object_force_N;        // [object][row]
  ClearanceCourse clearance;                              // of keep_clearance, where anything is soft
  ForcesCourse between;                                   // of between_samples
  std::vector<std::uint64_t> object_contact_ticks;        // [object]
  std::vector<double> object_max_force_N;                 // [object]
  std::vector<std::vector<FeltMaterial>> felt_materials;  // [soft object][material]
  LatencyHistogram tick_us;
  std::array<LatencyHistogram, kStages> stage_us;
  double max_force_N = 0.0, rms_force_N = 0.0;
  ForceError error;
  std::optional<Snapshot> moment;       // of keep_picture
  std::vector<RecordedTick> recording;  // of keep_recording
  std::vector<Edit> edits{};            // that were applied
  // Position of device and proxy as the session began. A late first tick may find the device elsewhere.
  glm::dvec3 start_m{0.0};
  std::string device_name;
  device::ServoEnd end = device::ServoEnd::finished;
  std::vector<std::string> device_messages;  // events of the device, each with its remedy
  std::vector<std::string> path_notes;       // findings of the path's reader: gaps, repeated times
  std::string realtime_note;                 // the priority that was granted, in words
  Percentiles late_us;                       // how late the machine woke the loop; not part of the tick
  // CPU time of the ticks, and of asynchronous relaxation: of its thread in real time, else of the work that
  // a thread would have done.
  double servo_s = 0.0, relaxation_s = 0.0;
  std::uint64_t async_results = 0;  // asynchronous results that ticks applied
  // Work budget of the contact in real time: the least share of any tick, and the number of ticks with less
  // than all.
  double least_work_share = 1.0;
  std::uint64_t ticks_with_less_work = 0;
};

// Adds notes on keys of the scene that have no effect with this kind of relaxation.
void note_relaxation(const Scene& scene, BuiltScene& built, bool async_relaxation);

// Runs the scene's path to its end on its device, or until a signal (StopOnSignal): then the result is of the
// ticks so far, and `end` says so. Throws SceneError: the tool starts inside something rigid.
SessionResult run_session(const Scene& scene, BuiltScene& built, const SessionOptions& options);

// The pieces, for callers that drive the loop themselves.
std::shared_ptr<const device::Path> scene_path(const Scene& scene);
std::unique_ptr<device::HapticDevice> scene_device(const Scene& scene,
                                                   std::shared_ptr<const device::Path> path);
// Starts the proxy or throws SceneError.
void begin_session(const Scene& scene, const World& world, WorldState& state, const glm::dvec3& device_m);

// The row of tick number `tick`, which has just ended.
BlackBoxRow black_box_row(const device::ServoInput& input, const TickResult& felt, std::uint64_t tick,
                          const WorldState& state) noexcept;

// Hashes. The running one covers the forces; the final one also every displacement, the pose and motion of
// every rigid body, and the state of the force limits.
inline constexpr std::uint64_t kHashBegin = 0xCBF29CE484222325ULL;
std::uint64_t hash_tick(std::uint64_t before, const TickResult& tick) noexcept;
std::uint64_t hash_state(std::uint64_t before, const WorldState& state) noexcept;

// A snapshot of now.
Snapshot take_snapshot(const World& world, const WorldState& state, const TickResult& tick, double t_s);

}  // namespace hybrid
