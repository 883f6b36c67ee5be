// SPDX-License-Identifier: GPL-3.0-or-later
// The object as the coarse levels of a CompositeGrid see it: the number and stiffness of the tissue cells in
// cubes, and the anchors.
//
// A cell lies between eight voxels. It exists if all of them do, and is as stiff as the softest of them
// (link_stiffness.h). Cell counts are stored for cubes of 4 cells an edge and larger, in a fortieth of a byte
// per voxel. Smaller cubes are counted from the labels. An object that fills its bounding box needs no
// counts.
//
// Where tissues differ in stiffness, the stiffness of a cube along an axis is that of its columns in
// parallel, with the cells of each column in series: the lower of the bounds of Cardwell & Parsons (Trans.
// AIME 160, 1945). A mean over all cells would make a stack of layers along a link about as stiff as its
// stiffest layer. The stored stiffness takes a fifth of a byte per voxel.
//
// Coordinates are voxel indices plus an offset, chosen such that an unanchored end of the object is a node of
// every level.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "voxel/lattice/lattice.h"

namespace voxel {
namespace composite {

inline std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace composite

class CoarseMaterial {
 public:
  explicit CoarseMaterial(const Lattice& lattice);

  using Index3 = std::array<int, 3>;
  [[nodiscard]] const Index3& offset() const { return offset_; }
  // For an object of one stiffness that fills its box. Chooses the offset such that the ends of the object
  // nearest to a voxel are nodes of every level. An axis along which the voxel is about equally far from both
  // ends keeps its offset. Returns whether the offset changed.
  bool align_to(const Index3& voxel) noexcept;
  // Coordinates of the outermost voxels along d.
  [[nodiscard]] int low(std::size_t d) const { return offset_[d]; }
  [[nodiscard]] int high(std::size_t d) const { return offset_[d] + dims_[d] - 1; }
  // Anchored share of the outermost voxels along d; end 0: the lowest, 1: the highest.
  [[nodiscard]] double anchored_share(std::size_t d, std::size_t end) const {
    return anchored_share_[d][end];
  }
  [[nodiscard]] bool fills_box() const { return fills_box_; }
  // Are there tissues of different stiffness or limits?
  [[nodiscard]] bool is_heterogeneous() const { return stiffness_.size() > 2; }
  [[nodiscard]] bool has_own_limits() const { return !lattice_.uniform_limits(); }
  [[nodiscard]] bool is_filled(const Index3& p) const noexcept;
  [[nodiscard]] bool is_anchored(const Index3& p) const noexcept;

  // ---- cubes of 2^m cells an edge, numbered from the origin of coordinates ----

  // Allocates scratch for planes of up to `cubes` cubes an axis, so that the functions below do not allocate.
  void reserve_planes(std::size_t cubes);
  // Number of cells in each cube of plane z, from cube (first_x, first_y) on. out: [y][x], nx to a row.
  void cell_counts(int m, int z, int first_x, int nx, int first_y, int ny, float* out) noexcept;
  // Number of cells of each cube times their stiffness along axis d, relative to the reference. Only if
  // is_heterogeneous(). out[d]: [y][x], nx to a row.
  void cube_stiffness(int m, int z, int first_x, int nx, int first_y, int ny,
                      const std::array<float*, 3>& out) noexcept;
  // Stiffness of single cells, relative to the reference; 0 where there is no cell. out: [y][x], nx to a row.
  void cell_stiffness(int z, int first_x, int nx, int first_y, int ny, float* out) noexcept;
  // Limits of links within a tissue, as shares of the spacing along the link: shorter, longer, sheared.
  using TissueLimits = std::array<float, 3>;
  // Limits of `nx` voxels along x from p on, only if has_own_limits(). Places without a voxel get the limits
  // of the first surface voxel. out: [shorter, longer, sheared].
  void voxel_limits(const Index3& p, int nx, const std::array<float*, 3>& out) noexcept;
  // Number of cells of each cube times their limits, only if has_own_limits(). out: as in cube_stiffness().
  void cube_limits(int m, int z, int first_x, int nx, int first_y, int ny,
                   const std::array<float*, 3>& out) noexcept;

  // ---- tissue one voxel thick (thin_links.cpp) ----

  // A link of a sheet or row of single voxels, from a voxel to the next one along d (LinkParts::thin). Its
  // cells are softer, or there are none. `excess`: its weight beyond that of its cells, relative to the
  // reference. `shape`: the same as if all tissue had the reference stiffness; 0 if there are cells. `share`:
  // the excess over the number of its cells; 0 if there are none.
  struct ThinLink {
    Index3 voxel{};
    std::size_t d = 0;
    float excess = 0.0F, shape = 0.0F, share = 0.0F;
  };
  // Calls visit(link) for the thin links whose first voxel is in the box, cube by cube.
  template <class Visit>
  void for_thin_links(const Index3& low, const Index3& high, const Visit& visit) const;

  // ---- anchors (coarse_anchors.cpp) ----

  // Voxels from either end of a line to its first anchored voxel other than the end itself; 0: there is none.
  struct AnchorSearch {
    int ahead = 0, back = 0;  // from the low end upwards, from the high end downwards
    int links = 0;            // links of the line that are in tissue
  };
  // Searches the line of `links` links from p in direction d. If that line has no tissue, searches the
  // nearest line that has some.
  [[nodiscard]] AnchorSearch anchors_along(const Index3& p, std::size_t d, int links) const noexcept;
  // May there be an anchor in the box between p and q, widened by half of `span`? `span` sets the size of the
  // cubes that are looked up.
  [[nodiscard]] bool anchor_near(const Index3& p, const Index3& q, int span) const noexcept;
  // Does the object have scattered anchors? An anchored voxel is scattered unless it lies in a side of the
  // object's box whose voxels are all anchored.
  [[nodiscard]] bool has_scattered_anchors() const { return !anchor_faces_.items.empty(); }
  // A quarter of the face between an anchored voxel and its neighbour along d, which is not anchored. Each of
  // the four cells round their link has one quarter.
  struct AnchorFace {
    Index3 voxel{};
    std::size_t d = 0;
    int side = 0;               // −1 or 1: side of the neighbour along d
    std::array<int, 2> cell{};  // −1 or 1: side of the cell along d + 1 and d + 2
    float stiffness = 1.0F;     // of the cell, relative to the reference
  };
  // Calls visit(face) for the faces of the anchored voxels in the box, cube by cube. Only if
  // has_scattered_anchors().
  template <class Visit>
  void for_anchor_faces(const Index3& low, const Index3& high, const Visit& visit) const;
  // Are the `count` voxels from p on in direction d all filled?
  [[nodiscard]] bool is_unbroken(Index3 p, std::size_t d, int count) const noexcept;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr int kLevels = 12;           // levels of cubes
  static constexpr int kFirstLevel = 2;        // level of the smallest cubes whose counts are stored
  static constexpr int kFirstAnchorLevel = 3;  // level of the smallest cubes with anchor marks
  struct CubeLevel {
    Index3 dims{};
    std::vector<std::uint8_t> counts8;   // of level kFirstLevel: at most 64 cells
    std::vector<std::uint32_t> counts;   // of coarser levels
    std::vector<std::uint8_t> anchored;  // 1: a voxel of the cube is anchored; cubes without the offset
    std::array<std::vector<float>, 3> stiffness;  // [d] cells times stiffness along d; where tissues differ
    std::array<std::vector<float>, 3> limits;     // [shorter, …] cells times limit; where limits differ
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
  [[nodiscard]] int offset_of_high_end(std::size_t d) const noexcept;
  void choose_offset();
  void rank_materials();
  void count_cells();
  void find_stiffness();
  void coarsen_stiffness(const CubeLevel& below, CubeLevel& coarse) const;
  void add_thin_to_cubes(int z, int first_x, int nx, int first_y, int ny,
                         const std::array<float*, 3>& out) noexcept;
  void add_limits();
  // Sets out[n] of the cubes of a plane to value(level, number of the cube); 0 outside the object. Only for
  // cubes that are stored, m >= kFirstLevel.
  template <class Value>
  void read_cubes(int m, int z, int first_x, int nx, int first_y, int ny, float* out,
                  const Value& value) const;
  void mark_anchors();
  void list_anchor_faces();
  void list_thin_links();
  void add_thin_link(const Index3& voxel, std::size_t d);
  // Calls visit(cell, d, share) for each cell of each thin link: `share` adds to the cell's stiffness along
  // d. Only cells in the box. Coordinates of cells include the offset.
  template <class Visit>
  void for_thin_cells(const Index3& low, const Index3& high, const Visit& visit) const;
  void add_anchor_face(const Index3& voxel, std::uint8_t d, std::uint8_t signs);
  [[nodiscard]] float cell_count(const CubeLevel& level, int m, const Index3& cube) const noexcept;
  void voxel_ranks(int x0, int nx, int j, int k, std::uint8_t* out) const noexcept;
  void cell_ranks(int k, int x0, int nx, int y0, int ny, std::uint8_t* out) noexcept;
  [[nodiscard]] AnchorSearch anchors_in_box(const Index3& p, std::size_t d, int links) const noexcept;
  [[nodiscard]] Index3 nearest_tissue_line(const Index3& p, std::size_t d, int links) const noexcept;

  const Lattice& lattice_;
  Index3 dims_, offset_{};
  std::array<std::array<double, 2>, 3> anchored_share_{};
  bool fills_box_ = false;
  std::array<std::uint8_t, 256> rank_{};  // [label] rank of its tissue, the softest 1; 0: no voxel
  std::vector<float> stiffness_;          // [rank] relative to the reference's
  std::vector<TissueLimits> limits_;      // [rank]; of rank 0: the reference's
  // [rank · ranks + rank] Mean stiffness of two cells in series, times their number. Rank 0 is no cell.
  std::vector<float> series_pair_;
  std::vector<CubeLevel> levels_;  // [m]
  std::vector<std::uint8_t> voxel_scratch_, cell_scratch_;
  struct PackedFace {
    std::array<std::uint16_t, 3> voxel{};  // without the offset
    std::uint8_t sides = 0;  // bit 0: side; bits 1 and 2: cell; 1 if set, else −1. Bits 3 and 4: d
    std::uint8_t rank = 0;   // of the cell's stiffness
  };
  struct PackedLink {
    std::array<std::uint16_t, 3> voxel{};  // without the offset
    std::uint8_t d = 0;
    float excess = 0.0F, shape = 0.0F, share = 0.0F;
  };
  // Items that belong to voxels, sorted by cubes of level kFirstAnchorLevel.
  template <class Item>
  struct ByCube {
    std::vector<Item> items;
    std::vector<std::uint32_t> until;  // [cube] end of its items
    [[nodiscard]] std::size_t memory_bytes() const {
      return items.capacity() * sizeof(Item) + until.capacity() * sizeof(std::uint32_t);
    }
  };
  template <class Item>
  void sort_by_cube(ByCube<Item>& list) const;
  // Calls visit(item, voxel) for the items whose voxel is in the box. `voxel` includes the offset.
  template <class Item, class Visit>
  void for_items(const ByCube<Item>& list, const Index3& low, const Index3& high, const Visit& visit) const;
  ByCube<PackedFace> anchor_faces_;
  ByCube<PackedLink> thin_links_;
  std::vector<float> thin_scratch_;  // of thin links: stiffness of cells beyond that of their softest voxel
};

template <class Value>
void CoarseMaterial::read_cubes(int m, int z, int first_x, int nx, int first_y, int ny, float* out,
                                const Value& value) const {
  const CubeLevel& level = levels_[composite::index(std::min(m, kLevels - 1))];
  for (int j = 0; j < ny; ++j) {
    for (int i = 0; i < nx; ++i) {
      const Index3 cube{first_x + i, first_y + j, z};
      out[j * nx + i] = level.in(cube) ? value(level, level.at(cube)) : 0.0F;
    }
  }
}

template <class Item>
void CoarseMaterial::sort_by_cube(ByCube<Item>& list) const {
  const CubeLevel& cubes = levels_[kFirstAnchorLevel];
  const auto cube_of = [&cubes](const Item& item) {
    return cubes.at({item.voxel[0] >> kFirstAnchorLevel, item.voxel[1] >> kFirstAnchorLevel,
                     item.voxel[2] >> kFirstAnchorLevel});
  };
  std::stable_sort(list.items.begin(), list.items.end(),
                   [&](const Item& a, const Item& b) { return cube_of(a) < cube_of(b); });
  list.until.assign(cubes.anchored.size(), 0);
  for (const Item& item : list.items) ++list.until[cube_of(item)];
  std::partial_sum(list.until.begin(), list.until.end(), list.until.begin());
}

template <class Item, class Visit>
void CoarseMaterial::for_items(const ByCube<Item>& list, const Index3& low, const Index3& high,
                               const Visit& visit) const {
  if (list.items.empty()) return;
  const CubeLevel& cubes = levels_[kFirstAnchorLevel];
  Index3 first{}, last{}, cube{};
  for (std::size_t d = 0; d < 3; ++d) {
    first[d] = std::max((low[d] - offset_[d]) >> kFirstAnchorLevel, 0);
    last[d] = std::min((high[d] - offset_[d]) >> kFirstAnchorLevel, cubes.dims[d] - 1);
  }
  for (cube[2] = first[2]; cube[2] <= last[2]; ++cube[2]) {
    for (cube[1] = first[1]; cube[1] <= last[1]; ++cube[1]) {
      for (cube[0] = first[0]; cube[0] <= last[0]; ++cube[0]) {
        const std::size_t at = cubes.at(cube);
        for (std::uint32_t n = at > 0 ? list.until[at - 1] : 0; n < list.until[at]; ++n) {
          Index3 voxel{};
          bool inside = true;
          for (std::size_t d = 0; d < 3; ++d) {
            voxel[d] = list.items[n].voxel[d] + offset_[d];
            inside = inside && voxel[d] >= low[d] && voxel[d] <= high[d];
          }
          if (inside) visit(list.items[n], voxel);
        }
      }
    }
  }
}

template <class Visit>
void CoarseMaterial::for_anchor_faces(const Index3& low, const Index3& high, const Visit& visit) const {
  for_items(anchor_faces_, low, high, [&](const PackedFace& packed, const Index3& voxel) {
    const auto sign = [&packed](int bit) { return (packed.sides >> bit & 1) != 0 ? 1 : -1; };
    visit(AnchorFace{
        voxel, std::size_t{packed.sides} >> 3U, sign(0), {sign(1), sign(2)}, stiffness_[packed.rank]});
  });
}

template <class Visit>
void CoarseMaterial::for_thin_links(const Index3& low, const Index3& high, const Visit& visit) const {
  for_items(thin_links_, low, high, [&](const PackedLink& packed, const Index3& voxel) {
    visit(ThinLink{voxel, packed.d, packed.excess, packed.shape, packed.share});
  });
}

template <class Visit>
void CoarseMaterial::for_thin_cells(const Index3& low, const Index3& high, const Visit& visit) const {
  const Index3 beyond{high[0] + 1, high[1] + 1, high[2] + 1};
  for_thin_links(low, beyond, [&](const ThinLink& link) {
    const std::size_t e = (link.d + 1) % 3, f = (link.d + 2) % 3;
    for (int n = 0; link.share > 0.0F && n < 4; ++n) {
      Index3 cell = link.voxel;
      cell[e] -= n & 1;
      cell[f] -= n >> 1;
      bool inside = true;
      for (std::size_t d = 0; d < 3; ++d) inside = inside && cell[d] >= low[d] && cell[d] <= high[d];
      if (inside) visit(cell, link.d, link.share);
    }
  });
}

}  // namespace voxel
