// SPDX-License-Identifier: GPL-3.0-or-later
// The figure of a session: forces, contacts, depth and times of the ticks of one run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "hybrid/plot/svg_figure.h"
#include "hybrid/session/clearance.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

struct PlottedObject {
  std::string name;
  bool soft = false;
  // Force of this object in each tick (N), one entry per row of the trace. Empty: not recorded.
  std::vector<double> force_N;
  // parts: names of the object's organs or materials; empty if there is only one. touched_part: for each row,
  // the index of the part that the tool touches.
  std::vector<std::string> parts{};
  std::vector<std::uint8_t> touched_part{};
};

// The objects of a trace. If a soft object has several materials, the result also has the material beneath
// the tool in each tick. This is the material of the vertex nearest to the proxy, on the surface at rest. It
// is looked up every few ticks.
std::vector<PlottedObject> plotted_objects(const DrawnScene& scene, std::span<const TraceRow> rows,
                                           const std::vector<std::vector<double>>& force_N);

struct SessionPlotOptions {
  ClearanceCourse near{};  // distances between objects; not drawn if empty
  double period_s = 1e-3;  // period of a tick: the time that it may take
};

// Plots force over time, a lane of contact for each object that was touched, the distance between device and
// proxy, the clearance between objects, and the times of the ticks. Long times without contact are squeezed.
// Each press has a line of force over depth, and each stroke along a surface one over path length.
Figure session_figure(std::span<const TraceRow> rows, std::span<const PlottedObject> objects,
                      const std::string& title, const SessionPlotOptions& options = {});
// Writes the figure as a file. Throws std::runtime_error if the file is not writable.
void save_session_plot(const std::filesystem::path& svg, std::span<const TraceRow> rows,
                       std::span<const PlottedObject> objects, const std::string& title,
                       const SessionPlotOptions& options = {});

}  // namespace hybrid
