// SPDX-License-Identifier: GPL-3.0-or-later
// The page of `hybrid tune SCENE --report DIR`.
#pragma once

#include <string>

#include "hybrid/page/page.h"
#include "hybrid/tune/tune.h"

namespace hybrid {

Page tune_page(const TuneResult& result, const std::string& title);

}  // namespace hybrid
