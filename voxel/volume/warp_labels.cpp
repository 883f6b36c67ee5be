// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/warp_labels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace voxel {
namespace {

// Tolerance of the point-in-tetrahedron test (unit: height of the tetrahedron), so that rounding opens no gap
// between neighbours.
constexpr double kSeam = 1e-6;

struct SliceData {
  std::vector<std::uint8_t> labels;
  std::vector<glm::vec3> moved;  // (unit: meter)
  bool still = true;             // no filled voxel has moved

  explicit SliceData(std::size_t size) : labels(size, 0), moved(size, glm::vec3(0.0F)) {}
  void clear() {
    std::fill(labels.begin(), labels.end(), std::uint8_t{0});
    std::fill(moved.begin(), moved.end(), glm::vec3(0.0F));
    still = true;
  }
};

// Displacements of the voxel corners that lie between two slices (unit: spacing).
struct Corners {
  std::vector<glm::dvec3> moved;
  bool still = true;
};

// Walks the boxes of all filled voxels, slice after slice.
class Boxes {
 public:
  Boxes(const VolumeFrame& frame, const LabelSlice& labels, const VectorSlice& displacement)
      : frame_(frame), labels_(labels), displacement_(displacement) {}

  // Calls visit(i, j, k, label, corners, still). corners[c] is the place of corner c (unit: index). Bits 0 to
  // 2 of c select the side along x, y and z. `corners` is valid only if not `still`.
  template <typename Visit>
  void for_each(Visit visit) const {
    const auto nx = static_cast<std::size_t>(frame_.dims[0]), ny = static_cast<std::size_t>(frame_.dims[1]);
    SliceData below(nx * ny), here(nx * ny);
    std::array<Corners, 2> level;
    for (Corners& c : level) c.moved.assign((nx + 1) * (ny + 1), glm::dvec3(0.0));
    for (int k = 0; k <= frame_.dims[2]; ++k) {
      if (k < frame_.dims[2]) {
        read(k, here);
      } else {
        here.clear();
      }
      std::swap(level[0], level[1]);
      find_corners(below, here, level[1]);
      if (k > 0) visit_slice(k - 1, below, level, visit);
      std::swap(below, here);
    }
  }

 private:
  void read(int k, SliceData& slice) const {
    labels_(k, slice.labels);
    displacement_(k, slice.moved);
    slice.still = true;
    for (std::size_t n = 0; n < slice.labels.size(); ++n) {
      if (slice.labels[n] == 0) continue;
      const glm::vec3& u = slice.moved[n];
      if (u == glm::vec3(0.0F)) continue;
      slice.still = false;
      if (!(std::isfinite(u.x) && std::isfinite(u.y) && std::isfinite(u.z)))
        throw std::runtime_error("a displacement is not finite, so the labels cannot be moved by it");
    }
  }

  void find_corners(const SliceData& below, const SliceData& above, Corners& corners) const {
    const bool still = below.still && above.still;
    if (still && corners.still) return;
    corners.still = still;
    std::fill(corners.moved.begin(), corners.moved.end(), glm::dvec3(0.0));
    if (still) return;
    const int nx = frame_.dims[0], ny = frame_.dims[1];
    const glm::dvec3 scale = 1.0 / frame_.spacing_m;
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) {
        glm::dvec3 sum(0.0);
        int count = 0;
        for (const SliceData* slice : {&below, &above}) {
          for (int b = std::max(j - 1, 0); b <= std::min(j, ny - 1); ++b) {
            for (int a = std::max(i - 1, 0); a <= std::min(i, nx - 1); ++a) {
              const auto n =
                  static_cast<std::size_t>(b) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(a);
              if (slice->labels[n] == 0) continue;
              sum += glm::dvec3(slice->moved[n]);
              ++count;
            }
          }
        }
        if (count > 0) corners.moved[corner(i, j)] = sum * scale / static_cast<double>(count);
      }
    }
  }

  [[nodiscard]] std::size_t corner(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(frame_.dims[0] + 1) +
           static_cast<std::size_t>(i);
  }

  template <typename Visit>
  void visit_slice(int k, const SliceData& slice, const std::array<Corners, 2>& level, Visit visit) const {
    const bool all_still = level[0].still && level[1].still;
    std::array<glm::dvec3, 8> place;
    std::size_t n = 0;
    for (int j = 0; j < frame_.dims[1]; ++j) {
      for (int i = 0; i < frame_.dims[0]; ++i, ++n) {
        if (slice.labels[n] == 0) continue;
        bool still = true;
        for (unsigned c = 0; c < 8 && !all_still; ++c) {
          const int x = static_cast<int>(c & 1U), y = static_cast<int>((c >> 1U) & 1U);
          const glm::dvec3& u = level[c >> 2U].moved[corner(i + x, j + y)];
          still = still && u == glm::dvec3(0.0);
          place[c] = glm::dvec3(i + x, j + y, k + static_cast<int>(c >> 2U)) - 0.5 +
                     u;  // corners lie between voxel centres
        }
        visit(i, j, k, slice.labels[n], place, still);
      }
    }
  }

  const VolumeFrame& frame_;
  const LabelSlice& labels_;
  const VectorSlice& displacement_;
};

struct IndexBox {
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
};

// The empty lattice that covers the volume before and after the warp. `shift` is the index of the old voxel
// (0,0,0).
LabelVolume enlarged(const VolumeFrame& frame, const IndexBox& range, glm::ivec3& shift,
                     std::size_t max_voxels) {
  LabelVolume volume;
  volume.spacing_m = frame.spacing_m;
  volume.rotation = frame.rotation;
  double voxels = 1.0;
  std::array<double, 3> counts{};
  glm::dvec3 below(0.0);
  for (int a = 0; a < 3; ++a) {
    const auto axis = static_cast<std::size_t>(a);
    // Includes a voxel whose centre the outermost corner just reaches, up to rounding.
    below[a] = std::max(0.0, -std::ceil(range.low[a] - kSeam));
    const double above =
        std::max(0.0, std::floor(range.high[a] + kSeam) - (static_cast<double>(frame.dims[axis]) - 1.0));
    counts[axis] = frame.dims[axis] + below[a] + above;
    voxels *= counts[axis];
  }
  if (!(voxels <= static_cast<double>(max_voxels))) {
    std::ostringstream text;
    text << "the moved labels span " << counts[0] << " x " << counts[1] << " x " << counts[2]
         << " voxels and need " << voxels / 1e6 << " MB, above the limit of "
         << static_cast<double>(max_voxels) / 1e6 << " MB; use a larger spacing";
    throw std::runtime_error(text.str());
  }
  for (std::size_t axis = 0; axis < 3; ++axis) volume.dims[axis] = static_cast<int>(counts[axis]);
  shift = glm::ivec3(below);
  volume.origin_m = frame.origin_m - frame.rotation * (below * frame.spacing_m);
  volume.labels.assign(static_cast<std::size_t>(voxels), std::uint8_t{0});
  return volume;
}

// Gives the label of a box to every voxel whose centre is in the box and that has no label yet.
void fill_box(const std::array<glm::dvec3, 8>& corner, std::uint8_t label, const glm::ivec3& shift,
              LabelVolume& volume) {
  // Kuhn's six tetrahedra about the diagonal 0-7. They are the same in every box, so that neighbours share
  // the diagonals of their common faces.
  static constexpr std::array<std::array<std::size_t, 2>, 6> kMiddle{
      {{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}}};
  for (const auto& [b, c] : kMiddle) {
    const glm::dvec3& o = corner[0];
    const glm::dmat3 edges(corner[b] - o, corner[c] - o, corner[7] - o);
    const double determinant = glm::determinant(edges);
    if (!(std::abs(determinant) > 1e-12)) continue;  // flat: contains no centre
    const glm::dmat3 inverse = glm::inverse(edges);
    const glm::dvec3 low = glm::min(glm::min(o, corner[b]), glm::min(corner[c], corner[7]));
    const glm::dvec3 high = glm::max(glm::max(o, corner[b]), glm::max(corner[c], corner[7]));
    const glm::ivec3 first = glm::ivec3(glm::ceil(low - kSeam)) + shift;
    const glm::ivec3 last = glm::ivec3(glm::floor(high + kSeam)) + shift;
    for (int z = std::max(first.z, 0); z <= std::min(last.z, volume.dims[2] - 1); ++z) {
      for (int y = std::max(first.y, 0); y <= std::min(last.y, volume.dims[1] - 1); ++y) {
        for (int x = std::max(first.x, 0); x <= std::min(last.x, volume.dims[0] - 1); ++x) {
          std::uint8_t& to = volume.labels[volume.index(x, y, z)];
          if (to != 0) continue;
          const glm::dvec3 w = inverse * (glm::dvec3(glm::ivec3(x, y, z) - shift) - o);
          if (w.x >= -kSeam && w.y >= -kSeam && w.z >= -kSeam && w.x + w.y + w.z <= 1.0 + kSeam) to = label;
        }
      }
    }
  }
}

}  // namespace

LabelVolume warp_labels(const VolumeFrame& frame, const LabelSlice& labels, const VectorSlice& displacement,
                        std::size_t max_voxels) {
  const Boxes boxes(frame, labels, displacement);
  IndexBox range;
  boxes.for_each([&](int, int, int, std::uint8_t, const std::array<glm::dvec3, 8>& corners, bool still) {
    if (still) return;
    for (const glm::dvec3& c : corners) {
      range.low = glm::min(range.low, c);
      range.high = glm::max(range.high, c);
    }
  });
  glm::ivec3 shift(0);
  LabelVolume volume = enlarged(frame, range, shift, max_voxels);
  boxes.for_each(
      [&](int i, int j, int k, std::uint8_t label, const std::array<glm::dvec3, 8>& corners, bool still) {
        if (still) {
          volume.labels[volume.index(i + shift.x, j + shift.y, k + shift.z)] = label;
        } else {
          fill_box(corners, label, shift, volume);
        }
      });
  return volume;
}

}  // namespace voxel
