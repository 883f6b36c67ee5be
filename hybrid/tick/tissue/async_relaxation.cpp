// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/async_relaxation.h"

#include <algorithm>

#include "hybrid/base/thread_time.h"
#include "hybrid/tick/tissue/work_budget.h"

namespace hybrid {

namespace {

constexpr std::size_t kMaxAsync = 64;  // bits of AsyncRelaxation::arrived
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

bool has_arrived(const AsyncRelaxation& async, const AsyncObject& object, std::size_t o,
                 std::uint64_t tick) noexcept {
  switch (async.arrival) {
    case Arrival::counted:
      return tick >= object.due;
    case Arrival::thread:
      return object.phase.load(std::memory_order_acquire) == AsyncObject::Phase::tick;
    case Arrival::recorded:
    case Arrival::played:
      break;
  }
  return (async.arrived >> o & 1U) != 0;
}

void submit(WorldState& state, AsyncObject& object, std::size_t o) noexcept {
  object.replica.give(*state.soft[o]);
  object.submitted = true;
  if (state.async.arrival == Arrival::thread || state.async.arrival == Arrival::played) {
    object.phase.store(AsyncObject::Phase::thread, std::memory_order_release);
    return;
  }
  const double before_s = thread_time_s();
  object.replica.relax();
  state.async.other_thread_us += 1e6 * (thread_time_s() - before_s);
  object.due = state.tick + 1 + object.replica.work() / kRowsRelaxed;
}

// One of these a tick: a part of what is taken, what comes before a give or a take, these, some rows.
void exchange(WorldState& state, std::size_t o, std::uint64_t& arrived) noexcept {
  AsyncObject& object = *state.async.objects[o];
  voxel::SoftObject& soft = *state.soft[o];
  // Noted when it is seen, not when it is taken: what is done until then depends on it.
  if (object.submitted && !object.arrived && has_arrived(state.async, object, o, state.tick)) {
    object.arrived = true;
    arrived |= std::uint64_t{1} << o;
  }
  if (object.replica.in_parts()) {
    object.replica.take_part(soft, !soft.held_still());
    state.async.applied = true;
    if (!object.replica.in_parts()) {
      object.next = state.tick + kOwnTicks;
    } else {
      soft.ask_to_rest();
    }
    return;
  }
  const bool drained = object.replica.drained();
  const bool gives = !object.submitted && state.tick >= object.next && voxel::Replica::wanted(soft);
  const bool takes = object.arrived && drained && !gives;
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
    submit(state, object, o);
  } else if (takes && !waits) {
    // At once it would be felt as a step where the tool is held still: of 48 mN in 150 in a brain. (While it
    // moves that is lost in its motion, and would come later.)
    object.replica.take(soft, soft.held_still() ? kParts : 1);
    if (object.replica.in_parts()) soft.ask_to_rest();
    object.submitted = object.arrived = false;
    ++state.async.results;
    state.async.applied = true;
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

void start_async_relaxation(WorldState& state, Arrival arrival) {
  state.async.arrival = arrival;
  state.async.objects.clear();
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    const voxel::SoftObject& object = *state.soft[o];
    const bool is_async = o < kMaxAsync && !object.lattice().yields() && !object.uses_grid();
    state.async.objects.push_back(is_async ? std::make_unique<AsyncObject>(*state.soft[o]) : nullptr);
  }
}

void give_work_share(WorldState& state, std::uint8_t steps) noexcept {
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.async.has(o)) state.soft[o]->set_work_share(WorkShare::share(steps));
  }
}

void relax_background(const World& world, WorldState& state) noexcept {
  std::uint64_t arrived = 0;
  state.async.other_thread_us = 0.0;
  state.async.applied = false;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.async.objects.empty() || state.async.objects[o] == nullptr) {
      state.soft[o]->relax_background(world.soft[o].budget);
    } else {
      state.soft[o]->relax_near_pairs();
      exchange(state, o, arrived);
    }
  }
  const bool said = state.async.arrival == Arrival::recorded || state.async.arrival == Arrival::played;
  if (!said) state.async.arrived = arrived;
}

}  // namespace hybrid
