// SPDX-License-Identifier: GPL-3.0-or-later
// Connected pieces of a label volume, and growing of labels.
#include "hybrid/geometry/surface_nets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "hybrid/geometry/label_checks.h"

namespace hybrid {
namespace {

using voxel::LabelVolume;

// A run of wanted voxels along x. Runs that touch are joined by union-find. Memory and time follow the number
// of runs, and there is no recursion.
struct Run {
  int j = 0, k = 0;
  int first = 0, last = 0;  // inclusive
  std::size_t piece = 0;    // index of a run of the same piece; the root has its own index
};

std::size_t root_of(std::vector<Run>& runs, std::size_t run) {
  while (runs[run].piece != run) {
    runs[run].piece = runs[runs[run].piece].piece;
    run = runs[run].piece;
  }
  return run;
}

// Joins the 6-connected runs of two neighbouring rows. Each row is a range of runs in order along x.
void join_rows(std::vector<Run>& runs, std::size_t a, std::size_t a_end, std::size_t b, std::size_t b_end) {
  while (a < a_end && b < b_end) {
    if (runs[a].first <= runs[b].last && runs[b].first <= runs[a].last) {
      const std::size_t ra = root_of(runs, a);
      const std::size_t rb = root_of(runs, b);
      runs[std::max(ra, rb)].piece = std::min(ra, rb);  // the first run of a piece in scan order is its root
    }
    if (runs[a].last < runs[b].last) {
      ++a;
    } else {
      ++b;
    }
  }
}

std::vector<Run> find_runs(const LabelVolume& volume, bool empty) {
  std::vector<Run> runs;
  const auto [nx, ny, nz] = volume.dims;
  std::vector<std::size_t> row_start;  // index of the first run of each row
  row_start.reserve(static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz) + 1);
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      const std::size_t row = row_start.size();
      row_start.push_back(runs.size());
      const std::uint8_t* labels = &volume.labels[volume.index(0, j, k)];
      for (int i = 0; i < nx; ++i) {
        if ((labels[i] == 0) != empty) continue;
        const int first = i;
        while (i + 1 < nx && (labels[i + 1] == 0) == empty) ++i;
        runs.push_back({j, k, first, i, runs.size()});
      }
      const std::size_t start = row_start[row];
      const std::size_t end = runs.size();
      if (j > 0) join_rows(runs, row_start[row - 1], start, start, end);
      if (k > 0) {
        const std::size_t under = row - static_cast<std::size_t>(ny);
        join_rows(runs, row_start[under], row_start[under + 1], start, end);
      }
    }
  }
  return runs;
}

void fill_run(LabelVolume& volume, const Run& run, std::uint8_t label) {
  std::uint8_t* labels = &volume.labels[volume.index(0, run.j, run.k)];
  std::fill(labels + run.first, labels + run.last + 1, label);
}

}  // namespace

void keep_largest_piece(LabelVolume& volume, bool fill_cavities) {
  check_volume(volume);
  if (volume.labels.empty()) return;
  {
    std::vector<Run> runs = find_runs(volume, false);
    std::vector<std::size_t> voxels(runs.size());
    for (std::size_t run = 0; run < runs.size(); ++run) {
      voxels[root_of(runs, run)] += static_cast<std::size_t>(runs[run].last - runs[run].first + 1);
    }
    const auto largest =
        static_cast<std::size_t>(std::max_element(voxels.begin(), voxels.end()) - voxels.begin());
    for (std::size_t run = 0; run < runs.size(); ++run) {
      if (root_of(runs, run) != largest) fill_run(volume, runs[run], 0);
    }
  }
  if (!fill_cavities) return;
  std::vector<Run> runs = find_runs(volume, true);
  std::vector<bool> open(runs.size());
  const auto [nx, ny, nz] = volume.dims;
  for (std::size_t run = 0; run < runs.size(); ++run) {
    const Run& r = runs[run];
    if (r.first == 0 || r.last == nx - 1 || r.j == 0 || r.j == ny - 1 || r.k == 0 || r.k == nz - 1) {
      open[root_of(runs, run)] = true;
    }
  }
  for (std::size_t run = 0; run < runs.size(); ++run) {
    if (!open[root_of(runs, run)]) fill_run(volume, runs[run], 1);
  }
}

// ---- Growing

namespace {

constexpr double kMostVoxels = 536'870'912.0;  // 2^29, four volumes of 512^3; about 3 GB while growing
constexpr float kFar = std::numeric_limits<float>::infinity();

// One line of the exact squared Euclidean distance transform (Felzenszwalb & Huttenlocher 2012). The result
// is the lower envelope of the parabolas f(q) + (h·(x − q))². A line without a finite value stays unchanged.
// Values above `limit` become infinite.
class DistanceLine {
 public:
  explicit DistanceLine(int longest)
      : value_(static_cast<std::size_t>(longest)),
        vertex_(static_cast<std::size_t>(longest)),
        from_(static_cast<std::size_t>(longest)) {}

  void transform(float* data, std::size_t stride, int length, double spacing, double limit) {
    const double h2 = spacing * spacing;
    int last = -1;  // index of the envelope's last parabola
    for (int q = 0; q < length; ++q) {
      const float sample = data[static_cast<std::size_t>(q) * stride];
      if (sample == kFar) continue;
      const double f = sample;
      double start = -std::numeric_limits<double>::infinity();
      while (last >= 0) {
        const int p = vertex_[static_cast<std::size_t>(last)];
        start = 0.5 * ((f - value_[static_cast<std::size_t>(last)]) / (h2 * (q - p)) + q + p);
        if (start > from_[static_cast<std::size_t>(last)]) break;
        --last;
      }
      if (last < 0) start = -std::numeric_limits<double>::infinity();
      ++last;
      vertex_[static_cast<std::size_t>(last)] = q;
      value_[static_cast<std::size_t>(last)] = f;
      from_[static_cast<std::size_t>(last)] = start;
    }
    if (last < 0) return;
    int at = 0;
    for (int x = 0; x < length; ++x) {
      while (at < last && from_[static_cast<std::size_t>(at) + 1] <= x) ++at;
      const double d = x - vertex_[static_cast<std::size_t>(at)];
      const double squared = value_[static_cast<std::size_t>(at)] + h2 * d * d;
      data[static_cast<std::size_t>(x) * stride] = squared <= limit ? static_cast<float>(squared) : kFar;
    }
  }

 private:
  std::vector<double> value_;
  std::vector<int> vertex_;
  std::vector<double> from_;  // start of each parabola in the envelope
};

struct Box {
  std::array<int, 3> low{}, high{};  // inclusive
  bool empty = true;
};

Box filled_box(const LabelVolume& volume) {
  Box box;
  const auto [nx, ny, nz] = volume.dims;
  box.low = {nx, ny, nz};
  box.high = {-1, -1, -1};
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      const std::uint8_t* labels = &volume.labels[volume.index(0, j, k)];
      for (int i = 0; i < nx; ++i) {
        if (labels[i] == 0) continue;
        const std::array<int, 3> at{i, j, k};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          box.low[axis] = std::min(box.low[axis], at[axis]);
          box.high[axis] = std::max(box.high[axis], at[axis]);
        }
        box.empty = false;
      }
    }
  }
  return box;
}

// The same labels on a larger lattice: `before` and `after` are the voxels added at the ends of each axis.
LabelVolume padded(const LabelVolume& volume, const std::array<int, 3>& before,
                   const std::array<int, 3>& after) {
  LabelVolume result;
  result.spacing_m = volume.spacing_m;
  result.rotation = volume.rotation;
  std::size_t count = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    result.dims[axis] = volume.dims[axis] + before[axis] + after[axis];
    count *= static_cast<std::size_t>(result.dims[axis]);
  }
  result.origin_m =
      volume.origin_m - volume.rotation * (glm::dvec3(before[0], before[1], before[2]) * volume.spacing_m);
  result.labels.assign(count, std::uint8_t{0});
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      const std::uint8_t* from = &volume.labels[volume.index(0, j, k)];
      std::copy(from, from + volume.dims[0],
                &result.labels[result.index(before[0], j + before[1], k + before[2])]);
    }
  }
  return result;
}

// Sets label 1 on empty voxels within `distance_m` of filled ones, inside `box`.
void label_near(LabelVolume& volume, const Box& box, double distance_m) {
  // Lengths are in units of the smallest spacing, so that their squares stay within a float's range. The
  // tolerance of 1e-6 is above the rounding of floats (6e-8), so rounding does not decide about a centre that
  // is exactly at the distance.
  const double unit_m = std::min({volume.spacing_m.x, volume.spacing_m.y, volume.spacing_m.z});
  const glm::dvec3 h = volume.spacing_m / unit_m;
  const double limit = distance_m / unit_m * (distance_m / unit_m) * (1.0 + 1e-6);
  std::array<int, 3> n{};
  for (std::size_t axis = 0; axis < 3; ++axis) n[axis] = box.high[axis] - box.low[axis] + 1;
  const auto nx = static_cast<std::size_t>(n[0]);
  const std::size_t nxy = nx * static_cast<std::size_t>(n[1]);
  std::vector<float> squared(nxy * static_cast<std::size_t>(n[2]), kFar);
  DistanceLine line(std::max({n[0], n[1], n[2]}));
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      const std::uint8_t* labels = &volume.labels[volume.index(box.low[0], j + box.low[1], k + box.low[2])];
      float* row = &squared[static_cast<std::size_t>(k) * nxy + static_cast<std::size_t>(j) * nx];
      for (int i = 0; i < n[0]; ++i) row[i] = labels[i] != 0 ? 0.0F : kFar;
      line.transform(row, 1, n[0], h.x, limit);
    }
    for (std::size_t i = 0; i < nx; ++i) {
      line.transform(&squared[static_cast<std::size_t>(k) * nxy + i], nx, n[1], h.y, limit);
    }
  }
  for (std::size_t ij = 0; ij < nxy; ++ij) line.transform(&squared[ij], nxy, n[2], h.z, limit);
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      std::uint8_t* labels = &volume.labels[volume.index(box.low[0], j + box.low[1], k + box.low[2])];
      const float* row = &squared[static_cast<std::size_t>(k) * nxy + static_cast<std::size_t>(j) * nx];
      for (int i = 0; i < n[0]; ++i) {
        if (labels[i] == 0 && row[i] != kFar) labels[i] = 1;
      }
    }
  }
}

}  // namespace

LabelVolume grow_labels(const LabelVolume& volume, double distance_m) {
  check_volume(volume);
  if (!(std::isfinite(distance_m) && distance_m >= 0.0)) {
    refuse("labels cannot be grown by ", distance_m, " m; give a finite distance of 0 or more");
  }
  Box box = volume.labels.empty() ? Box{} : filled_box(volume);
  if (box.empty || distance_m == 0.0) return volume;
  std::array<int, 3> before{}, after{};
  std::array<double, 3> reach{}, size{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    reach[axis] = std::floor(distance_m / volume.spacing_m[static_cast<int>(axis)] * (1.0 + 1e-6));
    const double low = std::min(0.0, box.low[axis] - reach[axis]);
    const double high = std::max(volume.dims[axis] - 1.0, box.high[axis] + reach[axis]);
    size[axis] = high - low + 1.0;
  }
  if (!(size[0] * size[1] * size[2] <= kMostVoxels)) {
    refuse("growing labels by ", distance_m, " m needs a lattice of ", size[0], " x ", size[1], " x ",
           size[2], " voxels, above the limit of ", kMostVoxels, "; grow by less or use a larger spacing");
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int steps = static_cast<int>(reach[axis]);
    before[axis] = std::max(0, steps - box.low[axis]);
    after[axis] = std::max(0, box.high[axis] + steps - (volume.dims[axis] - 1));
    box.low[axis] += before[axis] - steps;
    box.high[axis] += before[axis] + steps;
  }
  LabelVolume result = padded(volume, before, after);
  label_near(result, box, distance_m);
  return result;
}

}  // namespace hybrid
