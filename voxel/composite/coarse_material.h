// SPDX-License-Identifier: GPL-3.0-or-later
// What coarse levels of a composite grid know of an object: how much tissue there is in a cube of cells, how
// stiff that is, and where anchors are.
//
// A cell lies between eight voxels and is there where all of them are, as stiff as the softest of them
// (link_stiffness.h). Counts of cubes of 4 cells an edge and up are kept, a fiftieth of a byte a voxel, and none
// at all of an object that fills its box; smaller ones are looked up among the labels.
//
// Where tissues differ in stiffness, a cube is as stiff along an axis as its columns beside one another are,
// each of its halves in series: the lower of the bounds of Cardwell & Parsons (Trans. AIME 160, 1945).
// (Means over all cells instead have layers across a link carry what the stiffest alone would.) A fifth of a
// byte a voxel, only where they do.
//
// Coordinates are those of the voxels and an offset, so that an end of the object at which nothing is
// anchored is a node of every level.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "voxel/lattice/lattice.h"

namespace voxel {

class CoarseMaterial {
 public:
  explicit CoarseMaterial(const Lattice& lattice);

  using Index3 = std::array<int, 3>;
  [[nodiscard]] const Index3& offset() const { return offset_; }
  // Of an object of one stiffness that fills its box: from now on the ends nearest to a voxel are nodes of
  // every level; as it was along an axis where it is about as far from both. True: the offset changed.
  bool align_to(const Index3& voxel) noexcept;
  // Of the outermost voxels, with the offset.
  [[nodiscard]] int low(std::size_t d) const { return offset_[d]; }
  [[nodiscard]] int high(std::size_t d) const { return offset_[d] + dims_[d] - 1; }
  // What part of the outermost voxels is anchored, 0: of the lowest along d, 1: of the highest?
  [[nodiscard]] double anchored_part(std::size_t d, std::size_t end) const { return anchored_part_[d][end]; }
  [[nodiscard]] bool fills_box() const { return fills_box_; }
  // Are its tissues of more than one stiffness?
  [[nodiscard]] bool several() const { return stiffness_.size() > 2; }
  [[nodiscard]] bool filled(const Index3& p) const noexcept;
  [[nodiscard]] bool anchored(const Index3& p) const noexcept;

  // For plane() of so many cubes along an axis, so that it does not allocate.
  void make_room(std::size_t cubes);
  // Of the cubes of 2^m cells an edge from number `first` on, in one plane z of such cubes: how many cells of
  // each are there. out: [y][x], `nx` to a row.
  void plane(int m, int z, int first_x, int nx, int first_y, int ny, float* out) noexcept;
  // Where tissues differ, of the same cubes: their cells times how stiff these are along axis d, as a share
  // of the reference. out[d]: as above.
  void stiff_plane(int m, int z, int first_x, int nx, int first_y, int ny,
                   const std::array<float*, 3>& out) noexcept;
  // Of single cells, from number `first` on: how stiff each is; 0 where there is none.
  void cell_plane(int z, int first_x, int nx, int first_y, int ny, float* out) noexcept;
  // ModeResponse a line of `links` links from p in direction d, through tissue beside it where p is in none: voxels
  // to the first anchored one from either end, 0: there is none; and how many links there are.
  struct Anchored {
    int ahead = 0, back = 0, links = 0;
    bool low_free = false, high_free = false;  // at that end there is tissue that is not anchored
  };
  [[nodiscard]] Anchored anchors_along(const Index3& p, std::size_t d, int links) const noexcept;
  // May there be an anchored voxel between p and q, no further than `span` apart, or half of that beside
  // them?
  [[nodiscard]] bool anchor_near(const Index3& p, const Index3& q, int span) const noexcept;
  // Is every voxel from p on in direction d filled, `count` of them?
  [[nodiscard]] bool unbroken(Index3 p, std::size_t d, int count) const noexcept;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr int kKept = 2;  // the first level of which counts are kept, in bytes
  struct Kept {
    Index3 dims{};
    std::vector<std::uint8_t> small;          // of level kKept: 64 at most
    std::vector<std::uint32_t> count;         // of others
    std::vector<std::uint8_t> anchored;       // 1: some voxel of the cube is; from kAnchorBlocks on
    std::array<std::vector<float>, 3> stiff;  // [d] cells times stiffness along d; where tissues differ
    [[nodiscard]] bool in(const Index3& b) const {
      for (std::size_t d = 0; d < 3; ++d) {
        if (b[d] < 0 || b[d] >= dims[d]) return false;
      }
      return true;
    }
    [[nodiscard]] std::size_t at(const Index3& b) const {
      return (static_cast<std::size_t>(b[2]) * static_cast<std::size_t>(dims[1]) +
              static_cast<std::size_t>(b[1])) *
                 static_cast<std::size_t>(dims[0]) +
             static_cast<std::size_t>(b[0]);
    }
  };
  static constexpr int kAnchorBlocks = 3;
  [[nodiscard]] int offset_of_high_end(std::size_t d) const noexcept;
  void choose_offset();
  void rank_materials();
  void count_cells();
  void weigh_cells();
  void weigh_cubes_of_cubes(const Kept& below, Kept& coarse) const;
  void mark_anchors();
  [[nodiscard]] float cells_in(const Kept& kept, int m, const Index3& cube) const noexcept;
  void layer(int k, int x0, int nx, int y0, int ny, std::uint8_t* out) noexcept;
  void line(int x0, int nx, int j, int k, std::uint8_t* out) const noexcept;
  [[nodiscard]] Anchored anchors_in_box(const Index3& p, std::size_t d, int links) const noexcept;
  [[nodiscard]] Index3 in_tissue(const Index3& p, std::size_t d, int links) const noexcept;

  const Lattice& lattice_;
  Index3 dims_, offset_{};
  std::array<std::array<double, 2>, 3> anchored_part_{};
  bool fills_box_ = false;
  std::array<std::uint8_t, 256> rank_{};     // [label] among stiffnesses, the softest 1; 0: no voxel
  std::vector<float> stiffness_;             // [rank] share of the reference's
  std::vector<float> pair_;                  // [rank · ranks + rank] two cells in series, times how many are
  std::vector<Kept> kept_;                   // [m]
  std::vector<std::uint8_t> lines_, cells_;  // scratch of layer() and what asks it
};

}  // namespace voxel
