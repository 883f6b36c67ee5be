// SPDX-License-Identifier: GPL-3.0-or-later
// Where the haptic loop of a scene stops being stable, passive and calm: measured, beside theory.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/stability/pressed_loop.h"

namespace hybrid {

enum class Boundary : std::uint8_t { stable, passive, buzz };
std::string_view name_of(Boundary kind) noexcept;

// What is varied: the rows of one sweep lie on the same curves.
enum class StabilitySweep : std::uint8_t {
  damping,       // b of the mechanism, nobody's hand
  wall_damping,  // B
  rate,
  grip,          // the scene's device without friction and encoder, held
  quantisation,  // friction and encoder
  account,       // B with the care that the tick takes of it
  device,        // each device as it is, held
  tissue,        // the scene's soft objects, softer and stiffer
};
std::string_view title_of(StabilitySweep sweep) noexcept;

struct StabilityRow {
  StabilitySweep sweep = StabilitySweep::damping;
  Boundary kind = Boundary::stable;
  LoopSetting setting;
  std::string grip = "none", device;  // device: empty where it is no real one's model
  // The stiffness of the virtual coupling (N/m) up to which the loop is so; of buzz that at which it begins.
  std::optional<double> measured;  // empty: nowhere up to `stiffest`
  double stiffest = 1e7;
  std::optional<double> theory;       // empty: none is exact
  std::optional<double> lower_bound;  // what theory promises where it is not exact
  std::string theory_name;
  // Of tissue: Young's modulus of the first soft object; or the coupling is this stiff, and what is measured
  // is the modulus (Pa) at which it begins to buzz, up to `stiffest`.
  std::optional<double> young_Pa, coupling_N_per_m;
  // ---- of buzz ----
  Vibration vibration;                                     // where it begins
  std::optional<double> nominal_N_per_m, felt_at_nominal;  // at the device's nominal stiffness; felt above 1

  [[nodiscard]] double damping_N_s_per_m() const;     // b of theory: with the hand's, but for passivity
  [[nodiscard]] std::optional<double> error() const;  // measured / theory − 1
};

struct TheoryCurve {  // of a sweep, for one delay
  StabilitySweep sweep = StabilitySweep::damping;
  Boundary kind = Boundary::stable;
  int delay_ticks = 0;
  std::vector<double> x, stiffness_N_per_m;  // x: what is varied, SI
};

struct StabilityReport {
  std::string scene;
  std::vector<StabilityRow> rows;
  std::vector<TheoryCurve> curves;
  double seconds = 0.0, processor_seconds = 0.0;
  int stopped_by = 0;  // the signal that ended the measurement; the rows are then those that were done
};

struct StabilityOptions {
  bool quick = false;  // of each sweep and kind the first row alone
  Progress progress{};
};

// Measures them all: over rigid scenes the whole plan (two to five minutes; quick: some seconds), over scenes
// with something soft where they begin to buzz: with Young's modulus at 1, 10 and 100 kPa, and with a stiff
// coupling by Young's modulus. A signal (StopOnSignal) ends it early. Throws SceneError (see PressedScene).
StabilityReport measure_stability(const Scene& scene, const StabilityOptions& options = {});

// What theory and measurement are compared over: rows that have a theory, and how far the worst is off.
struct Agreement {
  int rows = 0;
  double worst = 0.0;  // |error|
};
Agreement agreement(const StabilityReport& report, Boundary kind);
// Rows measured below their lower bound (by more than the precision of the bisection).
int below_bound(const StabilityReport& report);

}  // namespace hybrid
