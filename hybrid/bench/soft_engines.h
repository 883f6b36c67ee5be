// SPDX-License-Identifier: GPL-3.0-or-later
// The engines that spread a wave, behind one interface, so that all get the same inputs in the same run. The
// header also has these inputs, and an inspection of the result that shares no code with any engine.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "hybrid/bench/soft_table.h"
#include "voxel/lattice/lattice.h"
#include "voxel/volume/label_volume.h"

namespace hybrid::bench {

inline constexpr double kSoftSpacing_m = 1e-3;  // spacing of all soft objects in the benchmarks

// Voxels of a volume to be moved, and their moves from their present positions (m).
struct Push {
  std::vector<std::array<int, 3>> sources;
  std::vector<glm::vec3> moves;
};

class WaveEngine {
 public:
  WaveEngine() = default;
  WaveEngine(const WaveEngine&) = delete;
  WaveEngine& operator=(const WaveEngine&) = delete;
  WaveEngine(WaveEngine&&) = delete;
  WaveEngine& operator=(WaveEngine&&) = delete;
  virtual ~WaveEngine() = default;

  virtual void prepare(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options,
                       const Push& push) = 0;
  virtual void rest() = 0;      // puts everything back to rest; not timed
  virtual double run_us() = 0;  // does the push once more, from the present state
  // Displacements of plane k of the volume, x fastest (m).
  virtual void read_plane(int k, std::vector<glm::vec3>& out) const = 0;
  [[nodiscard]] virtual std::uint64_t candidates() const = 0;  // examined in the last run; 0: not counted
  [[nodiscard]] virtual std::size_t bytes() const = 0;
};
std::unique_ptr<WaveEngine> make_wave_engine(SoftEngine engine);

// The state after a wave from rest.
//   moved         voxels away from rest
//   violated      links beyond their limits
//   unsupported   displaced voxels without a cause: no link at its limit leads to a voxel further from rest
//   source_off_m  greatest distance of a source from its target (m)
// Differences count only above a tolerance for rounding. It is the number of links on the longest way from a
// source, times the spacing of floats at the largest displacement. If the last three figures are zero, the
// state is exactly that of the definition. Then a shortest chain of links at their limits leads from each
// moved voxel to a source.
struct WaveState {
  std::size_t moved = 0, violated = 0, unsupported = 0;
  double source_off_m = 0.0;
  [[nodiscard]] bool exact() const { return violated == 0 && unsupported == 0 && !source_off; }
  bool source_off = false;
};
WaveState look_at(const WaveEngine& engine, const voxel::LabelVolume& volume,
                  const voxel::LatticeOptions& options, const Push& whole, double path_links);

// Materials of blocks with a spacing of 1 mm and an anchored bottom layer. "homogeneous": one label.
// "layers": slabs of 8 voxels with three labels in turn. "labels": lumps of about 10 voxels with three
// labels. "random": each voxel has one of eight labels. Links of label n may stretch, shorten and shear by
// `slack` · f spacings. f is 1, 1.5, 2; for "random" it is 1, 1 + 1/7 … 2.
const std::vector<std::string>& wave_materials();
voxel::LabelVolume wave_volume(const std::string& material, const std::array<int, 3>& dims);
voxel::LatticeOptions wave_options(const std::string& material, double slack);

}  // namespace hybrid::bench
