// SPDX-License-Identifier: GPL-3.0-or-later
// Public data sets beside the checkout, and Debian's sample volumes. Where one is missing, a test that needs
// it says so and is skipped. It fails instead when HYBRID_EXPECT_DATA is set, as on machines that should have
// the data.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace tests {

// The folder of a data set (e.g. "data/meshes"), or an empty path. HYBRID_SHARED_DATA overrides the location.
inline std::filesystem::path shared_data(const std::filesystem::path& folder) {
  const char* given = std::getenv("HYBRID_SHARED_DATA");
  const std::filesystem::path root = given != nullptr
                                         ? std::filesystem::path(given)
                                         : std::filesystem::path(HYBRID_SOURCE_DIR) / ".." / "shared";
  std::error_code ignored;
  return std::filesystem::is_directory(root / folder, ignored) ? root / folder : std::filesystem::path();
}

// Whether missing data are a failure.
inline bool data_are_expected() {
  return std::getenv("HYBRID_EXPECT_DATA") != nullptr;
}

}  // namespace tests

// In a test: returns when the data are missing, failed or skipped.
#define NEED_DATA(there, what_is_missing)                                                \
  do {                                                                                   \
    if (!(there) && tests::data_are_expected())                                          \
      FAIL() << what_is_missing << "; HYBRID_EXPECT_DATA asks for it: install or unset"; \
    if (!(there)) GTEST_SKIP() << "skipped: " << what_is_missing;                        \
  } while (false)

#define SKIP_WITHOUT(folder)                                \
  NEED_DATA(!(folder).empty(),                              \
            "the shared data are not beside this checkout " \
            "(HYBRID_SHARED_DATA names another place)")
