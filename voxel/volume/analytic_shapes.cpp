// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/analytic_shapes.h"

#include <algorithm>
#include <cmath>

#include "voxel/volume/invalid_argument.h"

namespace voxel {
namespace {

// Rounding tolerance (unit: spacing). With it, a voxel centre on a boundary is treated alike on every side of
// a shape.
constexpr double kRounding = 1e-9;

constexpr std::array<char, 3> kAxis{'x', 'y', 'z'};

bool positive(double value) {
  return std::isfinite(value) && value > 0.0;
}

void check_formula(const Formula& formula) {
  const bool ball = formula.shape == Formula::Shape::ball;
  for (int axis = 0; axis < 3; ++axis) {
    if (!positive(formula.spacing_m[axis])) {
      refuse("the formula's spacing along ", kAxis[axis], " is ", formula.spacing_m[axis],
             " m; give a finite length above 0");
    }
    const double size = ball ? formula.size_m.x : formula.size_m[axis];
    if (!positive(size)) {
      refuse("the formula's ", ball ? "ball diameter" : "block size", " along ", kAxis[axis], " is ", size,
             " m; give a finite length above 0");
    }
  }
  if (formula.label == 0) refuse("the formula's label is 0, which means empty; give a label from 1 to 255");
  if (ball && !formula.layers.empty())
    refuse("the formula is a ball with layers; only a block can have layers");
  for (std::size_t n = 0; n < formula.layers.size(); ++n) {
    if (!positive(formula.layers[n].thickness_m)) {
      refuse("layer ", n + 1, " of the formula is ", formula.layers[n].thickness_m,
             " m thick; give a finite thickness above 0");
    }
  }
  for (std::size_t n = 0; n < formula.inclusions.size(); ++n) {
    const Inclusion& inclusion = formula.inclusions[n];
    for (int axis = 0; axis < 3; ++axis) {
      const double size =
          inclusion.shape == Inclusion::Shape::ball ? inclusion.size_m.x : inclusion.size_m[axis];
      if (!positive(size) || !std::isfinite(inclusion.centre_m[axis])) {
        refuse("inclusion ", n + 1, " of the formula has size ", size, " m and centre ",
               inclusion.centre_m[axis], " m along ", kAxis[axis],
               "; give a finite size above 0 and a finite centre");
      }
    }
  }
}

LabelVolume empty_lattice(const Formula& formula, std::size_t max_voxels) {
  const bool ball = formula.shape == Formula::Shape::ball;
  LabelVolume volume;
  volume.spacing_m = formula.spacing_m;
  std::array<double, 3> counts{};
  for (int axis = 0; axis < 3; ++axis) {
    const double size = ball ? formula.size_m.x : formula.size_m[axis];
    counts[axis] = std::round(size / formula.spacing_m[axis]);
    if (counts[axis] < 1.0) {
      refuse("the formula's size of ", size, " m along ", kAxis[axis],
             " is less than half of its spacing of ", formula.spacing_m[axis],
             " m, so it has no voxel; make the spacing smaller");
    }
  }
  // The product is a double, because it may exceed any integer type.
  const double total = counts[0] * counts[1] * counts[2];
  constexpr double kLongest = 1e9;  // an axis must fit in an int
  if (!(total <= static_cast<double>(max_voxels)) || std::max({counts[0], counts[1], counts[2]}) > kLongest) {
    refuse("the formula would have ", counts[0], " x ", counts[1], " x ", counts[2], " = ", total,
           " voxels, above the limit of ", max_voxels, "; make the spacing larger or the shape smaller");
  }
  for (int axis = 0; axis < 3; ++axis) {
    volume.dims[axis] = static_cast<int>(counts[axis]);
    volume.origin_m[axis] = -0.5 * (counts[axis] - 1.0) * formula.spacing_m[axis];
  }
  volume.labels.assign(static_cast<std::size_t>(total), std::uint8_t{0});
  return volume;
}

// The label of each slice of the block. A slice whose voxel centres lie exactly on a layer boundary belongs
// to the upper layer.
std::vector<std::uint8_t> slice_labels(const Formula& formula, int slices) {
  const double spacing = formula.spacing_m.z;
  const double height = slices * spacing;
  std::vector<std::uint8_t> labels(static_cast<std::size_t>(slices), formula.label);
  double top = 0.0;
  int slice = 0;
  for (const Layer& layer : formula.layers) {
    top += layer.thickness_m;
    for (; slice < slices && (slice + 0.5 + kRounding) * spacing < top; ++slice) {
      labels[static_cast<std::size_t>(slice)] = layer.label;
    }
  }
  if (top > height + 0.5 * spacing) {
    refuse("the formula's layers are together ", top, " m thick, but its block is only ", height,
           " m high; make them thinner or the block higher");
  }
  return labels;
}

struct IndexRange {
  int first = 0, last = -1;  // inclusive
};

// Lattice indices along one axis whose centres can lie within `half` of `centre`.
IndexRange indices_near(const LabelVolume& volume, int axis, double centre, double half) {
  const double spacing = volume.spacing_m[axis];
  const double first = std::ceil((centre - half - volume.origin_m[axis]) / spacing - kRounding);
  const double last = std::floor((centre + half - volume.origin_m[axis]) / spacing + kRounding);
  const double end = volume.dims[axis] - 1.0;
  if (last < 0.0 || first > end) return {};
  return {static_cast<int>(std::max(first, 0.0)), static_cast<int>(std::min(last, end))};
}

// Calls visit(label) for each voxel whose centre lies in the box, or in the ball when `round`.
template <typename Visit>
void for_each_inside(LabelVolume& volume, bool round, const glm::dvec3& centre, const glm::dvec3& size,
                     Visit visit) {
  const glm::dvec3 half = 0.5 * (round ? glm::dvec3(size.x) : size);
  std::array<IndexRange, 3> range;
  for (int axis = 0; axis < 3; ++axis) range[axis] = indices_near(volume, axis, centre[axis], half[axis]);
  const double limit = half.x * half.x * (1.0 + kRounding);
  const auto offset = [&](int axis, int index) {
    return volume.origin_m[axis] + index * volume.spacing_m[axis] - centre[axis];
  };
  for (int k = range[2].first; k <= range[2].last; ++k) {
    for (int j = range[1].first; j <= range[1].last; ++j) {
      const double rest = limit - offset(1, j) * offset(1, j) - offset(2, k) * offset(2, k);
      for (int i = range[0].first; i <= range[0].last; ++i) {
        if (!round || offset(0, i) * offset(0, i) <= rest) visit(volume.labels[volume.index(i, j, k)]);
      }
    }
  }
}

}  // namespace

LabelVolume make_volume(const Formula& formula, std::size_t max_voxels) {
  check_formula(formula);
  LabelVolume volume = empty_lattice(formula, max_voxels);
  if (formula.shape == Formula::Shape::ball) {
    for_each_inside(volume, true, glm::dvec3(0.0), formula.size_m,
                    [&](std::uint8_t& label) { label = formula.label; });
  } else {
    const std::vector<std::uint8_t> labels = slice_labels(formula, volume.dims[2]);
    for (int k = 0; k < volume.dims[2]; ++k) {
      std::fill(volume.labels.begin() + static_cast<std::ptrdiff_t>(volume.index(0, 0, k)),
                volume.labels.begin() + static_cast<std::ptrdiff_t>(volume.index(0, 0, k + 1)),
                labels[static_cast<std::size_t>(k)]);
    }
  }
  // An inclusion replaces material inside the shape; outside, voxels stay empty. The test uses the shape, not
  // the labels: a later inclusion may fill a cavity (label 0) of an earlier one.
  std::vector<std::uint8_t> shape;
  if (!formula.inclusions.empty() && formula.shape == Formula::Shape::ball) shape = volume.labels;
  for (const Inclusion& inclusion : formula.inclusions) {
    for_each_inside(volume, inclusion.shape == Inclusion::Shape::ball, inclusion.centre_m, inclusion.size_m,
                    [&](std::uint8_t& label) {
                      const auto at = static_cast<std::size_t>(&label - volume.labels.data());
                      if (shape.empty() || shape[at] != 0) label = inclusion.label;
                    });
  }
  return volume;
}

}  // namespace voxel
