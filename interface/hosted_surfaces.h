// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces for a program that draws. The servo thread hands them to one reader, and neither of the two waits.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "hybrid/base/triple_buffer.h"
#include "hybrid/build/build_world.h"
#include "hybrid/snapshot/snapshot.h"
#include "hybrid/tick/tick.h"

namespace c_interface {

class HostedSurfaces {
 public:
  HostedSurfaces(const hybrid::Scene& scene, const hybrid::BuiltScene& built);

  // ---- constant after construction ----
  // Surface of an object at rest (scene frame).
  [[nodiscard]] const polygon::TriangleMesh& at_rest(std::size_t object) const {
    return drawn_.objects[object].surface;
  }

  // ---- servo ----
  // `live`: a thread relaxes the tissue and publishes the surfaces away from the tool.
  void publish(const hybrid::World& world, const hybrid::WorldState& state, const hybrid::TickResult& felt,
               std::uint64_t ticks, bool live);

  // ---- reader ----
  // Takes the newest published surfaces; false if there are none that are newer. `relaxed` returns the
  // surfaces of the relaxation thread, or null. It is called only after a publish().
  bool take(const std::function<const hybrid::RelaxedTissue*()>& relaxed);
  // The snapshot that was taken last; empty before the first one.
  [[nodiscard]] const hybrid::Snapshot* taken() const noexcept { return taken_ ? &*taken_ : nullptr; }
  // Did the object's surface change with the snapshot that was taken last?
  [[nodiscard]] bool changed(std::size_t object) const { return changed_[object]; }
  // Writes the vertices of that snapshot: x, y, z for each.
  void copy_vertices(std::size_t object, double* to) const;

 private:
  [[nodiscard]] bool differ(std::size_t object, const hybrid::Snapshot& a, const hybrid::Snapshot& b) const;

  struct Published {
    hybrid::Snapshot snapshot;
    std::uint64_t number = 0;  // counts from 1
  };
  hybrid::DrawnScene drawn_;
  hybrid::TripleBuffer<Published> published_;
  std::uint64_t published_number_ = 0;  // of the servo thread
  std::optional<hybrid::Snapshot> taken_;
  std::uint64_t taken_number_ = 0;
  std::vector<bool> changed_;
};

}  // namespace c_interface
