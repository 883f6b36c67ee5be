// SPDX-License-Identifier: GPL-3.0-or-later
// The two figures that sessions leave behind: what one felt like, and how models differ.
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
  // What this object contributed in each tick (N), one a row of the trace; or empty: not recorded.
  std::vector<double> force_N;
};

// Force over time, a lane of contact for each object, how far the device is from the proxy, and, where `near`
// has anything to say, how near objects came to one another. Throws std::runtime_error: file not writable.
void save_session_plot(const std::filesystem::path& svg, std::span<const TraceRow> rows,
                       std::span<const PlottedObject> objects, const std::string& title,
                       const ClearanceCourse& near = {});

struct ComparedModel {
  std::string name;
  std::vector<TraceRow> rows;
  // How deep the device is in the object in each tick (m), where that is known. Empty: taken as the device's
  // way since first contact against the direction of the largest force of the reference.
  std::vector<double> depth_m;
};

// A curve that a model should follow (Hertz, flat punch, a measurement).
struct ReferenceCurve {
  std::string name;
  std::vector<double> depth_m, force_N;
};

struct ComparePlotOptions {
  std::size_t reference = 0;  // the model the others are compared with
  double jnd_share = 0.07;    // a hand tells apart forces that differ by this share,
  double jnd_floor_N = 0.04;  // and by at least this
};

// Force over time, difference from the reference model with the band of one JND, and force over depth.
// Models may have their own times: they are compared at the reference's, linearly between samples.
// Throws std::runtime_error: file not writable, or std::invalid_argument: the reference is no model.
void save_compare_plot(const std::filesystem::path& svg, std::span<const ComparedModel> models,
                       std::span<const ReferenceCurve> curves, const std::string& title,
                       const ComparePlotOptions& options = {});

}  // namespace hybrid
