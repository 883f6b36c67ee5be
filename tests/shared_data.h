// SPDX-License-Identifier: GPL-3.0-or-later
// Public data sets beside the checkout, and Debian's sample volumes. If data are missing, a test that needs
// them is skipped and says so. On machines that should have the data, HYBRID_EXPECT_DATA is set, and then the
// test fails instead.
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

// For use in a test. If the data are missing, the test returns, marked as failed or skipped.
#define NEED_DATA(there, what_is_missing)                                                  \
  do {                                                                                     \
    if (!(there) && tests::data_are_expected())                                            \
      FAIL() << (what_is_missing) << "; HYBRID_EXPECT_DATA asks for it: install or unset"; \
    if (!(there)) GTEST_SKIP() << "skipped: " << (what_is_missing);                        \
  } while (false)

#define SKIP_WITHOUT(folder)                                \
  NEED_DATA(!(folder).empty(),                              \
            "the shared data are not beside this checkout " \
            "(HYBRID_SHARED_DATA names another place)")
