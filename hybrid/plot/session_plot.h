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
  // Names of the object's organs or materials, and for each row the index of the one that the tool touches.
  // Empty if the object has only one.
  std::vector<std::string> parts{};
  std::vector<std::uint8_t> touched_part{};
};

// The objects of a trace. For a soft object of several materials, also the material beneath the tool in each
// tick. It is that of the surface at rest nearest to the proxy, looked up every few ticks.
std::vector<PlottedObject> plotted_objects(const DrawnScene& scene, std::span<const TraceRow> rows,
                                           const std::vector<std::vector<double>>& force_N);

struct SessionPlotOptions {
  ClearanceCourse near{};  // distances between objects; not drawn if empty
  double period_s = 1e-3;  // period of a tick: the time that it may take
};

// Plots force over time, a lane of contact for each object that was touched, the distance between device and
// proxy, the clearance between objects, the times of the ticks, and force over depth with a line for each
// contact. Long times without contact are squeezed.
Figure session_figure(std::span<const TraceRow> rows, std::span<const PlottedObject> objects,
                      const std::string& title, const SessionPlotOptions& options = {});
// Writes the figure as a file. Throws std::runtime_error if the file is not writable.
void save_session_plot(const std::filesystem::path& svg, std::span<const TraceRow> rows,
                       std::span<const PlottedObject> objects, const std::string& title,
                       const SessionPlotOptions& options = {});

}  // namespace hybrid
