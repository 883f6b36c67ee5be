// SPDX-License-Identifier: GPL-3.0-or-later
// Ticks with random device input: what no device gives, and what a loop must come through all the same.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

struct FuzzOptions {
  std::uint64_t ticks = 20'000;  // over all scenes, a little more
  std::uint64_t seed = 1;
  bool async_relaxation = false;  // as SessionOptions::async_relaxation says, by counted work
  std::string only{};             // of the scenes, by its name; empty: all of them
  Progress progress{};
};

// Of one scene: rigid, soft and mixed ones as in the extremes suite; one whose rigid objects move, turn, are
// pushed, rub and are textured; and two soft blocks that meet under a punch.
struct FuzzResult {
  std::string scene;
  std::uint64_t ticks = 0, contact_ticks = 0, nonfinite = 0;  // nonfinite: inputs that were held back
  std::uint32_t faults = 0;                                   // FaultBit, ever
  std::uint64_t hash = 0;  // of all that was felt, and of the state at the end
  double most_N = 0.0, inside_m = 0.0, slowest_us = 0.0;
  double excess_share = 0.0;          // of the work done in an episode, given beyond what is allowed
  std::uint64_t recoveries = 0;       // times the tool was led away, and all came to rest
  std::vector<std::string> failures;  // in words, with the tick; the first few
};

// Episodes of 1,000 ticks. Positions: a walk over the surfaces in steps of 1e-9 to 1e-2 m, jumps of a metre,
// NaN, infinities, denormals, and magnitudes of 1e-300 to 1e300; velocities likewise. dt: 0.1 to 10 ms,
// stalls of up to 100 ms, 0, negative, NaN, infinite. Each tick is watched (TickInvariants): finite and
// within limits always, outside what is rigid and within the account of energy where that is defined. After
// each episode the tool is led away, and everything must come to rest without force. Throws
// std::runtime_error: no folder for temporary files.
std::vector<FuzzResult> fuzz_ticks(const FuzzOptions& options);

}  // namespace hybrid
