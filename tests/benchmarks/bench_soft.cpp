// SPDX-License-Identifier: GPL-3.0-or-later
// What a soft object costs, by its size: one relaxation cycle of everything, the same once only a contact
// moves, and plain Gauss-Seidel sweeps as the baseline that the multigrid has to beat at equal residual.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <vector>

#include "voxel/lattice/voxel_links.h"
#include "voxel/object/soft_object.h"

namespace {

struct Pressed {
  std::unique_ptr<voxel::SoftObject> object;
  voxel::ToolInBody tool;
};

// A cube of n³ voxels, pressed one spacing deep by a ball of eight.
Pressed pressed_cube(int n) {
  voxel::LabelVolume volume;
  volume.dims = {n, n, n};
  volume.labels.assign(
      static_cast<std::size_t>(n) * static_cast<std::size_t>(n) * static_cast<std::size_t>(n), 1);
  voxel::LatticeOptions options;
  options.anchor_faces = {"-z"};
  Pressed pressed{std::make_unique<voxel::SoftObject>(std::make_shared<voxel::Lattice>(volume, options)), {}};
  const double h = 1e-3, middle = 0.5 * (n - 1) * h;
  pressed.tool.radius = 8.0 * h;
  pressed.tool.centre = {middle, middle, (n - 1) * h + 0.5 * h + 7.0 * h};
  std::vector<voxel::VoxelId> top;
  for (const voxel::VoxelId v : pressed.object->lattice().surface()) {
    const glm::dvec3 away = pressed.object->lattice().rest(v) - pressed.tool.centre;
    if (std::sqrt(away.x * away.x + away.y * away.y + away.z * away.z) < 10.0 * h) top.push_back(v);
  }
  pressed.object->touch(top);
  pressed.object->push_out(pressed.tool);
  return pressed;
}

void press_to_rest(benchmark::State& state) {
  while (state.KeepRunning()) {
    state.PauseTiming();
    Pressed pressed = pressed_cube(static_cast<int>(state.range(0)));
    const double tolerance = 1e-4 * pressed.object->lattice().force_scale_N();
    state.ResumeTiming();
    benchmark::DoNotOptimize(pressed.object->settle(pressed.tool, tolerance, 200));
    state.counters["cycles"] = static_cast<double>(pressed.object->relaxation().cycles());
  }
}
BENCHMARK(press_to_rest)->Arg(24)->Arg(48)->Arg(72)->Unit(benchmark::kMillisecond)->Iterations(3);

// The baseline: sweeps of the finest level alone, as many as one would do in a second, and the residual they
// leave.
void sweeps_alone(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  while (state.KeepRunning()) {
    state.PauseTiming();
    Pressed pressed = pressed_cube(n);
    voxel::Displacement copy = pressed.object->state();
    const voxel::Lattice& lattice = pressed.object->lattice();
    voxel::Couplings couplings(lattice, nullptr);
    for (const voxel::VoxelId v : pressed.object->touched()) copy.set_role(v, voxel::Displacement::held);
    state.ResumeTiming();
    for (int sweep = 0; sweep < 500; ++sweep) {
      for (voxel::VoxelId v = 0; v < lattice.size(); ++v) {
        if (!lattice.filled(v) || lattice.anchored(v) || copy.role[v] != voxel::Displacement::free) continue;
        copy.set(v, voxel::link_minimum(couplings, copy, v));
      }
    }
    state.PauseTiming();
    double worst = 0.0;
    for (std::size_t v = 0; v < lattice.size(); ++v) {
      const auto id = static_cast<voxel::VoxelId>(v);
      if (!lattice.filled(id) || lattice.anchored(id) || copy.role[v] != voxel::Displacement::free) continue;
      const glm::dvec3 f = voxel::link_force(lattice, copy, id);
      worst = std::max(worst, std::sqrt(f.x * f.x + f.y * f.y + f.z * f.z));
    }
    state.counters["residual_of_scale"] = worst / lattice.force_scale_N();
    state.ResumeTiming();
  }
}
BENCHMARK(sweeps_alone)->Arg(24)->Arg(48)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
