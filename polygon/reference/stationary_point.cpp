// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/stationary_point.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace polygon {
namespace {

constexpr int kMostIterations = 24;  // steps of Newton's method
// Normals count as dependent if the sine of their angle is smaller: the line common to their surfaces would
// be rounding error. The subset without one of these normals is tried anyway.
constexpr FineReal kDependent = 1e-9L;
// Step length relative to radius + reach at which the iteration ends. Newton's next relative step would be
// about its square.
constexpr FineReal kConverged = 1e-14L;
// If the curvature along the common line is smaller, no point counts as stationary.
constexpr FineReal kFlat = 1e-12L;
// A goal that is nearer to the feature than this fraction of the radius has no direction from it.
constexpr FineReal kOnAxis = 1e-15L;

// Distance of a point from a feature's plane, line or point, and its gradient.
struct Local {
  FineReal distance = 0.0L;
  FineVec normal{0.0L};
};

Local local(const OffsetFeature& feature, const FineVec& q) {
  FineVec away = q - feature.at;
  if (feature.kind == FeatureKind::face) return {glm::dot(feature.along, away), feature.along};
  if (feature.kind == FeatureKind::edge) away -= glm::dot(feature.along, away) * feature.along;
  const FineReal distance = glm::length(away);
  return {distance, distance > 0.0L ? away / distance : FineVec(0.0L)};
}

// ∇²distance · v: the component of v across the axis and the normal, divided by the distance. It is the
// change of the normal along v.
FineVec hessian_times(const OffsetFeature& feature, const Local& here, const FineVec& v) {
  if (feature.kind == FeatureKind::face) return FineVec(0.0L);
  FineVec across = v - glm::dot(v, here.normal) * here.normal;
  if (feature.kind == FeatureKind::edge) across -= glm::dot(v, feature.along) * feature.along;
  return across / here.distance;
}

struct Step {
  FineVec move{0.0L};
  std::array<FineReal, 3> multiplier{};
};

bool step_on_two(std::span<const OffsetFeature> features, const std::array<Local, 3>& here,
                 const FineVec& pull, FineReal radius, Step& step) {
  const FineVec &n0 = here[0].normal, &n1 = here[1].normal;
  const FineVec cross = glm::cross(n0, n1);
  const FineReal sine2 = glm::dot(cross, cross);
  if (!(sine2 > kDependent * kDependent)) return false;
  // The dual vectors are computed by cross products. For nearly parallel normals, n0 − (n0·n1)·n1 would lose
  // digits by cancellation.
  const FineVec dual0 = glm::cross(n1, cross) / sine2, dual1 = glm::cross(cross, n0) / sine2;
  step.multiplier = {glm::dot(pull, dual0), glm::dot(pull, dual1), 0.0L};
  const FineVec tangent = cross / std::sqrt(sine2);
  const FineVec back = (radius - here[0].distance) * dual0 + (radius - here[1].distance) * dual1;
  const auto hessian = [&](const FineVec& v) {
    return v - step.multiplier[0] * hessian_times(features[0], here[0], v) -
           step.multiplier[1] * hessian_times(features[1], here[1], v);
  };
  const FineReal curvature = glm::dot(tangent, hessian(tangent));
  if (!(std::abs(curvature) > kFlat)) return false;
  step.move = back - tangent * (glm::dot(tangent, pull + hessian(back)) / curvature);
  return true;
}

bool step_on_three(const std::array<Local, 3>& here, const FineVec& pull, FineReal radius, Step& step) {
  const std::array<FineVec, 3> cross{glm::cross(here[1].normal, here[2].normal),
                                     glm::cross(here[2].normal, here[0].normal),
                                     glm::cross(here[0].normal, here[1].normal)};
  const FineReal volume = glm::dot(here[0].normal, cross[0]);
  if (!(std::abs(volume) > kDependent * kDependent)) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    if (!(std::abs(volume) > kDependent * glm::length(cross[i]))) return false;
    step.move += cross[i] * ((radius - here[i].distance) / volume);
    step.multiplier[i] = glm::dot(pull, cross[i]) / volume;
  }
  return true;
}

}  // namespace

int stationary_on_one(const OffsetFeature& feature, const FineVec& goal, FineReal radius, const FineVec& from,
                      std::array<StationaryPoint, 2>& out) {
  Local at_goal = local(feature, goal);
  if (feature.kind == FeatureKind::face) {
    const FineReal push = radius - at_goal.distance;
    out[0] = {
        goal + push * at_goal.normal, {push, 0.0L, 0.0L}, {at_goal.normal, FineVec(0.0L), FineVec(0.0L)}};
    return 1;
  }
  if (!(at_goal.distance > kOnAxis * radius)) {
    at_goal = {
        0.0L,
        local(feature, from).normal};  // the goal is on the axis or centre, so every direction is stationary
    if (at_goal.normal == FineVec(0.0L)) return 0;
  }
  const FineVec foot = goal - at_goal.distance * at_goal.normal;
  int count = 0;
  for (const FineReal side : {1.0L, -1.0L}) {
    const FineVec normal = side * at_goal.normal;
    out[static_cast<std::size_t>(count++)] = {foot + radius * normal,
                                              {radius - side * at_goal.distance, 0.0L, 0.0L},
                                              {normal, FineVec(0.0L), FineVec(0.0L)}};
  }
  return count;
}

bool stationary_on_several(std::span<const OffsetFeature> features, const FineVec& goal, FineReal radius,
                           const FineVec& start, FineReal reach, StationaryPoint& out) {
  // If the radius is large, the surface hardly curves within the reach. Then an iterate that leaves the reach
  // will not return.
  const FineReal stray = 4.0L * (radius < reach ? reach + radius : reach);
  FineVec q = start;
  std::array<Local, 3> here;
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    for (std::size_t i = 0; i < features.size(); ++i) here[i] = local(features[i], q);
    const FineVec pull = q - goal;
    Step step;
    const bool solved = features.size() == 2 ? step_on_two(features, here, pull, radius, step)
                                             : step_on_three(here, pull, radius, step);
    if (!solved) return false;
    q += step.move;
    const FineReal moved = glm::length(step.move);
    if (!(glm::length(q - start) <= stray)) return false;
    if (moved > kConverged * (radius + reach)) continue;
    out.point = q;
    out.multiplier = step.multiplier;
    for (std::size_t i = 0; i < features.size(); ++i) out.normal[i] = here[i].normal;
    return true;
  }
  return false;
}

}  // namespace polygon
