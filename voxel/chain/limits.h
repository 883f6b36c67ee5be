// SPDX-License-Identifier: GPL-3.0-or-later
// Limits of the links for a wave, by the labels of their two voxels.
//
// The limit of a link between two labels is the mean of the limits within each (Lattice). So each label
// contributes half of its own limit, and the tables of a wave need one entry per label.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "voxel/chain/row_kernels.h"
#include "voxel/lattice/lattice.h"

namespace voxel {

enum class Way : std::uint8_t { raise, lower };

// Directions from a voxel: 2·d towards +, 2·d + 1 towards −.
inline constexpr int kDirections = 6;

class ChainLimits {
 public:
  explicit ChainLimits(const Lattice& lattice);

  // [label] (m); kUnbounded for label 0 and for labels that no voxel has.
  using HalfLimitTable = std::array<float, 256>;

  // Half limits of a wave on one axis, by direction. A voxel raised to u requires its neighbour in direction
  // n to be at least u − limit. A voxel lowered to u requires at most u + limit. limit = half[n][label] +
  // half[n][the neighbour's label] >= 0.
  struct WaveLimits {
    std::array<const float*, kDirections> half{};

    [[nodiscard]] float between(int n, std::uint8_t a, std::uint8_t b) const {
      const float* const table = half[static_cast<std::size_t>(n)];
      return table[a] + table[b];
    }
  };
  [[nodiscard]] WaveLimits for_wave(int axis, Way way) const;
  // Number of registers of 8 floats that hold a table up to the largest label in use: 1, 2, or 0 for more.
  [[nodiscard]] int registers() const { return registers_; }

 private:
  std::array<HalfLimitTable, 3> shorter_{}, longer_{}, across_{};  // [d]
  int registers_ = 1;
};

}  // namespace voxel
