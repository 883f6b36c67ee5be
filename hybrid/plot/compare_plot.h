// SPDX-License-Identifier: GPL-3.0-or-later
// The figure of a comparison: each model's force, and its difference from the reference.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hybrid/plot/svg_figure.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

struct ComparedModel {
  std::string name;
  std::vector<TraceRow> rows;
  // Depth of the device in the object in each tick (m), if known. If empty, force is drawn over the device's
  // travel since the first touch of a contact, opposite to the reference's largest force in that contact.
  std::vector<double> depth_m{};
  // Drawn below the others, over its own time. Useful for a model that still pulls when the others have let
  // go.
  bool apart = false;
};

// A curve to compare models with (Hertz, flat punch, a measurement).
struct ReferenceCurve {
  std::string name;
  std::vector<double> depth_m, force_N;
};

struct ComparePlotOptions {
  std::size_t reference = 0;  // index of the model with which the others are compared
  double jnd_share = 0.07;    // a hand distinguishes forces that differ by this share
  double jnd_floor_N = 0.04;  // least difference that a hand distinguishes
};

// Parts that the figures of comparisons share. signed_jnd(): difference of the vectors in JND, negative if
// `force` is the smaller one. reference_note(): line that names reference and JND. not_felt_area(): area of
// differences below 1 JND between two times (s).
double signed_jnd(const glm::dvec3& force, const glm::dvec3& reference, const ComparePlotOptions& options);
std::string reference_note(const std::string& name, const ComparePlotOptions& options);
Area not_felt_area(const std::vector<double>& ends);

// Plots force over time and its difference from the reference in JND, for each model in panels of its own.
// For each contact plots force over depth, or for a stroke along a surface over path length. The difference
// is that of the force vectors, negative where the model's force is the smaller one. Models may have their
// own times: they are compared at the reference's times, linearly between samples. Throws
// std::invalid_argument if the reference is no model.
Figure compare_figure(std::span<const ComparedModel> models, std::span<const ReferenceCurve> curves,
                      const std::string& title, const ComparePlotOptions& options = {});
// Writes the figure as a file. Also throws std::runtime_error if the file is not writable.
void save_compare_plot(const std::filesystem::path& svg, std::span<const ComparedModel> models,
                       std::span<const ReferenceCurve> curves, const std::string& title,
                       const ComparePlotOptions& options = {});

}  // namespace hybrid
