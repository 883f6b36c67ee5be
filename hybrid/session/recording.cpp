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
#include "hybrid/tick/copy_state.h"
#include "hybrid/tick/take_over.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/tick/tissue/work_budget.h"

namespace hybrid {
namespace {

// Layout, little-endian: magic, sizes of path and text, number of ticks, dt, the device's force limit,
// resolution and friction, flag for asynchronous relaxation, state hash, device position before the first
// tick, path, text, ticks, changes of the scene, edits. A tick: x, y, z, hash, device fault, work share,
// arrived asynchronous results. The changes: their number, then for each its tick, the number of edits before
// it, the size of its text, and the text. An edit: tick, object, quantity, value. Version 5 has no changes,
// version 4 neither changes nor edits. A recording is written in the lowest version that can hold it.
constexpr std::array<char, 8> kMagic{'h', 'y', 'b', 'r', 'i', 'd', 'R', '6'};
constexpr std::array<char, 8> kMagicWithoutChanges{'h', 'y', 'b', 'r', 'i', 'd', 'R', '5'};
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
struct Change {
  std::uint64_t tick, edits_before, text_bytes;
};
static_assert(sizeof(Header) == 104 && sizeof(Tick) == 48 && sizeof(Change) == 24,
              "the file's layout has no padding");

bool is_edit(const Edit& edit) {
  return static_cast<std::uint32_t>(edit.quantity) < kEditedQuantities && std::isfinite(edit.value);
}

constexpr std::size_t kLongestPath = 4096;  // of a scene, in bytes; the system's PATH_MAX

// Periods of a servo loop (s): 1 MHz to 1 Hz, far beyond the rates that scenes and drivers have.
constexpr double kLeastPeriod_s = 1e-6, kMostPeriod_s = 1.0;

// Does the tick have only values that save_recording() writes? Other values would be replayed as something
// else.
bool is_tick(const Tick& tick) {
  return tick.fault <= static_cast<std::uint32_t>(device::DeviceFault::late) &&
         tick.work_share <= WorkShare::kMostSteps;
}

std::uint64_t before_changes(const Header& header) {
  return sizeof header + header.path_bytes + header.text_bytes + header.ticks * sizeof(Tick);
}

[[noreturn]] void refuse(const std::filesystem::path& file, const char* why) {
  throw std::runtime_error(fmt::format("{}: {}; copy it again", file.string(), why));
}

// Reads the changes of the scene. `left`: bytes left in the file. On return only the
// edits are left, so it is their size.
std::vector<RecordedChange> read_changes(std::istream& in, const std::filesystem::path& file,
                                         std::uint64_t ticks, std::uint64_t& left) {
  std::vector<RecordedChange> changes;
  const auto take = [&](void* to, std::uint64_t bytes) {
    if (bytes > left) refuse(file, "truncated changes of its scene");
    in.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
    left -= bytes;
  };
  std::uint64_t count = 0;
  take(&count, sizeof count);
  if (count > left / sizeof(Change)) refuse(file, "truncated changes of its scene");
  for (std::uint64_t n = 0; n < count; ++n) {
    Change change{};
    take(&change, sizeof change);
    const bool in_order = changes.empty() || (change.tick >= changes.back().tick &&
                                              change.edits_before >= changes.back().edits_before);
    if (!in_order || change.tick > ticks || change.text_bytes > left)
      refuse(file, "damaged changes of its scene");
    changes.push_back({change.tick, change.edits_before, std::string(change.text_bytes, '\0')});
    take(changes.back().text.data(), change.text_bytes);
  }
  return changes;
}

void write_changes(WholeFile& out, const std::vector<RecordedChange>& changes) {
  const std::uint64_t count = changes.size();
  out.write(&count, sizeof count);
  for (const RecordedChange& c : changes) {
    const Change change{c.tick, c.edits_before, c.text.size()};
    out.write(&change, sizeof change);
    out.write(c.text);
  }
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// A scene of the recording that is not in a file. Throws SceneError.
Scene scene_of_text(const Recording& recording, const std::string& text) {
  const std::filesystem::path& file = recording.scene_file;
  Scene scene = read_scene_text(text, file.has_filename() ? file : file / kNameOfText);
  choose_models(scene);
  return scene;
}

// The scene of a recording. Throws std::runtime_error if its file has changed, and SceneError.
Scene recorded_scene(const Recording& recording) {
  const std::filesystem::path& file = recording.scene_file;
  if (!file.has_filename()) return scene_of_text(recording, recording.scene_text);
  if (read_text(file) == recording.scene_text) return load_scene(file);
  throw std::runtime_error(
      fmt::format("{}: the scene is not what was recorded (changed or moved); put the recorded text back, "
                  "or record again",
                  printable(file.string(), kLongestPath)));
}

// The device of the recording may not be connected now, and may differ from the scene's. Its force limit says
// whether it was ideal, because only an ideal device has none. The other devices differ in their limits
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
  const bool changed = !recording.changes.empty();
  const Header header{changed                   ? kMagic
                      : recording.edits.empty() ? kMagicWithoutEdits
                                                : kMagicWithoutChanges,
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
  if (changed) write_changes(out, recording.changes);
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
  const bool with_changes = header.magic == kMagic;
  const bool with_edits = with_changes || header.magic == kMagicWithoutChanges;
  if (!in || (!with_edits && header.magic != kMagicWithoutEdits)) {
    throw std::runtime_error(fmt::format(
        "{}: not a recording of this version; record the session again with `hybrid run --record`",
        file.string()));
  }
  // Each size is checked by itself first, so that the sum cannot wrap.
  const bool sane =
      header.path_bytes <= size && header.text_bytes <= size && header.ticks <= size / sizeof(Tick) &&
      before_changes(header) <= size && header.dt_s >= kLeastPeriod_s && header.dt_s <= kMostPeriod_s &&
      header.max_force_N >= 0.0 && header.resolution_m >= 0.0 && std::isfinite(header.resolution_m) &&
      header.friction_N >= 0.0 && std::isfinite(header.friction_N) && header.async_relaxation <= 1 &&
      std::all_of(header.start.begin(), header.start.end(), [](double x) { return std::isfinite(x); });
  if (!sane)
    throw std::runtime_error(
        fmt::format("{}: truncated or damaged ({} bytes); copy it again", file.string(), size));
  Recording recording;
  std::string path(header.path_bytes, '\0');
  recording.scene_text.resize(header.text_bytes);
  in.read(path.data(), static_cast<std::streamsize>(path.size()));
  in.read(recording.scene_text.data(), static_cast<std::streamsize>(header.text_bytes));
  if (path.find('\0') != std::string::npos) refuse(file, "damaged name of its scene");
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
  std::uint64_t left = size - before_changes(header);
  if (with_changes && in) recording.changes = read_changes(in, file, header.ticks, left);
  if (with_edits ? left % sizeof(Edit) != 0 : left != 0)
    throw std::runtime_error(
        fmt::format("{}: truncated or damaged ({} bytes); copy it again", file.string(), size));
  recording.edits.resize(left / sizeof(Edit));
  for (Edit& edit : recording.edits) in.read(reinterpret_cast<char*>(&edit), sizeof edit);
  if (!in) throw std::runtime_error(fmt::format("{}: could not be read to its end", file.string()));
  if (!whole) refuse(file, "damaged ticks");
  if (!std::ranges::all_of(recording.edits, is_edit) ||
      !std::ranges::is_sorted(recording.edits, {}, &Edit::tick))
    refuse(file, "damaged edits");
  if (!recording.changes.empty() && recording.changes.back().edits_before > recording.edits.size())
    refuse(file, "damaged changes of its scene");
  return recording;
}

namespace {

// The scene that a replay is in. It changes as the recorded session did.
class ReplayedScene {
 public:
  ReplayedScene(const Recording& recording, const Progress& progress)
      : recording_(recording), progress_(progress), built_(build(recorded_scene(recording))) {}

  void begin() {
    begin_session(scene_, *built_.world, *built_.state, recording_.start_m);
    start_relaxation(*built_.state);
  }
  // Before tick `n`: edits and changes of the scene, in the order of the session.
  void advance_to(std::uint64_t n) {
    while (next_change_ < recording_.changes.size() && recording_.changes[next_change_].tick <= n) {
      const RecordedChange& change = recording_.changes[next_change_++];
      apply_edits(change.tick, change.edits_before);
      take_change(change);
    }
    apply_edits(n, recording_.edits.size());
  }
  [[nodiscard]] const World& world() const { return *built_.world; }
  [[nodiscard]] WorldState& state() { return *built_.state; }

 private:
  BuiltScene build(Scene scene) {
    use_recorded_device(scene, recording_.device);
    if (1.0 / scene.rate_hz != recording_.dt_s) scene.rate_hz = 1.0 / recording_.dt_s;  // the driver's rate
    scene_ = std::move(scene);
    return build_scene(scene_, progress_);
  }
  void start_relaxation(WorldState& state) const {
    if (recording_.async_relaxation) start_async_relaxation(state, Arrival::recorded);
  }
  void apply_edits(std::uint64_t tick, std::uint64_t end) {
    apply_edits_of_tick(world(), state(), std::span(recording_.edits).first(end), tick, next_edit_);
  }
  void take_change(const RecordedChange& change) {
    if (change.text.empty()) {
      // The state was copied when it was kept, and copied again when the session went back to it.
      built_.state = copy_state(world(), *kept_copy(world(), state()));
      start_relaxation(state());
      return;
    }
    BuiltScene next = build(scene_of_text(recording_, change.text));
    if (!why_no_take_over(world(), *next.world).empty() ||
        !take_over(world(), state(), *next.world, next.state))
      throw std::runtime_error(fmt::format(
          "the scene after tick {} cannot go on from the one before; copy the recording again", change.tick));
    built_ = std::move(next);
    start_relaxation(state());
  }

  const Recording& recording_;
  const Progress& progress_;
  Scene scene_;
  BuiltScene built_;
  std::size_t next_edit_ = 0, next_change_ = 0;
};

}  // namespace

ReplayResult replay(const Recording& recording, const Progress& progress) {
  set_flush_to_zero();
  ReplayedScene replayed(recording, progress);
  ReplayResult result;
  result.ticks = recording.ticks.size();
  result.equal = true;
  result.first_difference = result.ticks;
  if (recording.ticks.empty()) return result;
  replayed.begin();
  std::uint64_t hash = kHashBegin;
  for (std::size_t n = 0; n < recording.ticks.size() && device::stop_signal() == 0; ++n) {
    const device::DeviceState input{.position_m = recording.ticks[n].device_m,
                                    .fault = recording.ticks[n].fault};
    replayed.advance_to(n);
    restore_tick_timing(recording.ticks[n], replayed.state());
    hash = hash_tick(hash, haptic_tick(replayed.world(), replayed.state(), input, recording.dt_s));
    ++result.replayed_ticks;
    if (hash == recording.ticks[n].hash || !result.equal) continue;
    result.equal = false;
    result.first_difference = n;
  }
  // Makes a change that follows the last tick.
  if (result.replayed_ticks == result.ticks) replayed.advance_to(result.ticks);
  result.state_hash = hash_state(hash, replayed.state());
  if (result.replayed_ticks == result.ticks)
    result.equal = result.equal && result.state_hash == recording.state_hash;
  return result;
}

}  // namespace hybrid
