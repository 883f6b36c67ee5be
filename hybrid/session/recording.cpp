// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "device/loop/stop_signal.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/build/choose_model.h"
#include "hybrid/scene/read_scene_text.h"
#include "hybrid/scene/toml_tree.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/tick/tissue/work_budget.h"

namespace hybrid {
namespace {

// Layout, little-endian: magic, sizes of path and text, number of ticks, dt, the device's force limit,
// resolution and friction, flag for asynchronous relaxation, state hash, device position before the first
// tick, path, text, ticks, edits. A tick: x, y, z, hash, device fault, work share, arrived asynchronous
// results. An edit: tick, object, quantity, value. Version 4 has no edits and is still read; a recording
// without edits is written as version 4.
constexpr std::array<char, 8> kMagic{'h', 'y', 'b', 'r', 'i', 'd', 'R', '5'};
constexpr std::array<char, 8> kMagicWithoutEdits{'h', 'y', 'b', 'r', 'i', 'd', 'R', '4'};
struct Header {
  std::array<char, 8> magic;
  std::uint64_t path_bytes, text_bytes, ticks;
  double dt_s, max_force_N, resolution_m, friction_N;
  std::uint64_t async_relaxation, state_hash;
  std::array<double, 3> start;
};
struct Tick {
  std::array<double, 3> position;
  std::uint64_t hash;
  std::uint32_t fault, work_share;
  std::uint64_t arrived;
};
static_assert(sizeof(Header) == 104 && sizeof(Tick) == 48, "the file's layout has no padding");

// Edits fill the rest of the file.
bool are_edits(std::uint64_t bytes, bool with_edits) {
  return with_edits ? bytes % sizeof(Edit) == 0 : bytes == 0;
}

bool is_edit(const Edit& edit) {
  return static_cast<std::uint32_t>(edit.quantity) < kEditedQuantities && std::isfinite(edit.value);
}

constexpr std::size_t kLongestPath = 4096;  // of a scene, in bytes; the system's PATH_MAX

// Of a servo loop (unit: second): 1 MHz to 1 Hz, far beyond the rates that scenes and drivers have.
constexpr double kLeastPeriod_s = 1e-6, kMostPeriod_s = 1.0;

// Only values that save_recording() writes. Others would be replayed as something else.
bool is_tick(const Tick& tick) {
  return tick.fault <= static_cast<std::uint32_t>(device::DeviceFault::late) &&
         tick.work_share <= WorkShare::kMostSteps;
}

std::uint64_t before_edits(const Header& header) {
  return sizeof header + header.path_bytes + header.text_bytes + header.ticks * sizeof(Tick);
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// The scene of a recording. Throws std::runtime_error if its file is not as it was, and SceneError.
Scene recorded_scene(const Recording& recording) {
  const std::filesystem::path& file = recording.scene_file;
  if (!file.has_filename()) {
    Scene scene = read_scene_text(recording.scene_text, file / kNameOfText);
    choose_models(scene);
    return scene;
  }
  if (read_text(file) == recording.scene_text) return load_scene(file);
  throw std::runtime_error(
      fmt::format("{}: the scene is not what was recorded (changed or moved); put the recorded text back, "
                  "or record again",
                  printable(file.string(), kLongestPath)));
}

// The device of the recording may not be connected now, and may be another one than the scene's. Its force
// limit says whether it was ideal: only an ideal device has none. The other devices differ in their limits
// alone.
void use_recorded_device(Scene& scene, const device::DeviceLimits& limits) {
  scene.opened_limits = limits;
  if (std::isinf(limits.max_force_N) == is_ideal(scene)) return;
  scene.real_device.reset();
  scene.device_model = is_ideal(scene) ? device::DeviceModel::premium_1_5 : device::DeviceModel::ideal;
}

}  // namespace

void save_recording(const std::filesystem::path& file, const Recording& recording) {
  WholeFile out(file);
  const std::string path = recording.scene_file.string();
  const Header header{recording.edits.empty() ? kMagicWithoutEdits : kMagic,
                      path.size(),
                      recording.scene_text.size(),
                      recording.ticks.size(),
                      recording.dt_s,
                      recording.device.max_force_N,
                      recording.device.resolution_m,
                      recording.device.friction_N,
                      recording.async_relaxation ? 1U : 0U,
                      recording.state_hash,
                      {recording.start_m.x, recording.start_m.y, recording.start_m.z}};
  out.write(&header, sizeof header);
  out.write(path);
  out.write(recording.scene_text);
  for (const RecordedTick& t : recording.ticks) {
    const Tick tick{{t.device_m.x, t.device_m.y, t.device_m.z},
                    t.hash,
                    static_cast<std::uint32_t>(t.fault),
                    t.work_share,
                    t.arrived};
    out.write(&tick, sizeof tick);
  }
  for (const Edit& edit : recording.edits) out.write(&edit, sizeof edit);
  out.keep();
}

Recording load_recording(const std::filesystem::path& file) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  if (error || !in)
    throw std::runtime_error(
        fmt::format("{}: cannot be read; give a file written by `hybrid run --record`", file.string()));
  Header header{};
  in.read(reinterpret_cast<char*>(&header), sizeof header);
  const bool with_edits = header.magic == kMagic;
  if (!in || (!with_edits && header.magic != kMagicWithoutEdits)) {
    throw std::runtime_error(fmt::format(
        "{}: not a recording of this version; record the session again with `hybrid run --record`",
        file.string()));
  }
  // Each size is checked by itself first, so that the sum cannot wrap.
  const bool sane =
      header.path_bytes <= size && header.text_bytes <= size && header.ticks <= size / sizeof(Tick) &&
      before_edits(header) <= size && are_edits(size - before_edits(header), with_edits) &&
      header.dt_s >= kLeastPeriod_s && header.dt_s <= kMostPeriod_s && header.max_force_N >= 0.0 &&
      header.resolution_m >= 0.0 && std::isfinite(header.resolution_m) && header.friction_N >= 0.0 &&
      std::isfinite(header.friction_N) && header.async_relaxation <= 1 &&
      std::all_of(header.start.begin(), header.start.end(), [](double x) { return std::isfinite(x); });
  if (!sane)
    throw std::runtime_error(
        fmt::format("{}: truncated or damaged ({} bytes); copy it again", file.string(), size));
  Recording recording;
  std::string path(header.path_bytes, '\0');
  recording.scene_text.resize(header.text_bytes);
  in.read(path.data(), static_cast<std::streamsize>(path.size()));
  in.read(recording.scene_text.data(), static_cast<std::streamsize>(header.text_bytes));
  if (path.find('\0') != std::string::npos)
    throw std::runtime_error(fmt::format("{}: damaged name of its scene; copy it again", file.string()));
  recording.scene_file = path;
  recording.dt_s = header.dt_s;
  recording.device.max_force_N = header.max_force_N;
  recording.device.resolution_m = header.resolution_m;
  recording.device.friction_N = header.friction_N;
  recording.async_relaxation = header.async_relaxation != 0;
  recording.state_hash = header.state_hash;
  recording.start_m = {header.start[0], header.start[1], header.start[2]};
  recording.ticks.resize(header.ticks);
  bool whole = true;
  for (RecordedTick& t : recording.ticks) {
    Tick tick{};
    in.read(reinterpret_cast<char*>(&tick), sizeof tick);
    whole = whole && is_tick(tick);
    t = {{tick.position[0], tick.position[1], tick.position[2]},
         tick.hash,
         static_cast<device::DeviceFault>(tick.fault),
         tick.arrived,
         static_cast<std::uint8_t>(tick.work_share)};
  }
  recording.edits.resize((size - before_edits(header)) / sizeof(Edit));
  for (Edit& edit : recording.edits) in.read(reinterpret_cast<char*>(&edit), sizeof edit);
  if (!in) throw std::runtime_error(fmt::format("{}: could not be read to its end", file.string()));
  if (!whole) throw std::runtime_error(fmt::format("{}: damaged ticks; copy it again", file.string()));
  if (!std::ranges::all_of(recording.edits, is_edit) ||
      !std::ranges::is_sorted(recording.edits, {}, &Edit::tick))
    throw std::runtime_error(fmt::format("{}: damaged edits; copy it again", file.string()));
  return recording;
}

ReplayResult replay(const Recording& recording, const Progress& progress) {
  set_flush_to_zero();
  Scene scene = recorded_scene(recording);
  use_recorded_device(scene, recording.device);
  if (1.0 / scene.rate_hz != recording.dt_s) scene.rate_hz = 1.0 / recording.dt_s;  // the driver's rate
  const BuiltScene built = build_scene(scene, progress);
  ReplayResult result;
  result.ticks = recording.ticks.size();
  result.equal = true;
  result.first_difference = result.ticks;
  if (recording.ticks.empty()) return result;
  begin_session(scene, *built.world, *built.state, recording.start_m);
  if (recording.async_relaxation) start_async_relaxation(*built.state, Arrival::recorded);
  std::uint64_t hash = kHashBegin;
  std::size_t next_edit = 0;
  for (std::size_t n = 0; n < recording.ticks.size() && device::stop_signal() == 0; ++n) {
    const device::DeviceState input{.position_m = recording.ticks[n].device_m,
                                    .fault = recording.ticks[n].fault};
    apply_edits_of_tick(*built.world, *built.state, recording.edits, n, next_edit);
    restore_tick_timing(recording.ticks[n], *built.state);
    hash = hash_tick(hash, haptic_tick(*built.world, *built.state, input, recording.dt_s));
    ++result.replayed_ticks;
    if (hash == recording.ticks[n].hash || !result.equal) continue;
    result.equal = false;
    result.first_difference = n;
  }
  result.state_hash = hash_state(hash, *built.state);
  if (result.replayed_ticks == result.ticks)
    result.equal = result.equal && result.state_hash == recording.state_hash;
  return result;
}

}  // namespace hybrid
