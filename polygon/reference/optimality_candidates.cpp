// SPDX-License-Identifier: GPL-3.0-or-later
// Enumerates candidates. An octree divides the space around the proxy, nearest cells first, until few
// features can touch a ball centred in a cell. Then every subset of one, two or three features is solved.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <queue>

#include "polygon/reference/optimality_search.h"

namespace polygon {
namespace {

// Largest half angle of a cone of normals (rad). It is below a right angle, so that the cone is convex.
constexpr FineReal kNarrow = 1.5L;
constexpr std::size_t kFewFeatures = 8;    // few enough to try all subsets of three
constexpr std::size_t kManyFeatures = 24;  // with more features, no triples are tried
constexpr int kDeepest = 6;                // largest number of subdivisions of a cell
constexpr std::uint64_t kMostWork =
    8000;  // bound on closest points computed plus systems solved, in one search

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

// Adds the features of a triangle that can touch a ball whose centre is within `slack` of `centre`. A
// triangle is convex, so the projection of a point onto it is a nonexpansive function of the point. So is the
// vector from the projection to the point. Therefore a feature whose condition fails by more than `slack` at
// the centre cannot touch.
void OptimalityReference::Search::add_features(const NearTriangle& t, const FineVec& centre,
                                               const ClosestPoint& place, FineReal slack,
                                               std::vector<NearFeature>& features) const {
  const auto add = [&](const NearFeature& feature) {
    for (const NearFeature& other : features) {
      if (same(feature, other, tolerance_)) return;
    }
    features.push_back(feature);
  };
  const FineVec away = centre - place.point;
  if (t.has_area) {
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
    if (t.has_area && glm::dot(away, glm::cross(t.normal, t.side[i])) > slack) continue;
    if (closest_on_side(t, i, place.point).distance > slack) continue;
    add({{FeatureKind::edge, t.corner[i], t.side[i]}, t.corner[(i + 1) % 3]});
  }
}

// Keeps the triangles that can touch a ball centred in the cell, and lists their features. False if every
// such ball penetrates a triangle, or none touches anything.
bool OptimalityReference::Search::collect_features(SearchCell& cell,
                                                   std::vector<NearFeature>& features) const {
  features.clear();
  const FineReal slack = cell.reach * (1.0L + 1e-9L) + tolerance_;
  std::size_t kept = 0;
  for (const std::uint32_t i : cell.triangles) {
    const ClosestPoint place = closest_on(triangles_[i], cell.centre);
    if (place.distance < radius_ - slack) return false;
    if (place.distance > radius_ + slack) continue;
    cell.triangles[kept++] = i;
    add_features(triangles_[i], cell.centre, place, slack, features);
  }
  cell.triangles.resize(kept);
  return kept > 0;
}

void OptimalityReference::Search::try_singles(std::span<const NearFeature> features) {
  std::array<StationaryPoint, 2> found;
  for (const NearFeature& feature : features) {
    const int count = stationary_on_one(feature.surface, goal_, radius_, FineVec(0.0L), found);
    for (int i = 0; i < count; ++i) consider(found[static_cast<std::size_t>(i)]);
  }
}

void OptimalityReference::Search::try_from(std::span<const OffsetFeature> subset, const FineVec& start,
                                           FineReal reach) {
  StationaryPoint found;
  if (stationary_on_several(subset, goal_, radius_, start, reach, found)) consider(found);
}

void OptimalityReference::Search::try_subsets(const SearchCell& cell, std::span<const NearFeature> features) {
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
    // The ball is smaller than the cell. Newton's method must then start at the scale of the round offset
    // surfaces, near the corner that they share.
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

// True if all contact normals of balls centred in the cell lie in one convex cone, and the direction from the
// goal lies outside it. Then no point of the cell is optimal.
bool OptimalityReference::Search::outside_normal_cone(const SearchCell& cell) const {
  if (radius_ <= 2.0L * cell.reach) return false;
  const FineVec pull = cell.centre - goal_;
  const FineReal strength = glm::length(pull);
  if (!(strength > 2.0L * cell.reach)) return false;
  FineVec sum(0.0L);
  for (const std::uint32_t i : cell.triangles) {
    sum += unit(cell.centre - closest_on(triangles_[i], cell.centre).point);
  }
  const FineVec axis = unit(sum);
  FineReal widest = 0.0L;
  for (const std::uint32_t i : cell.triangles) {
    const FineVec away = cell.centre - closest_on(triangles_[i], cell.centre).point;
    const FineReal spread = std::asin(std::min(1.0L, cell.reach / glm::length(away)));
    widest = std::max(widest, std::acos(std::clamp(glm::dot(unit(away), axis), -1.0L, 1.0L)) + spread);
  }
  const FineReal angle = std::acos(std::clamp(glm::dot(pull / strength, axis), -1.0L, 1.0L));
  return widest < kNarrow && angle > widest + std::asin(cell.reach / strength) + 1e-9L;
}

void OptimalityReference::Search::search_within(FineReal reach) {
  limit_ = reach;
  load(reach);
  if (triangles_.empty()) return;
  SearchCell root;
  root.half = root.reach = reach;
  for (std::uint32_t i = 0; i < triangles_.size(); ++i) root.triangles.push_back(i);
  std::vector<NearFeature> features;
  const std::vector<std::uint32_t> all = root.triangles;
  if (!collect_features(root, features)) return;
  try_singles(features);

  const FineReal resolved = 2.0L * (kSkin * static_cast<FineReal>(mesh_.size()) + tolerance_);
  if (best_ <= resolved) return;
  root.half = root.reach = std::min(reach, best_);
  root.triangles = all;
  std::priority_queue<SearchCell> queue;
  queue.push(std::move(root));
  for (std::uint64_t work = 0; work < kMostWork && !queue.empty() && best_ > resolved;) {
    SearchCell cell = queue.top();
    queue.pop();
    if (cell.nearest >= std::min(best_, limit_)) return;
    work += 4 + cell.triangles.size();
    if (!collect_features(cell, features)) continue;
    if (features.size() <= kFewFeatures || cell.depth == kDeepest) {
      try_singles(features);
      try_subsets(cell, features);
      work +=
          features.size() * features.size() * (features.size() <= kManyFeatures ? features.size() : 3) / 6;
      continue;
    }
    if (outside_normal_cone(cell)) continue;
    for (int octant = 0; octant < 8; ++octant) {
      SearchCell child;
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

}  // namespace polygon
