// SPDX-License-Identifier: GPL-3.0-or-later
// Small files in every format of a fuzzer (meshes here, made in code), and mutations that damage them.
#pragma once

#include <random>
#include <string>
#include <vector>

namespace tests {

struct FuzzInput {
  std::string bytes;      // not packed
  std::string extension;  // e.g. ".ply"; if `packed`, the file is packed when written
  bool packed = false;
};

std::vector<FuzzInput> fuzz_seeds();

// Applies one or a few changes, chosen by `random`. Some changes insert pieces of `other`.
FuzzInput mutated(FuzzInput input, const FuzzInput& other, std::mt19937_64& random);

// The bytes packed with gzip.
std::string packed_bytes(const std::string& bytes);

}  // namespace tests
