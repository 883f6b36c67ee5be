// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/async_relaxation.h"

#include <algorithm>

#include "hybrid/base/thread_time.h"
#include "hybrid/tick/tissue/work_budget.h"

namespace hybrid {

namespace {

constexpr std::size_t kMaxAsync = 64;  // bits of AsyncRelaxation::arrived
// Rows of a result that are applied per tick: at most kMaxRowsApplied, which take about 100 µs. In a tick
// with a cycle of a large contact patch, the remaining work of the tick is the limit. A row then counts as
// kWorkOfRow, including its obstacle queries. But at least kLeastRows are applied, because a result that
// waits delays the next one.
constexpr std::size_t kMaxRowsApplied = 250, kLeastRows = 100, kWorkOfRow = 16;
// Number of parts in which a result's rows near a contact at rest are applied.
constexpr int kResultParts = 8;
// A submission or an application takes about 100 µs, and up to 300 µs. It waits up to kMaxWaits ticks for a
// tick without a cycle of a large patch. While it waits, the contact skips its cycles if the tool presses.
constexpr int kMaxWaits = 3;
// Rows that another core relaxes in the time of a tick. A fixed-step session uses this to get its results as
// late as a session in real time.
constexpr std::uint64_t kRowsRelaxed = 400;
// Ticks between a result and the next submission, in which the contact sees the full residual.
constexpr std::uint64_t kTicksBetween = 3;

bool has_arrived(const AsyncRelaxation& async, const AsyncObject& object, std::size_t o,
                 std::uint64_t tick) noexcept {
  switch (async.arrival) {
    case Arrival::counted:
      return tick >= object.due;
    case Arrival::thread:
      return object.phase.load(std::memory_order_acquire) == AsyncObject::Phase::tick;
    case Arrival::recorded:
    case Arrival::played:
    case Arrival::at_once:
      break;
  }
  return (async.arrived >> o & 1U) != 0;
}

void submit(WorldState& state, AsyncObject& object, std::size_t o) noexcept {
  object.shadow.submit(*state.soft[o]);
  object.submitted = true;
  if (state.async.arrival == Arrival::thread || state.async.arrival == Arrival::played) {
    object.phase.store(AsyncObject::Phase::thread, std::memory_order_release);
    return;
  }
  const double before_s = thread_time_s();
  object.shadow.relax();
  state.async.other_thread_us += 1e6 * (thread_time_s() - before_s);
  object.due = state.tick + 1 + object.shadow.work() / kRowsRelaxed;
}

// Results arrive at once. In real time a result is late by the work of its cycle, which grows with the number
// of voxels. With such a delay, a reference on a finer lattice would be further from rest.
void exchange_at_once(WorldState& state, std::size_t o) noexcept {
  AsyncObject& object = *state.async.objects[o];
  voxel::SoftObject& soft = *state.soft[o];
  if (state.tick < object.next || !voxel::ShadowObject::wanted(soft)) return;
  while (soft.prepare_exchange()) {
  }
  submit(state, object, o);
  object.shadow.apply_near(soft);
  while (!object.shadow.all_applied()) object.shadow.apply_far(soft, kMaxRowsApplied);
  object.submitted = false;
  object.next = state.tick + kTicksBetweenAtOnce;
  ++state.async.results;
  state.async.applied = true;
}

// Makes at most one of these exchanges in the tick: a part of a result, the preparation of an exchange, a
// submission, a result, or some of a result's far rows.
void exchange(WorldState& state, std::size_t o, std::uint64_t& arrived) noexcept {
  AsyncObject& object = *state.async.objects[o];
  voxel::SoftObject& soft = *state.soft[o];
  // Notes the arrival of a result in the tick in which it is seen. The result may be applied later, but the
  // exchanges until then depend on its arrival.
  if (object.submitted && !object.arrived && has_arrived(state.async, object, o, state.tick)) {
    object.arrived = true;
    arrived |= std::uint64_t{1} << o;
  }
  if (object.shadow.in_parts()) {
    object.shadow.apply_part(soft, !soft.contact_is_still());
    state.async.applied = true;
    if (!object.shadow.in_parts()) {
      object.next = state.tick + kTicksBetween;
    } else {
      soft.skip_next_cycle();
    }
    return;
  }
  const bool drained = object.shadow.all_applied();
  const bool gives = !object.submitted && state.tick >= object.next && voxel::ShadowObject::wanted(soft);
  const bool takes = object.arrived && drained && !gives;
  const bool waits = (gives || takes) && soft.large_patch_cycle() && object.waited < kMaxWaits;
  if (waits) {
    ++object.waited;
    soft.skip_next_cycle();
  } else if (gives || takes) {
    object.waited = 0;
  }
  if ((gives || takes) && !waits && soft.prepare_exchange()) {
    soft.skip_next_cycle();
    return;
  }
  if (gives && !waits) {
    submit(state, object, o);
  } else if (takes && !waits) {
    // If the tool is at rest, the result is applied in parts: as a whole it would be felt as a step. While
    // the tool moves, the step is not noticed, and parts would only delay the result.
    object.shadow.apply_near(soft, soft.contact_is_still() ? kResultParts : 1);
    if (object.shadow.in_parts()) soft.skip_next_cycle();
    object.submitted = object.arrived = false;
    ++state.async.results;
    state.async.applied = true;
    object.next = state.tick + kTicksBetween;
  } else if (!drained) {
    const auto shared = [&soft](std::size_t rows) {
      return static_cast<std::size_t>(soft.work_share() * static_cast<double>(rows));
    };
    const std::size_t beside = soft.work_left() / kWorkOfRow, most = shared(kMaxRowsApplied);
    object.shadow.apply_far(soft,
                            soft.large_patch_cycle() ? std::clamp(beside, shared(kLeastRows), most) : most);
  }
}

}  // namespace

bool relaxes_asynchronously(const WorldState& state, std::size_t o) {
  const voxel::SoftObject& object = *state.soft[o];
  return o < kMaxAsync && !object.lattice().has_plasticity() && !object.uses_patches();
}

void start_async_relaxation(WorldState& state, Arrival arrival) {
  state.async.arrival = arrival;
  state.async.objects.clear();
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    state.async.objects.push_back(
        relaxes_asynchronously(state, o) ? std::make_unique<AsyncObject>(*state.soft[o]) : nullptr);
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
      if (state.async.arrival == Arrival::at_once) {
        exchange_at_once(state, o);
      } else {
        exchange(state, o, arrived);
      }
    }
  }
  const bool said = state.async.arrival == Arrival::recorded || state.async.arrival == Arrival::played;
  if (!said) state.async.arrived = arrived;
}

}  // namespace hybrid
