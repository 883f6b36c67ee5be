// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/tissue/tissue_field.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <unordered_map>

#include "voxel/lattice/lattice.h"

namespace hybrid {
namespace {

// Differences below this share of the spacing count as rounding where a link has no slack.
constexpr float kRounding = 1e-5F;
constexpr int kReach = 2;  // voxels around a place among which the nearest one is looked for

// The filled voxel nearest to a place (unit: voxels).
std::optional<std::array<int, 3>> nearest_voxel(const voxel::Lattice& lattice, const glm::dvec3& place) {
  const std::array<int, 3>& dims = lattice.grid().dims;
  std::array<int, 3> middle{};
  for (std::size_t d = 0; d < 3; ++d) {
    const double at = std::round(place[static_cast<int>(d)]);
    if (!(at >= -kReach) || !(at < dims[d] + kReach)) return {};
    middle[d] = static_cast<int>(at);
  }
  std::optional<std::array<int, 3>> nearest;
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](int reach) {
    for (int k = middle[2] - reach; k <= middle[2] + reach; ++k) {
      for (int j = middle[1] - reach; j <= middle[1] + reach; ++j) {
        for (int i = middle[0] - reach; i <= middle[0] + reach; ++i) {
          if (std::min({i, j, k}) < 0 || i >= dims[0] || j >= dims[1] || k >= dims[2]) continue;
          if (!lattice.filled(lattice.at(i, j, k))) continue;
          const glm::dvec3 way = glm::dvec3(i, j, k) - place;
          if (const double squared = glm::dot(way, way); squared < least) {
            least = squared;
            nearest = {i, j, k};
          }
        }
      }
    }
  };
  for (int reach = 0; reach <= kReach && !nearest; ++reach) look(reach);
  return nearest;
}

// The eigenvalue of largest magnitude of a symmetric matrix (trigonometric solution; Smith 1961).
double largest_eigenvalue(const glm::dmat3& a) {
  const double mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
  glm::dmat3 b = a;
  double squares = 0.0;
  for (int d = 0; d < 3; ++d) {
    b[d][d] -= mean;
    squares += glm::dot(b[d], b[d]);
  }
  const double p = std::sqrt(squares / 6.0);
  if (!(p > 0.0)) return mean;
  const double half_determinant = 0.5 * glm::dot(glm::cross(b[0], b[1]), b[2]) / (p * p * p);
  const double angle = std::acos(std::clamp(half_determinant, -1.0, 1.0)) / 3.0;
  const double high = mean + 2.0 * p * std::cos(angle);
  const double low = mean + 2.0 * p * std::cos(angle + 2.0 * std::numbers::pi / 3.0);
  return std::abs(high) >= std::abs(low) ? high : low;
}

// The difference as a share of the limit, at most 1. If the limit is 0, any difference is the whole share.
float share_of(float difference_m, float limit_m, float rounding_m) {
  if (!(difference_m > rounding_m)) return 0.0F;
  return limit_m > rounding_m ? std::min(difference_m / limit_m, 1.0F) : 1.0F;
}

}  // namespace

std::optional<TissueColour> tissue_colour_named(std::string_view name) {
  const auto at = std::find(kTissueColours.begin(), kTissueColours.end(), name);
  if (at == kTissueColours.end()) return {};
  return static_cast<TissueColour>(at - kTissueColours.begin());
}

TissueField::TissueField(const DrawnInside& inside, std::span<const glm::dvec3> places_m)
    : to_scene_(inside.to_scene), of_place_(places_m.size(), kNone) {
  if (inside.lattice == nullptr) return;
  const voxel::Lattice& lattice = *inside.lattice;
  spacing_m_ = lattice.spacing_m();
  std::unordered_map<voxel::VoxelId, std::uint32_t> points, stencils;
  const auto point_of = [&](const std::array<int, 3>& c) {
    const auto [at, fresh] =
        points.try_emplace(lattice.at(c[0], c[1], c[2]), static_cast<std::uint32_t>(points_m_.size()));
    if (fresh) points_m_.push_back(inside.from_voxels({c[0], c[1], c[2]}));
    return at->second;
  };
  for (std::size_t p = 0; p < places_m.size(); ++p) {
    const auto c = nearest_voxel(lattice, inside.to_voxels(places_m[p]));
    if (!c) continue;
    const voxel::VoxelId v = lattice.at((*c)[0], (*c)[1], (*c)[2]);
    const auto [at, fresh] = stencils.try_emplace(v, static_cast<std::uint32_t>(stencils_.size()));
    of_place_[p] = at->second;
    if (!fresh) continue;
    Stencil stencil{.voxel = point_of(*c)};
    for (int n = 0; n < 6; ++n) {
      const int d = n / 2;
      const bool up = n % 2 == 0;
      const voxel::VoxelId end = up ? lattice.up(v, d) : lattice.down(v, d);
      const auto link = static_cast<std::size_t>(n);
      stencil.ends[link] = kNone;
      if (!lattice.filled(end)) continue;
      std::array<int, 3> of_end = *c;
      of_end[static_cast<std::size_t>(d)] += up ? 1 : -1;
      stencil.ends[link] = point_of(of_end);
      const voxel::LinkLimit& limit = lattice.limit(up ? v : end, d);
      stencil.limits_m[link] = {-limit.along_low, limit.along_high, limit.across};
    }
    stencils_.push_back(stencil);
  }
}

std::vector<float> TissueField::values(TissueColour colour, std::span<const glm::vec3> moved_m) const {
  std::vector<float> of_place(of_place_.size(), 0.0F);
  if (moved_m.size() != points_m_.size()) return of_place;
  std::vector<float> of_stencil(stencils_.size());
  for (std::size_t n = 0; n < stencils_.size(); ++n) {
    const float value =
        colour == TissueColour::strain ? strain_at(stencils_[n], moved_m) : limits_at(stencils_[n], moved_m);
    of_stencil[n] = std::isfinite(value) ? value : 0.0F;
  }
  for (std::size_t p = 0; p < of_place.size(); ++p) {
    if (of_place_[p] != kNone) of_place[p] = of_stencil[of_place_[p]];
  }
  return of_place;
}

float TissueField::strain_at(const Stencil& stencil, std::span<const glm::vec3> moved_m) const {
  glm::dmat3 gradient(0.0);  // [d] derivative of the displacement (object's axes) along axis d
  for (int d = 0; d < 3; ++d) {
    const std::uint32_t up = stencil.ends[2 * static_cast<std::size_t>(d)],
                        down = stencil.ends[2 * static_cast<std::size_t>(d) + 1];
    const int links = (up != kNone ? 1 : 0) + (down != kNone ? 1 : 0);
    if (links == 0) continue;
    const glm::vec3 difference =
        moved_m[up != kNone ? up : stencil.voxel] - moved_m[down != kNone ? down : stencil.voxel];
    if (difference == glm::vec3(0.0F)) continue;
    gradient[d] = (glm::dvec3(difference) * to_scene_) / (links * spacing_m_[d]);  // v · R is Rᵀ v
  }
  if (gradient == glm::dmat3(0.0)) return 0.0F;
  glm::dmat3 strain(0.0);
  for (int d = 0; d < 3; ++d) {
    for (int e = 0; e < 3; ++e) strain[d][e] = 0.5 * (gradient[d][e] + gradient[e][d]);
  }
  return static_cast<float>(std::abs(largest_eigenvalue(strain)));
}

float TissueField::limits_at(const Stencil& stencil, std::span<const glm::vec3> moved_m) const {
  float most = 0.0F;
  for (std::size_t n = 0; n < stencil.ends.size(); ++n) {
    if (stencil.ends[n] == kNone) continue;
    const glm::vec3 way = moved_m[stencil.ends[n]] - moved_m[stencil.voxel];
    if (way == glm::vec3(0.0F)) continue;
    const glm::dvec3 in_object = glm::dvec3(way) * to_scene_;
    const auto d = static_cast<int>(n / 2);
    const float rounding_m = kRounding * static_cast<float>(spacing_m_[d]);
    const auto& [shorter, longer, across] = stencil.limits_m[n];
    const float along = static_cast<float>(n % 2 == 0 ? in_object[d] : -in_object[d]);
    most = std::max({most, share_of(along, longer, rounding_m), share_of(-along, shorter, rounding_m)});
    for (int axis = 0; axis < 3; ++axis) {
      if (axis != d)
        most = std::max(most, share_of(static_cast<float>(std::abs(in_object[axis])), across, rounding_m));
    }
  }
  return most;
}

}  // namespace hybrid
