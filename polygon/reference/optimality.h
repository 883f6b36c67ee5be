// SPDX-License-Identifier: GPL-3.0-or-later
// Measures the distance of a proxy from the true constrained optimum. Every proxy error of this project is
// measured against this reference. The reference shares nothing with the proxy: it has its own search tree
// (CGAL), its own closest points (long double, then exact), and its own solution of the optimality
// conditions.
//
// The centre q of a ball of radius r minimises |q − goal|² subject to distance(q, triangle) >= r for every
// triangle. Each distance is differentiable outside its triangle. So an optimum q* satisfies the first-order
// conditions (Karush, Kuhn and Tucker): q* is feasible, and q* − goal = Σ λᵢ nᵢ with λᵢ >= 0. Here nᵢ is the
// unit vector to q* from the closest point of touching triangle i. At most three vectors are needed
// (Carathéodory). So there are three kinds of candidate: nearest points on one offset feature, and points
// where two or three offset features meet. The offset of a face is a plane, that of an edge a cylinder, and
// that of a corner a sphere.
#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <memory>

#include "polygon/mesh/mesh.h"

namespace polygon {

struct NearestOptimum {
  bool found = false;        // an optimum within the search radius, or the goal itself
  glm::dvec3 point{0.0};     // q*; the proxy itself if not found (unit: meter)
  double error_m = 0.0;      // |q* − proxy|; the search radius if not found
  double clearance_m = 0.0;  // distance(proxy, mesh) − radius; negative if the ball penetrates
};

class OptimalityReference {
 public:
  // Copies the mesh. Throws std::invalid_argument for an empty mesh, an index out of range, or a vertex that
  // is not finite or beyond 1e12 m.
  explicit OptimalityReference(const TriangleMesh& mesh);
  OptimalityReference(const OptimalityReference&) = delete;
  OptimalityReference& operator=(const OptimalityReference&) = delete;
  OptimalityReference(OptimalityReference&&) = delete;
  OptimalityReference& operator=(OptimalityReference&&) = delete;
  ~OptimalityReference();

  // The point nearest to `proxy` that satisfies the first-order conditions. All points are in the body frame.
  //
  // Radius: a radius below the skin (1e-9 of the mesh's size) is replaced by the skin. The skin stands for
  // the limit r → 0+, in which each point is on a definite side of a sheet.
  //
  // Reach: a point across the surface from the proxy does not count. The straight path from the proxy to the
  // point, or a path that arches over a convex edge, must not cross a triangle. The goal itself is optimal,
  // at any distance, if the ball can go straight to the goal. Of several equally near points the first one
  // found is returned.
  //
  // Bounds: `search_radius_m` bounds the search, and the amount of work is bounded too. So for a proxy that
  // is many features away from the optimum, a point further away may be returned. Then error_m is too large.
  // It is never too small.
  //
  // A goal or proxy that is not finite gives found == false and an infinite error. Throws
  // std::invalid_argument for a negative radius or search radius.
  [[nodiscard]] NearestOptimum nearest_optimum(const glm::dvec3& goal, const glm::dvec3& proxy, double radius,
                                               double search_radius_m) const;

  // Distance to the nearest triangle, exact and rounded once (unit: meter).
  [[nodiscard]] double distance(const glm::dvec3& point) const;

  // Whether the point is inside, exactly, by the parity of crossings. False on the surface. Undefined for an
  // open mesh.
  [[nodiscard]] bool inside(const glm::dvec3& point) const;

  // The global optimum for a closed convex mesh. A goal inside is pushed out through the nearest face, a goal
  // nearer than the radius is pushed away, and any other goal is returned.
  [[nodiscard]] glm::dvec3 convex_optimum(const glm::dvec3& goal, double radius) const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  class Search;
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace polygon
