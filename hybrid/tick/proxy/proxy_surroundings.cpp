// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/proxy/proxy_surroundings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

// A survey that finds more elements than it may list ends, and is repeated with the margin times kShrink.
// After kTries such surveys the limit is raised, and the first margin is tried again. The first limit is
// kMostOfGood times the target number. It applies only if the last survey found few elements, because the
// margin may then have grown in free space. The second limit is the usual size of a neighbourhood. The third
// one is for the pole of a fan, where very many triangles share a corner. With this limit the margin shrinks
// to its least value.
constexpr int kTries = 3;
constexpr double kMostOfGood = 4.0;  // (unit: the target number)
constexpr double kShrink = 0.125;
constexpr double kCentreAhead = 0.6;  // distance from the proxy to the centre of a survey (unit: margin)
// Height above the surface at which a ball's survey is centred (unit: margin), but at most the ball's radius.
// The survey then covers a larger ball of places, which reaches as far along the surface but has far fewer
// elements within touching distance (reach_of()).
constexpr double kLift = 4.0;
// Target number of elements in a survey. With fewer the proxy soon leaves the survey; more take long to read.
// A ball has more elements in contact range than a point has.
constexpr double kGoodCount = 16.0, kGoodUnderBall = 104.0;
// The margin doubles for a longer way only below this count (unit: elements). The next count is then at most
// four times as large along a surface, which a narrow survey may hold.
constexpr double kMostBeforeGrowth = 2.0 * kGoodCount;
// Work in units of one listed element: of a survey in addition to its elements, and of a renewed plane.
// kPlanesOfWork: number of planes that are read at the cost of one element.
constexpr std::uint32_t kWorkOfSurvey = 32, kWorkOfPlane = 2, kPlanesOfWork = 64;
// The proxy is at the pole of a fan if a survey with less than kPoleMargin times the last margin finds at
// least kPoleCount times the elements of the last survey.
constexpr double kPoleCount = 0.7;
constexpr double kPoleMargin = 0.6;
constexpr double kRangeGrowth = 4.0;  // growth of the range when it cut a step

double max_component(const glm::dvec3& v) noexcept {
  return std::max({v.x, v.y, v.z});
}

}  // namespace

// Renews the planes that `from` violates.
void ProxySurroundings::renew_planes(const glm::dvec3& from) noexcept {
  for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
    if (scope_.kind != Scope::Kind::all && (scope_.kind == Scope::Kind::only) != (o == scope_.object))
      continue;
    RigidState& near = state_.rigid[o];
    near.near.refresh_planes(*world_.rigid[o].surface, near.frame.to_body(from), radius_, rounding_);
  }
}

// Lists the objects near `point`, and surveys those whose known range does not cover it.
bool ProxySurroundings::survey_from(const glm::dvec3& point) noexcept {
  point_ = point;
  const double room = state_.look_m - radius_ - max_component(glm::abs(point_ - state_.look_at));
  if (scope_.kind == Scope::Kind::only) {
    state_.look_m = -1.0;  // the list would be that of the whole scene
  } else if (state_.look_m < 0.0 || room < 0.0 || query_cut_way_) {
    if (query_cut_way_) query_cells_ *= kRangeGrowth;  // too short a range for this motion
    state_.look_at = point_;
    state_.look_m = radius_ + query_cells_ * state_.map.cell_m();
    state_.look_mask = world_.use_map ? near_objects() : ~std::uint64_t{0};
    query_cut_way_ = false;
    // A neighbourhood out of range does not follow the proxy, which may come back on another side.
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      if (!in_scope(o) && !(scope_.kind == Scope::Kind::all_but && o == scope_.object))
        state_.rigid[o].near.forget();
    }
  }
  for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
    if (!in_scope(o)) continue;
    const glm::dvec3 view = state_.rigid[o].frame.to_body(point_);
    const bool ended = cutting_object_ == o + 1;
    if (!ended && state_.rigid[o].near.margin_left(view) > 0.0) continue;
    if (!survey(o, view, ended)) return false;
  }
  cutting_object_ = 0;
  return true;
}

// The bits of the objects within look_m of the viewpoint. If the scene has a single object, the element that
// holds the proxy gives the answer without a query. The map's answer would be the same.
std::uint64_t ProxySurroundings::near_objects() noexcept {
  if (world_.rigid.size() == 1 && state_.active_count > 0) {
    const glm::dvec3 view = state_.rigid[0].frame.to_body(point_);
    const double distance = world_.rigid[0].surface->closest(state_.active[0].element, view).distance;
    if (distance < state_.look_m - rounding_) return OccupancyMap::rigid_bit(0);
  }
  return state_.map.rigid_in(point_ - state_.look_m, point_ + state_.look_m, state_.map_trail);
}

bool ProxySurroundings::survey(std::uint32_t o, const glm::dvec3& view, bool moving) noexcept {
  RigidState& near = state_.rigid[o];
  const polygon::RigidSurface& surface = *world_.rigid[o].surface;
  const double smallest = 1e-6 * radius_ + 1e2 * rounding_;
  const double longest = glm::length(surface.upper() - surface.lower()) + radius_;
  if (surveys_ > 1 && near.counted < kMostBeforeGrowth) near.margin_m *= 2.0;  // too short for this motion
  near.margin_m = std::clamp(near.margin_m, std::min(4.0 * smallest, longest), longest);
  // Far from the object, the whole empty distance is the margin.
  const glm::dvec3 outside =
      glm::max(glm::max(surface.lower() - view, view - surface.upper()), glm::dvec3(0.0));
  const double apart = (glm::length(outside) - radius_) * (1.0 - 1e-9) - 4.0 * rounding_;
  if (apart > 2.0 * near.margin_m) {
    ++surveys_;
    work_ += kWorkOfSurvey;
    return near.near.survey(surface, view, apart, radius_, view);
  }
  const double margin = near.margin_m, good = good_count(margin);
  const std::array<std::uint32_t, 3> limits{static_cast<std::uint32_t>(kMostOfGood * good),
                                            polygon::Neighbourhood::kCapacity,
                                            polygon::Neighbourhood::kCrowdedCapacity};
  for (std::size_t l = near.counted < good ? 0 : 1; l < limits.size(); ++l) {
    near.margin_m = margin;
    const bool last = l + 1 == limits.size();
    for (int n = 0; last ? near.margin_m >= smallest : n < kTries; ++n) {
      const Reach reach = reach_of(near, view, moving);
      const bool complete = near.near.survey(surface, reach.centre, reach.margin, radius_, view, limits[l]);
      ++surveys_;
      work_ += kWorkOfSurvey + (complete ? near.near.size() : limits[l]);
      if (complete) {
        adapt_margin(near);
        return true;
      }
      near.margin_m *= kShrink;
    }
  }
  near.margin_m = radius_ + 1e3 * rounding_;
  state_.faults |= fault_triangle_overflow;
  return false;
}

// Centre and reach of a survey, such that the proxy may move by the margin along the surface, and further
// ahead. Let the centre be t above the surface, and let the reach be s. Then a ball of radius r may touch the
// elements within about sqrt(2 r (s − t)) of the contact. The higher the centre, the smaller s − t, and the
// fewer the elements.
ProxySurroundings::Reach ProxySurroundings::reach_of(const RigidState& near, const glm::dvec3& view,
                                                     bool moving) const noexcept {
  const double margin = near.margin_m;
  glm::dvec3 ahead =
      moving ? glm::transpose(near.frame.rotation) * direction_ * (kCentreAhead * margin) : glm::dvec3(0.0);
  double clearance = margin;
  glm::dvec3 up(0.0);
  for (std::uint32_t i = 0; i < near.near.size(); ++i) {
    const polygon::SeparatingPlane plane = near.near.plane(i);
    const double room = glm::dot(plane.normal, view) - plane.offset;
    if (!(room < clearance)) continue;
    clearance = room;
    up = plane.normal;
  }
  const double lift = std::min(kLift * margin, radius_);
  if (up == glm::dvec3(0.0) || lift < margin) return {view + ahead, margin};
  ahead -= glm::dot(ahead, up) * up;
  return {view + ahead + lift * up, std::sqrt(margin * margin + lift * lift)};
}

// The target number of elements in a survey.
double ProxySurroundings::good_count(double margin_m) const noexcept {
  return kGoodCount + kGoodUnderBall * radius_ / (radius_ + margin_m);
}

// The margin of the next survey, so that it finds neither too few elements nor too many if it can.
void ProxySurroundings::adapt_margin(RigidState& near) const noexcept {
  const double count = std::max(1.0, static_cast<double>(near.near.size()));
  const double good = good_count(near.margin_m);
  const bool pole = count > good && count >= kPoleCount * near.counted &&
                    near.margin_m < kPoleMargin * near.margin_counted_m;
  near.counted = count;
  near.margin_counted_m = near.margin_m;
  if (pole) {
    near.margin_m *= 2.0;
  } else if (surveys_ < 3 || count < good) {  // otherwise the way of this tick needs the margin
    near.margin_m *= std::clamp(std::sqrt(good / count), 0.5, 1.5);
  }
}

// The fraction of the straight way to q within the range that is known.
double ProxySurroundings::known_fraction(const glm::dvec3& q) noexcept {
  double fraction = 1.0;
  cutting_object_ = 0;
  query_cut_way_ = false;
  direction_ = q - point_;
  const double length = glm::length(direction_);
  if (length > 0.0) direction_ /= length;
  for (int d = 0; d < 3 && scope_.kind != Scope::Kind::only; ++d) {
    const double to = q[d] - point_[d];
    const double most = state_.look_m - radius_;
    const double ahead =
        to > 0.0 ? state_.look_at[d] + most - point_[d] : point_[d] - state_.look_at[d] + most;
    if (std::abs(to) * fraction > ahead) {
      fraction = std::max(0.0, ahead / std::abs(to));
      query_cut_way_ = true;
    }
  }
  for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
    if (!in_scope(o)) continue;
    const RigidState& near = state_.rigid[o];
    const glm::dvec3 a = near.frame.to_body(point_) - near.near.centre();
    const glm::dvec3 way = near.frame.to_body(q) - near.near.centre() - a;
    const double margin = near.near.margin();
    // |a + f way| = margin
    const double aa = glm::dot(way, way), ab = glm::dot(a, way), bb = glm::dot(a, a) - margin * margin;
    if (aa * fraction * fraction + 2.0 * ab * fraction + bb <= 0.0) continue;
    const double root = std::sqrt(std::max(0.0, ab * ab - aa * bb));
    const double f = std::max(0.0, (root - ab) / aa) * (1.0 - 1e-9);
    if (f >= fraction) continue;
    fraction = f;
    cutting_object_ = o + 1;
    query_cut_way_ = false;
  }
  return fraction;
}

// The element that the first `fraction` of the way to q meets first; kNobody if there is none.
ProxyPlane ProxySurroundings::first_in_the_way(const glm::dvec3& q, double fraction,
                                               std::span<const ProxyPlane> held) noexcept {
  ProxyPlane first{kNobody, 0, {}, true};
  double soonest = 2.0;
  for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
    if (in_scope(o)) first_in_object(o, q, fraction, held, first, soonest);
  }
  return first;
}

// A plane that was made from another viewpoint may stop the way before the way meets its element, but never
// lets it through. So the plane that stops the way first is made anew from the present viewpoint. This is
// repeated until the plane that stops the way first is a new one.
void ProxySurroundings::first_in_object(std::uint32_t o, const glm::dvec3& q, double fraction,
                                        std::span<const ProxyPlane> held, ProxyPlane& first,
                                        double& soonest) noexcept {
  using Violation = polygon::Neighbourhood::Violation;
  RigidState& near = state_.rigid[o];
  const glm::dvec3 view = near.frame.to_body(point_), goal = near.frame.to_body(q);
  const glm::dvec3 end = fraction == 1.0 ? goal : view + fraction * (goal - view);
  const double tolerance = 2.0 * rounding_;
  constexpr double kWholeWay = 2.0;  // no part of the way is cut
  const auto clear_part = [&](const polygon::SeparatingPlane& plane) {
    const auto depth = [&plane](const glm::dvec3& at) { return plane.offset - glm::dot(plane.normal, at); };
    // If only the first part of the way violates a plane, the proxy is on the wrong side by rounding. Such a
    // plane does not end the way.
    if (!(depth(end) > tolerance && depth(goal) > tolerance)) return kWholeWay;
    return polygon::Neighbourhood::fraction_before(plane, view, end);
  };
  std::span<Violation> violated = near.near.violated(view, end, tolerance);
  work_ += 1 + near.near.size() / kPlanesOfWork;
  const auto later = [&near](const Violation& a, const Violation& b) {
    return a.fraction > b.fraction ||
           (a.fraction == b.fraction && near.near.element(a.index) > near.near.element(b.index));
  };
  std::make_heap(violated.begin(), violated.end(), later);  // the soonest is first
  while (!violated.empty() && violated.front().fraction < soonest) {
    ProxyPlane candidate{o, near.near.element(violated.front().index), {}, true};
    if (violated.front().fresh) {
      soonest = violated.front().fraction;
      first = candidate;
      first.in_body = near.near.plane(violated.front().index);
      return;
    }
    std::pop_heap(violated.begin(), violated.end(), later);
    Violation& renewed = violated.back();
    work_ += kWorkOfPlane;
    const polygon::RigidSurface& surface = *world_.rigid[o].surface;
    renewed.fresh = true;
    if (!is_covered(candidate, held))
      candidate.in_body = polygon::separating_plane(surface, candidate.element, view, radius_);
    near.near.set_plane(renewed.index, candidate.in_body);
    renewed.fraction = clear_part(candidate.in_body);
    if (renewed.fraction < kWholeWay) {
      std::push_heap(violated.begin(), violated.end(), later);
    } else {
      violated = violated.first(violated.size() - 1);
    }
  }
}

// Does an active plane already separate the proxy from this element? On a convex surface one plane covers
// everything, so the proxy need not stop at each edge.
bool ProxySurroundings::is_covered(ProxyPlane& candidate,
                                   std::span<const ProxyPlane> held_planes) const noexcept {
  const polygon::RigidSurface& surface = *world_.rigid[candidate.object].surface;
  for (const ProxyPlane& held : held_planes) {
    if (held.object != candidate.object) continue;
    if (held.element != candidate.element && !(surface.support(candidate.element, held.in_body.normal) <=
                                               held.in_body.offset - radius_ + rounding_))
      continue;
    candidate.in_body = held.in_body;
    return true;
  }
  return false;
}

}  // namespace hybrid
