// SPDX-License-Identifier: GPL-3.0-or-later
// How far a proxy is from where it should be: the reference that every rigid error of this project is
// measured against. It shares nothing with the proxy: its own search tree (CGAL), its own closest points (in
// long double, then exact), its own solution of the conditions.
//
// A ball of radius r whose centre q wants to be at `goal` minimises |q − goal|² subject to
// distance(q, triangle) >= r for every triangle. Each of these distances is differentiable outside its
// triangle, so q* is optimal to first order (Karush, Kuhn and Tucker) when it is feasible and
// q* − goal = Σ λᵢ nᵢ, λᵢ >= 0, with nᵢ the unit vectors to q* from the closest points of triangles that
// touch there. Three of them are enough (Caratheodory), so points where one, two or three offset features
// (plane of a face, cylinder about an edge, ball about a corner) meet are all there is to try.
#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <memory>

#include "polygon/mesh/mesh.h"

namespace polygon {

struct NearestOptimum {
  bool found = false;        // within the search radius, or the goal itself
  glm::dvec3 point{0.0};     // q*; the proxy itself when nothing was found (unit: meter)
  double error_m = 0.0;      // |q* − proxy|; the search radius when nothing was found
  double clearance_m = 0.0;  // distance(proxy, mesh) − radius, below zero when the ball is in the surface
};

class FirstOrderReference {
 public:
  // Keeps its own copy of the mesh. Throws std::invalid_argument for an empty mesh, an index out of range or
  // a vertex that is not finite (or beyond 1e12 m).
  explicit FirstOrderReference(const TriangleMesh& mesh);
  FirstOrderReference(const FirstOrderReference&) = delete;
  FirstOrderReference& operator=(const FirstOrderReference&) = delete;
  FirstOrderReference(FirstOrderReference&&) = delete;
  FirstOrderReference& operator=(FirstOrderReference&&) = delete;
  ~FirstOrderReference();

  // The point nearest to `proxy` where the first-order conditions hold. All points in the body frame.
  //
  // A radius below 1e-9 of the mesh's size is that skin: the limit r → 0+, and the side of a sheet on which a
  // point stands is well defined. A point across the surface from the proxy does not count: the straight way
  // there, or one that bows out over a convex edge, must not cross a triangle. The goal itself is optimal
  // when the ball can go there straight (then nothing holds it, however far it is).
  // Where several points tie, the first found is given. `search_radius_m` bounds how far is looked. Work is
  // bounded too: for a proxy that is off by many features, the error may be that of a point further than the
  // nearest, never of a nearer one. A goal or proxy that is not finite: not found, the error infinite.
  // std::invalid_argument for a radius or a search radius below zero.
  [[nodiscard]] NearestOptimum nearest_optimum(const glm::dvec3& goal, const glm::dvec3& proxy, double radius,
                                               double search_radius_m) const;

  // To the nearest triangle (exact, rounded once).
  [[nodiscard]] double distance(const glm::dvec3& point) const;

  // Exact, by parity; false on the surface. Means nothing for an open mesh.
  [[nodiscard]] bool inside(const glm::dvec3& point) const;

  // For a closed convex mesh: the global optimum. A goal inside is pushed through the nearest face, a goal
  // nearer than the radius is pushed away, any other stays.
  [[nodiscard]] glm::dvec3 convex_optimum(const glm::dvec3& goal, double radius) const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  class Search;
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace polygon
