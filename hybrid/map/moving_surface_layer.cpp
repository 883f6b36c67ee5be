// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/map/moving_surface_layer.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <utility>

#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr double kFarthestDistrict = 1e9;  // largest coordinate; places further out are clamped to it

double largest(const glm::dvec3& v) noexcept {
  return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
}

// Half sizes of the axis-aligned bounding box of a box that has half sizes `half` and is rotated by `m`.
glm::dvec3 reach(const glm::dmat3& m, const glm::dvec3& half) noexcept {
  return glm::abs(m[0]) * half.x + glm::abs(m[1]) * half.y + glm::abs(m[2]) * half.z;
}

}  // namespace

void MovingSurfaceLayer::add(std::uint32_t object, std::uint64_t object_bit,
                             std::shared_ptr<const SurfaceCells> cells, const glm::dvec3& position,
                             const glm::dquat& rotation) {
  if (cells == nullptr || cells->empty()) return;
  Body body;
  body.bit = object_bit;
  body.cells = cells.get();
  body.object = object;
  body.middle_in_body = 0.5 * (cells->low() + cells->high());
  // The added cell keeps districts from being smaller than a cell.
  body.radius_m = 0.5 * glm::length(cells->high() - cells->low()) + cells->cell_m();
  body.owner = std::move(cells);
  set_pose(body, position, rotation);
  if (object >= body_of_object_.size()) body_of_object_.resize(object + 1, kNone);
  body_of_object_[object] = static_cast<std::uint32_t>(bodies_.size());
  district_m_ = std::max(district_m_, 2.0 * body.radius_m);
  bodies_.push_back(std::move(body));
  list_all();
}

void MovingSurfaceLayer::set_pose(Body& body, const glm::dvec3& position,
                                  const glm::dquat& rotation) noexcept {
  const glm::dmat3 to_scene = glm::mat3_cast(rotation);
  body.to_body = glm::transpose(to_scene);
  body.position = position;
  const glm::dvec3 middle = position + to_scene * body.middle_in_body;
  // Bound of the rounding errors of the position, of the transformation, and of a rotation that is a unit
  // quaternion only up to its last bits.
  body.slack_m =
      1e-9 * body.cells->cell_m() + 1e-15 * (largest(position) + largest(middle)) + 1e-14 * body.radius_m;
  const glm::dvec3 half =
      reach(to_scene, 0.5 * (body.cells->high() - body.cells->low())) + 2.0 * body.slack_m;
  body.low = middle - half;
  body.high = middle + half;
}

CellCoordinates MovingSurfaceLayer::district_of(const glm::dvec3& p) const noexcept {
  CellCoordinates c{};
  for (std::size_t d = 0; d < 3; ++d) {
    const double x =
        std::max(-kFarthestDistrict, std::min(p[static_cast<int>(d)] / district_m_, kFarthestDistrict));
    c[d] = static_cast<std::int32_t>(std::floor(x));
  }
  return c;
}

CellRange MovingSurfaceLayer::districts_of(const Body& body) const noexcept {
  // Uses the body's bounding ball instead of its box, so that turning in place changes no district.
  const glm::dvec3 middle = 0.5 * (body.low + body.high), ball(body.radius_m * (1.0 - 1e-12));
  return {district_of(middle - ball), district_of(middle + ball)};
}

std::size_t MovingSurfaceLayer::bucket_of(const CellCoordinates& district) const noexcept {
  std::uint64_t h = static_cast<std::uint32_t>(district[0]) * 0x9E3779B97F4A7C15ULL ^
                    static_cast<std::uint32_t>(district[1]) * 0xC2B2AE3D27D4EB4FULL ^
                    static_cast<std::uint32_t>(district[2]) * 0x165667B19E3779F9ULL;
  h ^= h >> 29;
  h *= 0xBF58476D1CE4E5B9ULL;
  return static_cast<std::size_t>(h >> 32) & (buckets_.size() - 1);
}

void MovingSurfaceLayer::list_all() {
  std::size_t buckets = 16;
  while (buckets < kSlots * bodies_.size()) buckets *= 2;
  buckets_.assign(buckets, kNone);
  nodes_.assign(kSlots * bodies_.size(), Node{});
  for (std::uint32_t b = 0; b < bodies_.size(); ++b) relist(b);
  changes_ = 0;
}

void MovingSurfaceLayer::list(std::uint32_t node, const CellCoordinates& district) noexcept {
  std::uint32_t& head = buckets_[bucket_of(district)];
  nodes_[node] = {district, head, true};
  head = node;
}

void MovingSurfaceLayer::unlist(std::uint32_t node) noexcept {
  std::uint32_t* link = &buckets_[bucket_of(nodes_[node].district)];
  while (*link != node) link = &nodes_[*link].next;
  *link = nodes_[node].next;
  nodes_[node].listed = false;
}

void MovingSurfaceLayer::relist(std::uint32_t body) noexcept {
  const CellRange now = districts_of(bodies_[body]);
  bodies_[body].districts = now;
  for (std::uint32_t slot = 0; slot < kSlots; ++slot) {
    // A slot stands for a parity of each coordinate. Of two neighbouring districts along an axis one is even,
    // so at most one district of the range belongs in this slot.
    CellCoordinates district = now.low;
    bool wanted = true;
    for (std::size_t d = 0; d < 3; ++d) {
      if ((static_cast<std::uint32_t>(district[d]) & 1U) != ((slot >> d) & 1U)) ++district[d];
      wanted = wanted && district[d] <= now.high[d];
    }
    const auto node = static_cast<std::uint32_t>(kSlots * body + slot);
    if (nodes_[node].listed == wanted && (!wanted || nodes_[node].district == district)) continue;
    if (nodes_[node].listed) unlist(node);
    if (wanted) list(node, district);
    ++changes_;
  }
}

void MovingSurfaceLayer::move(std::uint32_t object, const glm::dvec3& position,
                              const glm::dquat& rotation) noexcept {
  if (object >= body_of_object_.size() || body_of_object_[object] == kNone) return;
  const bool usable = polygon::is_finite(position) && std::isfinite(rotation.w) &&
                      std::isfinite(rotation.x) && std::isfinite(rotation.y) && std::isfinite(rotation.z);
  if (!usable) return;
  Body& body = bodies_[body_of_object_[object]];
  set_pose(body, position, rotation);
  const CellRange now = districts_of(body);
  if (now.low != body.districts.low || now.high != body.districts.high) relist(body_of_object_[object]);
}

bool MovingSurfaceLayer::box_in_body(const Body& body, const glm::dvec3& low, const glm::dvec3& high,
                                     glm::dvec3& low_in_body, glm::dvec3& high_in_body) noexcept {
  const bool apart = !(low.x <= body.high.x && high.x >= body.low.x && low.y <= body.high.y &&
                       high.y >= body.low.y && low.z <= body.high.z && high.z >= body.low.z);
  if (apart) return false;
  const glm::dvec3 centre = body.to_body * (0.5 * (low + high) - body.position);
  const glm::dvec3 half = reach(body.to_body, 0.5 * (high - low)) * (1.0 + 1e-12) + body.slack_m;
  low_in_body = centre - half;
  high_in_body = centre + half;
  return true;
}

template <class Visit>
void MovingSurfaceLayer::each(const glm::dvec3& low, const glm::dvec3& high, Visit&& visit) const noexcept {
  if (bodies_.empty()) return;
  CellCoordinates a{}, b{};
  bool all = bodies_.size() <= kTestAll;
  if (!all) {
    a = district_of(low);
    b = district_of(high);
    for (std::size_t d = 0; d < 3; ++d) all = all || b[d] - a[d] > 1;
  }
  if (all) {
    for (const Body& body : bodies_) {
      if (!visit(body)) return;
    }
    return;
  }
  CellCoordinates c{};
  for (c[2] = a[2]; c[2] <= b[2]; ++c[2]) {
    for (c[1] = a[1]; c[1] <= b[1]; ++c[1]) {
      for (c[0] = a[0]; c[0] <= b[0]; ++c[0]) {
        for (std::uint32_t n = buckets_[bucket_of(c)]; n != kNone; n = nodes_[n].next) {
          if (nodes_[n].district == c && !visit(bodies_[n / kSlots])) return;
        }
      }
    }
  }
}

bool MovingSurfaceLayer::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  bool any = false;
  each(low, high, [&](const Body& body) {
    glm::dvec3 l, h;
    any = box_in_body(body, low, high, l, h) && body.cells->any_near(l, h);
    return !any;
  });
  return any;
}

std::uint64_t MovingSurfaceLayer::objects_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  std::uint64_t objects = 0;
  each(low, high, [&](const Body& body) {
    glm::dvec3 l, h;
    if ((objects & body.bit) != 0 || !box_in_body(body, low, high, l, h)) return true;
    if (body.cells->objects_in(l, h) != 0) objects |= body.bit;
    return true;
  });
  return objects;
}

std::size_t MovingSurfaceLayer::occupied_cells() const noexcept {
  std::size_t cells = 0;
  for (const Body& body : bodies_) cells += body.cells->occupied_cells();
  return cells;
}

std::size_t MovingSurfaceLayer::memory_bytes() const noexcept {
  std::size_t bytes = bodies_.capacity() * sizeof(Body) + nodes_.capacity() * sizeof(Node) +
                      (body_of_object_.capacity() + buckets_.capacity()) * sizeof(std::uint32_t);
  for (const Body& body : bodies_) bytes += body.cells->memory_bytes();
  return bytes;
}

bool MovingSurfaceLayer::validate() const {
  std::size_t listed = 0, wanted = 0;
  for (std::size_t bucket = 0; bucket < buckets_.size(); ++bucket) {
    for (std::uint32_t n = buckets_[bucket]; n != kNone; n = nodes_[n].next) {
      const CellRange range = districts_of(bodies_[n / kSlots]);
      if (!nodes_[n].listed || bucket_of(nodes_[n].district) != bucket || ++listed > nodes_.size())
        return false;
      for (std::size_t d = 0; d < 3; ++d) {
        if (nodes_[n].district[d] < range.low[d] || nodes_[n].district[d] > range.high[d]) return false;
      }
    }
  }
  for (const Body& body : bodies_) {
    const CellRange range = districts_of(body);
    std::size_t districts = 1;
    for (std::size_t d = 0; d < 3; ++d)
      districts *= static_cast<std::size_t>(range.high[d] - range.low[d] + 1);
    if (districts > kSlots) return false;
    wanted += districts;
  }
  return listed == wanted;
}

}  // namespace hybrid
