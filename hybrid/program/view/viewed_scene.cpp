// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/view/viewed_scene.h"

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/build/choose_model.h"
#include "hybrid/scene/read_scene_text.h"
#include "hybrid/session/real_device.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/tune/scene_choices.h"

namespace hybrid {
namespace {

constexpr std::chrono::milliseconds kLookEvery{300};  // time between two looks at the scene's file

}  // namespace

std::unique_ptr<ViewedScene> load_for_window(const ViewCommand& command) {
  auto viewed = read_viewed_scene(command);
  if (viewed->scene.real_device)
    throw std::runtime_error("a scene of a real device is loaded by closing and opening the window");
  build_viewed_scene(command, *viewed, {});
  viewed->player = std::make_unique<Player>(viewed->scene, viewed->built, viewed->drawn, nullptr);
  return viewed;
}

std::vector<glm::dvec3> places_along(const device::Path& path) {
  constexpr int steps = 500;
  std::vector<glm::dvec3> places;
  for (int n = 0; n <= steps; ++n) places.push_back(path.position(path.duration_s() * n / steps));
  return places;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in || !text) throw std::runtime_error(file.string() + ": cannot be read; check its name and rights");
  return text.str();
}

std::unique_ptr<ViewedScene> read_viewed_scene(const ViewCommand& command) {
  auto viewed = std::make_unique<ViewedScene>();
  viewed->scene = load_scene(command.scene);  // comes first: its error messages are more precise
  viewed->text = viewed->file_text = viewed->began_with = text_of(command.scene);
  if (!command.device.empty()) use_device(viewed->scene, command.device);
  return viewed;
}

void build_viewed_scene(const ViewCommand& command, ViewedScene& viewed, const Progress& progress) {
  const Scene& scene = viewed.scene;
  viewed.built = build_scene(scene, progress);
  note_relaxation(scene, viewed.built, true);
  viewed.drawn =
      drawn_scene(scene, viewed.built, scene.title.empty() ? command.scene.stem().string() : scene.title);
  if (!scene.real_device) viewed.drawn.path_m = places_along(*scene_path(scene));
  Scene as_read = read_scene_text(viewed.text, command.scene);
  as_read.real_device = scene.real_device;  // the command may have chosen another one
  add_choices(as_read, viewed.drawn);
}

void SceneChanger::start(const ViewedScene& played) {
  built_ = asked_.size();
  meshes_built_ = meshes_.size();
  // Makes all changes since the played scene. The text of that scene stays while the new one is built.
  next_ = std::async(std::launch::async, [this, &played, changes = asked_, meshes = meshes_] {
    const ScopedFlushToZero flushed;  // as a replay does, so that it builds the same bits
    auto viewed = std::make_unique<ViewedScene>();
    viewed->text = changed_text(played.text, command_.scene, changes);
    viewed->file_text = played.file_text;
    viewed->began_with = played.began_with;
    viewed->changes = played.changes;
    for (const SceneChange& change : changes) viewed->changes.push_back(in_words(change));
    for (const std::filesystem::path& mesh : meshes) {
      viewed->text = text_with_mesh(viewed->text, command_.scene, mesh);
      viewed->changes.push_back(mesh.stem().string() + ": added");
    }
    viewed->scene = read_scene_text(viewed->text, command_.scene);
    choose_models(viewed->scene);
    if (!command_.device.empty()) use_device(viewed->scene, command_.device);
    build_viewed_scene(command_, *viewed, [this](const std::string& step) {
      const std::scoped_lock lock(guard_);
      step_ = step;
    });
    return viewed;
  });
}

std::unique_ptr<ViewedScene> SceneChanger::poll(const ViewedScene& played) {
  if (!next_.valid()) {
    if (!asked_.empty() || !meshes_.empty()) start(played);
    return nullptr;
  }
  if (next_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return nullptr;
  if (built_ < asked_.size() || meshes_built_ < meshes_.size()) {  // more was asked for meanwhile
    start(played);
    return nullptr;
  }
  asked_.clear();
  meshes_.clear();
  return next_.get();
}

std::unique_ptr<ViewedScene> SceneChanger::wait(const ViewedScene& played) {
  if (asked_.empty() && meshes_.empty()) return nullptr;
  start(played);
  asked_.clear();
  meshes_.clear();
  return next_.get();
}

std::string SceneChanger::building() const {
  if (!next_.valid()) return {};
  const std::scoped_lock lock(guard_);
  return step_.empty() ? "reading the changed scene" : step_;
}

void SceneChanger::cancel() {
  asked_.clear();
  meshes_.clear();
  if (next_.valid()) next_.wait();
  next_ = {};
}

// Looks first at the time of the last change, because that is cheap. If an editor is still writing, the time
// will change again.
bool SceneReload::file_changed() {
  const auto now = std::chrono::steady_clock::now();
  if (now - looked_ < kLookEvery) return false;
  looked_ = now;
  std::error_code missing;
  const auto written = std::filesystem::last_write_time(command_.scene, missing);
  if (missing || written == written_) return false;
  written_ = written;
  try {
    if (text_of(command_.scene) != tried_text_) return true;
    error_.clear();  // the change that was refused has been undone
  } catch (const std::runtime_error&) {
    // An editor that replaces the file removes it for a moment.
  }
  return false;
}

void SceneReload::start() {
  asked_ = false;
  next_ = std::async(std::launch::async, [this] { return load_for_window(command_); });
}

std::unique_ptr<ViewedScene> SceneReload::poll() {
  if (!next_.valid()) {
    if (file_changed() || asked_) start();
    return nullptr;
  }
  if (next_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return nullptr;
  try {
    auto viewed = next_.get();
    error_.clear();
    tried_text_ = viewed->text;
    return viewed;
  } catch (const std::exception& e) {
    error_ = e.what();
    return nullptr;
  }
}

void ChangeComparison::begin(std::unique_ptr<ViewedScene> before, const ViewedScene& now,
                             std::unique_ptr<WorldState> after) {
  cancel();
  stop_ = false;
  before_ = std::move(before);
  after_ = std::move(after);
  forces_ = std::async(std::launch::async, [this, &now] {
    return compare_at_rest(before_->built, *now.built.world, *after_, jnd_floor_N(now.scene), stop_);
  });
}

std::optional<ComparedForces> ChangeComparison::poll() {
  if (!forces_.valid() || forces_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return {};
  return wait();
}

std::optional<ComparedForces> ChangeComparison::wait() {
  if (!forces_.valid()) return {};
  const std::optional<ComparedForces> forces = forces_.get();
  before_.reset();
  after_.reset();
  return forces;
}

void ChangeComparison::cancel() {
  stop_ = true;
  (void)wait();
}

}  // namespace hybrid
