// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite_grid.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/link_weight.h"

namespace voxel {
namespace {

constexpr int kCoarsest = 5;  // nodes an edge
constexpr std::size_t kMostPressed = 2048;
constexpr int kTried = 10;                            // half width of level 0 where an object is tried
constexpr double kConverges = 0.85;                   // of what is left of rest stays in a cycle
constexpr double kMostOff = 0.05;                     // of the force, where boxes twice as wide have it
constexpr int kFromAnchors = 16;                      // voxels
constexpr double kLeastSeen = 0.8, kMostSeen = 1.25;  // of what anchors hold

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

// Has every link a cell on some side? One in a sheet, or a row, of single voxels has none.
bool has_thin_parts(const Lattice& lattice) {
  for (const VoxelId v : lattice.surface()) {
    const auto c = lattice.coordinates(v);
    std::uint32_t filled = 0;
    for (int n = 0; n < 27; ++n) {
      if (lattice.filled(lattice.at(c[0] + n % 3 - 1, c[1] + n / 3 % 3 - 1, c[2] + n / 9 - 1)))
        filled |= 1U << n;
    }
    for (int d = 0; d < 3; ++d) {
      if (!lattice.filled(lattice.up(v, d))) continue;
      const std::uint32_t parallels = parallel_links(filled, d);
      const auto there = [parallels](int p, int q) { return (parallels >> (p + 1 + 3 * (q + 1)) & 1U) != 0; };
      bool any = false;
      for (const int p : {-1, 1}) {
        for (const int q : {-1, 1}) any = any || (there(p, 0) && there(0, q) && there(p, q));
      }
      if (!any) return true;
    }
  }
  return false;
}

}  // namespace

std::string CompositeGrid::obstacle_to(const Lattice& lattice) {
  if (lattice.materials().size() != 2) return "it is of several materials";
  if (lattice.yields()) return "it keeps dents";
  if (lattice.has_bricks()) return "it is of the accurate energy";
  for (int d = 0; d < 3; ++d) {
    const LinkLimit& l = lattice.tightest(d);
    if (l.along_low >= 0.0F || l.along_high <= 0.0F || l.across <= 0.0F) return "its links have no slack";
  }
  if (has_thin_parts(lattice)) return "parts of it are one voxel thick";
  const double seen = CompositeGrid(lattice, kHalfWidth).anchors_seen();
  if (seen < kLeastSeen || seen > kMostSeen) return "coarse levels do not see what anchors hold";
  return CompositeGrid(lattice, kTried).wrong_somewhere();
}

// Asked of places all over the surface: from any state without a tool cycles come to rest, and a patch that
// is pressed feels what it does in boxes twice as wide. (Where a slot or an inclusion is as wide as the
// spacing of a level, what that is told to do may stretch links across it that it knows nothing of: such
// objects fail here.)
std::string CompositeGrid::wrong_somewhere() {
  constexpr std::size_t kPlaces = 12;
  constexpr int kCycles = 10, kFirst = 2, kPressedCycles = 24;
  constexpr double kDepth = 1.0;  // spacings
  CompositeGrid wide(lattice_, 2 * kTried, 2 * kHalfWidth);
  const auto surface = lattice_.surface();
  for (std::size_t n = 0; n < kPlaces; ++n) {
    const VoxelId v = surface[(2 * n + 1) * surface.size() / (2 * kPlaces)];
    const Place place = lattice_.coordinates(v);
    if (lattice_.anchored(v)) continue;
    begin(place);
    std::uint32_t random = 1;
    for (Level& level : levels_) {
      for (std::size_t i = 0; i < level.inverse[0].size(); ++i) {
        for (std::size_t a = 0; a < 3; ++a) {
          random = random * 1664525U + 1013904223U;
          level.u[a][i] =
              level.inverse[a][i] > 0.0F ? static_cast<float>(random >> 8U) * 0x1p-24F - 0.3F : 0.0F;
        }
      }
    }
    double before = energy_J();
    for (int c = 0; c < kCycles; ++c) {
      cycle();
      const double now = energy_J();
      if (c >= kFirst && !(now < kConverges * kConverges * before))
        return "coarse levels do not come to rest";
      before = now;
    }
    const glm::dvec3 outward = lattice_.outward(v), size = glm::abs(outward);
    if (outward == glm::dvec3(0.0) || !far_from_anchors(place)) continue;
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    glm::dvec3 normal(0.0);
    normal[axis] = outward[axis] > 0.0 ? -1.0 : 1.0;
    std::array<bool, 3> axes{};
    axes[index(axis)] = true;
    std::array<double, 2> felt_N{};
    for (CompositeGrid* const grid : {this, &wide}) {
      grid->begin(place);
      for (int c = 0; c < kPressedCycles; ++c) {
        grid->clear_pressed();
        grid->press(place, kDepth * lattice_.min_spacing_m() * normal, normal);
        grid->cycle(axes);
      }
      felt_N[grid == this ? 0 : 1] = glm::length(grid->force_on_tool_N());
    }
    if (!(std::fabs(felt_N[0] - felt_N[1]) < kMostOff * felt_N[1]))
      return "coarse levels know too little of its shape";
  }
  return {};
}

bool CompositeGrid::far_from_anchors(const Place& voxel) const noexcept {
  return !cells_.anchor_near(shifted(voxel), shifted(voxel), 2 * kFromAnchors);
}

CompositeGrid::CompositeGrid(const Lattice& lattice, int half_width, int coarse_half_width)
    : lattice_(lattice),
      cells_(lattice),
      half_width_(half_width == kWhole ? kWhole : std::max((half_width + 1) / 2 * 2, kHalfWidth)),
      coarse_half_width_(std::max((coarse_half_width + 1) / 2 * 2, kHalfWidth)) {
  const auto& dims = lattice.grid().dims;
  const std::uint8_t label = lattice.label(lattice.surface().front());
  tightest_ = std::numeric_limits<float>::max();
  for (int d = 0; d < 3; ++d) {
    const auto dd = index(d);
    const Spring& spring = lattice.spring_within(label, d);
    const LinkLimit& limit = lattice.limit_between(label, label, d);
    for (int axis = 0; axis < 3; ++axis) {
      spring_[dd][index(axis)] = spring.on(axis, d);
      room_[dd][index(axis)] = axis == d ? std::array<float, 2>{-limit.along_low, limit.along_high}
                                         : std::array<float, 2>{limit.across, limit.across};
      for (const float room : room_[dd][index(axis)]) tightest_ = std::min(tightest_, std::max(room, 1e-30F));
    }
  }
  pressed_.reserve(kMostPressed);
  const int largest = *std::max_element(dims.begin(), dims.end());
  const auto nodes = [largest](std::size_t l) { return (largest - 1 + (1 << l) - 1) / (1 << l) + 1; };
  while (half_width_ != kWhole && nodes(whole_) > 2 * half_width_of(whole_) + 1) ++whole_;
  std::size_t count = whole_ + 1;
  while (nodes(count - 1) > kCoarsest) ++count;
  levels_.resize(count);
  for (std::size_t l = 0; l < count; ++l) make_room(levels_[l], l);
  if (whole_ > 0) make_room(before_, 0);
  begin({dims[0] / 2, dims[1] / 2, dims[2] / 2});
}

void CompositeGrid::begin(const Place& centre) noexcept {
  centre_ = centre;
  const Place offset = cells_.offset();
  cells_.align_to(centre);
  const bool all_anew = offset != cells_.offset();
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    Level& level = levels_[l];
    const auto box = [&level] {
      const auto& line = level.line;
      return std::array<int, 6>{line[0].begin, line[1].begin, line[2].begin,
                                line[0].count, line[1].count, line[2].count};
    };
    const std::array<int, 6> before = box();  // no nodes at first
    lay_lines(level, l, shifted(centre));
    if (all_anew || before != box()) lay(level, l);
    for (auto* arrays : {&level.u, &level.held}) {
      for (Floats& axis : *arrays) std::fill(axis.begin(), axis.end(), 0.0F);
    }
    level.bounded = {};
  }
  for (std::size_t l = 0; l + 1 < levels_.size(); ++l) join(levels_[l], levels_[l + 1]);
  pressed_.clear();
}

void CompositeGrid::take_from(const CompositeGrid& other) noexcept {
  for (Level& level : levels_) {
    const auto& line = level.line;
    for (int k = 0; k < line[2].count; ++k) {
      for (int j = 0; j < line[1].count; ++j) {
        for (int i = 0; i < line[0].count; ++i) {
          const std::size_t n = level.node(i, j, k);
          const auto& offset = cells_.offset();
          const glm::dvec3 u =
              other.at({level.at(0, i) - offset[0], level.at(1, j) - offset[1], level.at(2, k) - offset[2]});
          for (std::size_t a = 0; a < 3; ++a)
            level.u[a][n] = level.inverse[a][n] != 0.0F || line[a].open_low || line[a].open_high
                                ? static_cast<float>(u[static_cast<int>(a)])
                                : 0.0F;
        }
      }
    }
  }
}

void CompositeGrid::fine_box(Place& low, Place& high) const noexcept {
  const auto& line = levels_[0].line;
  for (std::size_t d = 0; d < 3; ++d) {
    low[d] = std::max(line[d].begin + line[d].first - cells_.offset()[d], 0);
    high[d] = std::min(line[d].begin + line[d].last - cells_.offset()[d], lattice_.grid().dims[d] - 1);
  }
}

bool CompositeGrid::centre_on(const Place& centre) noexcept {
  bool moves = false;
  for (std::size_t d = 0; d < 3; ++d) moves = moves || std::abs(centre[d] - centre_[d]) >= 2;
  if (!moves || whole_ == 0) return false;
  centre_ = centre;
  bool joins = false;
  for (std::size_t l = whole_; l-- > 0;) {
    Level& level = levels_[l];
    before_.line = level.line;  // assigned element by element: the same sizes, nothing is allocated
    before_.step = level.step;
    before_.stride = level.stride;
    before_.plane = level.plane;
    lay_lines(level, l, shifted(centre));
    bool moved = false;
    for (std::size_t d = 0; d < 3; ++d)
      moved = moved || level.line[d].begin != before_.line[d].begin ||
              level.line[d].count != before_.line[d].count;
    if (moved) {
      const std::size_t floats = before_.first_row() + before_.floats() + kPad;
      for (std::size_t a = 0; a < 3; ++a) {
        std::copy_n(level.u[a].begin(), floats, before_.u[a].begin());
        std::copy_n(level.held[a].begin(), floats, before_.held[a].begin());
        std::fill(level.u[a].begin(), level.u[a].end(), 0.0F);
        std::fill(level.held[a].begin(), level.held[a].end(), 0.0F);
      }
      const auto& line = level.line;
      Place by{};
      for (std::size_t d = 0; d < 3; ++d) by[d] = (line[d].begin - before_.line[d].begin) / level.step;
      for (int k = 0; k < line[2].count; ++k) {
        for (int j = 0; j < line[1].count; ++j) {
          for (int i = 0; i < line[0].count; ++i) {
            const Place was{i + by[0], j + by[1], k + by[2]};
            bool known = true;
            for (std::size_t d = 0; d < 3; ++d)
              known = known && was[d] >= 0 && was[d] < before_.line[d].count;
            const std::size_t to = level.node(i, j, k);
            if (known) {
              const std::size_t from = before_.node(was[0], was[1], was[2]);
              for (std::size_t a = 0; a < 3; ++a) {
                level.u[a][to] = before_.u[a][from];
                level.held[a][to] = before_.held[a][from];
              }
              continue;
            }
            const glm::dvec3 u = interpolate(
                levels_[l + 1], {static_cast<double>(level.at(0, i)), static_cast<double>(level.at(1, j)),
                                 static_cast<double>(level.at(2, k))});
            for (std::size_t a = 0; a < 3; ++a) level.u[a][to] = static_cast<float>(u[static_cast<int>(a)]);
          }
        }
      }
      lay(level, l);
    }
    if (moved || joins) join(level, levels_[l + 1]);
    joins = moved;
  }
  return joins;
}

bool CompositeGrid::in_fine_box(const Place& voxel) const noexcept {
  const Place p = shifted(voxel);
  const Level& level = levels_[0];
  for (std::size_t d = 0; d < 3; ++d) {
    const int i = p[d] - level.line[d].begin;
    if (i < level.line[d].first || i > level.line[d].last) return false;
  }
  return level.inverse[0][fine_node(voxel)] != 0.0F;
}

std::size_t CompositeGrid::fine_node(const Place& voxel) const {
  const Place p = shifted(voxel);
  const Level& level = levels_[0];
  return level.node(p[0] - level.line[0].begin, p[1] - level.line[1].begin, p[2] - level.line[2].begin);
}

glm::dvec3 CompositeGrid::fine_at(const Place& voxel) const noexcept {
  const std::size_t n = fine_node(voxel);
  return {levels_[0].u[0][n], levels_[0].u[1][n], levels_[0].u[2][n]};
}

void CompositeGrid::set_fine(const Place& voxel, const glm::dvec3& u) noexcept {
  const std::size_t n = fine_node(voxel);
  for (std::size_t a = 0; a < 3; ++a) levels_[0].u[a][n] = static_cast<float>(u[static_cast<int>(a)]);
}

glm::dvec3 CompositeGrid::link_minimum(const Place& voxel) const noexcept {
  const Level& level = levels_[0];
  const std::size_t n = fine_node(voxel);
  glm::dvec3 place(0.0);
  for (std::size_t a = 0; a < 3; ++a) {
    double sum = 0.0;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
      sum += static_cast<double>(spring_[d][a] * (level.weight[d][n] * level.u[a][n + by] +
                                                  level.weight[d][n - by] * level.u[a][n - by]));
    }
    place[static_cast<int>(a)] = sum * static_cast<double>(level.inverse[a][n]);
  }
  return place;
}

glm::dvec3 CompositeGrid::compliance(const Place& voxel) const noexcept {
  const std::size_t n = fine_node(voxel);
  return {levels_[0].inverse[0][n], levels_[0].inverse[1][n], levels_[0].inverse[2][n]};
}

glm::dvec3 CompositeGrid::within_anchors(const Place& voxel, const glm::dvec3& u) const noexcept {
  glm::dvec3 result = u;
  const auto& dims = lattice_.grid().dims;
  for (std::size_t d = 0; d < 3; ++d) {
    for (const std::size_t end : {std::size_t{0}, std::size_t{1}}) {
      if (cells_.anchored_part(d, end) < 1.0) continue;
      const int links = end == 1 ? dims[d] - 1 - voxel[d] : voxel[d];
      for (std::size_t a = 0; a < 3; ++a) {
        // Beyond the low face u = u(b) − u(a) of a chain of links, beyond the high one the reverse.
        const double shorter = links * static_cast<double>(room_[d][a][0]),
                     longer = links * static_cast<double>(room_[d][a][1]);
        double& at = result[static_cast<int>(a)];
        at = std::clamp(at, end == 1 ? -longer : -shorter, end == 1 ? shorter : longer);
      }
    }
  }
  return result;
}

void CompositeGrid::press(const Place& voxel, const glm::dvec3& u, const glm::dvec3& normal) noexcept {
  if (pressed_.size() == kMostPressed) return;
  const Place p = shifted(voxel);
  const auto& line = levels_[0].line;
  pressed_.push_back(
      {{p[0] - line[0].begin, p[1] - line[1].begin, p[2] - line[2].begin}, glm::vec3(u), glm::vec3(normal)});
}

// What of a node's cell across d lies within its level's box: beyond a side there is half of it.
double CompositeGrid::share_of(const Level& level, std::size_t d, int i) noexcept {
  const Line& line = level.line[d];
  return (i < line.first && line.open_low) || (i > line.last && line.open_high) ? 0.5 : 1.0;
}

// … and within the finer level's.
double CompositeGrid::covered(std::size_t l, std::size_t d, int i) const noexcept {
  if (l == 0) return 0.0;
  const Line& fine = levels_[l - 1].line[d];
  const int here = fine.fine[index(i)];
  if (here == kOutside) return 0.0;
  return (here < fine.first && fine.open_low) || (here > fine.last && fine.open_high) ? 0.5 : 1.0;
}

// What anchors hold of a node (its number in its level) in direction d, and not of others.
double CompositeGrid::part_of_hold(std::size_t l, std::size_t number, std::size_t d) const noexcept {
  const Level& level = levels_[l];
  const Place node{static_cast<int>(number % level.stride),
                   static_cast<int>(number % level.plane / level.stride),
                   static_cast<int>(number / level.plane)};
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  if (share_of(level, d, node[d]) < 1.0) return 0.0;
  const double under = covered(l, d, node[d]) == 1.0 ? covered(l, e, node[e]) * covered(l, f, node[f]) : 0.0;
  return share_of(level, e, node[e]) * share_of(level, f, node[f]) * (1.0 - under);
}

// Likewise of the link up.
double CompositeGrid::part_of_link(std::size_t l, std::size_t number, std::size_t d) const noexcept {
  const Level& level = levels_[l];
  const Place node{static_cast<int>(number % level.stride),
                   static_cast<int>(number % level.plane / level.stride),
                   static_cast<int>(number / level.plane)};
  const std::size_t e = (d + 1) % 3, f = (d + 2) % 3;
  const bool inside = covered(l, d, node[d]) > 0.0 && covered(l, d, node[d] + 1) > 0.0;
  const double under = inside ? covered(l, e, node[e]) * covered(l, f, node[f]) : 0.0;
  return share_of(level, e, node[e]) * share_of(level, f, node[f]) * (1.0 - under);
}

glm::dvec3 CompositeGrid::force_on_tool_N() const noexcept {
  glm::dvec3 carried(0.0);
  for (std::size_t l = 0; l <= whole_; ++l) {
    const Level& level = levels_[l];
    const std::size_t first = level.first_row(), end = first + level.floats();
    for (std::size_t d = 0; d < 3; ++d) {
      const float* const hold = level.hold[d].data();
      for (std::size_t n = first; n < end; ++n) {
        if (hold[n] == 0.0F) continue;
        const double part = part_of_hold(l, n - first, d);
        for (std::size_t a = 0; a < 3; ++a)
          carried[static_cast<int>(a)] += part * static_cast<double>(hold[n] * spring_[d][a] * level.u[a][n]);
      }
    }
  }
  return -carried;
}

double CompositeGrid::anchors_seen() const noexcept {
  double all = 0.0;
  for (RowId row = 0; row < lattice_.grid().rows(); ++row) {
    std::uint32_t lanes = lattice_.anchored_lanes(row);
    for (; lanes != 0; lanes &= lanes - 1) {
      const VoxelId v = row * kRow + static_cast<VoxelId>(__builtin_ctz(lanes));
      for (int d = 0; d < 3; ++d) {
        for (const VoxelId w : {lattice_.up(v, d), lattice_.down(v, d)})
          all += lattice_.filled(w) && !lattice_.anchored(w) ? 1.0 : 0.0;
      }
    }
  }
  return all > 0.0 ? levels_[whole_].held_area / all : 0.0;
}

double CompositeGrid::most_beyond_limits() const noexcept {
  const Level& level = levels_[0];
  const auto& line = level.line;
  double most = 0.0;
  for (int k = line[2].first; k <= line[2].last; ++k) {
    for (int j = line[1].first; j <= line[1].last; ++j) {
      for (int i = line[0].first; i <= line[0].last; ++i) {
        const std::size_t n = level.node(i, j, k);
        for (std::size_t d = 0; d < 3; ++d) {
          if (level.weight[d][n] == 0.0F) continue;
          const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
          for (std::size_t a = 0; a < 3; ++a) {
            const float longer = level.u[a][n + by] - level.u[a][n];
            most = std::max(most,
                            static_cast<double>(std::max(longer - room_[d][a][1], -longer - room_[d][a][0])));
          }
        }
      }
    }
  }
  return most;
}

double CompositeGrid::energy_J() const noexcept {
  double energy = 0.0;
  for (std::size_t l = 0; l <= whole_; ++l) {
    const Level& level = levels_[l];
    const std::size_t first = level.first_row(), end = first + level.floats();
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t by = d == 0 ? 1 : d == 1 ? level.stride : level.plane;
      const float *const link = level.weight[d].data(), *const hold = level.hold[d].data();
      for (std::size_t n = first; n < end; ++n) {
        if (link[n] == 0.0F && hold[n] == 0.0F) continue;
        double of_link = 0.0, of_hold = 0.0;
        for (std::size_t a = 0; a < 3; ++a) {
          const float* u = level.u[a].data() + n;
          const double k = 0.5 * static_cast<double>(spring_[d][a]), longer = static_cast<double>(u[by] - *u);
          of_link += k * static_cast<double>(link[n]) * longer * longer;
          of_hold += k * static_cast<double>(hold[n] * *u * *u);
        }
        if (of_link != 0.0) energy += of_link * part_of_link(l, n - first, d);
        if (of_hold != 0.0) energy += of_hold * part_of_hold(l, n - first, d);
      }
    }
  }
  return energy;
}

// At a place of which a node is near.
glm::dvec3 CompositeGrid::interpolate(const Level& level, const std::array<double, 3>& place) const noexcept {
  std::array<int, 3> node{};
  std::array<float, 3> part{};
  for (std::size_t d = 0; d < 3; ++d) {
    const Line& line = level.line[d];
    const double steps = (place[d] - line.begin) / level.step;
    node[d] = std::clamp(static_cast<int>(steps), 0, std::max(0, line.count - 2));
    part[d] = static_cast<float>(std::clamp(steps - node[d], 0.0, line.count > 1 ? 1.0 : 0.0));
  }
  const std::size_t first = level.node(node[0], node[1], node[2]);
  std::array<float, 3> sum{};
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1, j = (corner >> 1) & 1, k = corner >> 2;
    const float w = (i != 0 ? part[0] : 1.0F - part[0]) * (j != 0 ? part[1] : 1.0F - part[1]) *
                    (k != 0 ? part[2] : 1.0F - part[2]);
    if (w == 0.0F) continue;
    const std::size_t at = first + index(i) + index(j) * level.stride + index(k) * level.plane;
    for (std::size_t a = 0; a < 3; ++a) sum[a] += w * level.u[a][at];
  }
  return {sum[0], sum[1], sum[2]};
}

glm::dvec3 CompositeGrid::at_point(const std::array<double, 3>& point) const noexcept {
  const std::array<double, 3> place{point[0] + cells_.offset()[0], point[1] + cells_.offset()[1],
                                    point[2] + cells_.offset()[2]};
  for (std::size_t l = 0; l < whole_; ++l) {
    const Level& level = levels_[l];
    bool inside = true;
    for (std::size_t d = 0; d < 3; ++d) {
      const Line& line = level.line[d];
      inside = inside && (!line.open_low || place[d] >= line.begin) &&
               (!line.open_high || place[d] <= level.at(d, line.count - 1));
    }
    if (inside) return interpolate(level, place);
  }
  return interpolate(levels_[whole_], place);
}

glm::dvec3 CompositeGrid::at(const Place& voxel) const noexcept {
  return at_point(
      {static_cast<double>(voxel[0]), static_cast<double>(voxel[1]), static_cast<double>(voxel[2])});
}

std::size_t CompositeGrid::memory_bytes() const {
  std::size_t bytes =
      levels_.capacity() * sizeof(Level) + pressed_.capacity() * sizeof(Pressed) + cells_.memory_bytes();
  const auto add = [&bytes](const Level& level) {
    for (const auto* arrays :
         {&level.u, &level.held, &level.weight, &level.hold, &level.inverse, &level.all}) {
      for (const Floats& array : *arrays) bytes += array.capacity() * sizeof(float);
    }
    for (const Floats* array : {&level.f, &level.old, &level.residual, &level.follows, &level.stuck,
                                &level.drag, &level.with_drag, &level.bound[0], &level.bound[1]})
      bytes += array->capacity() * sizeof(float);
    bytes += level.ghosts.capacity() * sizeof(Ghost) + level.beside.capacity() * sizeof(std::uint32_t);
  };
  for (const Level& level : levels_) add(level);
  add(before_);
  for (const Floats& plane : halves_) bytes += plane.capacity() * sizeof(float);
  return bytes;
}

}  // namespace voxel
