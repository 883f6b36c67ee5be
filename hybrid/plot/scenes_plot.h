// SPDX-License-Identifier: GPL-3.0-or-later
// The figure of whole scenes along one motion: all forces over time, and below them each scene's difference
// from the reference.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "hybrid/plot/compare_plot.h"

namespace hybrid {

// All scenes must have ticks at the same times. The difference is that of the force vectors in JND, negative
// where the scene's force is the smaller one. Throws std::invalid_argument if the reference is no scene.
Figure scenes_figure(std::span<const ComparedModel> scenes, const std::string& title,
                     const ComparePlotOptions& options = {});
// Writes the figure as a file. Also throws std::runtime_error if the file is not writable.
void save_scenes_plot(const std::filesystem::path& svg, std::span<const ComparedModel> scenes,
                      const std::string& title, const ComparePlotOptions& options = {});

}  // namespace hybrid
