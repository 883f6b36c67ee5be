// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "hybrid/validate/cases.h"
#include "hybrid/validate/references.h"
#include "hybrid/validate/specimen.h"

namespace hybrid {
namespace {

constexpr double kPoisson = 0.49;  // silicone keeps its volume; this is the highest ν that bricks take
// A linear law that is right at 5 % strain is 5.5 % below an incompressible neo-Hookean law at 10 % strain.
// These materials are within 7 % of the neo-Hookean law. So the linear law must be within 13 % at 10 %
// strain.
constexpr double kBoundAtTen = 0.13;

// % strain; offset between the points of different grades, so that they do not overlap.
constexpr double kBeside = 0.15;

double area_m2() {
  return 0.25 * std::numbers::pi * kSiliconeDiameter_m * kSiliconeDiameter_m;
}

using Forces = std::array<double, kSiliconeStrains.size()>;

// Forces (N) of the cylinder with a modulus of 1 Pa. They are scaled from the lattice's area to the true one.
Forces forces_per_Pa(bool bonded, double spacing_m) {
  // A cylinder that is bonded to both plates is modelled by its lower half. Its middle plane stays flat and
  // slips.
  const double height_m = bonded ? 0.5 * kSiliconeHeight_m : kSiliconeHeight_m;
  PressedSpecimen cylinder({.shape = Specimen::Shape::cylinder,
                            .size_m = {kSiliconeDiameter_m, kSiliconeDiameter_m, height_m},
                            .spacing_m = spacing_m,
                            .energy = Energy::trilinear,
                            .poisson = kPoisson,
                            .slipping_base = !bonded});
  Forces forces{};
  for (std::size_t s = 0; s < forces.size(); ++s) {
    const double on_lattice = cylinder.on_punch_N(kSiliconeDiameter_m, kSiliconeStrains[s] * height_m);
    forces[s] = on_lattice * area_m2() / cylinder.top_area_m2();
  }
  return forces;
}

void add_rows(const Silicone& silicone, const Forces& per_Pa, ValidationReport& report) {
  const double young_Pa = silicone.at_strain[0].mean_N / per_Pa[0];
  for (std::size_t s = 1; s < kSiliconeStrains.size(); ++s) {
    const MeanAndDeviation& measured = silicone.at_strain[s];
    const bool at_ten = s == 1;
    report.rows.push_back(
        {.group = "silicone",
         .name = silicone.name,
         .source = kSiliconeSource,
         .quantity = silicone_quantity(s),
         .unit = "N",
         .reference = measured.mean_N,
         .ours = young_Pa * per_Pa[s],
         .low = measured.mean_N - measured.deviation_N,
         .high = measured.mean_N + measured.deviation_N,
         .bound = kBoundAtTen,
         .stated = at_ten,
         .detail = !silicone.pure,
         .why = at_ten ? "" : "a linear lattice does not stiffen; silicone under compression does"});
  }
}

// All materials of one family. Each force is relative to that at 5 % strain.
ValidationPanel family_panel(std::string_view family, const Forces& per_Pa) {
  ValidationPanel panel{.group = "silicone",
                        .title = std::string(family),
                        .x_label = "strain (%)",
                        .y_label = "force / force at 5 %",
                        .x = {0.0},
                        .ours = {0.0},
                        .series = {}};
  for (std::size_t s = 0; s < per_Pa.size(); ++s) {
    panel.x.push_back(100.0 * kSiliconeStrains[s]);
    panel.ours.push_back(per_Pa[s] / per_Pa[0]);
  }
  ValidationSeries& series = panel.series.emplace_back();
  int grades = 0;
  for (const Silicone& silicone : silicones()) {
    if (!std::string_view(silicone.name).starts_with(family)) continue;
    const double unit = silicone.at_strain[0].mean_N;
    for (std::size_t s = 0; s < per_Pa.size(); ++s) {
      const MeanAndDeviation& m = silicone.at_strain[s];
      series.measured.push_back({100.0 * kSiliconeStrains[s] + kBeside * grades, m.mean_N / unit,
                                 (m.mean_N - m.deviation_N) / unit, (m.mean_N + m.deviation_N) / unit});
    }
    ++grades;
  }
  series.name = fmt::format("measured: {} grades, mean and SD", grades);
  return panel;
}

}  // namespace

std::string silicone_quantity(std::size_t strain) {
  return fmt::format("force at {:.0f} % strain, from that at 5 %", 100.0 * kSiliconeStrains.at(strain));
}

void add_silicones(const ValidationOptions& options, ValidationReport& report) {
  // Between slipping plates the strain is uniform, so a coarse spacing is exact.
  constexpr double kCoarse_m = 2.5e-3, kFine_m = 1.25e-3;
  say(options, "silicone between slipping plates");
  const Forces slipping = forces_per_Pa(false, kCoarse_m);
  say(options, "silicone bonded to the plates");
  const Forces bonded = forces_per_Pa(true, options.quick ? kCoarse_m : kFine_m);
  for (const Silicone& silicone : silicones()) {
    add_rows(silicone, slipping, report);
    const double at_five_N = silicone.at_strain[0].mean_N;
    report.moduli.push_back({.name = silicone.name,
                             .slipping_Pa = at_five_N / slipping[0],
                             .bonded_Pa = at_five_N / bonded[0],
                             .published_Pa = std::nullopt});
    if (silicone.published_kPa > 0.0) report.moduli.back().published_Pa = 1e3 * silicone.published_kPa;
  }
  for (const char* family : {"EcoFlex 00-10", "EcoFlex 00-30", "EcoFlex 00-50"})
    report.panels.push_back(family_panel(family, slipping));
}

}  // namespace hybrid
