// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/baseline/thesis_chainmail.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <string>

namespace voxel {
namespace {

constexpr std::size_t kMaxElements = std::size_t{1} << 29;  // the queue needs three bits for a direction
constexpr std::size_t kPrefetchCandidates = 24;  // candidates of the queue that are prefetched ahead
constexpr int kMapMargin = 8;                    // cells of the map on each side of the object at rest

bool same(const LinkMaterial& a, const LinkMaterial& b) {
  return a.young_Pa == b.young_Pa && a.poisson == b.poisson && a.stretch_min == b.stretch_min &&
         a.stretch_max == b.stretch_max && a.shear == b.shear;
}

double in_series(double a, double b) {
  return 2.0 * a * b / (a + b);
}

}  // namespace

ThesisChainMail::ThesisChainMail(const LabelVolume& volume, const LatticeOptions& options,
                                 const ThesisChainMailOptions& classic)
    : options_(classic), spacing_m_(volume.spacing_m) {
  fill(volume, options);
  fill_anchors(volume, options);
  queue_.resize(std::size_t{1} << 16);
}

void ThesisChainMail::fill(const LabelVolume& volume, const LatticeOptions& options) {
  std::size_t cells = 1, voxels = 1;
  for (std::size_t d = 0; d < 3; ++d) {
    dims_[d] = volume.dims[d] + 2;
    step_[2 * d] = static_cast<std::int64_t>(cells);
    step_[2 * d + 1] = -step_[2 * d];
    cells *= static_cast<std::size_t>(dims_[d]);
    voxels *= static_cast<std::size_t>(volume.dims[d]);
  }
  if (volume.labels.size() != voxels)
    throw std::invalid_argument("a label volume must hold one label a voxel");
  if (cells >= kMaxElements) {
    throw std::invalid_argument("the classic object holds at most " + std::to_string(kMaxElements) +
                                " cells, and this one has " + std::to_string(cells) +
                                "; give it a coarser spacing");
  }
  elements_.resize(cells);
  // Labels of equal material share a class, so that the tables stay small.
  std::array<int, 256> class_of{};
  class_of.fill(-1);
  std::vector<LinkMaterial> materials;
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      for (int i = 0; i < volume.dims[0]; ++i) {
        const std::uint8_t label = volume.labels[volume.index(i, j, k)];
        if (label == 0) continue;
        int& number = class_of[label];
        if (number < 0) {
          const LinkMaterial& m = options.materials[label];
          const auto found = std::find_if(materials.begin(), materials.end(),
                                          [&m](const LinkMaterial& other) { return same(m, other); });
          number = static_cast<int>(found - materials.begin());
          if (found == materials.end()) materials.push_back(m);
        }
        elements_[at(i, j, k)].info = static_cast<std::uint32_t>(number) | kFilled;
      }
    }
  }
  if (!materials.empty()) fill_tables(materials);
  for (ElementId v = 0; v < elements_.size(); ++v) {
    if (!filled(v)) continue;
    const auto empty = [this, v](std::int64_t step) { return !filled(static_cast<ElementId>(v + step)); };
    if (std::none_of(step_.begin(), step_.end(), empty)) continue;
    elements_[v].info |= kSurface;
    surface_.push_back(v);
  }
}

void ThesisChainMail::fill_tables(const std::vector<LinkMaterial>& materials) {
  classes_ = materials.size();
  const glm::dvec3 h = spacing_m_;
  for (std::uint32_t direction = 0; direction < kDirections; ++direction) {
    const auto d = static_cast<int>(direction / 2);
    const double length = h[d], area = h.x * h.y * h.z / length;
    for (const LinkMaterial& a : materials) {
      for (const LinkMaterial& b : materials) {
        // Half of a link belongs to each material: limits are means, springs are in series.
        const double shortest = (0.5 * (a.stretch_min + b.stretch_min) - 1.0) * length;
        const double longest = (0.5 * (a.stretch_max + b.stretch_max) - 1.0) * length;
        const double across = 0.5 * (a.shear + b.shear) * length;
        const auto shear_modulus = [](const LinkMaterial& m) {
          return across_modulus_Pa(m.young_Pa, m.poisson);
        };
        Limits limits;
        std::array<float, 3> springs{};
        for (int axis = 0; axis < 3; ++axis) {
          const auto n = static_cast<std::size_t>(axis);
          const bool along = axis == d, forward = direction % 2 == 0;
          limits.low[n] = static_cast<float>(!along ? -across : forward ? shortest : -longest);
          limits.high[n] = static_cast<float>(!along ? across : forward ? longest : -shortest);
          const double modulus =
              along ? in_series(a.young_Pa, b.young_Pa) : in_series(shear_modulus(a), shear_modulus(b));
          springs[n] = static_cast<float>(modulus * area / length);
        }
        limits_.push_back(limits);
        springs_.push_back(springs);
      }
    }
  }
}

void ThesisChainMail::fill_anchors(const LabelVolume& volume, const LatticeOptions& options) {
  std::array<int, 3> low = volume.dims, high{-1, -1, -1};
  const auto each = [&volume](const auto& visit) {
    for (int k = 0; k < volume.dims[2]; ++k)
      for (int j = 0; j < volume.dims[1]; ++j)
        for (int i = 0; i < volume.dims[0]; ++i)
          if (volume.labels[volume.index(i, j, k)] != 0) visit(std::array<int, 3>{i, j, k});
  };
  each([&](const std::array<int, 3>& c) {
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], c[d]);
      high[d] = std::max(high[d], c[d]);
    }
  });
  std::array<bool, 256> by_label{};
  for (const std::uint8_t label : options.anchor_labels) by_label[label] = true;
  each([&](const std::array<int, 3>& c) {
    bool anchored_here = by_label[volume.labels[volume.index(c[0], c[1], c[2])]];
    for (const std::string& face : options.anchor_faces) {
      const auto d = static_cast<std::size_t>(face.at(1) - 'x');
      anchored_here = anchored_here || c.at(d) == (face[0] == '-' ? low.at(d) : high.at(d));
    }
    if (anchored_here) elements_[at(c[0], c[1], c[2])].info |= kAnchored;
  });
  const auto nx = static_cast<std::size_t>(volume.dims[0]), ny = static_cast<std::size_t>(volume.dims[1]);
  for (const std::size_t index : options.anchor_voxels) {
    Element& e = elements_[at(static_cast<int>(index % nx), static_cast<int>(index / nx % ny),
                              static_cast<int>(index / (nx * ny)))];
    if ((e.info & kFilled) != 0) e.info |= kAnchored;
  }
}

ThesisChainMail::ElementId ThesisChainMail::at(int i, int j, int k) const {
  return static_cast<ElementId>((i + 1) + (j + 1) * step_[2] + (k + 1) * step_[4]);
}

glm::dvec3 ThesisChainMail::rest(ElementId v) const {
  const auto nx = static_cast<ElementId>(dims_[0]), ny = static_cast<ElementId>(dims_[1]);
  const ElementId i = v % nx, j = v / nx % ny, k = v / (nx * ny);
  return spacing_m_ * (glm::dvec3(i, j, k) - 1.0);  // the padding comes first
}

void ThesisChainMail::grow_queue() {  // the full queue has head == tail
  std::rotate(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(head_), queue_.end());
  head_ = 0;
  tail_ = queue_.size();
  queue_.resize(2 * queue_.size());
}

// Makes the neighbours of v candidates, except the one in direction `except`.
inline void ThesisChainMail::sponsor(ElementId v, std::uint32_t except) {
  for (std::uint32_t d = 0; d < kDirections; ++d) {
    if (d == except) continue;
    queue_[tail_] = static_cast<std::uint32_t>(v + step_[d]) << 3U | d;
    tail_ = (tail_ + 1) & (queue_.size() - 1);
    if (tail_ == head_) grow_queue();
  }
}

void ThesisChainMail::spread() {
  const std::uint64_t most = kMaxRounds * kDirections * elements_.size();
  while (head_ != tail_) {
    if (candidates_ == most) {
      gave_up_ = true;
      head_ = tail_ = 0;
      return;
    }
    const std::uint32_t entry = queue_[head_];
    // Prefetches a later candidate. Beyond the end of the queue this is a stale entry, which is harmless.
    __builtin_prefetch(&elements_[queue_[(head_ + kPrefetchCandidates) & (queue_.size() - 1)] >> 3U]);
    head_ = (head_ + 1) & (queue_.size() - 1);
    ++candidates_;
    const std::uint32_t direction = entry & 7U;
    const ElementId v = entry >> 3U, from = static_cast<ElementId>(v - step_[direction]);
    Element& candidate = elements_[v];
    if ((candidate.info & (kFilled | kAnchored)) != kFilled) continue;
    std::unique_lock<std::mutex> lock;
    if (options_.lock) lock = std::unique_lock(mutex_);
    const Limits& limits = limits_[pair(direction, from, v)];
    std::array<float, 3> u{};
    bool moved = false;
    for (std::size_t a = 0; a < 3; ++a) {
      const float by = elements_[from].u[a];
      u[a] = std::min(std::max(candidate.u[a], by + limits.low[a]), by + limits.high[a]);
      moved = moved || u[a] != candidate.u[a];
    }
    if (!moved) continue;
    set(v, u);
    sponsor(v, direction ^ 1U);
  }
}

void ThesisChainMail::set(ElementId v, const std::array<float, 3>& u) {
  const bool mapped = !map_.empty() && (elements_[v].info & kSurface) != 0;
  if (mapped) leave_map(v);
  elements_[v].u = u;
  if (mapped) enter_in_map(v);
}

void ThesisChainMail::move(std::span<const ElementId> sources, std::span<const glm::vec3> moves) {
  candidates_ = 0;
  gave_up_ = false;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const ElementId v = sources[i];
    if ((elements_[v].info & (kFilled | kAnchored)) != kFilled) continue;
    const std::array<float, 3>& u = elements_[v].u;
    set(v, {u[0] + moves[i].x, u[1] + moves[i].y, u[2] + moves[i].z});
    sponsor(v, kDirections);
  }
  spread();
}

void ThesisChainMail::make_map() {
  std::size_t cells = 1;
  for (const int n : dims_) cells *= static_cast<std::size_t>(n + 2 * kMapMargin);
  map_.assign(cells, kNone);
  for (const ElementId v : surface_) enter_in_map(v);
}

std::size_t ThesisChainMail::cell_of(const glm::dvec3& position) const {
  std::size_t cell = 0, stride = 1;
  for (int d = 0; d < 3; ++d) {
    const int n = dims_[static_cast<std::size_t>(d)] + 2 * kMapMargin;
    const double c = std::floor(position[d] / spacing_m_[d] + 0.5) + 1.0 + kMapMargin;
    if (!(c >= 0.0 && c < n)) return map_.size();
    cell += static_cast<std::size_t>(c) * stride;
    stride *= static_cast<std::size_t>(n);
  }
  return cell;
}

// A cell holds one element: the last one that entered.
void ThesisChainMail::enter_in_map(ElementId v) {
  const std::size_t cell = cell_of(position(v));
  if (cell < map_.size()) map_[cell] = v;
}
void ThesisChainMail::leave_map(ElementId v) {
  const std::size_t cell = cell_of(position(v));
  if (cell < map_.size() && map_[cell] == v) map_[cell] = kNone;
}

ThesisChainMail::ElementId ThesisChainMail::element_at(const glm::dvec3& point) const {
  const std::size_t cell = cell_of(point);
  if (cell >= map_.size()) return kNone;
  if (map_[cell] != kNone) return map_[cell];
  for (int n = 0; n < 27; ++n) {
    const glm::dvec3 step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const std::size_t other = cell_of(point + spacing_m_ * step);
    if (other >= map_.size() || map_[other] == kNone) continue;
    const glm::dvec3 apart = glm::abs(position(map_[other]) - point);
    if (apart.x <= 0.5 * spacing_m_.x && apart.y <= 0.5 * spacing_m_.y && apart.z <= 0.5 * spacing_m_.z)
      return map_[other];
  }
  return kNone;
}

ThesisChainMail::Touch ThesisChainMail::touch(const glm::dvec3& centre, double radius) {
  if (map_.empty()) make_map();
  const int points = options_.six_points ? 7 : 1;
  for (int p = 0; p < points; ++p) {
    glm::dvec3 point = centre;
    if (p > 0) point[(p - 1) / 2] += p % 2 == 1 ? radius : -radius;
    const ElementId found = element_at(point);
    if (found == kNone) continue;
    ElementId nearest = found;
    const auto distance = [this, &point](ElementId v) { return glm::distance(position(v), point); };
    for (const std::int64_t step : step_) {
      const auto v = static_cast<ElementId>(found + step);
      if ((elements_[v].info & kSurface) != 0 && distance(v) < distance(nearest)) nearest = v;
    }
    const glm::vec3 by(point - position(nearest));
    move({&nearest, 1}, {&by, 1});
    return {true, nearest, force_N(nearest)};
  }
  return {};
}

glm::dvec3 ThesisChainMail::force_N(ElementId v) const {
  glm::dvec3 force(0.0);
  for (std::uint32_t d = 0; d < kDirections; ++d) {
    ElementId a = v;
    for (auto b = static_cast<ElementId>(a + step_[d]); filled(b); b = static_cast<ElementId>(a + step_[d])) {
      const std::array<float, 3>& k = springs_[pair(d, a, b)];
      for (std::size_t n = 0; n < 3; ++n) {
        force[static_cast<int>(n)] += static_cast<double>(k[n]) * (static_cast<double>(elements_[b].u[n]) -
                                                                   static_cast<double>(elements_[a].u[n]));
      }
      a = b;
    }
  }
  return force;
}

std::array<float, 3> ThesisChainMail::relaxed(ElementId v) const {
  // A link is at rest if both ends have equal displacements. So it requires the displacement of its other
  // end.
  const std::array<float, 3>& u = elements_[v].u;
  std::array<double, 3> asked{}, weight{};
  for (std::uint32_t d = 0; d < kDirections; ++d) {
    const auto other = static_cast<ElementId>(v + step_[d]);
    if (!filled(other)) continue;
    const std::array<float, 3>& k = springs_[pair(d, v, other)];
    for (std::size_t a = 0; a < 3; ++a) {
      const double by =
          options_.movement == ThesisChainMailOptions::Movement::mean ? static_cast<double>(k[a]) : 1.0;
      asked[a] += by * (static_cast<double>(elements_[other].u[a]) - static_cast<double>(u[a]));
      weight[a] += by;
    }
  }
  std::array<float, 3> next = u;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(weight[a] > 0.0)) continue;
    const double part = options_.movement == ThesisChainMailOptions::Movement::mean ? weight[a] : 1.0;
    next[a] = static_cast<float>(static_cast<double>(u[a]) + options_.damping * asked[a] / part);
  }
  return next;
}

void ThesisChainMail::relax_all() {
  relaxed_.resize(elements_.size());
  const auto moves = [this](ElementId v) { return (elements_[v].info & (kFilled | kAnchored)) == kFilled; };
  const auto count = static_cast<ElementId>(elements_.size());
  for (ElementId v = 0; v < count; ++v) {
    if (moves(v)) relaxed_[v] = relaxed(v);
  }
  for (ElementId v = 0; v < count; ++v) {
    if (moves(v)) set(v, relaxed_[v]);
  }
}

void ThesisChainMail::relax_in_turn(std::uint64_t count) {
  std::size_t skipped = 0;
  while (count > 0 && skipped < elements_.size()) {
    if (++next_ >= elements_.size()) next_ = 0;
    ++skipped;
    if ((elements_[next_].info & (kFilled | kAnchored)) != kFilled) continue;
    std::unique_lock<std::mutex> lock;
    if (options_.lock) lock = std::unique_lock(mutex_);
    set(next_, relaxed(next_));
    skipped = 0;
    --count;
  }
}

void ThesisChainMail::reset() {
  for (Element& e : elements_) {
    if (e.u != std::array<float, 3>{}) e.u = {};
  }
  if (!map_.empty()) make_map();
}

std::size_t ThesisChainMail::memory_bytes() const {
  return elements_.size() * sizeof(Element) + limits_.size() * (sizeof(Limits) + sizeof(springs_[0])) +
         (surface_.size() + map_.size() + queue_.size()) * sizeof(ElementId) +
         relaxed_.size() * sizeof(relaxed_[0]);
}

}  // namespace voxel
