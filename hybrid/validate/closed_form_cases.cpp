// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "hybrid/validate/cases.h"
#include "hybrid/validate/half_space.h"
#include "hybrid/validate/references.h"
#include "hybrid/validate/specimen.h"

namespace hybrid {
namespace {

constexpr const char* kClosedFormGroup = "closed form";
constexpr double kYoung_Pa = 10e3;   // of all specimens
constexpr double kShallow = 0.0025;  // depth of a ball in its radii; Hertz holds for small depths

// Six links do not conserve volume, so ν is tested with bricks.
void add_bar(Energy energy, double poisson, double spacing_m, ValidationReport& report) {
  PressedSpecimen bar({.shape = Specimen::Shape::cylinder,
                       .size_m = {kSiliconeDiameter_m, kSiliconeDiameter_m, kSiliconeHeight_m},
                       .spacing_m = spacing_m,
                       .energy = energy,
                       .poisson = poisson,
                       .young_Pa = {kYoung_Pa},
                       .slipping_base = true});
  constexpr double strain = 0.1;
  const double ours = bar.on_punch_N(kSiliconeDiameter_m, strain * bar.height_m());
  report.rows.push_back(
      {.group = kClosedFormGroup,
       .name = fmt::format("cylinder between slipping plates, {}, ν {:.2f}", words_of(energy), poisson),
       .source = "F = E·A·ε",
       .quantity = "force at 10 % strain",
       .unit = "N",
       .reference = kYoung_Pa * bar.top_area_m2() * strain,
       .ours = ours,
       .bound = 0.01,
       .stated = true});
}

// Tests a cylinder that is bonded at both ends. By symmetry its middle plane stays flat and slips, so only
// the lower half is modelled.
void add_bonded_disc(double spacing_m, ValidationReport& report) {
  PressedSpecimen half({.shape = Specimen::Shape::cylinder,
                        .size_m = {kSiliconeDiameter_m, kSiliconeDiameter_m, 0.5 * kSiliconeHeight_m},
                        .spacing_m = spacing_m,
                        .energy = Energy::trilinear,
                        .poisson = 0.49,
                        .young_Pa = {kYoung_Pa}});
  constexpr double strain = 0.05;
  // Shape factor: loaded area / free area.
  const double shape = kSiliconeDiameter_m / (4.0 * kSiliconeHeight_m);
  const double apparent_Pa =
      half.on_punch_N(kSiliconeDiameter_m, strain * half.height_m()) / (half.top_area_m2() * strain);
  report.rows.push_back({.group = kClosedFormGroup,
                         .name = "cylinder bonded to both plates, bricks, ν 0.49",
                         .source = "Gent & Lindley 1959: 1 + 2·S², incompressible, approximate",
                         .quantity = "stiffness, relative to slipping plates",
                         .reference = 1.0 + 2.0 * shape * shape,
                         .ours = apparent_Pa / kYoung_Pa,
                         .bound = 0.05,
                         .stated = true});
}

void add_hertz(Energy energy, double poisson, int nodes, double bound, ValidationReport& report) {
  report.rows.push_back(
      {.group = kClosedFormGroup,
       .name = fmt::format("ball on a bonded block, {}, ν {:.2f}", words_of(energy), poisson),
       .source = "Hertz 1882, with the bonded layer of Dimitriadis et al. 2002",
       .quantity = fmt::format("force at a depth of {:.4f} R, contact {} spacings", kShallow, nodes),
       .unit = "E·R²",
       .reference = hertz_N(1.0, poisson, 1.0, kShallow),
       .ours = half_space_factor(energy, poisson, kShallow, nodes) * hertz_N(1.0, poisson, 1.0, kShallow),
       .bound = bound,
       .stated = true});
}

}  // namespace

void add_closed_forms(const ValidationOptions& options, ValidationReport& report) {
  const double spacing_m = options.quick ? 2.5e-3 : 1.25e-3;
  say(options, "closed forms: cylinder between plates");
  add_bar(Energy::six_link, 0.3, spacing_m, report);
  add_bar(Energy::trilinear, 0.45, spacing_m, report);
  add_bonded_disc(spacing_m, report);
  say(options, "closed forms: ball on a block");
  const int nodes = options.quick ? 5 : 8;
  add_hertz(Energy::six_link, 0.3, nodes, 0.03, report);
  add_hertz(Energy::trilinear, 0.3, nodes, 0.01, report);
  add_hertz(Energy::trilinear, 0.45, 5, 0.03, report);
  // The solver converges slowly near incompressibility. With ν near 0.5, F is 16/9·E·√R·d^1.5.
  if (!options.quick) add_hertz(Energy::trilinear, 0.49, 5, 0.03, report);
}

}  // namespace hybrid
