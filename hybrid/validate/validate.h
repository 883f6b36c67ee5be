// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid validate`: the program's forces against closed forms, finite elements and measured forces.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"

namespace hybrid {

// One figure of the program beside one of a reference.
struct ValidationRow {
  std::string group{}, name{};  // "silicone"; the case
  std::string source{};         // of the reference, with its credit
  std::string quantity{};       // "force at 10 % strain"
  std::string unit{};
  double reference = 0.0, ours = 0.0;
  std::optional<double> low{}, high{};  // spread of the reference
  // Largest difference, as a share of the reference. Empty: `ours` has to lie within the spread.
  std::optional<double> bound{};
  bool stated = false;  // the program states that this holds; else it is shown beside
  bool detail = false;  // left out of the table for the terminal unless it fails
  std::string why{};    // the reason if it lies outside

  [[nodiscard]] double difference() const { return ours / reference - 1.0; }
  [[nodiscard]] bool inside() const;
  [[nodiscard]] bool fails() const { return stated && !inside(); }
};

// Force over depth or strain: a panel of a figure.
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

// Young's modulus of a silicone that gives its force at 5 % strain.
struct FittedModulus {
  std::string name;
  double slipping_Pa = 0.0, bonded_Pa = 0.0;  // at the plates
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

// What the report comes to.
struct ValidationCount {
  std::size_t stated = 0, failed = 0;          // cases that have to hold, and those that do not
  std::size_t beside = 0, beside_outside = 0;  // the others
};
ValidationCount count(const ValidationReport& report);
std::string verdict(const ValidationReport& report);

}  // namespace hybrid
