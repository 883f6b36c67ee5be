// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/optimality_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

namespace polygon {
namespace {

constexpr FineReal kInfinity = std::numeric_limits<FineReal>::infinity();
// kTolerance and kFirstSearch are fractions of the mesh's size.
constexpr double kTolerance = 1e-12;    // depth that counts as rounding
constexpr double kFirstSearch = 1e-8;   // first search radius; enough for a converged proxy
constexpr double kSearchGrowth = 32.0;  // factor from one search to the next
// A few roundings of a double, relative to the largest coordinate.
constexpr double kRounding = 2e-15;
// Least skin, in multiples of kRounding times the largest coordinate, for meshes far from the origin.
constexpr double kSkinRoundings = 256.0;

constexpr FineReal kNegative = 1e-9L;  // relative to |q − goal|: a smaller negative multiplier counts as zero
// Relative to |q − goal|: a larger multiplier requires a touching triangle with its normal.
constexpr FineReal kActive = 1e-6L;
constexpr FineReal kSameNormal = 1e-5L;  // |difference| of unit normals that belong to one contact

}  // namespace

OptimalityReference::Search::Search(const ExactMesh& mesh, const glm::dvec3& goal, const glm::dvec3& proxy,
                                    double radius)
    : mesh_(mesh), goal_in_body_(goal), proxy_(proxy), goal_(FineVec(goal) - FineVec(proxy)) {
  const double coordinates =
      std::max(mesh.furthest(), std::max({std::abs(proxy.x), std::abs(proxy.y), std::abs(proxy.z)}));
  const double rounding = kRounding * coordinates;
  tolerance_ = kTolerance * mesh.size() + rounding;
  radius_ = std::max(radius, kSkin * mesh.size() + kSkinRoundings * rounding);
}

void OptimalityReference::Search::load(FineReal reach) {
  const FineReal all = radius_ + reach + tolerance_;
  mesh_.near_point(proxy_, static_cast<double>(all), ids_);
  triangles_.clear();
  for (const std::uint32_t id : ids_) {
    const NearTriangle t = near_triangle(id, mesh_.corners(id), proxy_);
    if (t.distance <= all) triangles_.push_back(t);
  }
  std::sort(triangles_.begin(), triangles_.end(),
            [](const NearTriangle& a, const NearTriangle& b) { return a.distance < b.distance; });
  last_violated_ = 0;
}

void OptimalityReference::Search::consider(const StationaryPoint& candidate) {
  const FineReal distance = glm::length(candidate.point);
  if (!(distance < best_ && distance <= limit_)) return;
  const FineReal pull = glm::length(candidate.point - goal_);
  for (const FineReal multiplier : candidate.multiplier) {
    if (multiplier < -kNegative * pull) return;
  }
  if (!contacts_are_real(candidate) || !is_reachable(candidate.point)) return;
  best_ = distance;
  best_point_ = candidate.point;
}

// Whether the point violates no triangle, and each normal with a positive multiplier belongs to a touching
// triangle. Distances close to the bound are decided exactly.
bool OptimalityReference::Search::contacts_are_real(const StationaryPoint& candidate) {
  const FineVec& q = candidate.point;
  const FineReal bearing = kActive * glm::length(q - goal_);
  std::array<bool, 3> real{};
  for (std::size_t i = 0; i < 3; ++i) real[i] = !(candidate.multiplier[i] > bearing);
  std::vector<std::uint32_t> close;
  const FineReal least = radius_ - 2.0L * tolerance_, most = radius_ + 2.0L * tolerance_;
  if (closest_on(triangles_[last_violated_], q).distance < least) return false;
  const FineReal moved = glm::length(q);
  for (std::size_t n = 0; n < triangles_.size() && triangles_[n].distance - moved <= most; ++n) {
    const NearTriangle& t = triangles_[n];
    const ClosestPoint place = closest_on(t, q);
    if (place.distance < least) {
      last_violated_ = n;
      return false;
    }
    if (place.distance > most) continue;
    close.push_back(t.id);
    const FineVec normal = unit(q - place.point);
    for (std::size_t i = 0; i < 3; ++i) {
      real[i] = real[i] || glm::length(normal - candidate.normal[i]) < kSameNormal;
    }
  }
  if (!(real[0] && real[1] && real[2])) return false;
  const FinePoint exact{proxy_, {q.x, q.y, q.z}};
  bool touches = false;
  for (const std::uint32_t id : close) {
    const double distance = mesh_.distance(exact, id);
    if (distance < radius_ - tolerance_) return false;
    touches = touches || distance <= radius_ + tolerance_;
  }
  return touches;
}

bool OptimalityReference::Search::is_crossed(const glm::dvec3& from, const glm::dvec3& to) const {
  for (const NearTriangle& t : triangles_) {
    // A proxy on the triangle itself may be on either side.
    if (from == proxy_ && t.distance <= tolerance_) continue;
    if (mesh_.crosses(from, to, t.id)) return true;
  }
  return false;
}

// Whether the ball's centre can move from the proxy to q, straight or on an arch over a convex edge. No
// surface can lie between two ball centres that are less than a radius apart.
bool OptimalityReference::Search::is_reachable(const FineVec& q) const {
  const FineReal distance = glm::length(q);
  if (distance < radius_) return true;
  const glm::dvec3 end = in_body(q);
  if (!is_crossed(proxy_, end)) return true;
  const FineVec up = unit(q - goal_);
  for (const FineReal height : {0.25L, 0.8L}) {
    const glm::dvec3 over = in_body(0.5L * q + height * distance * up);
    if (!is_crossed(proxy_, over) && !is_crossed(over, end)) return true;
  }
  return false;
}

bool OptimalityReference::Search::way_to_goal_is_free() const {
  std::vector<std::uint32_t> on_the_way;
  mesh_.near_segment(proxy_, goal_in_body_, static_cast<double>(radius_), on_the_way);
  for (const std::uint32_t id : on_the_way) {
    // A proxy that already penetrates must not go further in.
    const FineReal here = mesh_.distance({proxy_, {}}, id);
    const FineReal least = std::min(here, radius_) - tolerance_;
    if (mesh_.segment_distance(proxy_, goal_in_body_, id) < least) return false;
    if (mesh_.distance({goal_in_body_, {}}, id) < radius_ - tolerance_) return false;
  }
  return true;
}

double OptimalityReference::Search::clearance(double ball_radius) {
  if (triangles_.empty()) return mesh_.closest(proxy_).distance - ball_radius;
  double exact = std::numeric_limits<double>::infinity();
  for (const NearTriangle& t : triangles_) {
    if (t.distance > triangles_.front().distance * (1.0L + 1e-15L)) break;
    exact = std::min(exact, mesh_.distance({proxy_, {}}, t.id));
  }
  return exact - ball_radius;
}

NearestOptimum OptimalityReference::Search::run(double search_radius, double ball_radius) {
  NearestOptimum result;
  const FineReal to_goal = glm::length(goal_);
  const auto furthest = static_cast<FineReal>(search_radius);
  std::optional<bool> free;
  const auto goal_is_free = [&] {
    if (!free.has_value()) free = way_to_goal_is_free();
    return *free;
  };
  FineReal reach = std::min(furthest, kFirstSearch * static_cast<FineReal>(mesh_.size()) + 4.0L * tolerance_);
  for (bool first = true;; first = false, reach = std::min(furthest, kSearchGrowth * reach)) {
    const bool at_goal = to_goal <= std::min(reach, best_) && goal_is_free();
    if (!at_goal || first) search_within(at_goal ? 0.0L : reach);
    if (first) result.clearance_m = clearance(ball_radius);
    if (at_goal || best_ <= reach || reach >= furthest) break;
  }
  if (to_goal < best_ && goal_is_free()) {
    best_ = to_goal;
    best_point_ = goal_;
  }
  result.found = best_ < kInfinity;
  result.error_m = result.found ? static_cast<double>(best_) : search_radius;
  result.point = result.found ? in_body(best_point_) : proxy_;
  return result;
}

}  // namespace polygon
