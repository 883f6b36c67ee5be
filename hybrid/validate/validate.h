// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid validate`: the program's forces against closed forms, finite elements and measured forces.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

// One result of the program beside that of a reference.
struct ValidationRow {
  std::string group{}, name{};  // for example "silicone"; name of the case
  std::string source{};         // of the reference, with its credit
  std::string quantity{};       // for example "force at 10 % strain"
  std::string unit{};
  double reference = 0.0, ours = 0.0;
  std::optional<double> low{}, high{};  // spread of the reference
  // Greatest allowed difference, as a share of the reference. Empty: `ours` must lie within the spread.
  std::optional<double> bound{};
  bool stated = false;  // true: the program claims that the row holds; false: it is only shown
  bool detail = false;  // left out of the terminal's table unless it fails
  std::string why{};    // reason for a result that lies outside

  [[nodiscard]] double difference() const { return ours / reference - 1.0; }
  [[nodiscard]] bool inside() const;
  [[nodiscard]] bool fails() const { return stated && !inside(); }
};

// A panel of a figure: force over depth or strain.
struct ValidationPoint {
  double x = 0.0, y = 0.0, low = 0.0, high = 0.0;
};
struct ValidationSeries {
  std::string name;
  std::vector<ValidationPoint> measured;
};
struct ValidationPanel {
  std::string group, title, x_label, y_label;
  std::vector<double> x, ours;
  std::vector<ValidationSeries> series;
};

// Young's moduli with which a silicone has its measured force at 5 % strain.
struct FittedModulus {
  std::string name;
  double slipping_Pa = 0.0, bonded_Pa = 0.0;  // with slipping plates; bonded to the plates
  std::optional<double> published_Pa;
};

struct ValidationReport {
  std::vector<ValidationRow> rows;
  std::vector<ValidationPanel> panels;
  std::vector<FittedModulus> moduli;
  double seconds = 0.0;
};

struct ValidationOptions {
  bool quick = false;  // coarser grids, and no case that takes long
  Progress progress{};
};

ValidationReport validate(const ValidationOptions& options);

// Summary of the report.
struct ValidationCount {
  std::size_t stated = 0, failed = 0;          // rows that must hold; those of them that do not
  std::size_t beside = 0, beside_outside = 0;  // the other rows; those of them that lie outside
};
ValidationCount count(const ValidationReport& report);
std::string verdict(const ValidationReport& report);

}  // namespace hybrid
