// SPDX-License-Identifier: GPL-3.0-or-later
// The innermost loops of relaxation: one voxel, one row.
#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/relaxation.h"
#include "voxel/wide.h"

namespace voxel {
namespace {

constexpr float kNearLimit =
    0.999F;  // of the tightest limit: a row that stays within this has no link at its limit
constexpr float kTight = 1e-6F;  // of the spacing: nearer to its limit than this a link is at it
constexpr int kMaxRow = 2048;    // rows longer than this are relaxed in pieces

// Interval that the links of v allow its displacement on one axis.
std::array<float, 2> link_interval(const Lattice& lattice, const std::vector<float>& u, VoxelId v,
                                   int axis) noexcept {
  float low = -std::numeric_limits<float>::max(), high = std::numeric_limits<float>::max();
  for (int d = 0; d < 3; ++d) {
    const auto step = static_cast<VoxelId>(lattice.stride(d));
    if (lattice.filled(v + step)) {  // b0 <= u(v+step) − u(v) <= b1
      const auto b = lattice.bounds(v, d, axis);
      low = std::max(low, u[v + step] - b[1]);
      high = std::min(high, u[v + step] - b[0]);
    }
    if (lattice.filled(v - step)) {
      const auto b = lattice.bounds(v - step, d, axis);
      low = std::max(low, u[v - step] + b[0]);
      high = std::min(high, u[v - step] + b[1]);
    }
  }
  return {low, high};
}

float clamp_interval(float wanted, const std::array<float, 2>& interval, float now) noexcept {
  // An empty interval can only be a rounding wide: stay.
  if (interval[0] > interval[1]) return now;
  return std::clamp(wanted, interval[0], interval[1]);
}

float axis_minimum(const Springs& s, const std::vector<float>& u, VoxelId v, int axis) noexcept {
  float sum = 0.0F;
  for (int d = 0; d < 3; ++d) {
    const float* k = s.stiffness(axis, d);
    const auto step = static_cast<VoxelId>(s.stride[static_cast<std::size_t>(d)]);
    sum += k[v] * u[v + step] + k[v - step] * u[v - step];
  }
  return sum * s.inverse_diagonal[static_cast<std::size_t>(axis)][v];
}

// Could the link in direction d leave its limits, seen from the tightest limit there is? Branch-free, so that
// the row vectorises; an absent link (k = 0) cannot.
inline int leaves(float k, float difference, float low, float high) noexcept {
  return static_cast<int>(k > 0.0F) &
         (static_cast<int>(difference > high) | static_cast<int>(difference < low));
}

inline int reaches(float k, float difference, float low, float high) noexcept {
  return static_cast<int>(k > 0.0F) &
         (static_cast<int>(difference >= high) | static_cast<int>(difference <= low));
}

// One axis of a row at once. Returns false, with nothing written, when a limit is near.
HYBRID_WIDE bool relax_row_at_once(const Lattice& lattice, Displacement& state, int axis, std::size_t begin,
                                   int count) noexcept {
  const Springs& s = lattice.springs();
  float* u = state.u[static_cast<std::size_t>(axis)].data() + begin;
  const float* inverse = s.inverse_diagonal[static_cast<std::size_t>(axis)].data() + begin;
  const std::ptrdiff_t sy = static_cast<std::ptrdiff_t>(s.stride[1]),
                       sz = static_cast<std::ptrdiff_t>(s.stride[2]);
  const float *kx = s.stiffness(axis, 0) + begin, *ky = s.stiffness(axis, 1) + begin,
              *kz = s.stiffness(axis, 2) + begin;
  std::array<float, 3> low{}, high{};
  for (int d = 0; d < 3; ++d) {
    const LinkLimit& l = lattice.tightest(d);
    low[static_cast<std::size_t>(d)] = axis == d ? l.along_low : -l.across;
    high[static_cast<std::size_t>(d)] = axis == d ? l.along_high : l.across;
  }
  if (count <= 0) return true;
  std::array<float, kMaxRow> next;  // left uninitialised: 8 KiB a row would be cleared for nothing
  next[0] = 0.0F;
  int near = 0;
  const float ly = low[1], hy = high[1], lz = low[2], hz = high[2], lx = low[0], hx = high[0];
  for (int i = 0; i < count; ++i) {
    const float t = (kx[i - 1] * u[i - 1] + kx[i] * u[i + 1] + ky[i - sy] * u[i - sy] + ky[i] * u[i + sy] +
                     kz[i - sz] * u[i - sz] + kz[i] * u[i + sz]) *
                    inverse[i];
    next[static_cast<std::size_t>(i)] = t;
    near |= leaves(ky[i], u[i + sy] - t, ly, hy) | leaves(ky[i - sy], t - u[i - sy], ly, hy) |
            leaves(kz[i], u[i + sz] - t, lz, hz) | leaves(kz[i - sz], t - u[i - sz], lz, hz);
  }
  for (int i = 0; i + 1 < count; ++i) {
    near |= leaves(kx[i], next[static_cast<std::size_t>(i) + 1] - next[static_cast<std::size_t>(i)], lx, hx);
  }
  near |= leaves(kx[-1], next[0] - u[-1], lx, hx) |
          leaves(kx[count - 1], u[count] - next[static_cast<std::size_t>(count) - 1], lx, hx);
  if (near != 0) return false;
  std::copy_n(next.begin(), count, u);
  return true;
}

// After the links had their way with v: if that took it into its obstacle, where it goes with the obstacle
// there.
void relax_obstacle(const Lattice& lattice, Displacement& state, const ObstacleView& view,
                    VoxelId v) noexcept {
  if (!blocked(view, state, v, 0.0)) return;
  glm::dvec3 wanted = link_minimum(lattice, state, v);
  const Obstacle& o = view.obstacles[view.surface_number[v]];
  const glm::dvec3 n(o.normal);
  const double depth = static_cast<double>(o.bound) - glm::dot(n, wanted);
  if (depth > 0.0) {
    // Projected in the metric of the springs, so that the step lowers the energy along the surface.
    const Springs& s = lattice.springs();
    const glm::dvec3 w(s.inverse_diagonal[0][v], s.inverse_diagonal[1][v], s.inverse_diagonal[2][v]);
    const double denominator = glm::dot(n, w * n);
    if (denominator > 0.0) wanted += (depth / denominator) * w * n;
  }
  state.set(v, clamp_to_links(lattice, state, v, wanted));
}

void relax_row_one_by_one(const Lattice& lattice, Displacement& state, int axis, std::size_t begin,
                          int count) noexcept {
  auto& u = state.u[static_cast<std::size_t>(axis)];
  const auto& inverse = lattice.springs().inverse_diagonal[static_cast<std::size_t>(axis)];
  for (std::size_t i = begin; i < begin + static_cast<std::size_t>(count); ++i) {
    const auto v = static_cast<VoxelId>(i);
    if (inverse[v] == 0.0F || state.role[v] == Displacement::held) continue;
    u[v] =
        clamp_interval(axis_minimum(lattice.springs(), u, v, axis), link_interval(lattice, u, v, axis), u[v]);
  }
}

// The same at-once attempt for a correction: false, with nothing written, when a limit is near.
HYBRID_WIDE bool correct_row_at_once(const Lattice& lattice, Displacement& state, int axis, std::size_t begin,
                                     int count, const float* correction) noexcept {
  const Springs& s = lattice.springs();
  float* u = state.u[static_cast<std::size_t>(axis)].data() + begin;
  const float* inverse = s.inverse_diagonal[static_cast<std::size_t>(axis)].data() + begin;
  const std::ptrdiff_t sy = static_cast<std::ptrdiff_t>(s.stride[1]),
                       sz = static_cast<std::ptrdiff_t>(s.stride[2]);
  const float *kx = s.stiffness(axis, 0) + begin, *ky = s.stiffness(axis, 1) + begin,
              *kz = s.stiffness(axis, 2) + begin;
  const auto low = [&](int d) {
    return axis == d ? lattice.tightest(d).along_low : -lattice.tightest(d).across;
  };
  const auto high = [&](int d) {
    return axis == d ? lattice.tightest(d).along_high : lattice.tightest(d).across;
  };
  const float lx = low(0), hx = high(0), ly = low(1), hy = high(1), lz = low(2), hz = high(2);
  std::array<float, kMaxRow> next;
  next[0] = 0.0F;
  int near = 0;
  for (int i = 0; i < count; ++i) {
    const float t = u[i] + (inverse[i] != 0.0F ? correction[i] : 0.0F);
    next[static_cast<std::size_t>(i)] = t;
    near |= leaves(ky[i], u[i + sy] - t, ly, hy) | leaves(ky[i - sy], t - u[i - sy], ly, hy) |
            leaves(kz[i], u[i + sz] - t, lz, hz) | leaves(kz[i - sz], t - u[i - sz], lz, hz);
  }
  for (int i = 0; i + 1 < count; ++i) {
    near |= leaves(kx[i], next[static_cast<std::size_t>(i) + 1] - next[static_cast<std::size_t>(i)], lx, hx);
  }
  near |= leaves(kx[-1], next[0] - u[-1], lx, hx) |
          leaves(kx[count - 1], u[count] - next[static_cast<std::size_t>(count) - 1], lx, hx);
  if (near != 0) return false;
  std::copy_n(next.begin(), count, u);
  return true;
}

}  // namespace

HYBRID_WIDE bool near_limits(const Lattice& lattice, const Displacement& state, int axis, std::size_t begin,
                             int count) noexcept {
  const Springs& s = lattice.springs();
  const float* u = state.u[static_cast<std::size_t>(axis)].data() + begin;
  const std::ptrdiff_t sy = static_cast<std::ptrdiff_t>(s.stride[1]),
                       sz = static_cast<std::ptrdiff_t>(s.stride[2]);
  const float *kx = s.stiffness(axis, 0) + begin, *ky = s.stiffness(axis, 1) + begin,
              *kz = s.stiffness(axis, 2) + begin;
  const auto low = [&](int d) {
    return kNearLimit * (axis == d ? lattice.tightest(d).along_low : -lattice.tightest(d).across);
  };
  const auto high = [&](int d) {
    return kNearLimit * (axis == d ? lattice.tightest(d).along_high : lattice.tightest(d).across);
  };
  const float lx = low(0), hx = high(0), ly = low(1), hy = high(1), lz = low(2), hz = high(2);
  int near = 0;
  for (int i = 0; i < count; ++i) {
    near |= reaches(kx[i - 1], u[i] - u[i - 1], lx, hx) | reaches(kx[i], u[i + 1] - u[i], lx, hx) |
            reaches(ky[i - sy], u[i] - u[i - sy], ly, hy) | reaches(ky[i], u[i + sy] - u[i], ly, hy) |
            reaches(kz[i - sz], u[i] - u[i - sz], lz, hz) | reaches(kz[i], u[i + sz] - u[i], lz, hz);
  }
  return near != 0;
}

bool resisted(const Lattice& lattice, const Displacement& state, int axis, VoxelId v, float pull) noexcept {
  const auto& u = state.u[static_cast<std::size_t>(axis)];
  const auto interval = link_interval(lattice, u, v, axis);
  const float tight = kTight * static_cast<float>(lattice.min_spacing_m());
  return pull > 0.0F ? u[v] >= interval[1] - tight : u[v] <= interval[0] + tight;
}

void correct_row(const Lattice& lattice, Displacement& state, int axis, std::size_t begin, int count,
                 const float* correction) noexcept {
  const std::size_t row = begin / static_cast<std::size_t>(lattice.springs().dims[0]);
  auto& u = state.u[static_cast<std::size_t>(axis)];
  const auto& inverse = lattice.springs().inverse_diagonal[static_cast<std::size_t>(axis)];
  for (int from = 0; from < count; from += kMaxRow) {
    const int piece = std::min(kMaxRow, count - from);
    const std::size_t start = begin + static_cast<std::size_t>(from);
    if (state.row_held[row] == 0 &&
        correct_row_at_once(lattice, state, axis, start, piece, correction + from))
      continue;
    for (int i = 0; i < piece; ++i) {
      const auto v = static_cast<VoxelId>(start + static_cast<std::size_t>(i));
      if (inverse[v] == 0.0F || state.role[v] == Displacement::held) continue;
      u[v] = clamp_interval(u[v] + correction[from + i], link_interval(lattice, u, v, axis), u[v]);
    }
  }
}

void clear_obstacles(const Lattice& lattice, Displacement& state, const ObstacleView& view, std::size_t begin,
                     int count) noexcept {
  for (std::size_t i = begin; i < begin + static_cast<std::size_t>(count); ++i) {
    const auto v = static_cast<VoxelId>(i);
    if (state.role[v] != Displacement::obstacle) continue;
    const Obstacle& o = view.obstacles[view.surface_number[v]];
    const glm::dvec3 n(o.normal);
    const double depth = static_cast<double>(o.bound) - glm::dot(n, state.at(v));
    if (depth > 0.0) state.set(v, clamp_to_links(lattice, state, v, state.at(v) + depth * n));
  }
}

bool blocked(const ObstacleView& view, const Displacement& state, VoxelId v, double margin) noexcept {
  const Obstacle& o = view.obstacles[view.surface_number[v]];
  return glm::dot(glm::dvec3(o.normal), state.at(v)) < static_cast<double>(o.bound) + margin;
}

glm::dvec3 link_minimum(const Lattice& lattice, const Displacement& state, VoxelId v) noexcept {
  glm::dvec3 m(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    m[axis] = static_cast<double>(
        axis_minimum(lattice.springs(), state.u[static_cast<std::size_t>(axis)], v, axis));
  }
  return m;
}

glm::dvec3 clamp_to_links(const Lattice& lattice, const Displacement& state, VoxelId v,
                          const glm::dvec3& wanted) noexcept {
  glm::dvec3 result(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto& u = state.u[static_cast<std::size_t>(axis)];
    result[axis] = static_cast<double>(
        clamp_interval(static_cast<float>(wanted[axis]), link_interval(lattice, u, v, axis), u[v]));
  }
  return result;
}

glm::dvec3 link_force(const Lattice& lattice, const Displacement& state, VoxelId v) noexcept {
  const Springs& s = lattice.springs();
  glm::dvec3 force(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto& u = state.u[static_cast<std::size_t>(axis)];
    double sum = 0.0;
    for (int d = 0; d < 3; ++d) {
      const float* k = s.stiffness(axis, d);
      const auto step = static_cast<VoxelId>(s.stride[static_cast<std::size_t>(d)]);
      sum += static_cast<double>(k[v] * (u[v + step] - u[v])) +
             static_cast<double>(k[v - step] * (u[v - step] - u[v]));
    }
    force[axis] = sum;
  }
  return force;
}

void relax_row(const Lattice& lattice, Displacement& state, const ObstacleView& obstacles, std::size_t row,
               int first, int last) noexcept {
  const std::size_t base = row * static_cast<std::size_t>(lattice.springs().dims[0]);
  for (int from = first; from < last; from += kMaxRow) {
    const int count = std::min(kMaxRow, last - from);
    const std::size_t begin = base + static_cast<std::size_t>(from);
    for (int axis = 0; axis < 3; ++axis) {
      if (state.row_held[row] != 0 || !relax_row_at_once(lattice, state, axis, begin, count)) {
        relax_row_one_by_one(lattice, state, axis, begin, count);
      }
    }
    if (state.row_obstacles[row] == 0) continue;
    for (std::size_t v = begin; v < begin + static_cast<std::size_t>(count); ++v) {
      if (state.role[v] == Displacement::obstacle)
        relax_obstacle(lattice, state, obstacles, static_cast<VoxelId>(v));
    }
  }
}

}  // namespace voxel
