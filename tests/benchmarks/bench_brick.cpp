// SPDX-License-Identifier: GPL-3.0-or-later
// Time for the force on a node under either soft energy, on one thread. One lattice fits into the cache, the
// other does not.
#include <benchmark/benchmark.h>

#include <array>
#include <cstddef>
#include <vector>

#include "voxel/fem/hex_forces.h"
#include "voxel/lattice/simd_dispatch.h"

namespace {

struct Field {
  std::size_t n;
  std::array<std::vector<float>, 3> u, force;

  explicit Field(std::size_t nodes) : n(nodes) {
    for (std::size_t a = 0; a < 3; ++a) {
      u[a].resize(n * n * n);
      force[a].assign(n * n * n, 0.0F);
      for (std::size_t v = 0; v < u[a].size(); ++v) u[a][v] = 1e-4F * static_cast<float>((v * 37 + a) % 101);
    }
  }
  [[nodiscard]] voxel::NodeField view() const {
    const auto s = static_cast<std::ptrdiff_t>(n);
    return {{u[0].data(), u[1].data(), u[2].data()}, s, s * s};
  }
  // Calls row(node) with the first inner node of every inner row.
  template <typename Row>
  void each_row(Row row) {
    for (std::size_t k = 1; k + 1 < n; ++k) {
      for (std::size_t j = 1; j + 1 < n; ++j) row((k * n + j) * n + 1);
    }
    benchmark::DoNotOptimize(force[0].data());
    benchmark::ClobberMemory();
  }
  void report(benchmark::State& state) const {
    const auto nodes = static_cast<double>((n - 2) * (n - 2) * (n - 2));
    state.counters["ns_per_node"] = benchmark::Counter(
        nodes * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  }
};

const voxel::BrickStiffness& brick() {
  static const voxel::BrickStiffness made = voxel::brick_stiffness(1e4, 0.45, glm::dvec3(1e-3));
  return made;
}

void bricks_in_one_material(benchmark::State& state) {
  Field field(static_cast<std::size_t>(state.range(0)));
  const voxel::NodeStencil stencil = voxel::node_stencil(brick());
  while (state.KeepRunning()) {
    field.each_row([&](std::size_t first) {
      voxel::row_forces(stencil, field.view(), first, field.n - 2,
                        {&field.force[0][first], &field.force[1][first], &field.force[2][first]});
    });
  }
  field.report(state);
}

void bricks_by_stencil(benchmark::State& state) {
  Field field(static_cast<std::size_t>(state.range(0)));
  const voxel::NodeStencil stencil = voxel::node_stencil(brick());
  while (state.KeepRunning()) {
    field.each_row([&](std::size_t first) {
      for (std::size_t v = first; v < first + field.n - 2; ++v) {
        const auto f = voxel::node_force(stencil, field.view(), v);
        for (std::size_t a = 0; a < 3; ++a) field.force[a][v] = f[a];
      }
    });
  }
  field.report(state);
}

void bricks_by_brick(benchmark::State& state) {
  Field field(static_cast<std::size_t>(state.range(0)));
  const voxel::BrickFloats floats = voxel::in_floats(brick());
  const std::array<const voxel::BrickFloats*, 8> around{&floats, &floats, &floats, &floats,
                                                        &floats, &floats, &floats, &floats};
  while (state.KeepRunning()) {
    field.each_row([&](std::size_t first) {
      for (std::size_t v = first; v < first + field.n - 2; ++v) {
        const auto f = voxel::node_force(around, field.view(), v);
        for (std::size_t a = 0; a < 3; ++a) field.force[a][v] = f[a];
      }
    });
  }
  field.report(state);
}

// The baseline: forces of six links of one material on the nodes of a row.
HYBRID_MULTIVERSIONED void six_link_row(const voxel::NodeField& field, std::size_t first, std::size_t count,
                                        const std::array<float*, 3>& force) {
  for (std::size_t c = 0; c < 3; ++c) {
    const float* __restrict u = field.u[c] + first;
    float* __restrict out = force[c];
    const float x = c == 0 ? 10.0F : 3.0F, y = c == 1 ? 10.0F : 3.0F, z = c == 2 ? 10.0F : 3.0F;
    for (std::size_t i = 0; i < count; ++i) {
      const auto at = static_cast<std::ptrdiff_t>(i);
      out[at] = x * ((u[at + 1] - u[at]) + (u[at - 1] - u[at])) +
                y * ((u[at + field.stride_y] - u[at]) + (u[at - field.stride_y] - u[at])) +
                z * ((u[at + field.stride_z] - u[at]) + (u[at - field.stride_z] - u[at]));
    }
  }
}

void six_links(benchmark::State& state) {
  Field field(static_cast<std::size_t>(state.range(0)));
  while (state.KeepRunning()) {
    field.each_row([&](std::size_t first) {
      six_link_row(field.view(), first, field.n - 2,
                   {&field.force[0][first], &field.force[1][first], &field.force[2][first]});
    });
  }
  field.report(state);
}

BENCHMARK(six_links)->Arg(34)->Arg(162);
BENCHMARK(bricks_in_one_material)->Arg(34)->Arg(162);
BENCHMARK(bricks_by_stencil)->Arg(34)->Arg(162);
BENCHMARK(bricks_by_brick)->Arg(34)->Arg(162);

}  // namespace
