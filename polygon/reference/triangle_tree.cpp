// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/triangle_tree.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

namespace polygon {
namespace {

constexpr std::uint32_t kLeaf = 2;         // most triangles in a leaf
constexpr std::size_t kTreeLevels = 64;    // 2^32 triangles, halved at each level, need 32
constexpr double kNoSpeed = 1e-300;        // stands for 0 in a way's direction, whose inverse must be finite
constexpr double kWidened = 1e-9;          // of a triangle's area: no gap opens between neighbours
constexpr double kBoxSlack = 1.0 + 1e-12;  // for the roundings of the test against a box
constexpr float kInfinite = std::numeric_limits<float>::infinity();

float float_below(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f : std::nextafterf(f, -kInfinite);
}
float float_above(double x) {
  return -float_below(-x);
}

struct Way {
  glm::dvec3 from, along, inverse;  // `along`: the whole way; `inverse`: 1 / along
  double radius;
};

Way make_way(const glm::dvec3& from, const glm::dvec3& to, double radius) {
  Way way{.from = from, .along = to - from, .inverse = {}, .radius = radius};
  for (int i = 0; i < 3; ++i)
    way.inverse[i] = 1.0 / (std::fabs(way.along[i]) > kNoSpeed ? way.along[i] : kNoSpeed);
  return way;
}

// The part of the way at which the ball's box enters the box. Infinite if it does not enter before `most`.
double enters(const Way& way, const std::array<float, 3>& low, const std::array<float, 3>& high,
              double most) {
  double in = 0.0, out = most;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<glm::length_t>(i);
    const double a = (static_cast<double>(low[i]) - way.radius - way.from[axis]) * way.inverse[axis];
    const double b = (static_cast<double>(high[i]) + way.radius - way.from[axis]) * way.inverse[axis];
    in = std::max(in, std::min(a, b));
    out = std::min(out, std::max(a, b));
  }
  return in <= out * kBoxSlack ? in : std::numeric_limits<double>::infinity();
}

// The part t of the way at which the centre's distance to a moving point falls to the radius. It is the
// lesser root of a t² + 2 b t + c = 0, or 0 for a ball that is too near already. Infinite if there is no
// root, or if the distance grows.
double meets(double a, double b, double c) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (b >= 0.0 || a <= 0.0) return kNever;
  if (c <= 0.0) return 0.0;
  const double square = b * b - a * c;
  return square < 0.0 ? kNever : (-b - std::sqrt(square)) / a;
}

void keep_nearer(SweptHit& best, double part, const glm::dvec3& away, const glm::dvec3& along) {
  const double length = glm::length(away);
  if (!(part < best.part) || !(length > 0.0) || glm::dot(away, along) >= 0.0) return;
  best = {.hit = true, .part = part, .normal = away / length};
}

using Corners = std::array<glm::dvec3, 3>;

bool is_over(const Corners& corner, const glm::dvec3& normal, const glm::dvec3& at) {
  const double area = glm::dot(normal, glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3& a = corner[i];
    if (glm::dot(normal, glm::cross(corner[(i + 1) % 3] - a, at - a)) < -kWidened * area) return false;
  }
  return true;
}

// A ball against the inside of a face. True: the ball meets the face, and meets no rim before it.
bool meet_face(const Way& way, const Corners& corner, const glm::dvec3& normal, SweptHit& best) {
  const double height = glm::dot(normal, way.from - corner[0]), speed = glm::dot(normal, way.along);
  const double side = height < 0.0 ? -1.0 : 1.0;
  if (side * speed >= 0.0) return false;
  const double part = std::max(0.0, (side * height - way.radius) / (-side * speed));
  if (part >= best.part || !is_over(corner, normal, way.from + part * way.along)) return false;
  best = {.hit = true, .part = part, .normal = side * normal};
  return true;
}

// The first hit of a moving ball on the side ab and on its corner a. The ball's centre then lies on a
// cylinder round the side, or on a sphere round the corner.
void meet_rim(const Way& way, const glm::dvec3& a, const glm::dvec3& b, SweptHit& best) {
  const glm::dvec3 side = b - a, at = way.from - a;
  const double ss = glm::dot(side, side), sw = glm::dot(side, way.along), sa = glm::dot(side, at);
  const double ww = glm::dot(way.along, way.along), wa = glm::dot(way.along, at), aa = glm::dot(at, at);
  const double r2 = way.radius * way.radius;
  if (ss > 0.0) {
    const double part = meets(ss * ww - sw * sw, ss * wa - sw * sa, ss * (aa - r2) - sa * sa);
    const double along = (sa + part * sw) / ss;
    if (part < best.part && along >= 0.0 && along <= 1.0)
      keep_nearer(best, part, at + part * way.along - along * side, way.along);
  }
  const double part = meets(ww, wa, aa - r2);
  if (part < best.part) keep_nearer(best, part, at + part * way.along, way.along);
}

// A moving ball against a triangle (Ericson, Real-Time Collision Detection, 2005, 5.5.6): the face shifted by
// the radius, then cylinders round the sides and balls round the corners.
void meet_triangle(const Way& way, const Corners& corner, const glm::dvec3& normal, SweptHit& best) {
  const double height = glm::dot(normal, way.from - corner[0]);
  const double end = height + best.part * glm::dot(normal, way.along);
  if (height * end > 0.0 && std::min(std::fabs(height), std::fabs(end)) > way.radius)
    return;  // the ball stays clear of the plane
  if (meet_face(way, corner, normal, best) || way.radius <= 0.0) return;
  for (std::size_t i = 0; i < 3; ++i) meet_rim(way, corner[i], corner[(i + 1) % 3], best);
}

}  // namespace

TriangleTree::TriangleTree(const TriangleMesh& mesh) {
  if (mesh.empty()) throw std::invalid_argument("the mesh has no triangle; a tree needs one at least");
  std::vector<Item> items(mesh.triangles.size());
  for (std::uint32_t i = 0; i < items.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const glm::dvec3 middle = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0;
    items[i] = {i,
                {static_cast<float>(middle.x), static_cast<float>(middle.y), static_cast<float>(middle.z)}};
  }
  faces_.reserve(items.size());
  nodes_.reserve(items.size() * 2);
  nodes_.emplace_back();
  split(mesh, items, 0, 0, static_cast<std::uint32_t>(items.size()));
  nodes_.shrink_to_fit();
  for (std::size_t i = 0; i < 3; ++i)
    size_m_ =
        std::max(size_m_, static_cast<double>(nodes_[0].high[i]) - static_cast<double>(nodes_[0].low[i]));
}

// Halves the triangles at the median of their middles, along the longest edge of the box round the middles.
void TriangleTree::split(const TriangleMesh& mesh, std::vector<Item>& items, std::uint32_t node,
                         std::uint32_t first, std::uint32_t count) {
  if (count <= kLeaf) {
    glm::dvec3 low(std::numeric_limits<double>::max()), high(-low);
    nodes_[node].first = static_cast<std::uint32_t>(faces_.size());
    nodes_[node].count = count;
    for (std::uint32_t i = first; i < first + count; ++i) {
      const auto& [a, b, c] = mesh.triangles[items[i].triangle];
      Face face{.corner = {mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}, .normal = glm::dvec3(0.0)};
      for (const glm::dvec3& v : face.corner) low = glm::min(low, v), high = glm::max(high, v);
      const glm::dvec3 square = glm::cross(face.corner[1] - face.corner[0], face.corner[2] - face.corner[0]);
      if (const double area = glm::length(square); area > 0.0) face.normal = square / area;
      faces_.push_back(face);
    }
    nodes_[node].low = {float_below(low.x), float_below(low.y), float_below(low.z)};
    nodes_[node].high = {float_above(high.x), float_above(high.y), float_above(high.z)};
    return;
  }
  std::array<float, 3> low{kInfinite, kInfinite, kInfinite}, high{-kInfinite, -kInfinite, -kInfinite};
  for (std::uint32_t i = first; i < first + count; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], items[i].middle[k]);
      high[k] = std::max(high[k], items[i].middle[k]);
    }
  }
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  }
  const std::uint32_t half = count / 2;
  const auto begin = items.begin() + first;
  std::nth_element(begin, begin + half, begin + count,
                   [axis](const Item& a, const Item& b) { return a.middle[axis] < b.middle[axis]; });
  const auto child = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  split(mesh, items, child, first, half);
  split(mesh, items, child + 1, first + half, count - half);
  nodes_[node].first = child;
  for (std::size_t k = 0; k < 3; ++k) {
    nodes_[node].low[k] = std::min(nodes_[child].low[k], nodes_[child + 1].low[k]);
    nodes_[node].high[k] = std::max(nodes_[child].high[k], nodes_[child + 1].high[k]);
  }
}

SweptHit TriangleTree::first_hit(const glm::dvec3& from, const glm::dvec3& to, double radius) const noexcept {
  const Way way = make_way(from, to, radius);
  struct Waiting {
    std::uint32_t node;
    double in;
  };
  std::array<Waiting, kTreeLevels> waiting{};
  std::size_t depth = 0;
  SweptHit best;
  std::uint32_t at = 0;
  double in = enters(way, nodes_[0].low, nodes_[0].high, best.part);
  while (true) {
    const Node& node = nodes_[at];
    if (in <= best.part && node.count == 0) {  // goes on with the child that the ball enters first
      const Node &a = nodes_[node.first], &b = nodes_[node.first + 1];
      const double in_a = enters(way, a.low, a.high, best.part), in_b = enters(way, b.low, b.high, best.part);
      const bool a_first = in_a <= in_b;
      const double later = a_first ? in_b : in_a;
      if (later <= best.part) waiting[depth++] = {node.first + (a_first ? 1U : 0U), later};
      at = node.first + (a_first ? 0U : 1U);
      in = a_first ? in_a : in_b;
      continue;
    }
    if (in <= best.part) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
        meet_triangle(way, faces_[i].corner, faces_[i].normal, best);
    }
    do {
      if (depth == 0) return best;
      --depth;
      at = waiting[depth].node;
      in = waiting[depth].in;
    } while (in > best.part);
  }
}

std::size_t TriangleTree::memory_bytes() const {
  return nodes_.capacity() * sizeof(Node) + faces_.capacity() * sizeof(Face);
}

}  // namespace polygon
