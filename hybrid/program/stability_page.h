// SPDX-License-Identifier: GPL-3.0-or-later
// The page of `hybrid stability --report`.
#pragma once

#include <optional>

#include "hybrid/page/page.h"
#include "hybrid/plot/svg_figure.h"
#include "hybrid/scene/scene.h"
#include "hybrid/stability/stability.h"

namespace hybrid {

// `figure`: only for rigid scenes.
Page stability_page(const Scene& scene, const StabilityReport& report, const std::optional<Figure>& figure);

}  // namespace hybrid
