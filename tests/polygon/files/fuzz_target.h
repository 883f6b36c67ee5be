// SPDX-License-Identifier: GPL-3.0-or-later
// The steps that the fuzzers do with every file: load, check, touch, repair, check and touch again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace tests {

struct FuzzOutcome {
  bool loaded = false;        // false: the file was refused with a MeshError
  std::size_t triangles = 0;  // number in the loaded mesh
  // Summary of the behaviour: ids of findings and repairs, or the error text without its numbers. Two inputs
  // with the same signature test similar code.
  std::string signature;
};

// Aborts with a message on standard error if an invariant is violated.
FuzzOutcome fuzz_mesh_file(const std::filesystem::path& file);

}  // namespace tests
