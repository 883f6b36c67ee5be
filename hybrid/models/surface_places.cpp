// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/models/surface_places.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

namespace hybrid {
namespace {

constexpr float kNever = -1.0F;  // marks a vertex that cannot be a place, because it has no triangle
constexpr float kFar = std::numeric_limits<float>::max();

}  // namespace

SurfacePlaces::SurfacePlaces(const polygon::TriangleMesh& surface, double apart_m)
    : vertices_(surface.vertices.size()), all_(surface.vertices.size()), areas_m2_(surface.vertices.size()) {
  std::vector<glm::dvec3> normals(surface.vertices.size(), glm::dvec3(0.0));
  for (const polygon::TriangleIndices& t : surface.triangles) {
    const glm::dvec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]], &c = surface.vertices[t[2]];
    const glm::dvec3 twice = glm::cross(b - a, c - a);
    for (const std::uint32_t v : t) {
      normals[v] += twice;
      areas_m2_[v] += glm::length(twice) / 6.0;
    }
  }
  glm::dvec3 middle(0.0);
  double area = 0.0;
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    middle += areas_m2_[v] * surface.vertices[v];
    area += areas_m2_[v];
  }
  if (area > 0.0) middle /= area;
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    const double length = glm::length(normals[v]);
    vertices_[v].squared.fill(length > 0.0 ? kFar : kNever);
    if (!(length > 0.0)) continue;
    all_[v] = {surface.vertices[v], normals[v] / length};
    vertices_[v].at = glm::vec3(all_[v].at_m - middle);
    vertices_[v].facing = glm::vec3(apart_m * all_[v].outward);
  }
  // The first place is the vertex furthest from the middle.
  float furthest = -1.0F;
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    const float squared = glm::dot(vertices_[v].at, vertices_[v].at);
    if (vertices_[v].squared[0] == kNever || squared <= furthest) continue;
    furthest = squared;
    furthest_ = v;
  }
}

double SurfacePlaces::gap_m() const {
  return vertices_.empty() ? 0.0
                           : std::sqrt(static_cast<double>(std::max(vertices_[furthest_].squared[0], 0.0F)));
}

std::optional<SurfacePlace> SurfacePlaces::next(double gap_m) {
  if (!(this->gap_m() > gap_m)) return std::nullopt;
  const Vertex chosen = vertices_[furthest_];
  const SurfacePlace place = all_[furthest_];
  float most = -1.0F;
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    Vertex& vertex = vertices_[v];
    if (vertex.squared[0] == kNever) continue;
    const glm::vec3 by = vertex.at - chosen.at, turn = vertex.facing - chosen.facing;
    const float squared = glm::dot(by, by) + glm::dot(turn, turn);
    for (std::size_t n = 0; n < kNearest; ++n) {
      if (squared >= vertex.squared[n]) continue;
      std::copy_backward(vertex.squared.begin() + static_cast<std::ptrdiff_t>(n), vertex.squared.end() - 1,
                         vertex.squared.end());
      std::copy_backward(vertex.place.begin() + static_cast<std::ptrdiff_t>(n), vertex.place.end() - 1,
                         vertex.place.end());
      vertex.squared[n] = squared;
      vertex.place[n] = static_cast<std::uint32_t>(given_);
      break;
    }
    if (vertex.squared[0] > most) {
      most = vertex.squared[0];
      furthest_ = v;
    }
  }
  ++given_;
  return place;
}

std::vector<float> SurfacePlaces::spread(std::span<const float> of_places) const {
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> values(vertices_.size(), unknown);
  for (std::size_t v = 0; v < vertices_.size(); ++v) {
    const Vertex& vertex = vertices_[v];
    if (vertex.squared[0] == kNever || vertex.squared[0] == kFar || vertex.place[0] >= of_places.size())
      continue;
    const float nearest = of_places[vertex.place[0]];
    if (vertex.squared[0] == 0.0F || std::isnan(nearest)) {
      values[v] = nearest;
      continue;
    }
    // The furthest of the nearest places has weight 0, so that values do not jump where another place
    // replaces it.
    const bool few = vertex.squared.back() == kFar;
    const float reach = std::sqrt(vertex.squared.back());
    float sum = 0.0F, weights = 0.0F;
    for (std::size_t n = 0; n < kNearest; ++n) {
      if (vertex.squared[n] == kFar || vertex.place[n] >= of_places.size()) continue;
      const float value = of_places[vertex.place[n]], distance = std::sqrt(vertex.squared[n]);
      if (std::isnan(value)) continue;
      const float root = few ? 1.0F / distance : (reach - distance) / distance;
      sum += root * root * value;
      weights += root * root;
    }
    values[v] = weights > 0.0F ? sum / weights : nearest;
  }
  return values;
}

}  // namespace hybrid
