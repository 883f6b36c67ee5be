// SPDX-License-Identifier: GPL-3.0-or-later
// What spreads a wave, behind one interface, so that every engine gets the same inputs in the same run; the
// inputs; and a look at the result that shares no code with any engine.
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

inline constexpr double kSoftSpacing_m = 1e-3;  // of every benchmark's soft object

// Voxels of a volume that are moved, and by how much from where they are (unit: meter).
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
  virtual void rest() = 0;      // everything back to rest; not timed
  virtual double run_us() = 0;  // the push once more, from the state there is
  // Displacements of plane k of the volume, x fastest (unit: meter).
  virtual void read_plane(int k, std::vector<glm::vec3>& out) const = 0;
  [[nodiscard]] virtual std::uint64_t candidates() const = 0;  // looked at in the last run; 0: not counted
  [[nodiscard]] virtual std::size_t bytes() const = 0;
};
std::unique_ptr<WaveEngine> make_wave_engine(SoftEngine engine);

// What a wave from rest did, by more than floats round (the links of the longest way from a source times the
// spacing of floats at the largest displacement): voxels away from rest; links whose ends differ by more than
// their limits; voxels that no link at its limit towards a voxel further away made move so far; and how far
// the sources ended from where they were put (unit: meter). With none of the last three, the state is the
// definition's: by links at their limits there is a way from each voxel to a source, and none that is
// shorter.
struct WaveState {
  std::size_t moved = 0, violated = 0, unsupported = 0;
  double source_off_m = 0.0;
  [[nodiscard]] bool exact() const { return violated == 0 && unsupported == 0 && !source_off; }
  bool source_off = false;
};
WaveState look_at(const WaveEngine& engine, const voxel::LabelVolume& volume,
                  const voxel::LatticeOptions& options, const Push& whole, double path_links);

// Blocks to push into, spacing 1 mm, lower layer anchored. "homogeneous": one label; "layers": slabs of 8
// voxels of three labels in turn; "labels": lumps of about 10 voxels of three labels; "random": each voxel
// one of eight labels. Links of label n may stretch, shorten and shear by `slack` · f spacings: f is 1, 1.5,
// 2, or 1, 1 + 1/7 … 2 for "random".
const std::vector<std::string>& wave_materials();
voxel::LabelVolume wave_volume(const std::string& material, const std::array<int, 3>& dims);
voxel::LatticeOptions wave_options(const std::string& material, double slack);

}  // namespace hybrid::bench
