// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/lattice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace voxel {
namespace {

struct LinkModuli {
  double along = 0.0, across = 0.0;  // (unit: Pa)
};

LinkModuli moduli_of(const LinkMaterial& material) {
  const double nu = material.poisson;
  return {material.young_Pa, material.young_Pa / (4.0 * (1.0 - nu * nu))};
}

// Two half links in series, each of its own material.
double in_series(double a, double b) {
  return 2.0 * a * b / (a + b);
}

void check_material(std::size_t label, const LinkMaterial& m) {
  const auto say = [label](const std::string& what) {
    throw std::invalid_argument("the material of label " + std::to_string(label) + " has " + what);
  };
  if (!std::isfinite(m.young_Pa) || m.young_Pa <= 0.0)
    say("a Young's modulus that is not positive; give Pa, e.g. 5000");
  if (!(m.poisson >= 0.0 && m.poisson < 0.5)) say("a Poisson's ratio outside 0 <= nu < 0.5");
  if (!(m.stretch_min > 0.0 && m.stretch_min <= 1.0)) say("a least stretch outside 0 < min <= 1");
  if (!(m.stretch_max >= 1.0 && std::isfinite(m.stretch_max))) say("a greatest stretch below 1");
  if (!(m.shear >= 0.0 && std::isfinite(m.shear))) say("a negative shear limit");
}

}  // namespace

Lattice::Lattice(const LabelVolume& volume, const LatticeOptions& options) : spacing_m_(volume.spacing_m) {
  for (int d = 0; d < 3; ++d) {
    if (!(spacing_m_[d] > 0.0) || !std::isfinite(spacing_m_[d])) {
      throw std::invalid_argument("the spacing of a soft object must be positive and finite");
    }
  }
  min_spacing_m_ = std::min({spacing_m_.x, spacing_m_.y, spacing_m_.z});
  max_spacing_m_ = std::max({spacing_m_.x, spacing_m_.y, spacing_m_.z});
  fill_labels(volume);
  fill_springs(options);
  fill_anchors(volume, options);
  fill_limits(options);
  find_surface();
}

void Lattice::fill_labels(const LabelVolume& volume) {
  std::size_t cells = 1;
  for (std::size_t d = 0; d < 3; ++d) {
    springs_.dims[d] = volume.dims[d] + 2;
    cells *= static_cast<std::size_t>(springs_.dims[d]);
  }
  if (cells > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max())) {
    throw std::invalid_argument("a soft object of " + std::to_string(cells) +
                                " lattice cells is too large; give it a coarser spacing");
  }
  std::size_t expected = 1;
  for (const int n : volume.dims) expected *= static_cast<std::size_t>(std::max(n, 0));
  if (volume.labels.size() != expected)
    throw std::invalid_argument("a label volume must hold one label a voxel");
  springs_.stride = {1, static_cast<std::size_t>(springs_.dims[0]),
                     static_cast<std::size_t>(springs_.dims[0]) * static_cast<std::size_t>(springs_.dims[1])};
  label_.assign(cells, 0);
  springs_.row.assign(static_cast<std::size_t>(springs_.dims[1]) * static_cast<std::size_t>(springs_.dims[2]),
                      {0, 0});
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      auto& row = springs_.row[static_cast<std::size_t>(k + 1) * static_cast<std::size_t>(springs_.dims[1]) +
                               static_cast<std::size_t>(j + 1)];
      for (int i = 0; i < volume.dims[0]; ++i) {
        const std::uint8_t label = volume.labels[volume.index(i, j, k)];
        if (label == 0) continue;
        label_[at(i + 1, j + 1, k + 1)] = label;
        if (row[1] == 0) row[0] = i + 1;
        row[1] = i + 2;
        ++voxel_count_;
      }
    }
  }
  if (voxel_count_ == 0) {
    throw std::invalid_argument("a soft object without a voxel: check its labels or intensity range");
  }
}

void Lattice::fill_springs(const LatticeOptions& options) {
  std::array<LinkModuli, 256> moduli;
  std::array<bool, 256> used{};
  for (const std::uint8_t label : label_) used[label] = true;
  for (std::size_t label = 1; label < 256; ++label) {
    if (!used[label]) continue;
    check_material(label, options.materials[label]);
    moduli[label] = moduli_of(options.materials[label]);
  }
  const glm::dvec3 h = spacing_m_;
  const std::array<double, 3> area_by_length{h.y * h.z / h.x, h.x * h.z / h.y, h.x * h.y / h.z};
  for (std::size_t d = 0; d < 3; ++d) {
    springs_.along[d].assign(size(), 0.0F);
    springs_.across[d].assign(size(), 0.0F);
  }
  for (std::size_t a = 0; a < 3; ++a) springs_.inverse_diagonal[a].assign(size(), 0.0F);
  std::size_t links = 0;
  for (std::size_t v = 0; v < size(); ++v) {
    if (label_[v] == 0) continue;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::uint8_t other = label_[v + springs_.stride[d]];
      if (other == 0) continue;
      const LinkModuli &a = moduli[label_[v]], &b = moduli[other];
      springs_.along[d][v] = static_cast<float>(in_series(a.along, b.along) * area_by_length[d]);
      springs_.across[d][v] = static_cast<float>(in_series(a.across, b.across) * area_by_length[d]);
      force_scale_N_ += static_cast<double>(springs_.along[d][v]) * spacing_m_[static_cast<int>(d)];
      ++links;
    }
  }
  if (links > 0) force_scale_N_ /= static_cast<double>(links);
}

void Lattice::fill_anchors(const LabelVolume& volume, const LatticeOptions& options) {
  anchored_.assign(size(), 0);
  // The outermost voxels on a side are those in the outermost occupied layer of the lattice.
  std::array<int, 3> low = springs_.dims, high{0, 0, 0};
  for (std::size_t v = 0; v < size(); ++v) {
    if (label_[v] == 0) continue;
    const auto c = coordinates(static_cast<VoxelId>(v));
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], c[d]);
      high[d] = std::max(high[d], c[d]);
    }
  }
  std::array<bool, 256> by_label{};
  for (const std::uint8_t label : options.anchor_labels) by_label[label] = true;
  for (std::size_t v = 0; v < size(); ++v) {
    if (label_[v] == 0) continue;
    bool held = by_label[label_[v]];
    const auto c = coordinates(static_cast<VoxelId>(v));
    for (const std::string& face : options.anchor_faces) {
      if (face.size() != 2 || (face[0] != '-' && face[0] != '+') || face[1] < 'x' || face[1] > 'z') {
        throw std::invalid_argument("unknown anchor face \"" + face + "\"; use -x, +x, -y, +y, -z or +z");
      }
      const auto d = static_cast<std::size_t>(face[1] - 'x');
      held = held || c[d] == (face[0] == '-' ? low[d] : high[d]);
    }
    if (held) anchored_[v] = 1;
  }
  for (const std::size_t index : options.anchor_voxels) {
    if (index >= volume.labels.size())
      throw std::invalid_argument("an anchored voxel lies outside the volume");
    const auto nx = static_cast<std::size_t>(volume.dims[0]), ny = static_cast<std::size_t>(volume.dims[1]);
    const VoxelId v = at(static_cast<int>(index % nx) + 1, static_cast<int>(index / nx % ny) + 1,
                         static_cast<int>(index / (nx * ny)) + 1);
    if (label_[v] != 0) anchored_[v] = 1;
  }
  anchored_count_ = static_cast<std::size_t>(std::count(anchored_.begin(), anchored_.end(), std::uint8_t{1}));
  if (anchored_count_ == 0) {
    throw std::invalid_argument(
        "a free soft object has no equilibrium force: anchor a face, a label, or what touches bone");
  }
  // What is anchored, and what has no link at all, has no degree of freedom.
  for (std::size_t v = 0; v < size(); ++v) {
    if (label_[v] == 0 || anchored_[v] != 0) continue;
    for (int axis = 0; axis < 3; ++axis) {
      double sum = 0.0;
      for (int d = 0; d < 3; ++d) {
        const float* k = springs_.stiffness(axis, d);
        sum += static_cast<double>(k[v]) + static_cast<double>(k[v - stride(d)]);
      }
      if (sum > 0.0)
        springs_.inverse_diagonal[static_cast<std::size_t>(axis)][v] = static_cast<float>(1.0 / sum);
    }
  }
}

void Lattice::fill_limits(const LatticeOptions& options) {
  // Labels with equal limits share a class, so that the table stays small.
  std::vector<LinkMaterial> classes;
  std::array<bool, 256> used{};
  for (const std::uint8_t label : label_) used[label] = true;
  for (std::size_t label = 1; label < 256; ++label) {
    if (!used[label]) continue;
    const LinkMaterial& m = options.materials[label];
    const auto same = [&m](const LinkMaterial& c) {
      return c.stretch_min == m.stretch_min && c.stretch_max == m.stretch_max && c.shear == m.shear;
    };
    const auto found = std::find_if(classes.begin(), classes.end(), same);
    limit_class_[label] = static_cast<std::size_t>(found - classes.begin());
    if (found == classes.end()) classes.push_back(m);
  }
  class_count_ = classes.size();
  for (int d = 0; d < 3; ++d) {
    const double h = spacing_m_[d];
    auto& table = limits_[static_cast<std::size_t>(d)];
    LinkLimit& tightest = tightest_[static_cast<std::size_t>(d)];
    tightest = {-std::numeric_limits<float>::max(), std::numeric_limits<float>::max(),
                std::numeric_limits<float>::max()};
    for (const LinkMaterial& a : classes) {
      for (const LinkMaterial& b : classes) {
        // A link of two materials is half of each, so its limits are their means.
        LinkLimit limit;
        limit.along_low = static_cast<float>((0.5 * (a.stretch_min + b.stretch_min) - 1.0) * h);
        limit.along_high = static_cast<float>((0.5 * (a.stretch_max + b.stretch_max) - 1.0) * h);
        limit.across = static_cast<float>(0.5 * (a.shear + b.shear) * h);
        table.push_back(limit);
        tightest.along_low = std::max(tightest.along_low, limit.along_low);
        tightest.along_high = std::min(tightest.along_high, limit.along_high);
        tightest.across = std::min(tightest.across, limit.across);
      }
    }
  }
}

void Lattice::find_surface() {
  for (std::size_t v = 0; v < size(); ++v) {
    if (label_[v] == 0) continue;
    bool outside = false;
    for (int d = 0; d < 3; ++d) outside = outside || label_[v - stride(d)] == 0 || label_[v + stride(d)] == 0;
    if (outside) surface_.push_back(static_cast<VoxelId>(v));
  }
}

std::size_t Lattice::memory_bytes() const {
  return size() * (2 + 9 * sizeof(float)) + surface_.size() * sizeof(VoxelId) +
         springs_.row.size() * sizeof(springs_.row[0]);
}

}  // namespace voxel
