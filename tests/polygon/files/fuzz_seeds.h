// SPDX-License-Identifier: GPL-3.0-or-later
// Small meshes in every format that is read, made in code, and the ways to damage them.
#pragma once

#include <random>
#include <string>
#include <vector>

namespace tests {

struct FuzzInput {
  std::string bytes;      // never packed
  std::string extension;  // ".ply"; packed on writing when `packed`
  bool packed = false;
};

std::vector<FuzzInput> fuzz_seeds();

// One to a few changes, the same for the same random state. `other`: where pieces are taken from.
FuzzInput mutated(FuzzInput input, const FuzzInput& other, std::mt19937_64& random);

// gzip of the bytes.
std::string packed_bytes(const std::string& bytes);

}  // namespace tests
