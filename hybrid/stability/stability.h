// SPDX-License-Identifier: GPL-3.0-or-later
// Boundaries up to which the haptic loop of a scene is stable, passive and free of buzz. They are measured
// and compared with theory.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/stability/pressed_loop.h"

namespace hybrid {

enum class Boundary : std::uint8_t { stable, passive, buzz };
std::string_view name_of(Boundary kind) noexcept;

// The parameter that is varied. The rows of one sweep lie on the same curves.
enum class StabilitySweep : std::uint8_t {
  damping,       // b of the mechanism, without a hand
  wall_damping,  // B of the wall
  rate,
  grip,          // hands on the scene's device without friction and encoder
  quantisation,  // friction and encoder
  account,       // B with the tick's account of damping
  device,        // each device as it is, in a hand
  tissue,        // stiffness of the scene's soft objects
};
std::string_view title_of(StabilitySweep sweep) noexcept;

struct StabilityRow {
  StabilitySweep sweep = StabilitySweep::damping;
  Boundary kind = Boundary::stable;
  LoopSetting setting;
  std::string grip = "none", device;  // device: empty if the mechanism models no real device
  // Stiffness of the virtual coupling (N/m) up to which the loop is stable or passive, or at which buzz
  // begins.
  std::optional<double> measured;  // empty: there is no boundary up to `stiffest`
  double stiffest = 1e7;
  std::optional<double> theory;       // empty: no theory is exact
  std::optional<double> lower_bound;  // bound that theory guarantees if it is not exact
  std::string theory_name;
  // Only for sweep `tissue`, where exactly one of them is set. young_Pa: modulus of the first soft object;
  // the stiffness of the coupling is measured. coupling_N_per_m: stiffness of the coupling; the modulus at
  // which buzz begins is measured, and `measured` and `stiffest` are moduli (Pa).
  std::optional<double> young_Pa, coupling_N_per_m;
  // ---- only of buzz ----
  Vibration vibration;  // at the boundary
  // At the device's nominal stiffness; felt if above 1.
  std::optional<double> nominal_N_per_m, felt_at_nominal;

  // Damping b in theory. It includes the hand's, except for passivity.
  [[nodiscard]] double damping_N_s_per_m() const;
  [[nodiscard]] std::optional<double> error() const;  // measured / theory − 1
};

struct TheoryCurve {  // of one sweep, for one delay
  StabilitySweep sweep = StabilitySweep::damping;
  Boundary kind = Boundary::stable;
  int delay_ticks = 0;
  std::vector<double> x, stiffness_N_per_m;  // x: the varied parameter in SI units
};

struct StabilityReport {
  std::string scene;
  std::vector<StabilityRow> rows;
  std::vector<TheoryCurve> curves;
  double seconds = 0.0, processor_seconds = 0.0;
  int stopped_by = 0;  // the signal that ended the measurement early; rows not measured are missing
};

struct StabilityOptions {
  bool quick = false;  // only the first row of each sweep and kind
  Progress progress{};
};

// Runs all measurements. For a rigid scene this is the whole plan (two to five minutes; quick: some seconds).
// For a scene with soft objects only buzz is measured. The results are the stiffness of the coupling at which
// buzz begins, at moduli of 1, 10 and 100 kPa, and the modulus at which it begins under a stiff coupling. A
// signal (StopOnSignal) ends the measurement early. Throws SceneError (see PressedScene).
StabilityReport measure_stability(const Scene& scene, const StabilityOptions& options = {});

// Comparison with theory: the number of rows that have a theory, and the largest error.
struct Agreement {
  int rows = 0;
  double worst = 0.0;  // |error|
};
Agreement agreement(const StabilityReport& report, Boundary kind);
// Number of rows measured below their lower bound by more than the precision of the bisection.
int below_bound(const StabilityReport& report);

}  // namespace hybrid
