// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/proxy/minimise_on_planes.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

namespace polygon {
namespace {

constexpr int kMaxExchanges = 64;  // planes that are added to the subset in turn, at most
// Sine of the angle between one normal and the span of the others. Below this value the planes count as
// parallel, because their intersection would be rounding error.
constexpr double kParallel = 1e-9;
// A violation below this fraction of the distance from the target counts as none. Three planes at a blunt
// corner cannot be solved more exactly.
constexpr double kRounding = 1e-12;

// In coordinates y = Lᵀ(q − t), with A = L Lᵀ, the cost is |y|² and a plane reads unit · y >= distance.
struct Whitened {
  glm::dvec3 unit{0.0};
  double distance = 0.0;
  double length = 0.0;  // |L⁻¹ n|, by which unit and distance were divided
};

struct Subset {
  std::array<std::uint32_t, 3> plane{};
  std::uint32_t count = 0;
};

struct Candidate {
  glm::dvec3 way{0.0};  // q − t
  std::array<double, 3> multiplier{};
  double cost = 0.0;
};

// The inverse of the lower triangular Cholesky factor L, A = L Lᵀ (Golub & Van Loan, Matrix Computations,
// 4.2).
glm::dmat3 inverse_cholesky_of(const glm::dmat3& a) noexcept {
  const double l00 = std::sqrt(a[0][0]), l10 = a[0][1] / l00, l20 = a[0][2] / l00;
  const double l11 = std::sqrt(a[1][1] - l10 * l10), l21 = (a[1][2] - l20 * l10) / l11;
  const double l22 = std::sqrt(a[2][2] - l20 * l20 - l21 * l21);
  glm::dmat3 inverse(0.0);  // [column][row]
  inverse[0][0] = 1.0 / l00;
  inverse[1][1] = 1.0 / l11;
  inverse[2][2] = 1.0 / l22;
  inverse[0][1] = -l10 * inverse[0][0] / l11;
  inverse[1][2] = -l21 * inverse[1][1] / l22;
  inverse[0][2] = -(l20 * inverse[0][0] + l21 * inverse[0][1]) / l22;
  return inverse;
}

Whitened whiten(const glm::dmat3& inverse_l, const glm::dvec3& target, const ContactPlane& plane) noexcept {
  const glm::dvec3 m = inverse_l * plane.normal;
  const double length = glm::length(m);
  return {m / length, (plane.offset - glm::dot(plane.normal, target)) / length, length};
}

// Shortest y with unit · y = distance on all planes of a subset, by Gram-Schmidt. Solving for the multipliers
// first would square the condition number, and lose a micrometre where two triangles meet at a millionth of a
// radian. False if the planes are dependent.
bool solve_subset(const glm::dmat3& inverse_l, const glm::dvec3& target, std::span<const ContactPlane> planes,
                  const Subset& subset, Candidate& out) noexcept {
  std::array<Whitened, 3> white;
  std::array<glm::dvec3, 3> basis;
  std::array<std::array<double, 3>, 3> r{};  // unit_i = Σ_j r[j][i] basis_j
  std::array<double, 3> z{};                 // y = Σ z_i basis_i
  for (std::uint32_t i = 0; i < subset.count; ++i) {
    white[i] = whiten(inverse_l, target, planes[subset.plane[i]]);
    glm::dvec3 rest = white[i].unit;
    for (int pass = 0; pass < 2; ++pass) {  // the second pass removes the first one's rounding error
      for (std::uint32_t j = 0; j < i; ++j) {
        const double along = glm::dot(basis[j], rest);
        r[j][i] += along;
        rest -= along * basis[j];
      }
    }
    r[i][i] = glm::length(rest);
    if (!(r[i][i] > kParallel)) return false;
    basis[i] = rest / r[i][i];
    z[i] = white[i].distance;
    for (std::uint32_t j = 0; j < i; ++j) z[i] -= r[j][i] * z[j];
    z[i] /= r[i][i];
  }
  glm::dvec3 y(0.0);
  out.cost = 0.0;
  for (std::uint32_t i = subset.count; i-- > 0;) {
    double lambda = z[i];
    for (std::uint32_t j = i + 1; j < subset.count; ++j)
      lambda -= r[i][j] * out.multiplier[j] * white[j].length;
    out.multiplier[i] = lambda / r[i][i] / white[i].length;
    y += z[i] * basis[i];
    out.cost += z[i] * z[i];
  }
  out.way = glm::transpose(inverse_l) * y;
  return true;
}

}  // namespace

Metric::Metric(const glm::dmat3& a) noexcept : inverse_l_(inverse_cholesky_of(a)) {}

PlaneMinimum minimise_on_planes(const glm::dvec3& target, const Metric& metric,
                                std::span<const ContactPlane> planes, double tolerance) noexcept {
  PlaneMinimum result;
  result.point = target;
  if (planes.empty()) return result;
  const glm::dmat3& inverse_l = metric.inverse_cholesky();
  // Far from the origin the offsets themselves are rounded.
  tolerance += 16.0 * std::numeric_limits<double>::epsilon() * glm::length(target);
  glm::dvec3 way(0.0);
  for (int exchange = 0; exchange < kMaxExchanges; ++exchange) {
    std::uint32_t worst = 0;
    double depth = tolerance + kRounding * glm::length(way);
    bool violated = false;
    for (std::uint32_t i = 0; i < planes.size(); ++i) {
      const double d = planes[i].offset - glm::dot(planes[i].normal, result.point);
      if (!(d > depth)) continue;
      depth = d;
      worst = i;
      violated = true;
    }
    if (!violated) return result;

    // All subsets of the old active planes, each with the violated plane added.
    Candidate best;
    best.cost = std::numeric_limits<double>::max();
    Subset best_subset;
    for (std::uint32_t mask = 0; mask < (1U << result.active_count); ++mask) {
      Subset subset;
      subset.plane[subset.count++] = worst;
      bool fits = true;
      for (std::uint32_t i = 0; i < result.active_count; ++i) {
        if ((mask >> i & 1U) == 0U) continue;
        fits = fits && subset.count < 3;
        if (fits) subset.plane[subset.count++] = result.active[i];
      }
      if (!fits) continue;
      Candidate c;
      if (!solve_subset(inverse_l, target, planes, subset, c)) continue;
      bool valid = c.cost < best.cost;
      for (std::uint32_t i = 0; i < subset.count; ++i) valid = valid && c.multiplier[i] >= 0.0;
      // Planes of the subset are satisfied by construction.
      for (std::uint32_t i = 0; i < result.active_count && valid; ++i) {
        if ((mask >> i & 1U) != 0U) continue;
        const ContactPlane& p = planes[result.active[i]];
        valid = p.offset - glm::dot(p.normal, target + c.way) <= tolerance + kRounding * glm::length(c.way);
      }
      if (valid) {
        best = c;
        best_subset = subset;
      }
    }
    if (best_subset.count == 0) {
      // A plane that is parallel to the active ones counts as satisfied if its violation is at most kParallel
      // of the distance from the target.
      result.feasible = depth <= tolerance + kParallel * glm::length(way);
      return result;
    }
    way = best.way;
    result.point = target + way;
    result.active_count = best_subset.count;
    result.active = best_subset.plane;
    result.multiplier = best.multiplier;
  }
  result.feasible = false;
  return result;
}

}  // namespace polygon
