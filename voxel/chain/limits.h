// SPDX-License-Identifier: GPL-3.0-or-later
// How far a voxel may stay behind a neighbour that was raised, or lowered, by the labels of the two.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "voxel/lattice/lattice.h"

namespace voxel {

enum class Way : std::uint8_t { raise, lower };

// Directions from a voxel: 2·d towards +, 2·d + 1 towards −.
inline constexpr int kWays = 6;

class ChainLimits {
 public:
  explicit ChainLimits(const Lattice& lattice);

  // The limit of a link is the mean of what its two labels allow (see Lattice), so each brings its half:
  // [label], kNoLink where there is no voxel.
  static constexpr float kNoLink = 1e30F;
  using Halves = std::array<float, 256>;

  // On one axis: a voxel raised to u leaves its neighbour in direction n no lower than u − limit, one lowered
  // to u no higher than u + limit, limit = half[n][its label] + half[n][the neighbour's label] >= 0.
  struct Pass {
    std::array<const float*, kWays> half{};

    [[nodiscard]] float between(int n, std::uint8_t a, std::uint8_t b) const {
      const float* const table = half[static_cast<std::size_t>(n)];
      return table[a] + table[b];
    }
  };
  [[nodiscard]] Pass pass(int axis, Way way) const;
  // Registers of eight values that hold a table up to the greatest label in use: 1, 2, or 0 for more.
  [[nodiscard]] int registers() const { return registers_; }

 private:
  std::array<Halves, 3> shorter_{}, longer_{}, across_{};  // [d]
  int registers_ = 1;
};

}  // namespace voxel
