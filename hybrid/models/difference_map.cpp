// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/models/difference_map.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <thread>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/tick/take_over.h"
#include "voxel/lattice/lattice.h"

namespace hybrid {
namespace {

// A contact has about the tool's radius. A surface with places a quarter of that apart is covered.
constexpr double kCovered = 0.25;
// The tool starts this share of its radius away from the surface.
constexpr double kAway = 0.05;

double widest_spacing_m(const BuiltScene& built) {
  double widest = 0.0;
  for (const auto& object : built.state->soft) widest = std::max(widest, object->lattice().max_spacing_m());
  return widest;
}

bool is_soft(const BuiltScene& built, const std::string& object) {
  return std::ranges::any_of(built.world->soft, [&](const SoftBody& body) { return body.name == object; });
}

// A force without tissue comes from a rigid object that covers the tissue.
bool is_blocked(const RestForce& rest) {
  return !rest.tissue && glm::length(rest.force_N) > 0.0;
}

}  // namespace

std::string why_no_difference_map(const World& a, const World& b) {
  return why_no_take_over(a, b);
}

// For a tool that is a point, the size of a voxel stands in for its radius.
DifferenceMap::DifferenceMap(const std::string& object, const polygon::TriangleMesh& surface,
                             const BuiltScene& a, const BuiltScene& b, double depth_m, double floor_N)
    : a_(a),
      b_(b),
      a_soft_(is_soft(a, object)),
      b_soft_(is_soft(b, object)),
      places_(surface, std::max({a.world->tool.radius_m, widest_spacing_m(a), widest_spacing_m(b)})),
      depth_m_(depth_m),
      floor_N_(floor_N),
      radius_m_(a.world->tool.radius_m),
      gap_m_(kCovered * std::max({radius_m_, widest_spacing_m(a), widest_spacing_m(b)})),
      most_way_m_(std::max({kAway * radius_m_, widest_spacing_m(a), widest_spacing_m(b)})) {}

// Voxels may reach beyond the surface, so the tool may have to start a little further out.
void DifferenceMap::press_at(Pressed& place, const std::atomic<bool>& stop) const {
  const glm::dvec3 device_m = place.at.at_m + (radius_m_ - depth_m_) * place.at.outward;
  const glm::dvec3 outside_m = place.at.at_m + (1.0 + kAway) * radius_m_ * place.at.outward;
  const auto a = press_to_rest(*a_.world, *a_.state, device_m, outside_m, most_way_m_, stop);
  if (!a || (a_soft_ && is_blocked(*a))) return;
  const auto b = press_to_rest(*b_.world, *b_.state, device_m, outside_m, most_way_m_, stop);
  if (!b || (b_soft_ && is_blocked(*b)) || stop.load(std::memory_order_relaxed)) return;
  place.known = true;
  place.jnd = jnd_of(b->force_N, a->force_N, floor_N_);
  place.a_N = glm::length(a->force_N);
  place.b_N = glm::length(b->force_N);
}

bool DifferenceMap::press(std::size_t places, std::size_t threads, const std::atomic<bool>& stop) {
  const std::size_t first = pressed_.size();
  for (std::size_t n = 0; n < places; ++n) {
    const auto place = places_.next(gap_m_);
    if (!place) break;
    pressed_.push_back({*place});
  }
  std::atomic<std::size_t> next{first};
  const auto work = [&] {
    const ScopedFlushToZero flushed;
    for (std::size_t n = next++; n < pressed_.size() && !stop; n = next++) press_at(pressed_[n], stop);
  };
  {
    std::vector<std::jthread> helpers;
    for (std::size_t t = 1; t < threads; ++t) helpers.emplace_back(work);
    work();
  }
  return !stop && pressed_.size() == first + places;
}

FeltDifference DifferenceMap::now() const {
  FeltDifference now{.places = pressed_.size(), .gap_m = places_.gap_m()};
  std::vector<float> values;
  for (const Pressed& place : pressed_) {
    values.push_back(place.known ? static_cast<float>(place.jnd) : std::numeric_limits<float>::quiet_NaN());
    if (!place.known) continue;
    if (now.pressed++ == 0 || place.jnd > now.most.jnd)
      now.most = {place.at.at_m, place.jnd, place.a_N, place.b_N};
  }
  now.jnd = places_.spread(values);
  double known_m2 = 0.0, felt_m2 = 0.0;
  for (std::size_t v = 0; v < now.jnd.size(); ++v) {
    if (std::isnan(now.jnd[v])) continue;
    known_m2 += places_.areas_m2()[v];
    if (now.jnd[v] > 1.0F) felt_m2 += places_.areas_m2()[v];
  }
  if (known_m2 > 0.0) now.share_felt = felt_m2 / known_m2;
  return now;
}

}  // namespace hybrid
