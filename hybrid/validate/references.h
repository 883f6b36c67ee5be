// SPDX-License-Identifier: GPL-3.0-or-later
// Results that others measured or computed: summary figures, with their credit and limits.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybrid {

// ---- finite elements ----

// CalculiX 2.20, 8-node bricks with incompatible modes (C3D8I) on a grid of the given spacing. A block of 100
// × 100 × 60 mm has a bonded base and free sides. A rigid, frictionless square punch presses it 1 mm deep.
inline constexpr const char* kFemSource = "CalculiX 2.20 (C3D8I), same grid";
inline constexpr double kFemDepth_m = 1e-3;
struct FemRow {
  // Young's moduli. uniform: 10 kPa. layers: 10 kPa up to a height of 40 mm, 30 kPa up to 55 mm, 5 kPa above.
  // inclusion: 100 kPa in 35 to 65 × 35 to 65 × 30 to 45 mm, and 10 kPa around it.
  enum class Material : std::uint8_t { uniform, layers, inclusion } material;
  double spacing_m, width_m, poisson, force_N;  // width: distance between the outermost pressed nodes
};
std::span<const FemRow> fem_rows();

// ---- silicone between plates ----

// A cylinder is compressed at 10 mm/min, in ten tests for each material. Friction at the plates is not
// published. Below 2 % strain the casts are still seating. Mean and standard deviation are computed from the
// published curves.
inline constexpr const char* kSiliconeSource =
    "Dawood et al. 2026, tissue-phantom-material-database (CC BY 4.0), mean and SD of 10 tests";
inline constexpr double kSiliconeDiameter_m = 0.05, kSiliconeHeight_m = 0.03;
inline constexpr std::array<double, 4> kSiliconeStrains{0.05, 0.10, 0.20, 0.30};
struct MeanAndDeviation {
  double mean_N, deviation_N;
};
struct Silicone {
  const char* name;
  bool pure;                                  // without thinner
  double published_kPa;                       // Young's modulus that the authors published; 0: not known here
  std::array<MeanAndDeviation, 4> at_strain;  // at kSiliconeStrains
};
std::span<const Silicone> silicones();

// ---- ex-vivo tissue under a ball ----

// Quartiles over the sites of a set. Depth is measured along the normal, from light contact. Thickness and
// support are not published. Sets with negative forces are left out.
inline constexpr const char* kProbingSource =
    "Vanderbilt, robot-palpation-data (ICRA 2016, doi 10.1109/ICRA.2016.7487224 and .7487225), quartiles "
    "over sites";
struct ProbedDepth {
  double depth_m, low_N, median_N, high_N;
};
struct ProbedTissue {
  const char* name;
  bool pork;      // true: pork, false: liver
  double ball_m;  // radius
  int sites;
  std::vector<ProbedDepth> depths;
};
std::span<const ProbedTissue> probed_tissues();

// ---- cartilage under a sphere ----

// One site, loaded at 500 µN/min. The authors' instrument fits Hertz to 10 to 98 % of the load.
inline constexpr const char* kCartilageSource =
    "artorg-unibe-ch, CartilageIndentationAnalysis, Crosslinking 1, one site";
inline constexpr double kCartilageBall_m = 0.5e-3, kCartilageYoung_Pa = 755.6e3, kCartilagePoisson = 0.3;
inline constexpr double kCartilageContact_m =
    3.82e-6;  // reading of the instrument at which the contact begins
struct Indented {
  double reading_m, force_N;
};
std::span<const Indented> cartilage();

}  // namespace hybrid
