// SPDX-License-Identifier: GPL-3.0-or-later
// Public data sets that may lie beside the checkout. Tests use them where they are, and say where they are
// not.
#pragma once

#include <cstdlib>
#include <filesystem>

namespace tests {

// The folder of a data set (e.g. "data/meshes"), or an empty path. HYBRID_SHARED_DATA overrides the place.
inline std::filesystem::path shared_data(const std::filesystem::path& folder) {
  const char* given = std::getenv("HYBRID_SHARED_DATA");
  const std::filesystem::path root = given != nullptr
                                         ? std::filesystem::path(given)
                                         : std::filesystem::path(HYBRID_SOURCE_DIR) / ".." / "shared";
  std::error_code ignored;
  return std::filesystem::is_directory(root / folder, ignored) ? root / folder : std::filesystem::path();
}

}  // namespace tests

#define SKIP_WITHOUT(folder)                                               \
  if ((folder).empty())                                                    \
  GTEST_SKIP() << "skipped: the shared data are not beside this checkout " \
                  "(HYBRID_SHARED_DATA names another place)"
