// SPDX-License-Identifier: GPL-3.0-or-later
#include "hostile_meshes.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <map>
#include <random>
#include <tuple>

#include "polygon/primitives.h"

namespace tests {
namespace {

using glm::dvec3;
using polygon::TriangleIndices;

constexpr double kRadius = 0.05;

void add_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.push_back({a, b, c});
  mesh.triangles.push_back({a, c, d});
}

// A height field over given grid lines, closed by a bottom and four sides.
TriangleMesh block_under(const std::vector<double>& lines, const std::vector<double>& height, double bottom) {
  const auto n = static_cast<std::uint32_t>(lines.size());
  TriangleMesh mesh;
  for (const bool top : {true, false}) {
    for (std::uint32_t j = 0; j < n; ++j) {
      for (std::uint32_t i = 0; i < n; ++i)
        mesh.vertices.emplace_back(lines[i], lines[j], top ? height[j * n + i] : bottom);
    }
  }
  const std::uint32_t below = n * n;
  for (std::uint32_t j = 0; j + 1 < n; ++j) {
    for (std::uint32_t i = 0; i + 1 < n; ++i) {
      const std::uint32_t a = j * n + i;
      add_quad(mesh, a, a + 1, a + n + 1, a + n);
      add_quad(mesh, below + a, below + a + n, below + a + n + 1, below + a + 1);
    }
  }
  for (std::uint32_t k = 0; k + 1 < n; ++k) {
    const std::array<std::pair<std::uint32_t, std::uint32_t>, 4> rim{{{k, k + 1},
                                                                      {(k + 1) * n + n - 1, k * n + n - 1},
                                                                      {(n - 1) * n + k + 1, (n - 1) * n + k},
                                                                      {k * n, (k + 1) * n}}};
    add_quad(mesh, rim[0].first, below + rim[0].first, below + rim[0].second, rim[0].second);
    add_quad(mesh, rim[1].second, below + rim[1].second, below + rim[1].first, rim[1].first);
    add_quad(mesh, rim[2].first, below + rim[2].first, below + rim[2].second, rim[2].second);
    add_quad(mesh, rim[3].second, below + rim[3].second, below + rim[3].first, rim[3].first);
  }
  return mesh;
}

}  // namespace

TriangleMesh noisy_sphere(int subdivisions, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  TriangleMesh mesh = polygon::make_ball_mesh(kRadius, subdivisions);
  for (dvec3& v : mesh.vertices) v *= 1.0 + noise * u(random);
  return mesh;
}

TriangleMesh spiky_star(int subdivisions, double spike, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.5, 1.0);
  TriangleMesh mesh = polygon::make_ball_mesh(0.4 * kRadius, subdivisions);
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 8) mesh.vertices[i] *= 1.0 + spike * u(random);
  return mesh;
}

TriangleMesh terrain_block(int n, double roughness, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<double> lines, height;
  for (int i = 0; i <= n; ++i) lines.push_back(kRadius * (2.0 * i / n - 1.0));
  for (std::size_t k = 0; k < lines.size() * lines.size(); ++k) height.push_back(roughness * u(random));
  return block_under(lines, height, -0.5 * kRadius);
}

TriangleMesh unequal_block(int n, double growth, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::vector<double> lines, height;
  for (int i = -n; i <= n; ++i)
    lines.push_back(kRadius * (i == 0 ? 0.0 : std::copysign(std::pow(growth, std::abs(i) - n), i)));
  for (std::size_t k = 0; k < lines.size() * lines.size(); ++k) height.push_back(0.02 * kRadius * u(random));
  return block_under(lines, height, -0.5 * kRadius);
}

TriangleMesh torus(int around, int across, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  TriangleMesh mesh;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double a = glm::two_pi<double>() * i / around, b = glm::two_pi<double>() * j / across;
      const double minor = 0.3 * kRadius * (1.0 + noise * u(random));
      const double reach = 0.7 * kRadius + minor * std::cos(b);
      mesh.vertices.emplace_back(reach * std::cos(a), reach * std::sin(a), minor * std::sin(b));
    }
  }
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>((i % around) * across + j % across);
  };
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) add_quad(mesh, at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
  }
  return mesh;
}

TriangleMesh cubes(int n, double share, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::bernoulli_distribution filled(share);
  std::map<std::tuple<int, int, int>, bool> solid;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) solid[{i, j, k}] = filled(random);
    }
  }
  solid[{n / 2, n / 2, n / 2}] = true;
  TriangleMesh mesh;
  std::map<std::tuple<int, int, int>, std::uint32_t> number;
  const auto corner = [&](int i, int j, int k) {
    const auto [at, fresh] = number.try_emplace({i, j, k}, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (fresh) mesh.vertices.push_back(kRadius * (2.0 * dvec3(i, j, k) / static_cast<double>(n) - 1.0));
    return at->second;
  };
  const auto is_solid = [&](int i, int j, int k) {
    const auto found = solid.find({i, j, k});
    return found != solid.end() && found->second;
  };
  for (const auto& [at, here] : solid) {
    if (!here) continue;
    const auto [i, j, k] = at;
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {0, 1}) {
        std::array<int, 3> next{i, j, k};
        next[static_cast<std::size_t>(axis)] += side == 1 ? 1 : -1;
        if (is_solid(next[0], next[1], next[2])) continue;
        std::array<std::uint32_t, 4> quad{};
        for (std::size_t c = 0; c < 4; ++c) {
          std::array<int, 3> p{i, j, k};
          p[static_cast<std::size_t>(axis)] += side;
          p[static_cast<std::size_t>((axis + 1) % 3)] += c == 1 || c == 2 ? 1 : 0;
          p[static_cast<std::size_t>((axis + 2) % 3)] += c >= 2 ? 1 : 0;
          quad[c] = corner(p[0], p[1], p[2]);
        }
        if (side == 1) {
          add_quad(mesh, quad[0], quad[1], quad[2], quad[3]);
        } else {
          add_quad(mesh, quad[0], quad[3], quad[2], quad[1]);
        }
      }
    }
  }
  return mesh;
}

TriangleMesh cone(int sides) {
  TriangleMesh mesh;
  mesh.vertices = {{0.0, 0.0, kRadius}, {0.0, 0.0, -kRadius}};
  for (int i = 0; i < sides; ++i) {
    const double a = glm::two_pi<double>() * i / sides;
    mesh.vertices.emplace_back(kRadius * std::cos(a), kRadius * std::sin(a), -kRadius);
  }
  const auto count = static_cast<std::uint32_t>(sides);
  for (std::uint32_t i = 0; i < count; ++i) {
    mesh.triangles.push_back({0, 2 + i, 2 + (i + 1) % count});
    mesh.triangles.push_back({1, 2 + (i + 1) % count, 2 + i});
  }
  return mesh;
}

TriangleMesh uv_sphere(int around, int rings) {
  TriangleMesh mesh;
  mesh.vertices = {{0.0, 0.0, kRadius}, {0.0, 0.0, -kRadius}};
  for (int r = 1; r < rings; ++r) {
    for (int i = 0; i < around; ++i) {
      const double a = glm::two_pi<double>() * i / around, b = glm::pi<double>() * r / rings;
      mesh.vertices.push_back(kRadius *
                              dvec3(std::sin(b) * std::cos(a), std::sin(b) * std::sin(a), std::cos(b)));
    }
  }
  const auto at = [&](int r, int i) { return static_cast<std::uint32_t>(2 + (r - 1) * around + i % around); };
  for (int i = 0; i < around; ++i) {
    mesh.triangles.push_back({0, at(1, i), at(1, i + 1)});
    mesh.triangles.push_back({1, at(rings - 1, i + 1), at(rings - 1, i)});
    for (int r = 1; r + 1 < rings; ++r)
      add_quad(mesh, at(r, i), at(r + 1, i), at(r + 1, i + 1), at(r, i + 1));
  }
  return mesh;
}

TriangleMesh thin_plate() {
  return polygon::make_box_mesh({kRadius, kRadius, 1e-4 * kRadius}, 6);
}

TriangleMesh sheet(int n, double roughness, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  TriangleMesh mesh = polygon::make_plane_mesh(kRadius, n);
  for (dvec3& v : mesh.vertices) v.z += roughness * u(random);
  return mesh;
}

TriangleMesh crossed_sheets() {
  const double s = kRadius;
  TriangleMesh mesh;
  mesh.vertices = {{-s, -s, 0},
                   {s, -s, 0},
                   {s, s, 0},
                   {-s, s, 0},
                   {-s, 0.3 * s, -s},
                   {s, -0.2 * s, -s},
                   {s, -0.2 * s, s},
                   {-s, 0.3 * s, s},  // through the first
                   {0.3 * s, -s, 0},
                   {0.3 * s, s, 0},
                   {0.5 * s, s, 0.4 * s},
                   {0.5 * s, -s, 0.4 * s}};
  add_quad(mesh, 0, 1, 2, 3);
  add_quad(mesh, 4, 5, 6, 7);
  add_quad(mesh, 8, 9, 10, 11);  // stands on it
  return mesh;
}

TriangleMesh repeated(const TriangleMesh& mesh, int copies) {
  TriangleMesh many = mesh;
  for (int c = 1; c < copies; ++c) {
    for (const TriangleIndices& t : mesh.triangles)
      many.triangles.push_back(c % 2 == 1 ? TriangleIndices{t[0], t[2], t[1]} : t);
  }
  return many;
}

std::vector<HostileMesh> hostile_meshes(std::uint64_t seed) {
  return {{"noisy sphere", noisy_sphere(3, 0.06, seed)},
          {"rough sphere", noisy_sphere(4, 0.15, seed + 1)},
          {"star", spiky_star(3, 2.0, seed + 2)},
          {"terrain", terrain_block(24, 2e-3, seed + 3)},
          {"rough terrain", terrain_block(40, 4e-3, seed + 4)},
          {"unequal block", unequal_block(14, 2.0, seed + 5)},
          {"torus", torus(60, 30, 0.0, seed + 6)},
          {"rough torus", torus(50, 24, 0.2, seed + 7)},
          {"cubes", cubes(5, 0.5, seed + 8)},
          {"plate", thin_plate()},
          {"cone of 500", cone(500)},
          {"uv sphere", uv_sphere(400, 12)},
          {"repeated", repeated(noisy_sphere(2, 0.1, seed + 9), 5)},
          {"flat sheet", sheet(20, 0.0, seed + 10), false},
          {"rough sheet", sheet(24, 2e-3, seed + 11), false},
          {"crossed sheets", crossed_sheets(), false}};
}

}  // namespace tests
