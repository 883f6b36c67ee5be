// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/async_relaxation.h"

#include <sched.h>
#include <time.h>

#include <algorithm>
#include <chrono>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/tick/tissue/work_budget.h"
#include "hybrid/world/world.h"

namespace hybrid {

struct RelaxedApart {
  explicit RelaxedApart(voxel::SoftObject& object) : replica(object) {}
  enum class Phase : std::uint8_t { tick, thread };  // whose turn it is

  voxel::Replica replica;
  std::atomic<Phase> phase{Phase::tick};
  // ---- the tick's ----
  bool given = false;
  std::uint64_t due = 0;   // tick; of Arrival::counted
  std::uint64_t next = 0;  // tick, from which on it is given again
  bool here = false;       // what was found of it
  int waited = 0;          // ticks that a give or a take has waited
};

Apart::Apart() = default;
Apart::~Apart() = default;

namespace {

constexpr std::size_t kMostApart = 64;  // bits of Apart::arrived
// A tick: what a result is added to, about 100 us of it; beside a wide cycle round the contact as many rows
// as that leaves work for, so much each, what they have to look for included, and some always: a result that
// waits keeps the next one waiting. (With none, a brain had one every 125 ms in place of 65.)
constexpr std::size_t kRowsTaken = 250, kLeastRows = 100, kWorkOfRow = 16;
// Parts of what is taken near a contact that is held still.
constexpr int kParts = 8;
// A give or a take, of some 100 us and up to 300, comes in a tick without one: the contact is asked to rest,
// which it does while the tool presses. Otherwise so many ticks go by at most.
constexpr int kMostWaits = 3;
// Rows that another core relaxes in a tick's time, so that a fixed-step session takes results as late as one
// in real time does.
constexpr std::uint64_t kRowsRelaxed = 400;
// Ticks between a result and what is given next, in which the contact looks at all that pulls. (With one of
// them a block that a ball was pushed into beside another was 1.8 just noticeable differences off at most,
// with three 1.3, with eight 1.2.)
constexpr std::uint64_t kOwnTicks = 3;

double own_time_s() noexcept {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

bool has_arrived(const Apart& apart, const RelaxedApart& object, std::size_t o, std::uint64_t tick) noexcept {
  switch (apart.arrival) {
    case Arrival::counted:
      return tick >= object.due;
    case Arrival::thread:
      return object.phase.load(std::memory_order_acquire) == RelaxedApart::Phase::tick;
    case Arrival::recorded:
    case Arrival::played:
      break;
  }
  return (apart.arrived >> o & 1U) != 0;
}

void give(WorldState& state, RelaxedApart& object, std::size_t o) noexcept {
  object.replica.give(*state.soft[o]);
  object.given = true;
  if (state.apart.arrival == Arrival::thread || state.apart.arrival == Arrival::played) {
    object.phase.store(RelaxedApart::Phase::thread, std::memory_order_release);
    return;
  }
  const double before_s = own_time_s();
  object.replica.relax();
  state.apart.elsewhere_us += 1e6 * (own_time_s() - before_s);
  object.due = state.tick + 1 + object.replica.work() / kRowsRelaxed;
}

// One of these a tick: a part of what is taken, what comes before a give or a take, these, some rows.
void exchange(WorldState& state, std::size_t o, std::uint64_t& arrived) noexcept {
  RelaxedApart& object = *state.apart.objects[o];
  voxel::SoftObject& soft = *state.soft[o];
  // Noted when it is seen, not when it is taken: what is done until then depends on it.
  if (object.given && !object.here && has_arrived(state.apart, object, o, state.tick)) {
    object.here = true;
    arrived |= std::uint64_t{1} << o;
  }
  if (object.replica.in_parts()) {
    object.replica.take_part(soft, !soft.held_still());
    state.apart.took = true;
    if (!object.replica.in_parts()) {
      object.next = state.tick + kOwnTicks;
    } else {
      soft.ask_to_rest();
    }
    return;
  }
  const bool drained = object.replica.drained();
  const bool gives = !object.given && state.tick >= object.next && voxel::Replica::wanted(soft);
  const bool takes = object.here && drained && !gives;
  const bool waits = (gives || takes) && soft.wide_cycle() && object.waited < kMostWaits;
  if (waits) {
    ++object.waited;
    soft.ask_to_rest();
  } else if (gives || takes) {
    object.waited = 0;
  }
  if ((gives || takes) && !waits && soft.prepare_exchange()) {
    soft.ask_to_rest();
    return;
  }
  if (gives && !waits) {
    give(state, object, o);
  } else if (takes && !waits) {
    // At once it would be felt as a step where the tool is held still: of 48 mN in 150 in a brain. (While it
    // moves that is lost in its motion, and would come later.)
    object.replica.take(soft, soft.held_still() ? kParts : 1);
    if (object.replica.in_parts()) soft.ask_to_rest();
    object.given = object.here = false;
    ++state.apart.results;
    state.apart.took = true;
    object.next = state.tick + kOwnTicks;
  } else if (!drained) {
    const auto shared = [&soft](std::size_t rows) {
      return static_cast<std::size_t>(soft.work_share() * static_cast<double>(rows));
    };
    const std::size_t beside = soft.work_left() / kWorkOfRow, most = shared(kRowsTaken);
    object.replica.drain(soft, soft.wide_cycle() ? std::clamp(beside, shared(kLeastRows), most) : most);
  }
}

}  // namespace

void relax_apart(WorldState& state, Arrival arrival) {
  state.apart.arrival = arrival;
  state.apart.objects.clear();
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    const voxel::SoftObject& object = *state.soft[o];
    const bool apart = o < kMostApart && !object.lattice().yields() && !object.uses_grid();
    state.apart.objects.push_back(apart ? std::make_unique<RelaxedApart>(*state.soft[o]) : nullptr);
  }
}

void give_work_share(WorldState& state, std::uint8_t steps) noexcept {
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.apart.has(o)) state.soft[o]->set_work_share(WorkShare::share(steps));
  }
}

void relax_background(const World& world, WorldState& state) noexcept {
  std::uint64_t arrived = 0;
  state.apart.elsewhere_us = 0.0;
  state.apart.took = false;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.apart.objects.empty() || state.apart.objects[o] == nullptr) {
      state.soft[o]->relax_background(world.soft[o].budget);
    } else {
      state.soft[o]->relax_near_pairs();
      exchange(state, o, arrived);
    }
  }
  const bool said = state.apart.arrival == Arrival::recorded || state.apart.arrival == Arrival::played;
  if (!said) state.apart.arrived = arrived;
}

void ResultTape::keep(const Apart& apart) {
  for (std::size_t o = 0; o < apart.objects.size(); ++o) {
    if (apart.has(o) && apart.objects[o]->replica.times_relaxed() > found_[o].size())
      found_[o].push_back(apart.objects[o]->replica.found());
  }
}

void ResultTape::hand_out(Apart& apart) noexcept {
  for (std::size_t o = 0; o < apart.objects.size(); ++o) {
    if (!apart.has(o)) continue;
    RelaxedApart& object = *apart.objects[o];
    if (object.phase.load(std::memory_order_acquire) != RelaxedApart::Phase::thread ||
        next_[o] == found_[o].size())
      continue;
    object.replica.find_again(found_[o][next_[o]++]);
    object.phase.store(RelaxedApart::Phase::tick, std::memory_order_release);
  }
}

bool ResultTape::ready(const Apart& apart) noexcept {
  for (std::size_t o = 0; o < apart.objects.size(); ++o) {
    if ((apart.arrived >> o & 1U) == 0 || !apart.has(o)) continue;
    if (apart.objects[o]->phase.load(std::memory_order_acquire) != RelaxedApart::Phase::tick) return false;
  }
  return true;
}

RelaxationThread::RelaxationThread(const World& world, Apart& apart, double surfaces_hz)
    : world_(world), apart_(apart), surfaces_hz_(surfaces_hz), thread_([this] { go(); }) {}

RelaxationThread::~RelaxationThread() {
  stop_.store(true, std::memory_order_relaxed);
  thread_.join();
}

bool RelaxationThread::relax_given() noexcept {
  bool any = false;
  for (const auto& object : apart_.objects) {
    if (object == nullptr || object->phase.load(std::memory_order_acquire) != RelaxedApart::Phase::thread)
      continue;
    object->replica.relax();
    object->phase.store(RelaxedApart::Phase::tick, std::memory_order_release);
    any = true;
  }
  return any;
}

// Of its own state, which the tick never writes.
void RelaxationThread::say_surfaces() {
  Moved& moved = surfaces_.back();
  moved.resize(world_.object_count());
  for (std::size_t o = 0; o < world_.soft.size(); ++o) {
    if (!apart_.has(o)) continue;
    const SoftBody& body = world_.soft[o];
    auto& of_object = moved[world_.rigid.size() + o];
    of_object.resize(body.drawn.vertices.size());
    for (std::size_t v = 0; v < of_object.size(); ++v)
      of_object[v] =
          glm::vec3(body.pose.rotation * apart_.objects[o]->replica.displacement_at(body.drawn.vertices[v]));
  }
  surfaces_.publish();
}

void take_ordinary_priority() noexcept {
  const sched_param none{};
  (void)sched_setscheduler(0, SCHED_OTHER, &none);  // giving up a right is never refused
}

void RelaxationThread::go() {
  take_ordinary_priority();
  flush_denormals();  // as the tick does: it is to be the same to the last bit when it is played again
  using Clock = std::chrono::steady_clock;
  Clock::time_point next = Clock::now();
  while (!stop_.load(std::memory_order_relaxed)) {
    const bool any = relax_given();
    if (surfaces_hz_ > 0.0 && Clock::now() >= next) {
      say_surfaces();
      next = Clock::now() +
             std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / surfaces_hz_));
    }
    busy_s_.store(own_time_s(), std::memory_order_relaxed);
    if (!any) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

}  // namespace hybrid
