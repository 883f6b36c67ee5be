// SPDX-License-Identifier: GPL-3.0-or-later
// What is done with every file that the fuzzers make: load, check, repair, check again, touch; and what must
// hold of it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace tests {

struct FuzzOutcome {
  bool loaded = false;        // false: refused with a MeshError
  std::size_t triangles = 0;  // as loaded
  // What the file made the code do: ids of findings and of repairs, or the refusal without its numbers. Two
  // inputs with the same signature are much the same test.
  std::string signature;
};

// Aborts, with words on standard error, when anything that must hold does not.
FuzzOutcome fuzz_mesh_file(const std::filesystem::path& file);

}  // namespace tests
