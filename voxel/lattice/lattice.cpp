// SPDX-License-Identifier: GPL-3.0-or-later
// Construction of a lattice from labels, and its look-ups.
#include "voxel/lattice/lattice.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

namespace voxel {
namespace {

// Ids between two entries of surface_before_: a compromise between memory and look-up time.
constexpr std::size_t kSurfaceBlock = 256;
constexpr std::size_t kGivenBack = std::size_t{1} << 24U;  // bytes of a volume returned at a time
constexpr std::size_t kMostCells = std::size_t{1} << 31;  // so that VoxelId, in 32 bits, can number all cells

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
  if (m.bricks && m.poisson > kMostPoissonOfBricks)
    say("the trilinear energy and a Poisson's ratio above 0.49, which takes too long to come to "
        "rest; give 0.49 or less");
  if (!(m.yield > 0.0)) say("a yield strain that is not positive; leave it out where nothing yields");
}

}  // namespace

Lattice::Lattice(const LabelVolume& volume, const LatticeOptions& options)
    : Lattice(volume, options, nullptr) {}

Lattice::Lattice(LabelVolume&& volume, const LatticeOptions& options)
    : Lattice(volume, options, volume.labels.data()) {
  volume.labels = {};
}

Lattice::Lattice(const LabelVolume& volume, const LatticeOptions& options, std::uint8_t* give_back)
    : spacing_m_(volume.spacing_m) {
  for (int d = 0; d < 3; ++d) {
    if (!(spacing_m_[d] > 0.0) || !std::isfinite(spacing_m_[d])) {
      throw std::invalid_argument("the spacing of a soft object must be positive and finite");
    }
  }
  min_spacing_m_ = std::min({spacing_m_.x, spacing_m_.y, spacing_m_.z});
  max_spacing_m_ = std::max({spacing_m_.x, spacing_m_.y, spacing_m_.z});
  fill_labels(volume, give_back);
  fill_inside();
  fill_links(options);
  fill_force_scale();
  fill_anchors(volume, options);
  find_surface();
  find_blocks();
}

void Lattice::fill_labels(const LabelVolume& volume, std::uint8_t* give_back) {
  std::size_t expected = 1, cells = 1;
  for (const int n : volume.dims) {
    expected *= static_cast<std::size_t>(std::max(n, 0));
    cells *= static_cast<std::size_t>(std::max(n, 0)) + 2 * kRow;
    if (cells > kMostCells) {
      throw std::invalid_argument("a soft object of " + std::to_string(volume.dims[0]) + " x " +
                                  std::to_string(volume.dims[1]) + " x " + std::to_string(volume.dims[2]) +
                                  " voxels is too large; give it a coarser spacing");
    }
  }
  if (volume.labels.size() != expected)
    throw std::invalid_argument("a label volume must hold one label a voxel");
  if (expected == 0)
    throw std::invalid_argument("a soft object without a voxel: check its labels or intensity range");
  grid_ = Grid(volume.dims);
  label_ = LazyArray<std::uint8_t>(grid_.size());
  rows_ = LazyArray<std::uint8_t>(grid_.rows());
  std::size_t given = 0;
  const std::array<std::uint8_t, kRow> nothing{};
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      for (int i = 0; i < volume.dims[0]; i += kRow) {
        const auto count = static_cast<std::size_t>(std::min(kRow, volume.dims[0] - i));
        const std::uint8_t* from = volume.labels.data() + volume.index(i, j, k);
        // Empty rows are not written, so empty space costs no memory.
        if (std::memcmp(from, nothing.data(), count) == 0) continue;
        std::memcpy(label_.data() + grid_.at(i, j, k), from, count);
        const auto filled = count - static_cast<std::size_t>(std::count(from, from + count, std::uint8_t{0}));
        rows_[grid_.at(i, j, k) / kRow] = static_cast<std::uint8_t>(filled);
        voxel_count_ += filled;
      }
    }
    const std::size_t read = volume.index(0, 0, k + 1);
    if (give_back != nullptr && (read - given >= kGivenBack || k + 1 == volume.dims[2])) {
      voxel::give_back(give_back + given, read - given);
      given = read;
    }
  }
  if (voxel_count_ == 0) {
    throw std::invalid_argument("a soft object without a voxel: check its labels or intensity range");
  }
}

void Lattice::fill_links(const LatticeOptions& options) {
  std::array<bool, 256> used{};
  for (RowId row = 0; row < grid_.rows(); ++row) {
    if (filled_in(row) == 0) continue;
    const std::uint8_t* at = labels(row);
    for (int i = 0; i < kRow; ++i) used[at[i]] = true;
  }
  // Equal materials share a number, so that the tables stay small.
  std::vector<LinkMaterial>& materials = materials_;
  materials.resize(1);
  for (std::size_t label = 1; label < 256; ++label) {
    if (!used[label]) continue;
    const LinkMaterial& m = options.materials[label];
    check_material(label, m);
    const auto found = std::find(materials.begin() + 1, materials.end(), m);
    material_[label] = static_cast<std::uint8_t>(found - materials.begin());
    if (found == materials.end()) materials.push_back(m);
    has_bricks_ = has_bricks_ || m.bricks;
  }
  material_count_ = materials.size();

  const glm::dvec3 h = spacing_m_;
  area_by_length_m_ = {h.y * h.z / h.x, h.x * h.z / h.y, h.x * h.y / h.z};
  moduli_.assign(material_count_, {});
  for (std::size_t m = 1; m < material_count_; ++m)
    moduli_[m] = {materials[m].young_Pa, across_modulus_Pa(materials[m].young_Pa, materials[m].poisson)};
  for (int d = 0; d < 3; ++d) {
    const auto ud = static_cast<std::size_t>(d);
    within_[ud].assign(material_count_, {});
    for (std::size_t m = 1; m < material_count_; ++m) {
      within_[ud][m] = {static_cast<float>(moduli_[m].along_Pa * area_by_length_m_[ud]),
                        static_cast<float>(moduli_[m].across_Pa * area_by_length_m_[ud])};
    }
    LinkLimit& tightest = tightest_[ud];
    tightest = {-std::numeric_limits<float>::max(), std::numeric_limits<float>::max(),
                std::numeric_limits<float>::max()};
    limits_[ud].assign(material_count_ * material_count_, {});
    constexpr float never = std::numeric_limits<float>::infinity();
    yield_m_[ud].assign(material_count_ * material_count_, never);
    first_yield_m_[ud] = never;
    for (std::size_t ia = 1; ia < material_count_; ++ia) {
      for (std::size_t ib = 1; ib < material_count_; ++ib) {
        const LinkMaterial &a = materials[ia], &b = materials[ib];
        LinkLimit& limit = limits_[ud][ia * material_count_ + ib];
        // A link between two materials is half of each, so its limits are the means.
        limit.along_low = static_cast<float>((0.5 * (a.stretch_min + b.stretch_min) - 1.0) * h[d]);
        limit.along_high = static_cast<float>((0.5 * (a.stretch_max + b.stretch_max) - 1.0) * h[d]);
        limit.across = static_cast<float>(0.5 * (a.shear + b.shear) * h[d]);
        float& yield = yield_m_[ud][ia * material_count_ + ib];
        yield = static_cast<float>(std::min(a.yield, b.yield) * h[d]);
        first_yield_m_[ud] = std::min(first_yield_m_[ud], yield);
        has_plasticity_ = has_plasticity_ || yield < never;
        tightest.along_low = std::max(tightest.along_low, limit.along_low);
        tightest.along_high = std::min(tightest.along_high, limit.along_high);
        tightest.across = std::min(tightest.across, limit.across);
        uniform_limits_ = uniform_limits_ && a.stretch_min == materials[1].stretch_min &&
                          a.stretch_max == materials[1].stretch_max && a.shear == materials[1].shear;
      }
    }
  }
  if (has_plasticity_ && has_bricks_) {
    throw std::invalid_argument(
        "tissue that yields and tissue of the trilinear energy cannot be one object: give both the six-link "
        "energy, or take the yield away");
  }
}

// Marks the rows that are inside a region of one label.
void Lattice::fill_inside() {
  LazyArray<std::uint8_t> whole(grid_.rows());  // label of a full row of one label
  for (RowId row = 0; row < grid_.rows(); ++row) {
    if (filled_in(row) != kRow) continue;
    const std::uint8_t* at = labels(row);
    if (std::count(at, at + kRow, at[0]) == kRow) whole[row] = at[0];
  }
  for (RowId row = 0; row < grid_.rows(); ++row) {
    const std::uint8_t own = whole[row];
    if (own == 0) continue;
    bool same = true;
    for (const RowId plane : {row - grid_.row_z, row, row + grid_.row_z}) {
      for (const RowId r : {plane - 1, plane, plane + 1}) {
        const VoxelId first = r * kRow;
        same = same && whole[r] == own && label_[grid_.down(first, 0)] == own &&
               label_[grid_.up(first + kRow - 1, 0)] == own;
      }
    }
    if (same) rows_[row] = kInside;
  }
}

void Lattice::fill_force_scale() {
  std::vector<std::size_t> count(3 * material_count_ * material_count_);  // links by direction and materials
  for (RowId row = 0; row < grid_.rows(); ++row) {
    if (filled_in(row) == 0) continue;
    const std::uint8_t* at = labels(row);
    for (int i = 0; i < kRow; ++i) {
      if (at[i] == 0) continue;
      const VoxelId v = row * kRow + static_cast<VoxelId>(i);
      for (int d = 0; d < 3; ++d) {
        const std::uint8_t other = label_[grid_.up(v, d)];
        if (other != 0)
          ++count[static_cast<std::size_t>(d) * material_count_ * material_count_ + pair_of(at[i], other)];
      }
    }
  }
  std::size_t links = 0, pair = 0;
  for (int d = 0; d < 3; ++d) {
    for (std::size_t a = 0; a < material_count_; ++a) {
      for (std::size_t b = 0; b < material_count_; ++b) {
        const std::size_t n = count[pair++];
        links += n;
        force_scale_N_ += static_cast<double>(n) * softer(moduli_[a], moduli_[b]).along_Pa *
                          area_by_length_m_[static_cast<std::size_t>(d)] * spacing_m_[d];
      }
    }
  }
  if (links > 0) force_scale_N_ /= static_cast<double>(links);
}

Spring Lattice::spring_among(const std::array<std::uint8_t, 9>& from, const std::array<std::uint8_t, 9>& to,
                             int d) const noexcept {
  const auto ud = static_cast<std::size_t>(d);
  const std::uint8_t own = from[kLinkItself];
  if (own == 0 || to[kLinkItself] == 0) return {};
  bool one = true;
  for (std::size_t n = 0; n < 9; ++n) one = one && from[n] == own && to[n] == own;
  if (one) return within_[ud][own];
  std::array<LinkModuli, 9> links;
  for (std::size_t n = 0; n < 9; ++n) links[n] = softer(moduli_[from[n]], moduli_[to[n]]);
  const LinkModuli moduli = link_moduli(links);
  return {static_cast<float>(moduli.along_Pa * area_by_length_m_[ud]),
          static_cast<float>(moduli.across_Pa * area_by_length_m_[ud])};
}

Spring Lattice::spring(VoxelId v, int d) const noexcept {
  const std::uint8_t within = inside(v / kRow);
  if (within != 0) return spring_within(within, d);
  const VoxelId w = grid_.up(v, d);
  if (label_[v] == 0 || label_[w] == 0) return {};
  const int p = (d + 1) % 3, q = (d + 2) % 3;
  std::array<std::uint8_t, 9> from{}, to{};
  const auto look = [&](VoxelId at, std::array<std::uint8_t, 9>& out) {
    std::size_t n = 0;
    for (const VoxelId a : {grid_.down(at, q), at, grid_.up(at, q)}) {
      for (const VoxelId b : {grid_.down(a, p), a, grid_.up(a, p)}) out[n++] = material(b);
    }
  };
  look(v, from);
  look(w, to);
  return spring_among(from, to, d);
}

VoxelSprings Lattice::springs_of(VoxelId v) const noexcept {
  VoxelSprings out;
  for (int d = 0; d < 3; ++d) {
    const auto ud = static_cast<std::size_t>(d);
    out.up[ud] = spring(v, d);
    out.down[ud] = spring(grid_.down(v, d), d);
  }
  if (!anchored(v)) out.set_inverse();
  return out;
}

void Lattice::fill_anchors(const LabelVolume& volume, const LatticeOptions& options) {
  LazyArray<std::uint32_t> lanes(grid_.rows());  // [row] anchored lanes
  // The outermost voxels on a side are those in the outermost occupied layer of the lattice.
  std::array<int, 3> low = grid_.dims, high{-1, -1, -1};
  std::array<bool, 256> by_label{};
  for (const std::uint8_t label : options.anchor_labels) by_label[label] = true;
  const auto for_each_voxel = [this](const auto& visit) {
    for (RowId row = 0; row < grid_.rows(); ++row) {
      if (filled_in(row) == 0) continue;
      const std::array<int, 3> c = grid_.row_coordinates(row);
      for (int i = 0; i < kRow; ++i) {
        const VoxelId v = row * kRow + static_cast<VoxelId>(i);
        if (label_[v] != 0) visit(v, std::array<int, 3>{(c[0] - 1) * kRow + i, c[1], c[2]});
      }
    }
  };
  for_each_voxel([&](VoxelId, const std::array<int, 3>& c) {
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], c[d]);
      high[d] = std::max(high[d], c[d]);
    }
  });
  struct Face {
    std::size_t d;
    int layer;
  };
  std::vector<Face> faces;
  for (const std::string& face : options.anchor_faces) {
    if (face.size() != 2 || (face[0] != '-' && face[0] != '+') || face[1] < 'x' || face[1] > 'z') {
      throw std::invalid_argument("unknown anchor face \"" + face + "\"; use -x, +x, -y, +y, -z or +z");
    }
    const auto d = static_cast<std::size_t>(face[1] - 'x');
    faces.push_back({d, face[0] == '-' ? low[d] : high[d]});
  }
  const auto anchor = [this, &lanes](VoxelId v) {
    const std::uint32_t bit = 1U << v % kRow;
    anchored_count_ += (lanes[v / kRow] & bit) == 0 ? 1 : 0;
    lanes[v / kRow] |= bit;
  };
  for_each_voxel([&](VoxelId v, const std::array<int, 3>& c) {
    const bool on_face =
        std::any_of(faces.begin(), faces.end(), [&c](const Face& f) { return c[f.d] == f.layer; });
    if (on_face || by_label[label_[v]]) anchor(v);
  });
  for (const std::size_t index : options.anchor_voxels) {
    if (index >= volume.labels.size())
      throw std::invalid_argument("an anchored voxel lies outside the volume");
    const auto nx = static_cast<std::size_t>(volume.dims[0]), ny = static_cast<std::size_t>(volume.dims[1]);
    const VoxelId v = at(static_cast<int>(index % nx), static_cast<int>(index / nx % ny),
                         static_cast<int>(index / (nx * ny)));
    if (label_[v] != 0) anchor(v);
  }
  if (anchored_count_ == 0) {
    throw std::invalid_argument(
        "a soft object that is not held cannot balance the tool's force: anchor a face, a label, or what "
        "touches bone");
  }
  anchor_blocks(lanes);
  list_anchors(lanes);
}

void Lattice::list_anchors(const LazyArray<std::uint32_t>& lanes) {
  listed_before_.assign(grid_.rows() / kListBlock + 1, 0);
  for (RowId row = 0; row < grid_.rows(); ++row) {
    if (row % kListBlock == 0)
      listed_before_[row / kListBlock] = static_cast<std::uint32_t>(anchored_.size());
    if (filled_in(row) == 0 || lanes[row] == 0) continue;
    const Anchors which = lanes[row] == filled_lanes(row) ? Anchors::all : Anchors::some;
    rows_[row] |= static_cast<std::uint8_t>(static_cast<unsigned>(which) << kAnchorShift);
    if (which == Anchors::some) anchored_.push_back(lanes[row]);
  }
  anchored_.shrink_to_fit();
}

std::uint32_t Lattice::listed_anchors(RowId row) const noexcept {
  std::size_t at = listed_before_[row / kListBlock];
  for (RowId r = row - row % kListBlock; r < row; ++r) at += anchors_of(r) == Anchors::some ? 1 : 0;
  return anchored_[at];
}

std::uint32_t Lattice::filled_lanes(RowId row) const noexcept {
  const int count = filled_in(row);
  if (count == 0 || count == kRow) return count == 0 ? 0U : ~0U;
  const std::uint8_t* at = labels(row);
  std::uint32_t lanes = 0;
  for (int i = 0; i < kRow; ++i) lanes |= static_cast<std::uint32_t>(at[i] != 0) << i;
  return lanes;
}

void Lattice::find_surface() {
  surface_before_.assign(grid_.size() / kSurfaceBlock + 2, 0);
  for (RowId row = 0; row < grid_.rows(); ++row) {
    const VoxelId first = row * kRow;
    if (first % kSurfaceBlock == 0)
      surface_before_[first / kSurfaceBlock] = static_cast<std::uint32_t>(surface_.size());
    if (filled_in(row) == 0) continue;
    // A full row among full rows has surface voxels only at its ends.
    const bool inside = filled_in(row) == kRow && filled_in(row - 1) == kRow && filled_in(row + 1) == kRow &&
                        filled_in(row - grid_.row_z) == kRow && filled_in(row + grid_.row_z) == kRow;
    for (int i = 0; i < kRow; i += inside ? kRow - 1 : 1) {
      const VoxelId v = first + static_cast<VoxelId>(i);
      if (label_[v] == 0) continue;
      bool outside = false;
      for (int d = 0; d < 3; ++d)
        outside = outside || label_[grid_.down(v, d)] == 0 || label_[grid_.up(v, d)] == 0;
      if (outside) surface_.push_back(v);
    }
  }
  surface_.shrink_to_fit();
  const std::size_t known = (grid_.size() - 1) / kSurfaceBlock + 1;
  for (std::size_t b = known; b < surface_before_.size(); ++b)
    surface_before_[b] = static_cast<std::uint32_t>(surface_.size());
}

// Surface number of the first surface voxel with an id >= `v` in the block of ids that contains `v`. If there
// is none, the number after the block's last surface voxel.
std::uint32_t Lattice::surface_from(VoxelId v) const noexcept {
  const auto block = v / kSurfaceBlock;
  const auto first = surface_.begin() + static_cast<std::ptrdiff_t>(surface_before_[block]),
             last = surface_.begin() + static_cast<std::ptrdiff_t>(surface_before_[block + 1]);
  return static_cast<std::uint32_t>(std::lower_bound(first, last, v) - surface_.begin());
}

std::uint32_t Lattice::surface_number(VoxelId v) const noexcept {
  if (inside(v / kRow) != 0) return kNoSurface;
  const std::uint32_t number = surface_from(v);
  return number < surface_.size() && surface_[number] == v ? number : kNoSurface;
}

std::array<std::uint32_t, 2> Lattice::surface_in(RowId row) const noexcept {
  if (inside(row) != 0) return {0, 0};
  const std::uint32_t first = surface_from(row * kRow);
  std::uint32_t last = first;
  while (last < surface_.size() && surface_[last] < (row + 1) * kRow) ++last;
  return {first, last};
}

glm::dvec3 Lattice::outward(VoxelId v) const noexcept {
  const auto c = coordinates(v);
  glm::dvec3 sum(0.0);
  for (int k = -1; k <= 1; ++k) {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        if (!filled(at(c[0] + i, c[1] + j, c[2] + k))) sum += glm::dvec3(i, j, k);
      }
    }
  }
  sum /= spacing_m_;
  const double length = glm::length(sum);
  return length > 0.0 ? sum / length : sum;
}

std::size_t Lattice::memory_bytes() const {
  return sizeof(*this) + label_.resident_bytes() + rows_.resident_bytes() + resident_bytes(listed_before_) +
         resident_bytes(anchored_) + resident_bytes(surface_) + resident_bytes(surface_before_) +
         block_.resident_bytes() + 3 * limits_[0].size() * (sizeof(LinkLimit) + sizeof(float));
}

}  // namespace voxel
