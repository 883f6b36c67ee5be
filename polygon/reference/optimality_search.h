// SPDX-License-Identifier: GPL-3.0-or-later
// The search for one optimum. optimality_candidates.cpp enumerates points that satisfy the conditions on a
// subset of nearby features. optimality_search.cpp accepts a candidate if its contacts are real and the proxy
// can reach it. It grows the search region until a candidate is accepted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <span>
#include <vector>

#include "polygon/reference/exact_mesh.h"
#include "polygon/reference/near_triangle.h"
#include "polygon/reference/optimality.h"
#include "polygon/reference/stationary_point.h"

namespace polygon {

// Least radius, as a fraction of the mesh's size. It stands for the limit r → 0+.
inline constexpr double kSkin = 1e-9;

struct NearFeature {
  OffsetFeature surface;
  FineVec end{0.0L};  // only for an edge: its other end
};

struct SearchCell {
  FineVec centre{0.0L};
  FineReal half = 0.0L;   // half of the cube's side
  FineReal reach = 0.0L;  // radius around the centre that contains the cell
  FineReal nearest = 0.0L;
  int depth = 0;
  std::vector<std::uint32_t> triangles;  // that may touch a ball centred in the cell

  // Puts the nearest cell at the top of a heap.
  bool operator<(const SearchCell& other) const { return nearest > other.nearest; }
};

// One query. Coordinates are relative to the proxy, so that long double resolves the small differences that
// matter.
class OptimalityReference::Search {
 public:
  Search(const ExactMesh& mesh, const glm::dvec3& goal, const glm::dvec3& proxy, double radius);
  NearestOptimum run(double search_radius, double ball_radius);

 private:
  void load(FineReal reach);
  void search_within(FineReal reach);
  [[nodiscard]] bool collect_features(SearchCell& cell, std::vector<NearFeature>& features) const;
  void add_features(const NearTriangle& t, const FineVec& centre, const ClosestPoint& place, FineReal slack,
                    std::vector<NearFeature>& features) const;
  void try_singles(std::span<const NearFeature> features);
  void try_subsets(const SearchCell& cell, std::span<const NearFeature> features);
  void try_from(std::span<const OffsetFeature> subset, const FineVec& start, FineReal reach);
  [[nodiscard]] bool outside_normal_cone(const SearchCell& cell) const;
  void consider(const StationaryPoint& candidate);
  [[nodiscard]] bool contacts_are_real(const StationaryPoint& candidate);
  [[nodiscard]] bool is_reachable(const FineVec& q) const;
  [[nodiscard]] bool is_crossed(const glm::dvec3& from, const glm::dvec3& to) const;
  [[nodiscard]] bool way_to_goal_is_free() const;
  [[nodiscard]] double clearance(double ball_radius);

  [[nodiscard]] glm::dvec3 in_body(const FineVec& q) const { return glm::dvec3(FineVec(proxy_) + q); }

  const ExactMesh& mesh_;
  glm::dvec3 goal_in_body_;
  glm::dvec3 proxy_;
  FineVec goal_;
  FineReal radius_;
  FineReal tolerance_;
  FineReal limit_ = 0.0L;                                      // candidates further away are ignored
  FineReal best_ = std::numeric_limits<FineReal>::infinity();  // distance of best_point_
  FineVec best_point_{0.0L};
  std::vector<std::uint32_t> ids_;
  std::vector<NearTriangle> triangles_;  // within radius_ + the current reach of the proxy, nearest first
  // Index of the triangle that last ruled out a candidate; it is tested first.
  std::size_t last_violated_ = 0;
};

}  // namespace polygon
