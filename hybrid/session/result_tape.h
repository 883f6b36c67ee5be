// SPDX-License-Identifier: GPL-3.0-or-later
// All results of asynchronous relaxation in a session. With the results of this tape, the ticks of a replayed
// session are the same to the last bit, whatever the other cores do meanwhile.
#pragma once

#include <cstddef>
#include <vector>

#include "hybrid/world/async_relaxation.h"

namespace hybrid {

class ResultTape {
 public:
  explicit ResultTape(std::size_t objects) : found_(objects), next_(objects, 0) {}

  // Call after each tick of a session that runs with Arrival::recorded.
  void keep(const AsyncRelaxation& async);
  // Hands out the results of the states that were submitted since the last call. For another thread of a
  // session that runs with Arrival::played.
  void hand_out(AsyncRelaxation& async) noexcept;
  // Are the results that the next tick applies ready?
  [[nodiscard]] static bool ready(const AsyncRelaxation& async) noexcept;

 private:
  std::vector<std::vector<voxel::ShadowObject::Result>> found_;  // [soft]
  // [soft]; index of the next result to be handed out
  std::vector<std::size_t> next_;
};

}  // namespace hybrid
