// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/world/contact_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <tuple>
#include <variant>

#include "polygon/surface/primitives.h"

namespace hybrid {
namespace {

constexpr double kEdgeSteps = 40.0;  // number of points on an edge as long as the shape's diagonal
constexpr double kAlongAxis = 0.5;   // distance of points on a capsule's axis (unit: its radius)
constexpr double kSharp = 0.03;      // sharpness beyond which an edge gets points
constexpr double kFlat = 1e-6;       // a vertex gets a point if the sharpness of its edges adds up to more

struct Weighed {
  glm::dvec3 at{0.0};
  double sharpness = 0.0;  // 0: flat; largest at a boundary or a corner
  std::array<std::uint32_t, 2> ends{};
  glm::dvec3 step{0.0};  // to the next point of the edge
};

struct Edge {
  std::uint32_t low, high, triangle;
  double sharpness = 0.0;  // 1 − cosine of the angle between its faces' normals; 2 unless it has two faces
  bool operator<(const Edge& other) const {
    return std::tie(low, high, triangle) < std::tie(other.low, other.high, other.triangle);
  }
};

class SharpPlaces {
 public:
  explicit SharpPlaces(const polygon::TriangleMesh& shape)
      : shape_(shape), at_vertex_(shape.vertices.size(), 0.0) {
    glm::dvec3 low(1e300), high(-1e300);
    for (const polygon::TriangleIndices& t : shape.triangles) {
      for (const auto v : t) {
        low = glm::min(low, shape.vertices[v]);
        high = glm::max(high, shape.vertices[v]);
      }
      normals_.push_back(normal_of(t));
    }
    step_m_ = glm::length(high - low) / kEdgeSteps;
    find_edges();
    for (const Edge& edge : edges_) {
      at_vertex_[edge.low] += edge.sharpness;
      at_vertex_[edge.high] += edge.sharpness;
    }
    std::vector<std::uint32_t> number(at_vertex_.size());
    for (std::size_t v = 0; v < at_vertex_.size(); ++v) {
      number[v] = static_cast<std::uint32_t>(points_.size());
      if (at_vertex_[v] > kFlat) points_.push_back({shape.vertices[v], at_vertex_[v]});
    }
    for (const Edge& edge : edges_) {
      if (edge.sharpness > kSharp) add_points_along(edge, {number[edge.low], number[edge.high]});
    }
  }

  [[nodiscard]] std::vector<Weighed> points() && { return std::move(points_); }
  [[nodiscard]] double step_m() const { return step_m_; }

 private:
  [[nodiscard]] glm::dvec3 normal_of(const polygon::TriangleIndices& t) const {
    const glm::dvec3& a = shape_.vertices[t[0]];
    const glm::dvec3 n = glm::cross(shape_.vertices[t[1]] - a, shape_.vertices[t[2]] - a);
    const double length = glm::length(n);
    return length > 0.0 ? n / length : glm::dvec3(0.0);
  }

  void find_edges() {
    std::vector<Edge> sides;
    sides.reserve(3 * shape_.triangles.size());
    for (std::uint32_t t = 0; t < shape_.triangles.size(); ++t) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::uint32_t a = shape_.triangles[t][c], b = shape_.triangles[t][(c + 1) % 3];
        if (a != b) sides.push_back({std::min(a, b), std::max(a, b), t});
      }
    }
    std::sort(sides.begin(), sides.end());
    for (std::size_t from = 0; from < sides.size();) {
      std::size_t to = from + 1;
      while (to < sides.size() && sides[to].low == sides[from].low && sides[to].high == sides[from].high)
        ++to;
      Edge edge = sides[from];
      edge.sharpness =
          to - from == 2 ? 1.0 - glm::dot(normals_[edge.triangle], normals_[sides[from + 1].triangle]) : 2.0;
      edges_.push_back(edge);
      from = to;
    }
  }

  void add_points_along(const Edge& edge, const std::array<std::uint32_t, 2>& ends) {
    const glm::dvec3 &a = shape_.vertices[edge.low], &b = shape_.vertices[edge.high];
    const int steps = static_cast<int>(std::ceil(glm::distance(a, b) / step_m_));
    for (int n = 1; n < steps; ++n)
      points_.push_back({glm::mix(a, b, static_cast<double>(n) / steps), edge.sharpness, ends,
                         (b - a) / (static_cast<double>(steps))});
  }

  const polygon::TriangleMesh& shape_;
  std::vector<glm::dvec3> normals_;
  std::vector<double> at_vertex_;
  std::vector<Edge> edges_;
  std::vector<Weighed> points_;
  double step_m_ = 0.0;
};

// Keeps the sharpest point of each cell of a grid. Cells grow until at most kMostSurfacePoints are left.
std::vector<SurfacePoint> thinned(std::vector<Weighed> points, double cell_m) {
  using Cell = std::tuple<double, double, double>;
  const bool whole = points.size() <= kMostSurfacePoints;
  while (points.size() > kMostSurfacePoints) {
    std::vector<std::pair<Cell, Weighed>> sorted;
    sorted.reserve(points.size());
    for (const Weighed& p : points) {
      const glm::dvec3 cell = glm::floor(p.at / cell_m);
      sorted.push_back({{cell.x, cell.y, cell.z}, p});
    }
    std::stable_sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first < b.first : a.second.sharpness > b.second.sharpness;
    });
    points.clear();
    for (std::size_t n = 0; n < sorted.size(); ++n) {
      if (n == 0 || sorted[n].first != sorted[n - 1].first) points.push_back(sorted[n].second);
    }
    cell_m *= std::sqrt(2.0);
  }
  std::vector<SurfacePoint> result;
  result.reserve(points.size());
  for (const Weighed& p : points) {
    SurfacePoint point;
    point.at_m = p.at;
    const double reach_m = glm::length(p.step);
    if (whole && reach_m > 0.0) {
      point.ends = p.ends;
      point.along = p.step / reach_m;
      point.reach_m = reach_m;
    }
    result.push_back(point);
  }
  return result;
}

std::vector<SurfacePoint> points_of(const polygon::TriangleMesh& shape) {
  SharpPlaces places(shape);
  const double step_m = places.step_m();
  return thinned(std::move(places).points(), step_m);
}

}  // namespace

std::vector<SurfacePoint> surface_points(const RigidSource& source, const polygon::TriangleMesh& shape) {
  if (const auto* ball = std::get_if<BallPrimitive>(&source))
    return {{.at_m = glm::dvec3(0.0), .radius_m = ball->radius_m, .ends = {}, .along = {}}};
  if (const auto* capsule = std::get_if<CapsulePrimitive>(&source)) {
    const int steps =
        std::clamp(static_cast<int>(std::ceil(capsule->length_m / (kAlongAxis * capsule->radius_m))), 1,
                   static_cast<int>(kMostSurfacePoints) - 1);
    std::vector<SurfacePoint> result;
    for (int n = 0; n <= steps; ++n) {
      const double along = (static_cast<double>(n) / steps - 0.5) * capsule->length_m;
      result.push_back({.at_m = {0.0, 0.0, along}, .radius_m = capsule->radius_m, .ends = {}, .along = {}});
    }
    return result;
  }
  // Drawn meshes of boxes and sheets have many triangles, which cut the object's edges into pieces. Undivided
  // meshes are used instead.
  if (const auto* box = std::get_if<BoxPrimitive>(&source))
    return points_of(polygon::make_box_mesh(0.5 * box->size_m, 1));
  if (const auto* sheet = std::get_if<PlanePrimitive>(&source))
    return points_of(polygon::make_plane_mesh(0.5 * sheet->size_m, 1));
  return points_of(shape);
}

}  // namespace hybrid
