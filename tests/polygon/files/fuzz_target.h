// SPDX-License-Identifier: GPL-3.0-or-later
// What the fuzzers do with every file: load, check, repair, check again, touch. It aborts if an invariant is
// violated.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace tests {

struct FuzzOutcome {
  bool loaded = false;        // false: MeshError
  std::size_t triangles = 0;  // as loaded
  // Summary of the behaviour: ids of findings and repairs, or the error text without its numbers. Two inputs
  // with the same signature test much the same.
  std::string signature;
};

// Aborts with a message on standard error if an invariant is violated.
FuzzOutcome fuzz_mesh_file(const std::filesystem::path& file);

}  // namespace tests
