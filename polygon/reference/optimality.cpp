// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/optimality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <queue>
#include <span>
#include <stdexcept>
#include <vector>

#include "polygon/reference/exact_mesh.h"
#include "polygon/reference/near_triangle.h"
#include "polygon/reference/stationary_point.h"

namespace polygon {
namespace {

constexpr FineReal kInfinity = std::numeric_limits<FineReal>::infinity();
// Of the mesh's size:
constexpr double kSkin = 1e-9;          // the radius of a point
constexpr double kTolerance = 1e-12;    // depth that is rounding
constexpr double kFirstSearch = 1e-8;   // a converged proxy is found there, among a handful of features
constexpr double kSearchGrowth = 32.0;  // from one search to the next
// Of the coordinates' size: a few roundings of a double.
constexpr double kRounding = 2e-15;
constexpr double kSkinRoundings = 256.0;  // far from the origin the skin has to be more than they are

constexpr FineReal kNegative = 1e-9L;      // a multiplier above minus this, of |q − goal|, is zero
constexpr FineReal kActive = 1e-6L;        // a multiplier above this, of |q − goal|, needs its contact
constexpr FineReal kNarrow = 1.5L;         // a cone's half angle, less than a right one: it is convex
constexpr FineReal kSameNormal = 1e-5L;    // |difference| of unit normals that are one contact's
constexpr std::size_t kFewFeatures = 8;    // few enough to try all subsets of three
constexpr std::size_t kManyFeatures = 24;  // beyond it triples are not tried in the smallest cells
constexpr int kDeepest = 6;                // halvings of a cell
constexpr std::uint64_t kMostWork = 8000;  // closest points and systems solved in one search

struct NearFeature {
  OffsetFeature surface;
  FineVec end{0.0L};  // of an edge
};

struct Cell {
  FineVec centre{0.0L};
  FineReal half = 0.0L;   // of the cube's side
  FineReal reach = 0.0L;  // no point of it is further from the centre
  FineReal nearest = 0.0L;
  int depth = 0;
  std::vector<std::uint32_t> triangles;  // those that may touch a ball in it

  bool operator<(const Cell& other) const { return nearest > other.nearest; }  // the top of a heap is nearest
};

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

bool same(const NearFeature& a, const NearFeature& b, FineReal tolerance) {
  if (a.surface.kind != b.surface.kind) return false;
  const FineVec &p = a.surface.at, &q = b.surface.at;
  switch (a.surface.kind) {
    case FeatureKind::corner:
      return p == q;
    case FeatureKind::edge:
      return (p == q && a.end == b.end) || (p == b.end && a.end == q);
    case FeatureKind::face:
      return glm::length(a.surface.along - b.surface.along) < 1e-15L &&
             std::abs(glm::dot(a.surface.along, p - q)) < 0.01L * tolerance;
  }
  return false;
}

}  // namespace

struct FirstOrderReference::Data {
  explicit Data(const TriangleMesh& soup) : mesh(soup) {}
  ExactMesh mesh;
};

// One question. All coordinates are from the proxy, where long double resolves what matters.
class FirstOrderReference::Search {
 public:
  Search(const ExactMesh& mesh, const glm::dvec3& goal, const glm::dvec3& proxy, double radius);
  NearestOptimum run(double search_radius, double ball_radius);

 private:
  void load(FineReal reach);
  void look_within(FineReal reach);
  [[nodiscard]] bool describe(Cell& cell, std::vector<NearFeature>& features) const;
  void add_features(const NearTriangle& t, const FineVec& centre, const Place& place, FineReal slack,
                    std::vector<NearFeature>& features) const;
  void try_singles(std::span<const NearFeature> features);
  void try_subsets(const Cell& cell, std::span<const NearFeature> features);
  void try_from(std::span<const OffsetFeature> subset, const FineVec& start, FineReal reach);
  [[nodiscard]] bool pulls_elsewhere(const Cell& cell) const;
  void consider(const StationaryPoint& candidate);
  [[nodiscard]] bool contacts_are_real(const StationaryPoint& candidate);
  [[nodiscard]] bool connected(const FineVec& q) const;
  [[nodiscard]] bool crossed(const glm::dvec3& from, const glm::dvec3& to) const;
  [[nodiscard]] bool way_to_goal_is_free() const;
  [[nodiscard]] double clearance(double ball_radius);

  [[nodiscard]] glm::dvec3 in_body(const FineVec& q) const { return glm::dvec3(FineVec(proxy_) + q); }

  const ExactMesh& mesh_;
  glm::dvec3 goal_in_body_;
  glm::dvec3 proxy_;
  FineVec goal_;
  FineReal radius_;
  FineReal tolerance_;
  FineReal limit_ = 0.0L;      // nothing further is of interest now
  FineReal best_ = kInfinity;  // distance of best_point_
  FineVec best_point_{0.0L};
  std::vector<std::uint32_t> ids_;
  std::vector<NearTriangle> triangles_;  // all within radius_ + the present reach, nearest first
  std::size_t last_in_the_way_ = 0;      // of them: as likely as not it rules out the next candidate too
};

FirstOrderReference::Search::Search(const ExactMesh& mesh, const glm::dvec3& goal, const glm::dvec3& proxy,
                                    double radius)
    : mesh_(mesh), goal_in_body_(goal), proxy_(proxy), goal_(FineVec(goal) - FineVec(proxy)) {
  const double coordinates =
      std::max(mesh.furthest(), std::max({std::abs(proxy.x), std::abs(proxy.y), std::abs(proxy.z)}));
  const double rounding = kRounding * coordinates;
  tolerance_ = kTolerance * mesh.size() + rounding;
  radius_ = std::max(radius, kSkin * mesh.size() + kSkinRoundings * rounding);
}

void FirstOrderReference::Search::load(FineReal reach) {
  const FineReal all = radius_ + reach + tolerance_;
  mesh_.near_point(proxy_, static_cast<double>(all), ids_);
  triangles_.clear();
  for (const std::uint32_t id : ids_) {
    const NearTriangle t = near_triangle(id, mesh_.corners(id), proxy_);
    if (t.distance <= all) triangles_.push_back(t);
  }
  std::sort(triangles_.begin(), triangles_.end(),
            [](const NearTriangle& a, const NearTriangle& b) { return a.distance < b.distance; });
  last_in_the_way_ = 0;
}

// Which features can touch a ball of the radius whose centre is at most `slack` from `centre`: projection to
// a convex set and what it leaves over both move by no more than the point does, so the place and the way
// from it tell what is out of reach.
void FirstOrderReference::Search::add_features(const NearTriangle& t, const FineVec& centre,
                                               const Place& place, FineReal slack,
                                               std::vector<NearFeature>& features) const {
  const auto add = [&](const NearFeature& feature) {
    for (const NearFeature& other : features) {
      if (same(feature, other, tolerance_)) return;
    }
    features.push_back(feature);
  };
  const FineVec away = centre - place.point;
  if (t.flat) {
    const FineReal height = glm::dot(away, t.normal);
    if (glm::length(away - height * t.normal) <= slack) {
      if (height > 0.0L || radius_ <= slack) add({{FeatureKind::face, t.corner[0], t.normal}, {}});
      if (height < 0.0L || radius_ <= slack) add({{FeatureKind::face, t.corner[0], -t.normal}, {}});
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const FineReal along = glm::dot(away, t.side[i]);
    if (along <= slack && glm::dot(away, -t.side[(i + 2) % 3]) <= slack &&
        glm::length(place.point - t.corner[i]) <= slack) {
      add({{FeatureKind::corner, t.corner[i], {}}, {}});
    }
    if (t.side[i] == FineVec(0.0L) || !(std::abs(along) <= slack)) continue;
    if (t.flat && glm::dot(away, glm::cross(t.normal, t.side[i])) > slack) continue;
    if (place_on_side(t, i, place.point).distance > slack) continue;
    add({{FeatureKind::edge, t.corner[i], t.side[i]}, t.corner[(i + 1) % 3]});
  }
}

// Keeps of the cell's triangles those that matter, and lists their features. False: no ball fits there, or
// none touches anything.
bool FirstOrderReference::Search::describe(Cell& cell, std::vector<NearFeature>& features) const {
  features.clear();
  const FineReal slack = cell.reach * (1.0L + 1e-9L) + tolerance_;
  std::size_t kept = 0;
  for (const std::uint32_t i : cell.triangles) {
    const Place place = place_on(triangles_[i], cell.centre);
    if (place.distance < radius_ - slack) return false;
    if (place.distance > radius_ + slack) continue;
    cell.triangles[kept++] = i;
    add_features(triangles_[i], cell.centre, place, slack, features);
  }
  cell.triangles.resize(kept);
  return kept > 0;
}

void FirstOrderReference::Search::try_singles(std::span<const NearFeature> features) {
  std::array<StationaryPoint, 2> found;
  for (const NearFeature& feature : features) {
    const int count = stationary_on_one(feature.surface, goal_, radius_, FineVec(0.0L), found);
    for (int i = 0; i < count; ++i) consider(found[static_cast<std::size_t>(i)]);
  }
}

void FirstOrderReference::Search::try_from(std::span<const OffsetFeature> subset, const FineVec& start,
                                           FineReal reach) {
  StationaryPoint found;
  if (stationary_on_several(subset, goal_, radius_, start, reach, found)) consider(found);
}

void FirstOrderReference::Search::try_subsets(const Cell& cell, std::span<const NearFeature> features) {
  const bool triples = features.size() <= kManyFeatures;
  const FineVec* corner = nullptr;
  for (const NearFeature& feature : features) {
    if (feature.surface.kind == FeatureKind::corner) corner = &feature.surface.at;
  }
  std::array<OffsetFeature, 3> subset;
  const auto attempt = [&](std::size_t count) {
    const std::span<const OffsetFeature> chosen(subset.data(), count);
    try_from(chosen, cell.centre, cell.reach);
    if (radius_ >= cell.reach || corner == nullptr) return;
    // A ball much smaller than the cell: where round surfaces meet, Newton's method needs to begin at their
    // own scale, which is about the corner they share.
    FineVec faces(0.0L);
    bool round = false;
    for (const OffsetFeature& f : chosen) {
      if (f.kind == FeatureKind::face) faces += f.along;
      round = round || f.kind != FeatureKind::face;
    }
    if (!round) return;
    const FineVec out = unit(*corner - goal_);
    for (const FineVec& way : {out, unit(faces), unit(out + unit(faces))}) {
      if (way != FineVec(0.0L)) try_from(chosen, *corner + radius_ * way, radius_);
    }
  };
  for (std::size_t i = 0; i < features.size(); ++i) {
    subset[0] = features[i].surface;
    for (std::size_t j = i + 1; j < features.size(); ++j) {
      subset[1] = features[j].surface;
      attempt(2);
      for (std::size_t k = j + 1; triples && k < features.size(); ++k) {
        subset[2] = features[k].surface;
        attempt(3);
      }
    }
  }
}

// All normals that a ball in the cell can meet lie in one cone, and the pull from the goal does not.
bool FirstOrderReference::Search::pulls_elsewhere(const Cell& cell) const {
  if (radius_ <= 2.0L * cell.reach) return false;
  const FineVec pull = cell.centre - goal_;
  const FineReal strength = glm::length(pull);
  if (!(strength > 2.0L * cell.reach)) return false;
  FineVec sum(0.0L);
  for (const std::uint32_t i : cell.triangles) {
    sum += unit(cell.centre - place_on(triangles_[i], cell.centre).point);
  }
  const FineVec axis = unit(sum);
  FineReal widest = 0.0L;
  for (const std::uint32_t i : cell.triangles) {
    const FineVec away = cell.centre - place_on(triangles_[i], cell.centre).point;
    const FineReal spread = std::asin(std::min(1.0L, cell.reach / glm::length(away)));
    widest = std::max(widest, std::acos(std::clamp(glm::dot(unit(away), axis), -1.0L, 1.0L)) + spread);
  }
  const FineReal angle = std::acos(std::clamp(glm::dot(pull / strength, axis), -1.0L, 1.0L));
  return widest < kNarrow && angle > widest + std::asin(cell.reach / strength) + 1e-9L;
}

void FirstOrderReference::Search::look_within(FineReal reach) {
  limit_ = reach;
  load(reach);
  if (triangles_.empty()) return;
  Cell root;
  root.half = root.reach = reach;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) root.triangles.push_back(i);
  std::vector<NearFeature> features;
  const std::vector<std::uint32_t> all = root.triangles;
  if (!describe(root, features)) return;
  try_singles(features);

  const FineReal resolved = 2.0L * (kSkin * static_cast<FineReal>(mesh_.size()) + tolerance_);
  if (best_ <= resolved) return;
  root.half = root.reach = std::min(reach, best_);
  root.triangles = all;
  std::priority_queue<Cell> queue;
  queue.push(std::move(root));
  for (std::uint64_t work = 0; work < kMostWork && !queue.empty() && best_ > resolved;) {
    Cell cell = queue.top();
    queue.pop();
    if (cell.nearest >= std::min(best_, limit_)) return;
    work += 4 + cell.triangles.size();
    if (!describe(cell, features)) continue;
    if (features.size() <= kFewFeatures || cell.depth == kDeepest) {
      try_singles(features);
      try_subsets(cell, features);
      work +=
          features.size() * features.size() * (features.size() <= kManyFeatures ? features.size() : 3) / 6;
      continue;
    }
    if (pulls_elsewhere(cell)) continue;
    for (int octant = 0; octant < 8; ++octant) {
      Cell child;
      child.half = 0.5L * cell.half;
      child.reach = child.half * std::sqrt(3.0L);
      child.depth = cell.depth + 1;
      const FineVec toward((octant & 1) != 0 ? 1 : -1, (octant & 2) != 0 ? 1 : -1,
                           (octant & 4) != 0 ? 1 : -1);
      child.centre = cell.centre + child.half * toward;
      child.nearest = glm::length(glm::max(glm::abs(child.centre) - child.half, FineVec(0.0L)));
      child.triangles = cell.triangles;
      queue.push(std::move(child));
    }
  }
}

void FirstOrderReference::Search::consider(const StationaryPoint& candidate) {
  const FineReal distance = glm::length(candidate.point);
  if (!(distance < best_ && distance <= limit_)) return;
  const FineReal pull = glm::length(candidate.point - goal_);
  for (const FineReal multiplier : candidate.multiplier) {
    if (multiplier < -kNegative * pull) return;
  }
  if (!contacts_are_real(candidate) || !connected(candidate.point)) return;
  best_ = distance;
  best_point_ = candidate.point;
}

// The point is no nearer to any triangle than the radius, and each normal that bears load belongs to a
// triangle that touches: decided exactly where long double is close to the bound.
bool FirstOrderReference::Search::contacts_are_real(const StationaryPoint& candidate) {
  const FineVec& q = candidate.point;
  const FineReal bearing = kActive * glm::length(q - goal_);
  std::array<bool, 3> real{};
  for (std::size_t i = 0; i < 3; ++i) real[i] = !(candidate.multiplier[i] > bearing);
  std::vector<std::uint32_t> close;
  const FineReal least = radius_ - 2.0L * tolerance_, most = radius_ + 2.0L * tolerance_;
  if (place_on(triangles_[last_in_the_way_], q).distance < least) return false;
  const FineReal moved = glm::length(q);
  for (std::size_t n = 0; n < triangles_.size() && triangles_[n].distance - moved <= most; ++n) {
    const NearTriangle& t = triangles_[n];
    const Place place = place_on(t, q);
    if (place.distance < least) {
      last_in_the_way_ = n;
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

bool FirstOrderReference::Search::crossed(const glm::dvec3& from, const glm::dvec3& to) const {
  for (const NearTriangle& t : triangles_) {
    // A proxy on the triangle itself stands on either side.
    if (from == proxy_ && t.distance <= tolerance_) continue;
    if (mesh_.crosses(from, to, t.id)) return true;
  }
  return false;
}

// Can the centre go there, straight or in a bow over a convex edge? Two places less than a radius apart have
// nothing between them.
bool FirstOrderReference::Search::connected(const FineVec& q) const {
  const FineReal distance = glm::length(q);
  if (distance < radius_) return true;
  const glm::dvec3 end = in_body(q);
  if (!crossed(proxy_, end)) return true;
  const FineVec up = unit(q - goal_);
  for (const FineReal height : {0.25L, 0.8L}) {
    const glm::dvec3 over = in_body(0.5L * q + height * distance * up);
    if (!crossed(proxy_, over) && !crossed(over, end)) return true;
  }
  return false;
}

bool FirstOrderReference::Search::way_to_goal_is_free() const {
  std::vector<std::uint32_t> on_the_way;
  mesh_.near_segment(proxy_, goal_in_body_, static_cast<double>(radius_), on_the_way);
  for (const std::uint32_t id : on_the_way) {
    // A proxy that is already in the surface only must not go further in.
    const FineReal here = mesh_.distance({proxy_, {}}, id);
    const FineReal least = std::min(here, radius_) - tolerance_;
    if (mesh_.segment_distance(proxy_, goal_in_body_, id) < least) return false;
    if (mesh_.distance({goal_in_body_, {}}, id) < radius_ - tolerance_) return false;
  }
  return true;
}

double FirstOrderReference::Search::clearance(double ball_radius) {
  if (triangles_.empty()) return mesh_.closest(proxy_).distance - ball_radius;
  double exact = std::numeric_limits<double>::infinity();
  for (const NearTriangle& t : triangles_) {
    if (t.distance > triangles_.front().distance * (1.0L + 1e-15L)) break;
    exact = std::min(exact, mesh_.distance({proxy_, {}}, t.id));
  }
  return exact - ball_radius;
}

NearestOptimum FirstOrderReference::Search::run(double search_radius, double ball_radius) {
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
    if (!at_goal || first) look_within(at_goal ? 0.0L : reach);
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

FirstOrderReference::FirstOrderReference(const TriangleMesh& mesh) : data_(std::make_unique<Data>(mesh)) {}

FirstOrderReference::~FirstOrderReference() = default;

NearestOptimum FirstOrderReference::nearest_optimum(const glm::dvec3& goal, const glm::dvec3& proxy,
                                                    double radius, double search_radius_m) const {
  if (!(radius >= 0.0) || !(search_radius_m >= 0.0)) {
    throw std::invalid_argument("a radius or search radius that is negative or not a number has no optimum");
  }
  if (!is_finite(goal) || !is_finite(proxy)) {
    return {false, proxy, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()};
  }
  return Search(data_->mesh, goal, proxy, radius).run(search_radius_m, radius);
}

double FirstOrderReference::distance(const glm::dvec3& point) const {
  if (!is_finite(point)) return std::numeric_limits<double>::quiet_NaN();
  return data_->mesh.closest(point).distance;
}

bool FirstOrderReference::inside(const glm::dvec3& point) const {
  return is_finite(point) && data_->mesh.inside(point);
}

glm::dvec3 FirstOrderReference::convex_optimum(const glm::dvec3& goal, double radius) const {
  if (!is_finite(goal)) return goal;
  const ExactMesh::Closest closest = data_->mesh.closest(goal);
  const bool inside = data_->mesh.inside(goal);
  if (!inside && closest.distance >= radius) return goal;
  const NearTriangle t = near_triangle(closest.triangle, data_->mesh.corners(closest.triangle), goal);
  const FineVec touch = place_on(t, FineVec(0.0L)).point;
  // On the surface itself a closed mesh's own orientation says where out is.
  FineVec out = closest.distance > 0.0 ? unit(inside ? touch : -touch) : t.normal;
  if (out == FineVec(0.0L)) out = t.normal;
  return glm::dvec3(FineVec(goal) + touch + static_cast<FineReal>(radius) * out);
}

std::size_t FirstOrderReference::memory_bytes() const {
  return sizeof(*this) + data_->mesh.memory_bytes();
}

}  // namespace polygon
