// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/optimality.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

#include "polygon/mesh/is_finite.h"
#include "polygon/reference/exact_mesh.h"
#include "polygon/reference/near_triangle.h"
#include "polygon/reference/optimality_search.h"
#include "polygon/reference/stationary_point.h"

namespace polygon {

struct OptimalityReference::Data {
  explicit Data(const TriangleMesh& soup) : mesh(soup) {}
  ExactMesh mesh;
};

OptimalityReference::OptimalityReference(const TriangleMesh& mesh) : data_(std::make_unique<Data>(mesh)) {}

OptimalityReference::~OptimalityReference() = default;

NearestOptimum OptimalityReference::nearest_optimum(const glm::dvec3& goal, const glm::dvec3& proxy,
                                                    double radius, double search_radius_m) const {
  if (!(radius >= 0.0) || !(search_radius_m >= 0.0)) {
    throw std::invalid_argument("a radius or search radius that is negative or not a number has no optimum");
  }
  if (!is_finite(goal) || !is_finite(proxy)) {
    return {false, proxy, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()};
  }
  return Search(data_->mesh, goal, proxy, radius).run(search_radius_m, radius);
}

double OptimalityReference::distance(const glm::dvec3& point) const {
  if (!is_finite(point)) return std::numeric_limits<double>::quiet_NaN();
  return data_->mesh.closest(point).distance;
}

bool OptimalityReference::inside(const glm::dvec3& point) const {
  return is_finite(point) && data_->mesh.inside(point);
}

glm::dvec3 OptimalityReference::convex_optimum(const glm::dvec3& goal, double radius) const {
  if (!is_finite(goal)) return goal;
  const ExactMesh::Closest closest = data_->mesh.closest(goal);
  const bool inside = data_->mesh.inside(goal);
  if (!inside && closest.distance >= radius) return goal;
  const NearTriangle t = near_triangle(closest.triangle, data_->mesh.corners(closest.triangle), goal);
  const FineVec touch = closest_on(t, FineVec(0.0L)).point;
  // On the surface itself the mesh's orientation gives the outward direction.
  FineVec out = closest.distance > 0.0 ? unit(inside ? touch : -touch) : t.normal;
  if (out == FineVec(0.0L)) out = t.normal;
  return glm::dvec3(FineVec(goal) + touch + static_cast<FineReal>(radius) * out);
}

std::size_t OptimalityReference::memory_bytes() const {
  return sizeof(*this) + data_->mesh.memory_bytes();
}

}  // namespace polygon
