// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/interior_coarsening.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>

#include "voxel/volume/connected_components.h"

namespace voxel {
namespace {

template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  throw std::invalid_argument(text.str());
}

void check_options(const LabelVolume& volume, const ThinningOptions& options) {
  if (options.every < 2 || options.every > 64)
    refuse("thinning keeps every ", options.every, "th row of voxels; use every = 2 to 64");
  if (options.shell < 1 || options.shell > 63)
    refuse("thinning keeps a shell ", options.shell, " voxels thick; use shell = 1 to 63");
  const glm::dvec3& h = volume.spacing_m;
  const double smallest = std::min({h.x, h.y, h.z}), largest = std::max({h.x, h.y, h.z});
  const double middle = h.x + h.y + h.z - smallest - largest;
  // The middle of four voxels of the shell is half a diagonal from each of them. A voxel counts as a ball
  // with half the smallest spacing as radius.
  const double gap = 0.5 * options.stretch_max * std::hypot(largest, middle) - 0.5 * smallest;
  if (options.tool_radius_m >= gap) return;
  refuse(
      "a tool of radius ", options.tool_radius_m * 1e3,
      " mm fits between the voxels of a stretched shell, and behind it thinning leaves none; use a tool of ",
      gap * 1e3, " mm or more, a smaller spacing, or no thinning");
}

// Unused labels, largest first.
std::vector<std::uint8_t> free_labels(const LabelVolume& volume) {
  std::array<bool, 256> used{};
  for (const std::uint8_t label : volume.labels) used[label] = true;
  std::vector<std::uint8_t> spare;
  for (int label = 255; label > 0; --label) {
    if (!used[static_cast<std::size_t>(label)]) spare.push_back(static_cast<std::uint8_t>(label));
  }
  return spare;
}

class Thinner {
 public:
  Thinner(LabelVolume volume, const ThinningOptions& options) : options_(options) {
    result_.volume = std::move(volume);
  }

  Thinned thin() {
    choose_labels();
    mark();
    join_pieces();
    for (std::uint8_t& label : volume().labels) {
      if (!is_removed_[label]) continue;
      label = 0;
      ++result_.removed;
    }
    return std::move(result_);
  }

 private:
  LabelVolume& volume() { return result_.volume; }

  // Each stiff label gets one label for its struts and one for its removed voxels. The second label is
  // temporary: removed voxels still count as stiff, and join_pieces() may restore them.
  void choose_labels() {
    std::array<std::size_t, 256> count{};
    for (const std::uint8_t label : volume().labels) ++count[label];
    std::vector<std::uint8_t> spare = free_labels(volume());
    for (const std::uint8_t label : options_.labels) {
      if (label == 0 || count[label] == 0 || result_.strut_label[label] != 0) continue;
      if (spare.size() < 2) {
        refuse("the object uses so many of the 255 labels that none is left for the struts of label ",
               static_cast<int>(label), "; thin fewer labels, or join some");
      }
      result_.stiff += count[label];
      result_.strut_label[label] = spare[0];
      removed_label_[label] = spare[1];
      original_[spare[1]] = label;
      is_removed_[spare[1]] = true;
      for (const std::uint8_t one : {label, spare[0], spare[1]}) is_stiff_[one] = true;
      spare.erase(spare.begin(), spare.begin() + 2);
    }
    if (result_.stiff == 0)
      refuse("no voxel has a label that thinning names; name the labels of what is stiff");
  }

  // Marks struts along the edges of cubes, and the frame in or under the shell (see the header).
  void mark() {
    const LabelVolume& v = volume();
    std::vector<bool> inside(v.labels.size());
    for_each_stiff([&](const std::array<int, 3>& at, std::size_t index) {
      inside[index] = is_inside(at[0], at[1], at[2]);
    });
    const auto is_in = [&](std::array<int, 3> at, std::size_t d, int step) {
      at[d] += step;
      return at[d] >= 0 && at[d] < v.dims[d] && inside[v.index(at[0], at[1], at[2])];
    };
    for_each_stiff([&](const std::array<int, 3>& at, std::size_t index) {
      std::array<bool, 3> on{};
      for (std::size_t d = 0; d < 3; ++d) on[d] = at[d] % options_.every == 0;
      // A shell of one layer has the frame beneath it. A thicker shell has the frame in its innermost layer.
      const bool may_carry = inside[index] == (options_.shell == 1);
      bool strut = inside[index] && on[0] + on[1] + on[2] >= 2;
      for (std::size_t d = 0; d < 3 && may_carry && !strut; ++d) {
        const bool beside_other = is_in(at, d, -1) != inside[index] || is_in(at, d, 1) != inside[index];
        strut = beside_other && (on[(d + 1) % 3] || on[(d + 2) % 3]);
      }
      std::uint8_t& label = volume().labels[index];
      if (strut) {
        label = result_.strut_label[label];
      } else if (inside[index]) {
        label = removed_label_[label];
      }
    });
  }

  // Calls visit(place, index) for the voxels of the labels to be thinned.
  template <typename Visit>
  void for_each_stiff(const Visit& visit) {
    const std::array<int, 3>& n = volume().dims;
    std::size_t index = 0;
    for (int k = 0; k < n[2]; ++k) {
      for (int j = 0; j < n[1]; ++j) {
        for (int i = 0; i < n[0]; ++i, ++index) {
          if (removed_label_[volume().labels[index]] != 0) visit(std::array<int, 3>{i, j, k}, index);
        }
      }
    }
  }

  // True if all voxels within the shell's thickness are stiff, corners included.
  [[nodiscard]] bool is_inside(int i, int j, int k) {
    const int s = options_.shell;
    const std::array<int, 3>& n = volume().dims;
    if (i < s || j < s || k < s || i >= n[0] - s || j >= n[1] - s || k >= n[2] - s) return false;
    for (int c = k - s; c <= k + s; ++c) {
      for (int b = j - s; b <= j + s; ++b) {
        const std::uint8_t* row = &volume().labels[volume().index(i - s, b, c)];
        if (!std::all_of(row, row + 2 * s + 1, [&](std::uint8_t label) { return is_stiff_[label]; }))
          return false;
      }
    }
    return true;
  }

  // ---- connection

  [[nodiscard]] std::size_t row_of(int j, int k) {
    return static_cast<std::size_t>(j) +
           static_cast<std::size_t>(k) * static_cast<std::size_t>(volume().dims[1]);
  }

  void join_pieces() {
    std::vector<bool> before(256, true), after(256, true);
    before[0] = after[0] = false;
    for (std::size_t label = 0; label < 256; ++label) after[label] = after[label] && !is_removed_[label];
    const ConnectedRuns whole(volume(), before), kept(volume(), after);
    if (kept.pieces() == whole.pieces()) return;  // thinning can only split components
    // In each component of the whole object, the first kept component is the one that the others join.
    std::vector<std::uint32_t> first(whole.pieces(), ConnectedRuns::kNone);
    DisjointSets joined;
    for (std::uint32_t p = 0; p < kept.pieces(); ++p) joined.add();
    std::vector<std::vector<glm::ivec3>> loose(kept.pieces());
    for (std::size_t row = 0; row < kept.rows(); ++row) {
      for (std::size_t r = kept.row_begin(row); r < kept.row_begin(row + 1); ++r) {
        const ConnectedRuns::Run& run = kept.runs()[r];
        std::uint32_t& main = first[whole.piece_of(run.first, row)];
        if (main == ConnectedRuns::kNone) main = run.piece;
        if (main == run.piece) continue;
        const int j = static_cast<int>(row % static_cast<std::size_t>(volume().dims[1]));
        const int k = static_cast<int>(row / static_cast<std::size_t>(volume().dims[1]));
        for (int i = run.first; i <= run.last; ++i) loose[run.piece].emplace_back(i, j, k);
      }
    }
    for (std::uint32_t p = 0; p < kept.pieces(); ++p) {
      if (!loose[p].empty()) join_piece(p, loose[p], kept, joined);
    }
  }

  // Restores the shortest path, through removed voxels, from a component to any component that is not joined
  // to it yet. The path is short, because struts lie `every` apart. If the path leads to another loose
  // component, that component is joined in its own turn.
  void join_piece(std::uint32_t piece, const std::vector<glm::ivec3>& voxels, const ConnectedRuns& kept,
                  DisjointSets& joined) {
    static constexpr std::array<std::array<int, 3>, 6> kFaces{
        {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
    constexpr std::size_t kStart = std::numeric_limits<std::size_t>::max();
    std::map<std::size_t, std::size_t> from;  // voxel reached → the voxel before it
    std::vector<glm::ivec3> front = voxels, next;
    for (; !front.empty(); front.swap(next), next.clear()) {
      for (const glm::ivec3& at : front) {
        const std::size_t here = volume().index(at.x, at.y, at.z);
        for (const auto& d : kFaces) {
          const glm::ivec3 to = at + glm::ivec3(d[0], d[1], d[2]);
          if (to.x < 0 || to.y < 0 || to.z < 0 || to.x >= volume().dims[0] || to.y >= volume().dims[1] ||
              to.z >= volume().dims[2])
            continue;
          const std::size_t there = volume().index(to.x, to.y, to.z);
          const std::uint8_t label = volume().labels[there];
          if (is_removed_[label]) {
            if (from.emplace(there, from.count(here) != 0 ? here : kStart).second) next.push_back(to);
            continue;
          }
          const auto restored_there = restored_.find(there);
          const std::uint32_t other = restored_there != restored_.end()
                                          ? restored_there->second
                                          : kept.piece_of(to.x, row_of(to.y, to.z));
          if (other == ConnectedRuns::kNone || joined.find(other) == joined.find(piece)) continue;
          for (std::size_t v = from.count(here) != 0 ? here : kStart; v != kStart; v = from.at(v)) {
            std::uint8_t& restored = volume().labels[v];
            restored = result_.strut_label[original_[restored]];
            ++result_.joined;
            restored_[v] = piece;
          }
          joined.join(other, piece);
          return;
        }
      }
    }
  }

  ThinningOptions options_;
  Thinned result_;
  std::map<std::size_t, std::uint32_t> restored_;  // restored voxel → the component that it joins
  std::array<std::uint8_t, 256> removed_label_{}, original_{};  // by stiff label; by removed label
  std::array<bool, 256> is_stiff_{}, is_removed_{};
};

}  // namespace

Thinned thin_labels(LabelVolume volume, const ThinningOptions& options) {
  check_options(volume, options);
  return Thinner(std::move(volume), options).thin();
}

}  // namespace voxel
