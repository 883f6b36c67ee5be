// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/proxy.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

namespace polygon {
namespace {

constexpr int kMaxExchanges = 64;
// Gram determinants below this fraction of their diagonal's product: the planes are parallel to rounding.
constexpr double kSingular = 1e-12;

struct Subset {
  std::array<std::uint32_t, 3> plane{};
  std::uint32_t count = 0;
};

struct Candidate {
  glm::dvec3 point{0.0};
  std::array<double, 3> multiplier{};
  double cost = 0.0;
};

// Equality-constrained minimum on a subset: q = t + A⁻¹ Nᵀ λ with N q = o. False when the planes are
// dependent.
bool solve_subset(const glm::dvec3& target, const glm::dmat3& inverse_metric,
                  std::span<const ContactPlane> planes, const Subset& subset, Candidate& out) noexcept {
  std::array<glm::dvec3, 3> pull;  // A⁻¹ n
  std::array<double, 3> missing{};
  glm::dmat3 gram(1.0);
  double diagonal = 1.0;
  for (std::uint32_t i = 0; i < subset.count; ++i) {
    const ContactPlane& p = planes[subset.plane[i]];
    pull[i] = inverse_metric * p.normal;
    missing[i] = p.offset - glm::dot(p.normal, target);
  }
  for (std::uint32_t i = 0; i < subset.count; ++i) {
    for (std::uint32_t j = 0; j < subset.count; ++j) {
      gram[static_cast<int>(j)][static_cast<int>(i)] = glm::dot(planes[subset.plane[i]].normal, pull[j]);
    }
    diagonal *= gram[static_cast<int>(i)][static_cast<int>(i)];
  }
  if (!(std::fabs(glm::determinant(gram)) > kSingular * diagonal)) return false;
  const glm::dvec3 lambda = glm::inverse(gram) * glm::dvec3(missing[0], subset.count > 1 ? missing[1] : 0.0,
                                                            subset.count > 2 ? missing[2] : 0.0);
  out.point = target;
  out.cost = 0.0;
  for (std::uint32_t i = 0; i < subset.count; ++i) {
    out.multiplier[i] = lambda[static_cast<int>(i)];
    out.point += out.multiplier[i] * pull[i];
    out.cost += out.multiplier[i] * missing[i];
  }
  return true;
}

}  // namespace

PlaneMinimum minimise_on_planes(const glm::dvec3& target, const glm::dmat3& metric,
                                std::span<const ContactPlane> planes, double tolerance) noexcept {
  PlaneMinimum result;
  result.point = target;
  if (planes.empty()) return result;
  const glm::dmat3 inverse_metric = glm::inverse(metric);
  for (int exchange = 0; exchange < kMaxExchanges; ++exchange) {
    std::uint32_t worst = 0;
    double depth = tolerance;
    for (std::uint32_t i = 0; i < planes.size(); ++i) {
      const double d = planes[i].offset - glm::dot(planes[i].normal, result.point);
      if (d > depth) {
        depth = d;
        worst = i;
      }
    }
    if (depth <= tolerance) return result;

    // Subsets of the old active planes, each with the new one added.
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
      if (!solve_subset(target, inverse_metric, planes, subset, c)) continue;
      bool valid = c.cost < best.cost;
      for (std::uint32_t i = 0; i < subset.count; ++i) valid = valid && c.multiplier[i] >= 0.0;
      for (std::uint32_t i = 0; i < result.active_count && valid; ++i) {
        const ContactPlane& p = planes[result.active[i]];
        valid = p.offset - glm::dot(p.normal, c.point) <= tolerance;
      }
      if (valid) {
        best = c;
        best_subset = subset;
      }
    }
    if (best_subset.count == 0) {
      result.feasible = false;
      return result;
    }
    result.point = best.point;
    result.active_count = best_subset.count;
    result.active = best_subset.plane;
    result.multiplier = best.multiplier;
  }
  result.feasible = false;
  return result;
}

}  // namespace polygon
