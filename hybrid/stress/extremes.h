// SPDX-License-Identifier: GPL-3.0-or-later
// The extremes suite: rigid, soft and mixed scenes with one setting, or several, taken to its end; and what
// must hold of each. A case ends in a right answer or in a clear refusal.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

struct ExtremeRow {
  std::string test_case;  // scene and motion: "mixed: hand on a path"
  std::string setting;    // what was taken to its end: "stiffness 25000 N/m, dt 0.1 ms"
  std::string oracle;     // what must hold
  std::string outcome;    // what was seen, in figures and words
  bool ok = false;
};

// The oracles:
//   finite   no number in force or state is not one
//   limits   the force is within the device's limit, and its step within the slew
//   energy   the hand gets back what it stored, and no more than holding a force for a tick costs beside it
//   passive  with the controller on, the hand gets no more than it gave, and one tick's worst case
//   outside  the tool is in nothing rigid, nor nearer than its radius
//   held     what the tool is pulled through by a metre in a tick, it does not go through
//   settled  when the tool has left: no force, and everything soft back where it was
//   same     the forces are those of the same scene without the flaw, or where it is not far away
//   hash     a second run gives the same bits
//   time     no tick takes long
//   refused  file, line and column, what is wrong and what to do
// TickInvariants says exactly what is meant by the first four.
//
// A coupling stiffer than the sampled loop can hold buzzes: that is physics, and no row falls short for it.
// What must hold then is that the buzz is fed by the sampling alone (energy), stays within the device's
// limit, and ends when the tool leaves.

struct ExtremesOptions {
  bool quick = false;  // a share of the table, in a few seconds
  std::filesystem::path
      scene{};  // also this one, as it is written, with every motion of a hand; may be empty
  Progress progress{};
  std::function<void(const ExtremeRow&)> on_row{};  // as soon as there is one
};

// Throws std::runtime_error: the folder for temporary files cannot be written.
std::vector<ExtremeRow> run_extremes(const ExtremesOptions& options);

nlohmann::ordered_json to_json(const ExtremeRow& row);
// For people: a line for each case and setting, with what fell short in words; and a count of each oracle.
std::string extremes_text(const std::vector<ExtremeRow>& rows);

}  // namespace hybrid
