// SPDX-License-Identifier: GPL-3.0-or-later
// State of asynchronous relaxation: tissue away from the contact is relaxed outside the tick, in a copy of
// the soft object (voxel/object/shadow_object.h). The tick's part is in
// hybrid/tick/tissue/async_relaxation.h. The thread's part is in hybrid/session/relaxation_thread.h.
//
// The tick submits displacements and applies results; it never waits. Only the time at which a result is
// ready depends on the machine. The tick that first applies a result is therefore recorded, and a replayed
// session applies it in the same tick.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "voxel/object/shadow_object.h"

namespace hybrid {

// When a submitted state is relaxed, and when its result is applied.
enum class Arrival : std::uint8_t {
  counted,   // relaxed at once; applied after a delay in proportion to its work; for fixed-step sessions
  thread,    // relaxed by the thread; applied when it is done
  recorded,  // relaxed at once; applied in the tick whose recorded `arrived` has the object's bit
  played,    // not relaxed, because another thread installs recorded results; applied as `recorded` is
  at_once,   // relaxed and applied whole in the tick of the submission; for references, which may be slow
};

// The copy (shadow) of one soft object. `phase` says who may use the copy now, the tick or the thread.
struct AsyncObject {
  explicit AsyncObject(voxel::SoftObject& object) : shadow(object) {}
  enum class Phase : std::uint8_t { tick, thread };

  voxel::ShadowObject shadow;
  std::atomic<Phase> phase{Phase::tick};
  // Only the tick uses the fields below.
  bool submitted = false;
  std::uint64_t due = 0;   // tick in which the result arrives; for Arrival::counted
  std::uint64_t next = 0;  // earliest tick of the next submission
  bool arrived = false;    // the result is ready
  int waited = 0;          // ticks for which a submission or a result has been put off
};

// Objects under asynchronous relaxation, and the results of this tick.
struct AsyncRelaxation {
  [[nodiscard]] bool has(std::size_t o) const { return o < objects.size() && objects[o] != nullptr; }

  Arrival arrival = Arrival::counted;
  std::vector<std::unique_ptr<AsyncObject>> objects;  // [soft]; null or missing: relaxed in the tick
  // Bit o: the result of soft object o arrived in this tick. The tick reads it with Arrival::recorded and
  // Arrival::played, and otherwise writes it.
  std::uint64_t arrived = 0;
  std::uint64_t results = 0;  // results applied so far
  bool applied = false;       // a result, or a part of one, was applied near the contact in the last tick
  // CPU time (us) of this tick that a separate thread would have spent; excluded from tick_us.
  double other_thread_us = 0.0;
};

}  // namespace hybrid
