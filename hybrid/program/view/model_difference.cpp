// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/view/model_difference.h"

#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/number_text.h"
#include "hybrid/build/choose_model.h"
#include "hybrid/models/difference_map.h"
#include "hybrid/scene/read_scene_text.h"
#include "hybrid/tune/scene_choices.h"

namespace hybrid {
namespace {

struct Stopped {};

constexpr double kPublishEvery_s = 0.3;
// Each thread has a copy of the tissue's state, up to 110 MB in `head`.
constexpr std::size_t kMostThreads = 4;

void apply(const BuiltScene& built, const std::string& object, EditedQuantity quantity, double value) {
  const World& world = *built.world;
  std::uint32_t number = object.empty() ? Edit::kTool : 0;
  if (!object.empty()) {
    while (number < world.rigid.size() && world.rigid[number].name != object) ++number;
    for (std::size_t o = 0; number >= world.rigid.size() && o < world.soft.size(); ++o) {
      if (world.soft[o].name == object) number = static_cast<std::uint32_t>(world.rigid.size() + o);
    }
  }
  (void)apply_edit(world, *built.state, {0, number, quantity, value});  // a model may lack the value
}

}  // namespace

void ModelDifference::ask(const ModelComparison& comparison, const ViewedScene& viewed, const Snapshot& now) {
  stop();
  if (comparison.object.empty()) return;
  const auto& objects = viewed.drawn.objects;
  const auto object = std::ranges::find(objects, comparison.object, &DrawnObject::name);
  if (object == objects.end()) return;
  forget();
  Job job{.comparison = comparison,
          .text = viewed.text,
          .edits = {},
          .surface = object->surface,
          .object = static_cast<std::size_t>(object - objects.begin()),
          .floor_N = jnd_floor_N(viewed.scene)};
  for (std::size_t n = 0; n < viewed.drawn.editable.size() && n < now.values.size(); ++n) {
    const EditableValue& value = viewed.drawn.editable[n];
    if (now.values[n] == value.in_scene) continue;
    job.edits.push_back({value.object == Edit::kTool ? std::string() : objects[value.object].name,
                         value.quantity, now.values[n]});
  }
  ++comparisons_;
  stop_ = false;
  say("reading the scene");
  thread_ = std::thread([this, job = std::move(job)] {
    std::string why_not;
    try {
      run(job);
    } catch (const Stopped&) {  // the comparison was stopped on request
    } catch (const std::exception& e) {
      why_not = e.what();
    }
    const std::scoped_lock lock(guard_);
    words_.clear();
    error_ = std::move(why_not);
  });
}

void ModelDifference::stop() {
  stop_ = true;
  wait();
}

void ModelDifference::wait() {
  if (thread_.joinable()) thread_.join();
}

void ModelDifference::forget() {
  stop();
  const std::scoped_lock lock(guard_);
  found_.reset();
  error_.clear();
}

BuiltScene ModelDifference::build(const Job& job, const std::vector<SceneChange>& changes, const char* name) {
  Scene scene = read_scene_text(changed_text(job.text, command_.scene, changes), command_.scene);
  choose_models(scene);
  BuiltScene built = build_scene(scene, [&](const std::string& step) {
    if (stop_) throw Stopped{};
    say(fmt::format("building model {}: {}", name, step));
  });
  for (const NamedEdit& edit : job.edits) apply(built, edit.object, edit.quantity, edit.value);
  return built;
}

void ModelDifference::run(const Job& job) {
  const ScopedFlushToZero flushed;
  const BuiltScene a = build(job, job.comparison.a, "A"), b = build(job, job.comparison.b, "B");
  if (const std::string why_not = why_no_difference_map(*a.world, *b.world); !why_not.empty())
    throw std::runtime_error(why_not);
  if (beside_) {
    const sched_param none{};
    (void)sched_setscheduler(0, SCHED_IDLE, &none);  // the threads below inherit it
  }
  const std::size_t threads =
      std::clamp<std::size_t>(std::thread::hardware_concurrency() / 2, 1, kMostThreads);
  DifferenceMap map(job.comparison.object, job.surface, a, b, job.comparison.depth_m, job.floor_N);
  const std::size_t most = job.comparison.places;
  std::size_t more = 2 * threads;
  for (bool goes_on = true; goes_on;) {
    const auto begin = std::chrono::steady_clock::now();
    goes_on = map.press(most > 0 ? std::min(more, most - map.places()) : more, threads, stop_);
    if (stop_) throw Stopped{};
    const double took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    more = std::clamp<std::size_t>(
        static_cast<std::size_t>(static_cast<double>(more) * kPublishEvery_s / std::max(took_s, 1e-3)),
        threads, 64 * threads);
    if (most > 0 && map.places() >= most) goes_on = false;
    auto found = std::make_shared<FeltDifference>(map.now());
    found->object = job.object;
    found->comparison = comparisons_;
    const std::size_t places = found->places;
    const std::string gap = with_digits(1e3 * found->gap_m, 2) + " mm";
    const std::scoped_lock lock(guard_);
    found->number = ++numbers_;
    found_ = std::move(found);
    words_ = fmt::format("{} places pressed{}; at most {} to the next", places,
                         most > 0 ? fmt::format(" of {}", most) : std::string(), gap);
  }
}

void ModelDifference::say(std::string words) {
  const std::scoped_lock lock(guard_);
  words_ = std::move(words);
}

std::shared_ptr<const FeltDifference> ModelDifference::found() const {
  const std::scoped_lock lock(guard_);
  return found_;
}

std::string ModelDifference::in_words() const {
  const std::scoped_lock lock(guard_);
  return words_;
}

std::string ModelDifference::take_error() {
  const std::scoped_lock lock(guard_);
  return std::exchange(error_, {});
}

}  // namespace hybrid
