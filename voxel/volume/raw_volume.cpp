// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/raw_volume.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <numbers>
#include <type_traits>

namespace voxel {
namespace {

constexpr double kShortest = 1e-9, kLongest = 1e6;  // (unit: meter) edge of a voxel
constexpr double kLongestAxis = 1e6;                // (unit: voxel) a longer axis means a broken header

// Calls visit with a zero of the component's type.
template <typename Visit>
auto visit_component(Component component, Visit visit) {
  switch (component) {
    case Component::uint8:
      return visit(std::uint8_t{});
    case Component::int8:
      return visit(std::int8_t{});
    case Component::uint16:
      return visit(std::uint16_t{});
    case Component::int16:
      return visit(std::int16_t{});
    case Component::uint32:
      return visit(std::uint32_t{});
    case Component::int32:
      return visit(std::int32_t{});
    case Component::uint64:
      return visit(std::uint64_t{});
    case Component::int64:
      return visit(std::int64_t{});
    case Component::float32:
      return visit(float{});
    case Component::float64:
      break;
  }
  return visit(double{});
}

template <typename T>
T value_at(std::span<const std::byte> bytes, std::size_t index) {
  T value;
  std::memcpy(&value, &bytes[index * sizeof(T)], sizeof(T));
  return value;
}

std::string megabytes(double bytes) {
  std::ostringstream text;
  text.precision(4);
  text << bytes / 1e6 << " MB";
  return text.str();
}

// Removes the file's float rounding: signed permutations of the axes become exact, other matrices orthonormal
// to double precision.
glm::dmat3 exact_axes(const glm::dmat3& direction) {
  glm::dmat3 snapped(0.0);
  bool permutation = true;
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) {
      snapped[c][r] = std::round(direction[c][r]);
      permutation = permutation && std::abs(direction[c][r] - snapped[c][r]) < 1e-5;
    }
  }
  if (permutation) return snapped;
  const glm::dvec3 x = glm::normalize(direction[0]);
  const glm::dvec3 y = glm::normalize(direction[1] - glm::dot(direction[1], x) * x);
  const double handed = glm::determinant(direction) < 0.0 ? -1.0 : 1.0;
  return {x, y, handed * glm::cross(x, y)};
}

// Quaternion of a rotation. The 24 rotations that permute axes have only components 0, 1/2, sqrt(1/2) and 1,
// which are set exactly.
glm::dquat quaternion_of(const glm::dmat3& rotation) {
  glm::dquat q = glm::normalize(glm::quat_cast(rotation));
  for (int n = 0; n < 4; ++n) {
    for (const double exact : {0.0, 0.5, std::numbers::sqrt2 / 2.0, 1.0}) {
      if (std::abs(std::abs(q[n]) - exact) < 1e-12) q[n] = std::copysign(exact, q[n]);
    }
    if (q[n] == 0.0) q[n] = 0.0;  // no negative zero
  }
  return q;
}

void check_frame(const std::filesystem::path& path, const FileFrame& frame) {
  for (int axis = 0; axis < 3; ++axis) {
    const double n = frame.dims[static_cast<std::size_t>(axis)];
    if (!(n >= 1.0 && n <= kLongestAxis)) {
      refuse_volume(path, "the header says ", n, " voxels along axis ", axis + 1,
                    "; a volume has 1 to 1,000,000 along each. Export the volume again");
    }
    const double h = frame.spacing[axis];
    if (!(std::isfinite(h) && h > 0.0)) {
      refuse_volume(path, "the header says a voxel spacing of ", h, " along axis ", axis + 1,
                    "; it must be a finite length above 0. Correct the header or export the volume again");
    }
    if (!std::isfinite(frame.origin[axis])) {
      refuse_volume(path, "the header's origin is ", frame.origin[axis], " along axis ", axis + 1,
                    "; it must be finite. Correct the header or export the volume again");
    }
  }
  double worst = 0.0;
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      const double error = std::abs(glm::dot(frame.direction[a], frame.direction[b]) - (a == b ? 1.0 : 0.0));
      worst = std::isfinite(error) ? std::max(worst, error) : std::numeric_limits<double>::infinity();
    }
  }
  // A tilted gantry gives errors of tens of percent, rounding in a header at most 1e-4.
  if (worst > 1e-3) {
    refuse_volume(path, "the axes are not at right angles (off by ", worst,
                  "), as with a tilted gantry; resample the volume onto a rectangular lattice first");
  }
}

// Resampling along one axis: the source voxel nearest to the centre of each result voxel.
struct Axis {
  std::vector<std::size_t> source;
  double first_centre = 0.0;  // (unit: source spacing) from source voxel 0
};

double resampled_count(int voxels, double spacing, double wanted) {
  return std::max(1.0, std::ceil(voxels * (spacing / wanted) - 1e-6));
}

Axis resample_axis(int voxels, double spacing, double wanted, bool reversed) {
  Axis axis;
  const double ratio = wanted / spacing;
  const auto count = static_cast<std::size_t>(resampled_count(voxels, spacing, wanted));
  axis.first_centre = 0.5 * (voxels - 1) - 0.5 * (static_cast<double>(count) - 1.0) * ratio;
  axis.source.resize(count);
  for (std::size_t n = 0; n < count; ++n) {
    // A centre halfway between two voxels goes to the lower voxel, independent of rounding.
    const double at = std::ceil(axis.first_centre + static_cast<double>(n) * ratio - 0.5 - 1e-9);
    const double clamped = std::clamp(at, 0.0, voxels - 1.0);
    axis.source[n] = static_cast<std::size_t>(reversed ? voxels - 1.0 - clamped : clamped);
  }
  return axis;
}

// `intensities`: empty, or as many as labels.
template <typename T, typename Label>
void fill_labels(const VolumeData& data, const NextSlice& next, const std::array<Axis, 3>& axes,
                 Label label_of, LabelVolume& volume, std::span<float> intensities) {
  const auto nx = static_cast<std::size_t>(data.header.dims[0]);
  const auto slices = static_cast<std::size_t>(data.header.dims[2]);
  const std::vector<std::size_t>& from = axes[2].source;  // rising: only the first axis may be reversed
  std::size_t out = 0;
  for (std::size_t slice = 0, k = 0; slice < slices; ++slice) {
    const std::span<const std::byte> bytes = next();
    for (; k < from.size() && from[k] == slice; ++k) {
      for (const std::size_t j : axes[1].source) {
        for (const std::size_t i : axes[0].source) {
          const std::size_t at = j * nx + i;
          const T value = value_at<T>(bytes, at);
          if (!intensities.empty()) intensities[out] = static_cast<float>(value);
          volume.labels[out++] = label_of(value, at, slice);
        }
      }
    }
  }
}

std::uint8_t label_by_rules(double value, const std::vector<LabelRule>& rules) {
  for (const LabelRule& rule : rules) {
    if (value >= rule.lower && value <= rule.upper) return rule.label;
  }
  return 0;
}

}  // namespace

const char* name_of(Component component) {
  constexpr std::array<const char*, 10> kNames{"uint8", "int8",   "uint16", "int16",   "uint32",
                                               "int32", "uint64", "int64",  "float32", "float64"};
  return kNames[static_cast<std::size_t>(component)];
}

std::size_t size_of(Component component) {
  return visit_component(component, [](auto value) { return sizeof(value); });
}

void complete_axes(FileFrame& frame, std::size_t given) {
  glm::dmat3& d = frame.direction;
  if (given == 0) d = glm::dmat3(1.0);
  if (given == 1) {
    const glm::dvec3 aside = std::abs(d[0].y) < 0.9 ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(1.0, 0.0, 0.0);
    d[1] = glm::normalize(aside - glm::dot(aside, d[0]) * d[0]);
  }
  if (given < 3) d[2] = glm::cross(d[0], d[1]);
}

void set_frame(const std::filesystem::path& path, const FileFrame& frame, Component component, double unit_m,
               VolumeData& data) {
  if (!(std::isfinite(unit_m) && unit_m > 0.0)) {
    refuse_volume(path, "the file's length unit is given as ", unit_m,
                  " m; it must be above 0 (1e-3 for mm)");
  }
  check_frame(path, frame);
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing_m = frame.spacing[axis] * unit_m;
    if (spacing_m >= kShortest && spacing_m <= kLongest) continue;
    refuse_volume(path, "voxels would be ", spacing_m, " m long along axis ", axis + 1,
                  "; between 1 nm and 1,000 km can be used. Correct the header, or the unit");
  }
  glm::dmat3 direction = exact_axes(frame.direction);
  glm::dvec3 origin = frame.origin;
  VolumeHeader& header = data.header;
  data.component = component;
  data.reversed = glm::determinant(direction) < 0.0;
  if (data.reversed) {
    origin += direction[0] * ((frame.dims[0] - 1.0) * frame.spacing.x);
    direction[0] = -direction[0];
    header.notes.emplace_back("the file's frame is left-handed; its first axis is reversed");
  }
  double voxels = 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    header.dims[axis] = static_cast<int>(frame.dims[axis]);
    voxels *= frame.dims[axis];
  }
  header.component = name_of(component);
  header.spacing_m = frame.spacing * unit_m;
  header.origin_m = origin * unit_m;
  header.rotation = quaternion_of(direction);
  header.bytes = static_cast<std::uint64_t>(voxels * static_cast<double>(size_of(component)));  // below 2^63
}

void check_memory(const std::filesystem::path& path, const VolumeData& data, double copies,
                  const std::optional<glm::dvec3>& spacing_m, std::uint64_t max_bytes) {
  const std::array<int, 3>& n = data.header.dims;
  double labels = 1.0;
  std::ostringstream lattice;
  lattice << n[0] << " x " << n[1] << " x " << n[2] << " voxels of " << data.header.component;
  for (int axis = 0; axis < 3; ++axis) {
    const double h = data.header.spacing_m[axis];
    const double count =
        resampled_count(n[static_cast<std::size_t>(axis)], h, spacing_m ? (*spacing_m)[axis] : h);
    if (!(count <= kLongestAxis)) {
      refuse_volume(path, "resampled to ", (*spacing_m)[axis], " m it would have ", count,
                    " voxels along axis ", axis + 1, ", above the limit of ", kLongestAxis,
                    "; use a larger spacing");
    }
    labels *= count;
  }
  if (spacing_m) {
    lattice << ", resampled to " << labels << " voxels at " << spacing_m->x << " x " << spacing_m->y << " x "
            << spacing_m->z << " m,";
  }
  const double needed =
      copies * static_cast<double>(data.header.bytes) + static_cast<double>(data.slice_bytes()) + labels;
  if (needed > static_cast<double>(max_bytes)) {
    refuse_volume(path, lattice.str(), " need ", megabytes(needed), ", above the limit of ",
                  megabytes(static_cast<double>(max_bytes)),
                  "; raise the limit, or make the volume smaller (crop it, or use a larger spacing)");
  }
}

void check_options(const std::filesystem::path& path, const VolumeFileOptions& options) {
  for (std::size_t n = 0; n < options.rules.size(); ++n) {
    const LabelRule& rule = options.rules[n];
    if (rule.label == 0)
      refuse_volume(path, "rule ", n + 1, " gives label 0, which means empty; use 1 to 255");
    if (!(rule.lower <= rule.upper)) {
      refuse_volume(path, "rule ", n + 1, " takes intensities from ", rule.lower, " to ", rule.upper,
                    ", which is no range; give the lower one first");
    }
  }
  if (!options.spacing_m) return;
  for (int axis = 0; axis < 3; ++axis) {
    const double h = (*options.spacing_m)[axis];
    if (!(std::isfinite(h) && h > 0.0)) {
      refuse_volume(path, "the spacing to resample to is ", h, " m along axis ", axis + 1,
                    "; it must be above 0");
    }
  }
}

LabelVolume label_voxels(const std::filesystem::path& path, const VolumeData& data, const NextSlice& next,
                         const VolumeFileOptions& options, std::vector<float>* intensities) {
  const VolumeHeader& header = data.header;
  LabelVolume volume;
  volume.rotation = header.rotation;
  volume.spacing_m = options.spacing_m.value_or(header.spacing_m);
  std::array<Axis, 3> axes;
  glm::dvec3 first_centre(0.0);
  std::size_t voxels = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    axes[a] = resample_axis(header.dims[a], header.spacing_m[axis], volume.spacing_m[axis],
                            data.reversed && axis == 0);
    first_centre[axis] = axes[a].first_centre * header.spacing_m[axis];
    volume.dims[a] = static_cast<int>(axes[a].source.size());
    voxels *= axes[a].source.size();
  }
  volume.origin_m = header.origin_m;
  if (options.spacing_m) volume.origin_m += header.rotation * first_centre;
  volume.labels.resize(voxels);
  const double needed = static_cast<double>(header.bytes) + static_cast<double>(data.slice_bytes()) +
                        static_cast<double>(voxels) * (1.0 + sizeof(float));
  if (intensities != nullptr && needed <= static_cast<double>(options.max_bytes)) intensities->resize(voxels);
  const std::span<float> kept = intensities != nullptr ? std::span<float>(*intensities) : std::span<float>();
  visit_component(data.component, [&](auto zero) {
    using T = decltype(zero);
    if (!options.rules.empty()) {
      fill_labels<T>(
          data, next, axes,
          [&](T value, std::size_t, std::size_t) {
            return label_by_rules(static_cast<double>(value), options.rules);
          },
          volume, kept);
      return;
    }
    const auto label_of = [&](T value, std::size_t index, std::size_t slice) {
      // The comparison is made in double, so that it means the same for every type. NaN fails it.
      const auto number = static_cast<double>(value);
      if (number >= 0.0 && number <= 255.0 && number == std::floor(number))
        return static_cast<std::uint8_t>(number);
      const auto nx = static_cast<std::size_t>(header.dims[0]);
      refuse_volume(path, "the file was read as labels, but voxel (", index % nx, ", ", index / nx, ", ",
                    slice, ") holds ", number,
                    ", which is not a label from 0 to 255; say which range of intensities is meant, and of "
                    "which label");
    };
    fill_labels<T>(data, next, axes, label_of, volume, kept);
  });
  return volume;
}

VolumeStatistics statistics_of(const VolumeData& data, const NextSlice& next) {
  VolumeStatistics statistics;
  std::array<std::size_t, 256> counts{};
  bool labels = true;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  visit_component(data.component, [&](auto zero) {
    using T = decltype(zero);
    for (int slice = 0; slice < data.header.dims[2]; ++slice) {
      const std::span<const std::byte> bytes = next();
      for (std::size_t n = 0; n < bytes.size() / sizeof(T); ++n) {
        const auto value = static_cast<double>(value_at<T>(bytes, n));
        if (std::isnan(value)) ++statistics.not_numbers;
        if (value < low) low = value;  // false for NaN, which is in no range
        if (value > high) high = value;
        if (labels && value >= 0.0 && value <= 255.0 && value == std::floor(value)) {
          ++counts[static_cast<std::size_t>(value)];
        } else {
          labels = false;
        }
      }
    }
  });
  if (low <= high) {
    statistics.minimum = low;
    statistics.maximum = high;
  }
  for (std::size_t label = 0; labels && label < counts.size(); ++label) {
    if (counts[label] > 0) statistics.label_counts.emplace_back(static_cast<int>(label), counts[label]);
  }
  return statistics;
}

void rescale_voxels(Component from, std::span<const std::byte> voxels, double slope, double intercept,
                    Component to, std::span<std::byte> out) {
  visit_component(from, [&](auto zero) {
    using From = decltype(zero);
    visit_component(to, [&](auto zero_out) {
      using To = decltype(zero_out);
      for (std::size_t n = 0; n < voxels.size() / sizeof(From); ++n) {
        double scaled = slope * static_cast<double>(value_at<From>(voxels, n)) + intercept;
        if constexpr (std::is_integral_v<To>) {
          scaled = std::clamp(scaled, static_cast<double>(std::numeric_limits<To>::lowest()),
                              static_cast<double>(std::numeric_limits<To>::max()));
        }
        const auto value = static_cast<To>(scaled);
        std::memcpy(&out[n * sizeof(To)], &value, sizeof(To));
      }
    });
  });
}

}  // namespace voxel
