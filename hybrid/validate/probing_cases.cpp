// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hybrid/validate/cases.h"
#include "hybrid/validate/half_space.h"
#include "hybrid/validate/references.h"
#include "hybrid/validate/specimen.h"

namespace hybrid {
namespace {

constexpr double kFitDepth_m = 1e-3;      // E is fitted to the force at this depth
constexpr double kClaimedDepth_m = 2e-3;  // the force at this depth is predicted
constexpr double kFirstDepth_m = 0.5e-3;  // the start of the contact is fitted to the force at this depth
// Thickness and width of the samples are not published. The block is 16 mm (pork) or 20 mm (liver) thick.
constexpr double kBlockWide = 8.0, kBlockDeep = 5.0;  // in radii of the ball

// Force of a ball on the block at rest, over depth. Units: E·R² and R.
class ForceCurve {
 public:
  ForceCurve(Energy energy, double poisson, int nodes_a_radius) {
    PressedSpecimen block({.size_m = {kBlockWide, kBlockWide, kBlockDeep},
                           .spacing_m = 1.0 / nodes_a_radius,
                           .energy = energy,
                           .poisson = poisson});
    for (const double depth : {0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.3}) {
      depth_.push_back(depth);
      steady_.push_back(block.on_ball_N(1.0, depth) / std::pow(depth, 1.5));
    }
  }
  // Interpolates force / depth^1.5, which varies slowly: Hertz's power of the depth is divided out.
  [[nodiscard]] double at(double depth) const {
    if (!(depth > 0.0)) return 0.0;
    const auto above = std::ranges::upper_bound(depth_, depth);
    if (above == depth_.begin()) return steady_.front() * std::pow(depth, 1.5);
    const auto n = static_cast<std::size_t>(std::min(above, std::prev(depth_.end())) - depth_.begin());
    const double share = (depth - depth_[n - 1]) / (depth_[n] - depth_[n - 1]);
    return (steady_[n - 1] + share * (steady_[n] - steady_[n - 1])) * std::pow(depth, 1.5);
  }

 private:
  std::vector<double> depth_, steady_;
};

const ProbedDepth& at_depth(const ProbedTissue& tissue, double depth_m) {
  return *std::ranges::find_if(
      tissue.depths, [depth_m](const ProbedDepth& d) { return std::fabs(d.depth_m - depth_m) < 1e-9; });
}

// A prediction: force = scale · curve((depth + offset) / R).
struct Fit {
  double scale_N = 0.0, offset_m = 0.0;
  [[nodiscard]] double at(const ForceCurve& curve, const ProbedTissue& tissue, double depth_m) const {
    return scale_N * curve.at((depth_m + offset_m) / tissue.ball_m);
  }
};

Fit fit_modulus(const ForceCurve& curve, const ProbedTissue& tissue, double offset_m = 0.0) {
  const double shape = curve.at((kFitDepth_m + offset_m) / tissue.ball_m);
  return {.scale_N = at_depth(tissue, kFitDepth_m).median_N / shape, .offset_m = offset_m};
}

// Fits E and the start of the contact to the first two depths. The contact may have begun before depth 0
// ("light contact").
Fit fit_modulus_and_contact(const ForceCurve& curve, const ProbedTissue& tissue) {
  const double first_N = at_depth(tissue, kFirstDepth_m).median_N;
  double low_m = -0.4e-3, high_m = 2e-3;
  for (int n = 0; n < 60; ++n) {
    const double middle_m = 0.5 * (low_m + high_m);
    // The earlier the contact began, the larger is the force at the first depth relative to that at
    // kFitDepth_m.
    const bool more = fit_modulus(curve, tissue, middle_m).at(curve, tissue, kFirstDepth_m) < first_N;
    (more ? low_m : high_m) = middle_m;
  }
  return fit_modulus(curve, tissue, 0.5 * (low_m + high_m));
}

ValidationRow row_of(const ProbedTissue& tissue, const ProbedDepth& measured, double ours_N,
                     const std::string& how) {
  return {.group = tissue.pork ? "pork" : "liver",
          .name = fmt::format("{}, {}", tissue.name, how),
          .source = kProbingSource,
          .quantity = fmt::format("force at {:.2f} mm, from that at 1 mm", 1e3 * measured.depth_m),
          .unit = "N",
          .reference = measured.median_N,
          .ours = ours_N,
          .low = measured.low_N,
          .high = measured.high_N};
}

std::string reason(const ProbedTissue& tissue, double depth_m) {
  if (depth_m < kFitDepth_m)
    return "depth 0 is light contact: the probe already pressed there, and no contact point is published";
  if (!tissue.pork)
    return "this liver stiffens faster than a linear half-space: strain, or a thin slice on a board; "
           "thickness is not published";
  return "tissue stiffens with strain, and a linear lattice does not; contact deeper than half the radius";
}

void add_tissue(const ProbedTissue& tissue, const ForceCurve& bricks, const ForceCurve& links,
                ValidationReport& report) {
  const Fit fit = fit_modulus(bricks, tissue);
  for (const ProbedDepth& measured : tissue.depths) {
    if (measured.depth_m == kFitDepth_m) continue;
    ValidationRow row = row_of(tissue, measured, fit.at(bricks, tissue, measured.depth_m), "bricks");
    row.stated = tissue.pork && measured.depth_m == kClaimedDepth_m;
    row.detail = measured.depth_m != kClaimedDepth_m && measured.depth_m < 2.9e-3;
    row.why = reason(tissue, measured.depth_m);
    report.rows.push_back(std::move(row));
  }
  const ProbedDepth& claimed = at_depth(tissue, kClaimedDepth_m);
  ValidationRow by_links =
      row_of(tissue, claimed, fit_modulus(links, tissue).at(links, tissue, kClaimedDepth_m), "links");
  by_links.detail = true;
  by_links.why = reason(tissue, kClaimedDepth_m);
  report.rows.push_back(std::move(by_links));
  ValidationRow shifted = row_of(
      tissue, claimed, fit_modulus_and_contact(bricks, tissue).at(bricks, tissue, kClaimedDepth_m), "bricks");
  shifted.name += ", contact point fitted too";
  shifted.quantity = "force at 2.00 mm, from those at 0.5 and 1 mm";
  shifted.detail = true;
  shifted.why = "an earlier contact makes the curve straighter, and this tissue stiffens";
  report.rows.push_back(std::move(shifted));
}

ValidationPanel panel_of(const ProbedTissue& tissue, const ForceCurve& bricks) {
  ValidationPanel panel{
      .group = tissue.pork ? "pork" : "liver",
      .title = fmt::format("{}: ball of {:.2f} mm, {} sites", tissue.name, 1e3 * tissue.ball_m, tissue.sites),
      .x_label = "depth (mm)",
      .y_label = "force (N)",
      .x = {},
      .ours = {},
      .series = {{.name = "measured: median and quartiles", .measured = {}}}};
  const Fit fit = fit_modulus(bricks, tissue);
  constexpr int kSteps = 30;  // points of the drawn curve
  for (int n = 0; n <= kSteps; ++n) {
    const double depth_m = 3e-3 * n / kSteps;
    panel.x.push_back(1e3 * depth_m);
    panel.ours.push_back(fit.at(bricks, tissue, depth_m));
  }
  for (const ProbedDepth& d : tissue.depths)
    panel.series.front().measured.push_back({1e3 * d.depth_m, d.median_N, d.low_N, d.high_N});
  return panel;
}

void add_deep_rows(const ForceCurve& bricks, double poisson, ValidationReport& report) {
  for (const double depth : {0.45, 1.0}) {
    report.rows.push_back(
        {.group = "deep indentation",
         .name = fmt::format("ball pressed {:.2f} radii deep, bricks, ν {:.2f}", depth, poisson),
         .source =
             "4/3·E/(1−ν²)·√R·d^1.5 for d ≪ R (16/9·E for ν 0.5; Shojaeifard & Bacca 2025), bonded layer",
         .quantity = "force",
         .unit = "E·R²",
         .reference =
             hertz_N(1.0, poisson, 1.0, depth) * bonded_layer_factor(poisson, std::sqrt(depth) / kBlockDeep),
         .ours = bricks.at(depth),
         .bound = 0.1,
         .stated = false,
         .detail = false,
         .why = "rotations of a linear lattice have to be small; a press deeper than about a third of the "
                "radius is not"});
  }
}

}  // namespace

void add_probed_tissues(const ValidationOptions& options, ValidationReport& report) {
  // Bricks get the ratio of tissue; for links see as_six_links() in hybrid/scene/tissue_table.h.
  constexpr double kPoissonOfBricks = 0.45, kPoissonOfLinks = 0.3;
  const int nodes = options.quick ? 6 : 10;
  say(options, "ex-vivo tissue under a ball, bricks");
  const ForceCurve bricks(Energy::trilinear, kPoissonOfBricks, nodes);
  say(options, "ex-vivo tissue under a ball, links");
  const ForceCurve links(Energy::six_link, kPoissonOfLinks, nodes);
  for (const ProbedTissue& tissue : probed_tissues()) {
    add_tissue(tissue, bricks, links, report);
    report.panels.push_back(panel_of(tissue, bricks));
  }
  add_deep_rows(bricks, kPoissonOfBricks, report);
}

void add_cartilage(const ValidationOptions& options, ValidationReport& report) {
  ValidationPanel panel{.group = "cartilage",
                        .title = "Cartilage: sphere of 0.5 mm",
                        .x_label = "depth from the contact point (µm)",
                        .y_label = "force (µN)",
                        .x = {0.0},
                        .ours = {0.0},
                        .series = {{.name = "measured, one site", .measured = {}}}};
  constexpr double kClaimedFrom = 0.01;  // least depth of the stated rows, in radii
  for (const Indented& point : cartilage()) {
    say(options, fmt::format("cartilage at {:.2f} µm", 1e6 * point.reading_m));
    const double depth_m = point.reading_m - kCartilageContact_m, share = depth_m / kCartilageBall_m;
    const double ours_N =
        hertz_N(kCartilageYoung_Pa, kCartilagePoisson, kCartilageBall_m, depth_m) *
        half_space_factor(Energy::trilinear, kCartilagePoisson, share, options.quick ? 5 : 6);
    report.rows.push_back(
        {.group = "cartilage",
         .name = "cartilage, bricks, E 755.6 kPa and contact at 3.82 µm of the authors' fit",
         .source = kCartilageSource,
         .quantity = fmt::format("force at {:.2f} µm, {:.2f} µm deep", 1e6 * point.reading_m, 1e6 * depth_m),
         .unit = "µN",
         .reference = 1e6 * point.force_N,
         .ours = 1e6 * ours_N,
         .bound = 0.06,
         .stated = share >= kClaimedFrom,
         .detail = false,
         .why = "near the contact point: 0.1 µm there is 4 % of the force and more"});
    panel.x.push_back(1e6 * depth_m);
    panel.ours.push_back(1e6 * ours_N);
    panel.series.front().measured.push_back(
        {1e6 * depth_m, 1e6 * point.force_N, 1e6 * point.force_N, 1e6 * point.force_N});
  }
  report.panels.push_back(std::move(panel));
}

}  // namespace hybrid
