// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "hybrid/session/session.h"
#include "hybrid/tick/tissue/async_relaxation.h"

namespace hybrid {

void note_relaxation(const Scene& scene, BuiltScene& built, bool async_relaxation) {
  if (!async_relaxation) return;
  for (std::size_t o = 0; o < built.state->soft.size(); ++o) {
    const SoftDescription& soft = scene.soft[o];
    if (soft.budget_place.line == 0 || !relaxes_asynchronously(*built.state, o)) continue;
    built.notes.push_back(
        {soft.name, polygon::Severity::warning,
         fmt::format(
             "line {}: 'budget' has no effect in this session: the object relaxes apart from the tick; "
             "the budget counts with --relaxation tick, and in `hybrid compare`",
             soft.budget_place.line)});
  }
}

}  // namespace hybrid
