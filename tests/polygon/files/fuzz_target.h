// SPDX-License-Identifier: GPL-3.0-or-later
// The steps that the fuzzers do with every file: load, check, touch, repair, check and touch again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace tests {

struct FuzzOutcome {
  bool loaded = false;   // false: refused with a message
  std::size_t size = 0;  // as loaded: triangles of a mesh, entries of another file
  // Summary of the behaviour: ids of findings and repairs, or the error text without its numbers. Two inputs
  // with the same signature test similar code.
  std::string signature;
};

// Aborts with a message on standard error if an invariant is violated.
FuzzOutcome fuzz_file(const std::filesystem::path& file);

}  // namespace tests
