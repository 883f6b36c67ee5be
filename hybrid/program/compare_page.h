// SPDX-License-Identifier: GPL-3.0-or-later
// The pages of `hybrid compare --report`.
#pragma once

#include <string>

#include "hybrid/compare/compare.h"
#include "hybrid/compare/compare_scenes.h"
#include "hybrid/page/page.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {

// One object by several models. `about`: the scene and the motion.
Page comparison_page(const Comparison& comparison, const Figure& figure, const std::string& title,
                     const std::string& about);
// Whole scenes along one motion.
Page scenes_page(const ScenesComparison& comparison, const Figure& figure, const std::string& title);

}  // namespace hybrid
