// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/object/validate.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace voxel {
namespace {

constexpr double kHalfUlp = 5.97e-8;  // 2^-24, relative

template <class... Parts>
std::string said(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return text.str();
}

std::string where(const Lattice& lattice, VoxelId v) {
  const std::array<int, 3> c = lattice.coordinates(v);
  return said("voxel (", c[0], ", ", c[1], ", ", c[2], ")");
}

bool inside(const Lattice& lattice, VoxelId v) {
  const std::array<int, 3> c = lattice.coordinates(v);
  for (std::size_t d = 0; d < 3; ++d) {
    if (c[d] < 0 || c[d] >= lattice.grid().dims[d]) return false;
  }
  return true;
}

bool has_gap_beside(const Lattice& lattice, VoxelId v) {
  for (int d = 0; d < 3; ++d) {
    if (!lattice.filled(lattice.up(v, d)) || !lattice.filled(lattice.down(v, d))) return true;
  }
  return false;
}

std::string validate_row(const Lattice& lattice, const Displacement& state, RowId row) {
  int standing = 0, obstacles = 0;
  for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
    const std::uint8_t role = state.role[v];
    if (role > Displacement::pressed && !Displacement::in_block(role))
      return where(lattice, v) + " has a role that there is not";
    if (role != Displacement::free && !lattice.filled(v))
      return where(lattice, v) + " has a role and is empty";
    if (Displacement::in_block(role) != (lattice.block(v) != 0))
      return where(lattice, v) + " moves as one with a part it is not in, or not with that it is in";
    if (role >= Displacement::obstacle && role != Displacement::joined &&
        lattice.surface_number(v) == Lattice::kNoSurface)
      return where(lattice, v) + " lies inside and is pressed, or has an obstacle";
    standing += Displacement::stands(role) ? 1 : 0;
    obstacles += Displacement::at_obstacle(role) ? 1 : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float u = state.u[axis][v];
      if (!std::isfinite(u)) return said(where(lattice, v), " is at ", u, " on axis ", axis);
      if (u != 0.0F && !lattice.filled(v)) return where(lattice, v) + " is empty and displaced";
      if (u != 0.0F && lattice.anchored(v)) return where(lattice, v) + " is anchored and displaced";
    }
  }
  if (standing != state.row_standing[row] || obstacles != state.row_obstacles[row])
    return said("the row of ", where(lattice, row * kRow), " counts its roles wrongly");
  return {};
}

}  // namespace

std::string validate(const Lattice& lattice) {
  std::size_t voxels = 0, anchored = 0, surface = 0;
  for (RowId row = 0; row < lattice.grid().rows(); ++row) {
    int filled = 0;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (lattice.anchored(v) && !lattice.filled(v)) return where(lattice, v) + " is anchored and empty";
      if (!lattice.filled(v)) continue;
      if (!inside(lattice, v)) return where(lattice, v) + " is in the border";
      ++filled;
      anchored += lattice.anchored(v) ? 1 : 0;
      const std::uint32_t number = lattice.surface_number(v);
      if (has_gap_beside(lattice, v) != (number != Lattice::kNoSurface))
        return where(lattice, v) + " is wrongly in the surface, or not in it";
      if (number == Lattice::kNoSurface) continue;
      ++surface;
      if (number >= lattice.surface().size() || lattice.surface()[number] != v)
        return where(lattice, v) + " has another's number in the surface";
    }
    if (filled != lattice.filled_in(row))
      return said("the row of ", where(lattice, row * kRow), " counts its voxels wrongly");
    voxels += static_cast<std::size_t>(filled);
  }
  if (voxels != lattice.voxel_count() || anchored != lattice.anchored_count() ||
      surface != lattice.surface().size())
    return "voxels, anchors or surface are counted wrongly";
  return {};
}

std::string validate(const Lattice& lattice, const Displacement& state, double roundings) {
  std::array<double, 3> largest{};
  for (RowId row = 0; row < lattice.grid().rows(); ++row) {
    std::string wrong = validate_row(lattice, state, row);
    if (!wrong.empty()) return wrong;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v)
        largest[axis] = std::max(largest[axis], std::fabs(static_cast<double>(state.u[axis][v])));
    }
  }
  for (RowId row = 0; row < lattice.grid().rows(); ++row) {
    for (VoxelId v = row * kRow; lattice.filled_in(row) > 0 && v < (row + 1) * kRow; ++v) {
      for (int d = 0; d < 3 && lattice.filled(v); ++d) {
        const VoxelId w = lattice.up(v, d);
        for (int axis = 0; axis < 3 && lattice.filled(w); ++axis) {
          const auto n = static_cast<std::size_t>(axis);
          const std::array<float, 2> bounds = lattice.bounds(v, d, axis);
          const double apart = static_cast<double>(state.u[n][w]) - static_cast<double>(state.u[n][v]);
          const double beyond =
              std::max(apart - static_cast<double>(bounds[1]), static_cast<double>(bounds[0]) - apart);
          if (beyond > roundings * kHalfUlp * largest[n])
            return said("the link of ", where(lattice, v), " in +", "xyz"[d], " is ", beyond,
                        " m beyond its limits on axis ", axis);
        }
      }
    }
  }
  return {};
}

}  // namespace voxel
