// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/soft_engines.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hybrid/bench/timer.h"
#include "voxel/baseline/thesis_chainmail.h"
#include "voxel/chain/chainmail.h"

namespace hybrid::bench {
namespace {

const TickTimer& timer() {
  static const TickTimer kTimer;
  return kTimer;
}

// ---- the product ----

class ChainEngine : public WaveEngine {
 public:
  void prepare(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options,
               const Push& push) override {
    dims_ = volume.dims;
    lattice_ = std::make_unique<voxel::Lattice>(volume, options);
    state_ = std::make_unique<voxel::Displacement>(*lattice_);
    chain_ = std::make_unique<voxel::ChainMail>(*lattice_);
    sources_.clear();
    for (const auto& s : push.sources) sources_.push_back(lattice_->at(s[0], s[1], s[2]));
    moves_ = push.moves;
  }
  void rest() override {
    // Writes only the rows that moved. Half a gigabyte of zeros would leave lines in the caches that the next
    // wave would first have to write back to memory.
    for (auto& axis : state_->u) {
      for (float* row = axis.begin(); row != axis.end(); row += voxel::kRow) {
        if (std::any_of(row, row + voxel::kRow, [](float u) { return u != 0.0F; }))
          std::fill_n(row, voxel::kRow, 0.0F);
      }
    }
  }
  double run_us() override {
    const std::uint64_t before = TickTimer::begin();
    for (std::size_t s = 0; s < sources_.size(); ++s)
      state_->set(sources_[s], state_->at(sources_[s]) + glm::dvec3(moves_[s]));
    chain_->settle(*state_, sources_, moves_, {});
    return timer().us(TickTimer::end() - before);
  }
  void read_plane(int k, std::vector<glm::vec3>& out) const override {
    std::size_t n = 0;
    for (int j = 0; j < dims_[1]; ++j) {
      for (int i = 0; i < dims_[0]; ++i) out[n++] = glm::vec3(state_->at(lattice_->at(i, j, k)));
    }
  }
  [[nodiscard]] std::uint64_t candidates() const override { return chain_->work() * voxel::kRow; }
  [[nodiscard]] std::size_t bytes() const override {
    return lattice_->memory_bytes() + lattice_->size() * (3 * sizeof(float) + 1) + chain_->memory_bytes();
  }

 private:
  std::array<int, 3> dims_{};
  std::unique_ptr<voxel::Lattice> lattice_;
  std::unique_ptr<voxel::Displacement> state_;
  std::unique_ptr<voxel::ChainMail> chain_;
  std::vector<voxel::VoxelId> sources_;
  std::vector<glm::vec3> moves_;
};

// ---- the thesis ----

class ClassicEngine : public WaveEngine {
 public:
  void prepare(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options,
               const Push& push) override {
    dims_ = volume.dims;
    object_ = std::make_unique<voxel::ThesisChainMail>(volume, options);
    sources_.clear();
    for (const auto& s : push.sources) sources_.push_back(object_->at(s[0], s[1], s[2]));
    moves_ = push.moves;
  }
  void rest() override { object_->reset(); }
  double run_us() override {
    const std::uint64_t before = TickTimer::begin();
    object_->move(sources_, moves_);
    return timer().us(TickTimer::end() - before);
  }
  void read_plane(int k, std::vector<glm::vec3>& out) const override {
    std::size_t n = 0;
    for (int j = 0; j < dims_[1]; ++j) {
      for (int i = 0; i < dims_[0]; ++i) out[n++] = object_->displacement(object_->at(i, j, k));
    }
  }
  [[nodiscard]] std::uint64_t candidates() const override { return object_->candidates(); }
  [[nodiscard]] std::size_t bytes() const override { return object_->memory_bytes(); }

 private:
  std::array<int, 3> dims_{};
  std::unique_ptr<voxel::ThesisChainMail> object_;
  std::vector<voxel::ThesisChainMail::ElementId> sources_;
  std::vector<glm::vec3> moves_;
};

constexpr int kLayer = 8;                  // voxels
constexpr double kLump = 10.0;             // voxels; half a period of the waves
constexpr std::uint8_t kRandomLabels = 8;  // labels of the material "random"

// Lumps: regions in which the sum of three waves at odd angles to the lattice is large or small.
std::uint8_t lump_label(int i, int j, int k) {
  const double x = i * 3.14159 / kLump, y = j * 3.14159 / kLump, z = k * 3.14159 / kLump;
  const double sum = std::sin(x + 0.4 * y + 1.0) + std::sin(y - 0.5 * z + 2.0) + std::sin(z + 0.3 * x + 3.0);
  return sum < -0.7 ? 2 : sum > 0.7 ? 3 : 1;
}

// Mixes the bits of a voxel's number: the labels look random and are the same on every machine.
std::uint8_t random_label(std::size_t n) {
  std::uint64_t x = (n + 1) * 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  return static_cast<std::uint8_t>(1 + (x >> 61U) % kRandomLabels);
}

}  // namespace

std::unique_ptr<WaveEngine> make_wave_engine(SoftEngine engine) {
  if (engine == SoftEngine::classic) return std::make_unique<ClassicEngine>();
  return std::make_unique<ChainEngine>();
}

namespace {

// Inspects two neighbouring planes of voxels at a time, so that a volume of any size needs little memory.
class Inspection {
 public:
  Inspection(const WaveEngine& engine, const voxel::LabelVolume& volume, const voxel::LatticeOptions& options)
      : engine_(engine),
        volume_(volume),
        options_(options),
        row_(static_cast<std::size_t>(volume.dims[0])),
        size_(row_ * static_cast<std::size_t>(volume.dims[1])),
        below_(size_),
        plane_(size_),
        owed_below_(size_),
        owed_(size_) {}

  WaveState run(const Push& whole, double path_links) {
    float largest = 0.0F;
    for (int k = 0; k < volume_.dims[2]; ++k) {
      engine_.read_plane(k, plane_);
      for (const glm::vec3& u : plane_)
        largest = std::max({largest, std::fabs(u.x), std::fabs(u.y), std::fabs(u.z)});
    }
    rounding_ = path_links *
                static_cast<double>(std::nextafter(largest, std::numeric_limits<float>::max()) - largest);
    for (int k = 0; k < volume_.dims[2]; ++k) look_at_plane(k, whole);
    for (const std::uint8_t owed : owed_below_) result_.unsupported += owed != 0 ? 1 : 0;
    result_.source_off = result_.source_off_m > rounding_;
    return result_;
  }

 private:
  void look_at_plane(int k, const Push& whole) {
    engine_.read_plane(k, plane_);
    for (std::size_t n = 0; n < size_; ++n) {
      owed_[n] = 0;  // one bit for each axis on which the voxel moved, until a link is found that moved it
      for (int axis = 0; axis < 3; ++axis)
        if (std::fabs(static_cast<double>(plane_[n][axis])) > rounding_)
          owed_[n] = static_cast<std::uint8_t>(owed_[n] | 1U << static_cast<unsigned>(axis));
      result_.moved += owed_[n] != 0 ? 1 : 0;
    }
    for (std::size_t s = 0; s < whole.sources.size(); ++s) {
      if (whole.sources[s][2] != k) continue;
      const auto n = static_cast<std::size_t>(whole.sources[s][1]) * row_ +
                     static_cast<std::size_t>(whole.sources[s][0]);
      owed_[n] = 0;
      for (int axis = 0; axis < 3; ++axis)
        result_.source_off_m = std::max(
            result_.source_off_m, static_cast<double>(std::fabs(plane_[n][axis] - whole.moves[s][axis])));
    }
    const std::uint8_t* const labels = volume_.labels.data() + static_cast<std::size_t>(k) * size_;
    for (std::size_t n = 0; n < size_; ++n) {
      if ((n + 1) % row_ != 0)
        link(0, labels[n], labels[n + 1], plane_[n], plane_[n + 1], owed_[n], owed_[n + 1]);
      if (n + row_ < size_)
        link(1, labels[n], labels[n + row_], plane_[n], plane_[n + row_], owed_[n], owed_[n + row_]);
      if (k > 0) {
        const std::uint8_t under = volume_.labels[static_cast<std::size_t>(k - 1) * size_ + n];
        link(2, under, labels[n], below_[n], plane_[n], owed_below_[n], owed_[n]);
      }
    }
    if (k > 0)
      for (const std::uint8_t owed : owed_below_) result_.unsupported += owed != 0 ? 1 : 0;
    std::swap(below_, plane_);
    std::swap(owed_below_, owed_);
  }

  void link(int d, std::uint8_t label_a, std::uint8_t label_b, const glm::vec3& a, const glm::vec3& b,
            std::uint8_t& owed_a, std::uint8_t& owed_b) {
    if (label_a == 0 || label_b == 0) return;
    const voxel::LinkMaterial &m = options_.materials[label_a], &n = options_.materials[label_b];
    const double h = volume_.spacing_m[d], across = 0.5 * (m.shear + n.shear) * h;
    bool broken = false;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = axis == d ? (0.5 * (m.stretch_min + n.stretch_min) - 1.0) * h : -across;
      const double high = axis == d ? (0.5 * (m.stretch_max + n.stretch_max) - 1.0) * h : across;
      const double apart = static_cast<double>(b[axis]) - static_cast<double>(a[axis]);
      broken = broken || apart < low - rounding_ || apart > high + rounding_;
      const auto settled = static_cast<std::uint8_t>(~(1U << static_cast<unsigned>(axis)));
      // The end that is nearer to rest was moved by the other end.
      if (apart > high - rounding_) {
        if (b[axis] > 0.0F && a[axis] > 0.0F) owed_a &= settled;
        if (b[axis] < 0.0F && a[axis] < 0.0F) owed_b &= settled;
      }
      if (apart < low + rounding_) {
        if (b[axis] > 0.0F && a[axis] > 0.0F) owed_b &= settled;
        if (b[axis] < 0.0F && a[axis] < 0.0F) owed_a &= settled;
      }
    }
    result_.violated += broken ? 1 : 0;
  }

  const WaveEngine& engine_;
  const voxel::LabelVolume& volume_;
  const voxel::LatticeOptions& options_;
  std::size_t row_, size_;
  std::vector<glm::vec3> below_, plane_;
  std::vector<std::uint8_t> owed_below_, owed_;
  double rounding_ = 0.0;
  WaveState result_;
};

}  // namespace

WaveState look_at(const WaveEngine& engine, const voxel::LabelVolume& volume,
                  const voxel::LatticeOptions& options, const Push& whole, double path_links) {
  return Inspection(engine, volume, options).run(whole, path_links);
}

const std::vector<std::string>& wave_materials() {
  static const std::vector<std::string> kMaterials{"homogeneous", "layers", "labels", "random"};
  return kMaterials;
}

voxel::LabelVolume wave_volume(const std::string& material, const std::array<int, 3>& dims) {
  voxel::LabelVolume volume;
  volume.dims = dims;
  volume.labels.assign(static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                           static_cast<std::size_t>(dims[2]),
                       1);
  if (material == "homogeneous") return volume;
  std::size_t n = 0;
  for (int k = 0; k < dims[2]; ++k) {
    // Layers are counted from the top, so that a push meets the same layers for any block size.
    const auto layer = static_cast<std::uint8_t>(1 + (dims[2] - 1 - k) / kLayer % 3);
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++n) {
        volume.labels[n] = material == "layers"   ? layer
                           : material == "labels" ? lump_label(i, j, k)
                                                  : random_label(n);
      }
    }
  }
  return volume;
}

voxel::LatticeOptions wave_options(const std::string& material, double slack) {
  voxel::LatticeOptions options;
  options.anchor_faces = {"-z"};
  const int labels = material == "random" ? kRandomLabels : 3;
  for (int n = 0; n < labels; ++n) {
    const double play = slack * (1.0 + static_cast<double>(n) / (labels - 1));
    options.materials[static_cast<std::size_t>(n) + 1] = {
        .stretch_min = 1.0 - play, .stretch_max = 1.0 + play, .shear = play};
  }
  return options;
}

}  // namespace hybrid::bench
