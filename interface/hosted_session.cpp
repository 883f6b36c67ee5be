// SPDX-License-Identifier: GPL-3.0-or-later
#include "interface/hosted_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/build/choose_model.h"
#include "hybrid/scene/read_scene_text.h"
#include "hybrid/tick/copy_state.h"
#include "hybrid/tick/tissue/async_relaxation.h"

namespace c_interface {
namespace {

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// Refuses a scene with a driver's device, because the caller is the device.
hybrid::Scene without_driver(hybrid::Scene scene) {
  if (!scene.real_device) return scene;
  throw hybrid::SceneError(
      scene.file, scene.real_device->place,
      "the scene asks for the driver of a PHANToM, but here the calling program moves the tool; use [device] "
      "model = \"premium-1.5\", whose force limits are those of a PHANToM");
}

hybrid::Scene at_rate(hybrid::Scene scene, std::optional<double> rate_hz) {
  if (rate_hz) scene.rate_hz = *rate_hz;
  return scene;
}

std::vector<std::string> texts_of(const std::vector<hybrid::BuildNote>& notes) {
  std::vector<std::string> texts;
  texts.reserve(notes.size());
  for (const hybrid::BuildNote& note : notes)
    texts.push_back(note.object.empty() ? note.text : note.object + ": " + note.text);
  return texts;
}

bool presses_tissue(const hybrid::WorldState& state) noexcept {
  return std::any_of(state.reactions.begin(), state.reactions.end(),
                     [](const voxel::Reaction& reaction) { return reaction.pressed > 0; });
}

}  // namespace

SceneSource scene_from_file(const std::filesystem::path& file) {
  return {without_driver(hybrid::load_scene(file)), read_text(file), std::filesystem::absolute(file)};
}

SceneSource scene_from_text(const std::string& text, const std::filesystem::path& folder) {
  const std::filesystem::path base = std::filesystem::absolute(folder);
  hybrid::Scene scene = hybrid::read_scene_text(text, base / hybrid::kNameOfText);
  hybrid::choose_models(scene);
  return {without_driver(std::move(scene)), text, base / ""};
}

HostedSession::HostedSession(SceneSource source, const HostOptions& options)
    : source_(std::move(source)),
      options_(options),
      period_s_(1.0 / options.rate_hz.value_or(source_.scene.rate_hz)),
      work_share_(period_s_) {
  source_.scene = at_rate(std::move(source_.scene), options.rate_hz);
  built_ = hybrid::build_scene(source_.scene);
  hybrid::note_relaxation(source_.scene, built_, options.relaxation != Relaxation::tick);
  notes_ = texts_of(built_.notes);
  editable_ = hybrid::editable_values(*built_.world, *built_.state);
  if (options.surfaces) surfaces_.emplace(source_.scene, built_);
}

const std::string& HostedSession::name_of(std::size_t object) const {
  const hybrid::World& world = *built_.world;
  return object < world.rigid.size() ? world.rigid[object].name
                                     : world.soft[object - world.rigid.size()].name;
}

void HostedSession::begin(const glm::dvec3& device_m) {
  const hybrid::ScopedFlushToZero flushed;
  const hybrid::World& world = *built_.world;
  hybrid::WorldState& state = *built_.state;
  recorded_.reserve(options_.recorded_ticks);
  applied_.reserve(kMostEdits);
  if (options_.error) {
    course_.reserve(options_.recorded_ticks);
    if (!at_start_) at_start_ = hybrid::copy_state(world, state);
  }
  start_m_ = device_m;
  hybrid::begin_session(source_.scene, world, state, device_m);
  live_ = options_.relaxation == Relaxation::thread && !state.soft.empty();
  if (options_.relaxation != Relaxation::tick)
    hybrid::start_async_relaxation(state, live_ ? hybrid::Arrival::thread : hybrid::Arrival::counted);
  if (live_)
    relaxation_thread_ = std::make_unique<hybrid::RelaxationThread>(
        world, state.async, options_.surfaces ? options_.surfaces_hz : 0.0);
  begun_ = true;
}

void HostedSession::take_edits() noexcept {
  hybrid::Edit edit;
  while (applied_.size() < kMostEdits && edits_.pop(edit)) {
    edit.tick = ticks_;
    if (hybrid::apply_edit(*built_.world, *built_.state, edit)) applied_.push_back(edit);
  }
}

void HostedSession::tick(const glm::dvec3& device_m, double dt_s) noexcept {
  hybrid::WorldState& state = *built_.state;
  take_edits();
  if (live_) hybrid::give_work_share(state, work_share_.steps());
  felt_ = hybrid::haptic_tick(*built_.world, state, {.position_m = device_m}, dt_s);
  keep(dt_s);
  if (live_) work_share_.observe(felt_.tick_us, presses_tissue(state));
  ++ticks_;
}

void HostedSession::keep(double dt_s) noexcept {
  const hybrid::WorldState& state = *built_.state;
  hash_ = hybrid::hash_tick(hash_, felt_);
  if (dt_s != period_s_) ++other_dt_;
  if (recorded_.size() == options_.recorded_ticks) {
    ++unkept_;
    return;
  }
  recorded_.push_back({felt_.device_m, hash_, device::DeviceFault::none, state.async.arrived,
                       live_ ? work_share_.steps() : std::uint8_t{0}});
  if (!at_start_) return;
  course_.push_back({felt_.device_m, hybrid::coupling_force_N(*built_.world, state, felt_.device_m),
                     presses_tissue(state)});
}

void HostedSession::publish() {
  surfaces_->publish(*built_.world, *built_.state, felt_, ticks_, live_);
}

bool HostedSession::take_surfaces() {
  return surfaces_->take([this] { return relaxation_thread_ ? &relaxation_thread_->tissue() : nullptr; });
}

bool HostedSession::edit(const hybrid::Edit& edit) noexcept {
  if (edits_sent_ == kMostEdits || !edits_.push(edit)) return false;
  ++edits_sent_;
  return true;
}

std::string HostedSession::not_recorded() const {
  if (unkept_ > 0) {
    return fmt::format("{} ticks were done, but recorded_ticks is {}; open the session with at least as many",
                       ticks_, options_.recorded_ticks);
  }
  if (other_dt_ > 0) {
    return fmt::format(
        "{} of {} ticks had another dt_s than the period of {:.17g} s; pass period_s in every tick, or open "
        "the session with rate_hz = 1 / dt_s",
        other_dt_, ticks_, period_s_);
  }
  return {};
}

void HostedSession::save_recording(const std::filesystem::path& file) const {
  hybrid::save_recording(file, {.scene_file = source_.recorded_path,
                                .scene_text = source_.text,
                                .dt_s = period_s_,
                                .device = hybrid::scene_limits(source_.scene),
                                .async_relaxation = options_.relaxation != Relaxation::tick,
                                .state_hash = hybrid::hash_state(hash_, *built_.state),
                                .start_m = start_m_,
                                .ticks = recorded_,
                                .edits = applied_});
}

hybrid::ForceError HostedSession::measure_error() const {
  hybrid::ForceError error;
  error.not_measured = not_recorded();
  if (built_.state->soft.empty()) error.not_measured = "nothing is soft";
  if (!at_start_) error.not_measured = "with_error was not set; set it in hybrid_options";
  if (!applied_.empty()) error.not_measured = "values were edited";
  if (!error.not_measured.empty()) return error;
  const hybrid::ScopedFlushToZero flushed;
  const auto state = hybrid::copy_state(*built_.world, *at_start_);
  hybrid::begin_session(source_.scene, *built_.world, *state, start_m_);
  hybrid::SlowRunOptions slow = hybrid::slow_run_options(hybrid::Reference::quick);
  slow.dt_s = period_s_;
  slow.floor_N = hybrid::jnd_floor_N(source_.scene);
  slow.async_relaxation = options_.relaxation != Relaxation::tick;
  return hybrid::compare_with_slow_run(*built_.world, *state, course_, slow);
}

}  // namespace c_interface
