// SPDX-License-Identifier: GPL-3.0-or-later
// The page of `hybrid run --report`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "hybrid/page/page.h"
#include "hybrid/session/session.h"

namespace hybrid {

// The page of a session, for a reader who did not see it. `report` comes from run_report(). The session must
// have been played with keep_rows and keep_picture (SessionOptions). Without OpenGL the page says why it has
// no picture.
Page run_page(const Scene& scene, const BuiltScene& built, const SessionResult& result,
              const nlohmann::ordered_json& report, const std::string& title);

}  // namespace hybrid
