// SPDX-License-Identifier: GPL-3.0-or-later
// The two figures of a session: the forces of one run, and the comparison of models.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hybrid/session/clearance.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

struct PlottedObject {
  std::string name;
  bool soft = false;
  // Force of this object in each tick (N), one entry per row of the trace; empty: not recorded.
  std::vector<double> force_N;
};

// Plots force over time, a lane of contact for each object, the distance between device and proxy, and the
// clearance between objects if `near` is not empty. Throws std::runtime_error: file not writable.
void save_session_plot(const std::filesystem::path& svg, std::span<const TraceRow> rows,
                       std::span<const PlottedObject> objects, const std::string& title,
                       const ClearanceCourse& near = {});

struct ComparedModel {
  std::string name;
  std::vector<TraceRow> rows;
  // Depth of the device in the object in each tick (m), if known. Empty: the device's travel since first
  // contact, against the direction of the reference's largest force.
  std::vector<double> depth_m;
};

// A curve that a model should follow (Hertz, flat punch, a measurement).
struct ReferenceCurve {
  std::string name;
  std::vector<double> depth_m, force_N;
};

struct ComparePlotOptions {
  std::size_t reference = 0;  // index of the model that the others are compared with
  double jnd_share = 0.07;    // a hand distinguishes forces that differ by this share
  double jnd_floor_N = 0.04;  // and by at least this amount
};

// Plots force over time, the difference from the reference model with the band of one JND, and force over
// depth. Models may have their own times: they are compared at the reference's times, linearly between
// samples. Throws std::runtime_error: file not writable; std::invalid_argument: the reference is no model.
void save_compare_plot(const std::filesystem::path& svg, std::span<const ComparedModel> models,
                       std::span<const ReferenceCurve> curves, const std::string& title,
                       const ComparePlotOptions& options = {});

}  // namespace hybrid
