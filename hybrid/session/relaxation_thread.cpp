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
void RelaxationThread::publish_surfaces() {
  MovedSurfaces& moved = surfaces_.back();
  moved.resize(world_.object_count());
  for (std::size_t o = 0; o < world_.soft.size(); ++o) {
    if (!async_.has(o)) continue;
    const SoftBody& body = world_.soft[o];
    auto& of_object = moved[world_.rigid.size() + o];
    of_object.resize(body.drawn.vertices.size());
    for (std::size_t v = 0; v < of_object.size(); ++v)
      of_object[v] =
          glm::vec3(body.pose.rotation * async_.objects[o]->shadow.displacement_at(body.drawn.vertices[v]));
  }
  surfaces_.publish();
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
      publish_surfaces();
      next = Clock::now() +
             std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / surfaces_hz_));
    }
    busy_s_.store(thread_time_s(), std::memory_order_relaxed);
    if (!any) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

}  // namespace hybrid
