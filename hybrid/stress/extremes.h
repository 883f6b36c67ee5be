// SPDX-License-Identifier: GPL-3.0-or-later
// The extremes suite: rigid, soft and mixed scenes in which one or several settings have extreme values, and
// oracles for each. A case must end in a right answer or in a clear refusal.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

struct ExtremeRow {
  std::string test_case;  // scene and motion, for example "mixed: hand on a path"
  std::string setting;    // the extreme setting, for example "stiffness 25000 N/m, dt 0.1 ms"
  std::string oracle;     // name of the oracle
  std::string outcome;    // result in figures and words
  bool ok = false;
};

// The oracles:
//   finite   all numbers in force and state are finite
//   limits   the force is within the device's limit, and its change within the slew limit
//   energy   the hand gets back at most the stored energy and the cost of holding a force for a tick
//   passive  with the controller on, the hand gets at most the energy that it gave, plus that of one tick
//   outside  the tool is in no rigid object, and no nearer to one than its radius
//   held     the tool stays on its side when it is pulled a metre through an object within a tick
//   settled  after the tool has left, there is no force, and all tissue is back at rest
//   same     the forces are those of the scene without the flaw, or near the origin
//   hash     a second run gives the same bits
//   time     no tick takes long
//   refused  the message has file, line, column, the error and the remedy
// TickInvariants defines finite, limits, energy and outside exactly.
//
// A coupling that is too stiff for the sampled loop buzzes. That is physics, and no row falls short for it.
// But only the sampling may feed the buzz (energy), it must stay within the device's limit, and it must end
// when the tool leaves.

struct ExtremesOptions {
  bool quick = false;             // a share of the cases, in a few seconds
  std::filesystem::path scene{};  // also run this scene, unchanged, with every motion of a hand; may be empty
  Progress progress{};
  std::function<void(const ExtremeRow&)> on_row{};  // called for each row as soon as it is there
};

// Throws std::runtime_error if the folder for temporary files cannot be written.
std::vector<ExtremeRow> run_extremes(const ExtremesOptions& options);

nlohmann::ordered_json to_json(const ExtremeRow& row);
// Text for people: a line for each row that fell short, and counts for each oracle.
std::string extremes_text(const std::vector<ExtremeRow>& rows);

}  // namespace hybrid
