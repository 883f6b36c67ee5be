// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/relaxation_thread.h"

#include <sched.h>

#include <chrono>
#include <cstddef>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/thread_time.h"

namespace hybrid {

RelaxationThread::RelaxationThread(const World& world, AsyncRelaxation& async, double surfaces_hz)
    : world_(world), async_(async), surfaces_hz_(surfaces_hz), thread_([this] { run(); }) {}

RelaxationThread::~RelaxationThread() {
  stop_.store(true, std::memory_order_relaxed);
  thread_.join();
}

bool RelaxationThread::relax_submitted() noexcept {
  bool any = false;
  for (const auto& object : async_.objects) {
    if (object == nullptr || object->phase.load(std::memory_order_acquire) != AsyncObject::Phase::thread)
      continue;
    object->shadow.relax();
    object->phase.store(AsyncObject::Phase::tick, std::memory_order_release);
    any = true;
  }
  return any;
}

// Reads only the thread's own state, which the tick never writes.
void RelaxationThread::publish_tissue() {
  RelaxedTissue& tissue = tissue_.back();
  const AskedPoints* const asked = asked_.take().get();
  tissue.surfaces.resize(world_.object_count());
  tissue.asked.moved_m.resize(world_.object_count());
  tissue.asked.number = asked != nullptr ? asked->number : 0;
  for (std::size_t o = 0; o < world_.soft.size(); ++o) {
    if (!async_.has(o)) continue;
    const SoftBody& body = world_.soft[o];
    const std::size_t number = world_.rigid.size() + o;
    const auto displacement_at = [&](const glm::dvec3& in_body) {
      return glm::vec3(body.pose.rotation * async_.objects[o]->shadow.displacement_at(in_body));
    };
    auto& surface = tissue.surfaces[number];
    surface.resize(body.drawn.vertices.size());
    for (std::size_t v = 0; v < surface.size(); ++v) surface[v] = displacement_at(body.drawn.vertices[v]);
    auto& points = tissue.asked.moved_m[number];
    points.clear();
    if (asked == nullptr || number >= asked->at_rest_m.size()) continue;
    for (const glm::dvec3& at : asked->at_rest_m[number]) points.push_back(displacement_at(body.to_body(at)));
  }
  tissue_.publish();
}

void take_ordinary_priority() noexcept {
  const sched_param none{};
  (void)sched_setscheduler(0, SCHED_OTHER, &none);  // lowering the priority is always permitted
}

void RelaxationThread::run() {
  take_ordinary_priority();
  set_flush_to_zero();  // as the tick does: a replay must be equal bit by bit
  using Clock = std::chrono::steady_clock;
  Clock::time_point next = Clock::now();
  while (!stop_.load(std::memory_order_relaxed)) {
    const bool any = relax_submitted();
    if (surfaces_hz_ > 0.0 && Clock::now() >= next) {
      publish_tissue();
      next = Clock::now() +
             std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / surfaces_hz_));
    }
    busy_s_.store(thread_time_s(), std::memory_order_relaxed);
    if (!any) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

}  // namespace hybrid
