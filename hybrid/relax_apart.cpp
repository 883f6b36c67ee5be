// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/relax_apart.h"

#include <time.h>

#include <chrono>

#include "hybrid/session.h"
#include "hybrid/world.h"
#include "voxel/replica.h"

namespace hybrid {

struct RelaxedApart {
  explicit RelaxedApart(voxel::SoftObject& object) : replica(object) {}
  enum class Phase : std::uint8_t { tick, thread };  // whose turn it is

  voxel::Replica replica;
  std::atomic<Phase> phase{Phase::tick};
  // ---- the tick's ----
  bool given = false, taking = false;
  std::uint64_t due = 0;  // tick; of Arrival::counted
};

Apart::Apart() = default;
Apart::~Apart() = default;

namespace {

constexpr std::size_t kMostApart = 64;   // bits of Apart::arrived
constexpr std::size_t kRowsTaken = 250;  // a tick: what a result is added to, about 100 us of it
// Rows that another core relaxes in a tick's time, so that a fixed-step session takes results as late as one
// in real time does.
constexpr std::uint64_t kRowsRelaxed = 1000;

bool has_arrived(const Apart& apart, const RelaxedApart& object, std::size_t o, std::uint64_t tick) noexcept {
  switch (apart.arrival) {
    case Arrival::counted:
      return tick >= object.due;
    case Arrival::thread:
      return object.phase.load(std::memory_order_acquire) == RelaxedApart::Phase::tick;
    case Arrival::recorded:
      break;
  }
  return (apart.arrived >> o & 1U) != 0;
}

void give(WorldState& state, RelaxedApart& object, std::size_t o) noexcept {
  object.replica.give(*state.soft[o]);
  object.given = true;
  if (state.apart.arrival == Arrival::thread) {
    object.phase.store(RelaxedApart::Phase::thread, std::memory_order_release);
    return;
  }
  object.replica.relax();
  object.due = state.tick + 1 + object.replica.work() / kRowsRelaxed;
}

void exchange(WorldState& state, std::size_t o, std::uint64_t& arrived) noexcept {
  RelaxedApart& object = *state.apart.objects[o];
  if (object.given && !object.taking && has_arrived(state.apart, object, o, state.tick)) {
    object.taking = true;
    arrived |= std::uint64_t{1} << o;
    ++state.apart.results;
  }
  if (object.taking) {
    object.taking = !object.replica.take(*state.soft[o], kRowsTaken);
    object.given = object.taking;
  } else if (!object.given && voxel::Replica::wanted(*state.soft[o])) {
    give(state, object, o);
  }
}

double own_time_s() noexcept {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

}  // namespace

void relax_apart(WorldState& state, Arrival arrival) {
  state.apart.arrival = arrival;
  state.apart.objects.clear();
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    const bool apart = o < kMostApart && !state.soft[o]->lattice().yields();
    state.apart.objects.push_back(apart ? std::make_unique<RelaxedApart>(*state.soft[o]) : nullptr);
  }
}

void relax_background(const World& world, WorldState& state) noexcept {
  std::uint64_t arrived = 0;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.apart.objects.empty() || state.apart.objects[o] == nullptr) {
      state.soft[o]->relax_background(world.soft[o].budget);
    } else {
      exchange(state, o, arrived);
    }
  }
  if (state.apart.arrival != Arrival::recorded) state.apart.arrived = arrived;
}

RelaxationThread::RelaxationThread(Apart& apart) : apart_(apart), thread_([this] { go(); }) {}

RelaxationThread::~RelaxationThread() {
  stop_.store(true, std::memory_order_relaxed);
  thread_.join();
}

void RelaxationThread::go() noexcept {
  flush_denormals();  // as the tick does: it is to be the same to the last bit when it is played again
  while (!stop_.load(std::memory_order_relaxed)) {
    bool any = false;
    for (const auto& object : apart_.objects) {
      if (object == nullptr || object->phase.load(std::memory_order_acquire) != RelaxedApart::Phase::thread)
        continue;
      object->replica.relax();
      object->phase.store(RelaxedApart::Phase::tick, std::memory_order_release);
      jobs_.fetch_add(1, std::memory_order_relaxed);
      any = true;
    }
    busy_s_.store(own_time_s(), std::memory_order_relaxed);
    if (!any) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

}  // namespace hybrid
