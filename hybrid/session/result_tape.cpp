// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/result_tape.h"

namespace hybrid {

void ResultTape::keep(const AsyncRelaxation& async) {
  for (std::size_t o = 0; o < async.objects.size(); ++o) {
    if (async.has(o) && async.objects[o]->shadow.times_relaxed() > found_[o].size())
      found_[o].push_back(async.objects[o]->shadow.result());
  }
}

void ResultTape::hand_out(AsyncRelaxation& async) noexcept {
  for (std::size_t o = 0; o < async.objects.size(); ++o) {
    if (!async.has(o)) continue;
    AsyncObject& object = *async.objects[o];
    if (object.phase.load(std::memory_order_acquire) != AsyncObject::Phase::thread ||
        next_[o] == found_[o].size())
      continue;
    object.shadow.replay_result(found_[o][next_[o]++]);
    object.phase.store(AsyncObject::Phase::tick, std::memory_order_release);
  }
}

bool ResultTape::ready(const AsyncRelaxation& async) noexcept {
  for (std::size_t o = 0; o < async.objects.size(); ++o) {
    if ((async.arrived >> o & 1U) == 0 || !async.has(o)) continue;
    if (async.objects[o]->phase.load(std::memory_order_acquire) != AsyncObject::Phase::tick) return false;
  }
  return true;
}

}  // namespace hybrid
