// SPDX-License-Identifier: GPL-3.0-or-later
// References for closest points, written to be obviously right rather than fast.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <random>

#include "polygon/mesh.h"

namespace tests {

using Real = long double;
struct Vec {
  Real x = 0, y = 0, z = 0;
  Vec(Real px, Real py, Real pz) : x(px), y(py), z(pz) {}
  explicit Vec(const glm::dvec3& v) : x(v.x), y(v.y), z(v.z) {}
};
inline Vec operator-(const Vec& a, const Vec& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec operator+(const Vec& a, const Vec& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec operator*(const Vec& a, Real s) {
  return {a.x * s, a.y * s, a.z * s};
}
inline Real dot(const Vec& a, const Vec& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Real length(const Vec& a) {
  return std::sqrt(dot(a, a));
}

inline Real segment_distance(const Vec& p, const Vec& a, const Vec& b) {
  const Vec ab = b - a;
  const Real l2 = dot(ab, ab);
  const Real t = l2 > 0 ? std::clamp(dot(p - a, ab) / l2, Real(0), Real(1)) : Real(0);
  return length(p - (a + ab * t));
}

// Least of the three edges and, where the foot of the perpendicular lies inside, the plane; in long double.
inline double triangle_distance(const glm::dvec3& point, const polygon::TriangleMesh& mesh,
                                std::size_t triangle) {
  const polygon::TriangleIndices& t = mesh.triangles[triangle];
  const Vec p(point), a(mesh.vertices[t[0]]), b(mesh.vertices[t[1]]), c(mesh.vertices[t[2]]);
  Real best = std::min({segment_distance(p, a, b), segment_distance(p, b, c), segment_distance(p, c, a)});
  const Vec n = cross(b - a, c - a);
  if (dot(n, n) > 0) {
    const Vec foot = p - n * (dot(p - a, n) / dot(n, n));
    const bool in = dot(cross(b - a, foot - a), n) >= 0 && dot(cross(c - b, foot - b), n) >= 0 &&
                    dot(cross(a - c, foot - c), n) >= 0;
    if (in) best = std::min(best, length(p - foot));
  }
  return static_cast<double>(best);
}

// Sum of solid angles over 4π (van Oosterom and Strackee 1983): 1 inside a closed, outward mesh, 0 outside.
inline double winding_number(const glm::dvec3& point, const polygon::TriangleMesh& mesh) {
  Real sum = 0;
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    const Vec p(point);
    const Vec a = Vec(mesh.vertices[t[0]]) - p, b = Vec(mesh.vertices[t[1]]) - p,
              c = Vec(mesh.vertices[t[2]]) - p;
    const Real la = length(a), lb = length(b), lc = length(c);
    sum +=
        2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return static_cast<double>(sum / (4 * std::numbers::pi_v<Real>));
}

inline double signed_volume(const polygon::TriangleMesh& mesh) {
  Real sum = 0;
  const Vec o(mesh.vertices[0]);
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    sum +=
        dot(Vec(mesh.vertices[t[0]]) - o, cross(Vec(mesh.vertices[t[1]]) - o, Vec(mesh.vertices[t[2]]) - o)) /
        6;
  }
  return static_cast<double>(sum);
}

inline glm::dvec3 random_point(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> u(-half, half);
  const double x = u(random), y = u(random), z = u(random);
  return {x, y, z};
}

// Triangles of all shapes about the origin: fat, slivers, segments and points.
inline polygon::TriangleMesh random_soup(std::mt19937_64& random, std::size_t triangles, double size) {
  polygon::TriangleMesh mesh;
  for (std::size_t i = 0; i < triangles; ++i) {
    const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
    const glm::dvec3 a = random_point(random, size);
    const glm::dvec3 u = random_point(random, 0.2 * size), v = random_point(random, 0.2 * size);
    mesh.vertices.push_back(a);
    mesh.vertices.push_back(i % 19 == 7 ? a : a + u);
    switch (i % 5) {
      case 0:
        mesh.vertices.push_back(a + 2.0 * u);
        break;  // on one line
      case 1:
        mesh.vertices.push_back(a + 0.4 * u + 1e-7 * v);
        break;  // a sliver
      default:
        mesh.vertices.push_back(a + v);
    }
    if (i % 23 == 11) mesh.vertices[base + 2] = mesh.vertices[base + 1] = a;
    mesh.triangles.push_back({base, base + 1, base + 2});
  }
  return mesh;
}

}  // namespace tests
