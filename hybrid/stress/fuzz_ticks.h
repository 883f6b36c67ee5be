// SPDX-License-Identifier: GPL-3.0-or-later
// Ticks with random device input, including input that no device gives and that a loop must survive.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

struct FuzzOptions {
  std::uint64_t ticks = 20'000;  // sum over all scenes; slightly more are run
  std::uint64_t seed = 1;
  bool async_relaxation = false;  // as SessionOptions::async_relaxation, by counted work
  std::string only{};             // name of the only scene to run; empty: all scenes
  Progress progress{};
};

// Result of one scene. There are rigid, soft and mixed scenes as in the extremes suite. In a further scene
// rigid objects move, turn, are pushed, have friction and are textured. In the last one two soft blocks meet
// under a punch.
struct FuzzResult {
  std::string scene;
  // `nonfinite`: inputs that were held back.
  std::uint64_t ticks = 0, contact_ticks = 0, nonfinite = 0;
  std::uint32_t faults = 0;  // all FaultBit flags that were ever set
  std::uint64_t hash = 0;    // of all forces, and of the state at the end
  double most_N = 0.0, inside_m = 0.0, slowest_us = 0.0;
  double excess_share = 0.0;          // excess over the allowed energy, as a share of an episode's work
  std::uint64_t recoveries = 0;       // times that the tool was led away and all came to rest
  std::vector<std::string> failures;  // in words, with the tick; only the first few
};

// Runs episodes of 1,000 ticks. Positions: a walk over the surfaces in steps of 1e-9 to 1e-2 m, jumps of a
// metre, NaN, infinities, denormals, and magnitudes of 1e-300 to 1e300. Velocities likewise. dt: 0.1 to 10
// ms, stalls of up to 100 ms, 0, negative, NaN, infinite.
// TickInvariants checks each tick. All values must be finite and within the limits. Where the scene allows
// these checks, the tool must be outside rigid objects, and the energy must be within its account. After each
// episode the tool is led away, and everything must come to rest without force. Throws std::runtime_error if
// there is no folder for temporary files.
std::vector<FuzzResult> fuzz_ticks(const FuzzOptions& options);

}  // namespace hybrid
