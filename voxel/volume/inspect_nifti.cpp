// SPDX-License-Identifier: GPL-3.0-or-later
// The header of a NIfTI-1 file. Source: nifti1.h of the NIfTI working group.
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <map>
#include <sstream>

#include "voxel/volume/check_header.h"
#include "voxel/volume/text_header.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

constexpr std::int32_t kNiftiBytes = 348;  // size of a NIfTI-1 header, which it also states

struct NiftiHeader {
  std::array<unsigned char, kNiftiBytes> bytes{};
  bool swapped = false;  // byte order differs from this machine's

  template <typename T>
  [[nodiscard]] T at(std::size_t where) const {
    return at<T>(where, swapped);
  }
  template <typename T>
  [[nodiscard]] T at(std::size_t where, bool turned) const {
    std::array<unsigned char, sizeof(T)> field{};
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(where), sizeof(T), field.begin());
    if (turned) std::reverse(field.begin(), field.end());
    T value;
    std::memcpy(&value, field.data(), sizeof(T));
    return value;
  }
  [[nodiscard]] double real(std::size_t where, std::size_t index = 0) const {
    return static_cast<double>(at<float>(where + 4 * index));
  }
  [[nodiscard]] int qform() const { return at<std::int16_t>(252); }
  [[nodiscard]] int sform() const { return at<std::int16_t>(254); }
};

// Place of voxel (0, 0, 0) and the steps between voxels, in NIfTI's frame (x right, y front, z head).
struct NiftiAffine {
  glm::dmat3 steps{1.0};
  glm::dvec3 origin{0.0};
};

// Refuses a frame that is not finite.
void check_nifti_frame(const fs::path& path, const NiftiHeader& header) {
  const auto check = [&](const char* what, std::size_t at, std::size_t count) {
    for (std::size_t n = 0; n < count; ++n) {
      const double value = header.real(at, n);
      if (std::isfinite(value) && std::abs(value) < 1e12) continue;
      refuse_volume(path, "the header's ", what, " has an entry of ", value, "; ", kDamaged);
    }
  };
  check("voxel size", 80, 3);
  if (header.qform() > 0) check("qform", 256, 6);
  if (header.sform() > 0) check("sform", 280, 12);
}

// Refuses valid files whose name is wrong, or whose kind is not supported.
void check_nifti_kind(const fs::path& path, const NiftiHeader& header) {
  const bool named_packed = ends_with(lower_case(path.string()), ".gz");
  std::ifstream file(path, std::ios::binary);
  const bool packed = file.get() == 0x1f && file.get() == 0x8b;
  if (packed && !named_packed) refuse_volume(path, "the file is packed by gzip; let its name end in .nii.gz");
  if (!packed && named_packed && header.at<std::int32_t>(0, false) == kNiftiBytes)
    refuse_volume(path, "the file is not packed, as its name says; let it end in .nii");
  for (const bool swapped : {false, true}) {
    if (header.at<std::int32_t>(0, swapped) == 540)
      refuse_volume(path, "this is NIfTI-2, which is not read; save it as NIfTI-1, NRRD or MetaImage");
  }
  if (std::memcmp(&header.bytes[344], "ni1", 4) == 0)
    refuse_volume(path, "the voxels are in a file of their own (.img); save it as one .nii file");
}

NiftiHeader read_nifti_header(const fs::path& path) {
  NiftiHeader header;
  const gzFile file = gzopen(path.c_str(), "rb");  // also reads unpacked files
  const int got = file == nullptr ? 0 : gzread(file, header.bytes.data(), kNiftiBytes);
  if (file != nullptr) gzclose(file);
  check_nifti_kind(path, header);
  header.swapped = header.at<std::int32_t>(0, true) == kNiftiBytes;
  if (got != kNiftiBytes || header.at<std::int32_t>(0) != kNiftiBytes ||
      std::memcmp(&header.bytes[344], "n+1", 4) != 0) {
    refuse_volume(path, "this is not a NIfTI-1 file with header and voxels together; ", kDamaged);
  }
  return header;
}

Component nifti_component(const fs::path& path, const NiftiHeader& header) {
  const std::map<int, Component> components{
      {2, Component::uint8},    {4, Component::int16},    {8, Component::int32},    {16, Component::float32},
      {64, Component::float64}, {256, Component::int8},   {512, Component::uint16}, {768, Component::uint32},
      {1024, Component::int64}, {1280, Component::uint64}};
  const std::map<int, const char*> others{{1, "bits"},
                                          {32, "complex numbers"},
                                          {128, "colours (RGB)"},
                                          {1536, "numbers of 128 bits"},
                                          {1792, "complex numbers"},
                                          {2048, "complex numbers"},
                                          {2304, "colours (RGBA)"}};
  const int type = header.at<std::int16_t>(70);
  const auto found = components.find(type);
  if (found != components.end()) return found->second;
  const auto other = others.find(type);
  if (other == others.end())
    refuse_volume(path, "the header gives the voxels a type of number ", type,
                  ", which NIfTI does not know; ", kDamaged);
  refuse_volume(path, "the voxels are ", other->second,
                ", where one whole or real number is needed; save one channel of it");
}

// Reads the number of voxels and the voxel size along the first three axes. A last axis with one voxel and no
// size, as in a file of one slice, does not count.
void read_nifti_axes(const fs::path& path, const NiftiHeader& header, VoxelPlace& place) {
  const int axes = header.at<std::int16_t>(40);
  check_axes(path, axes);
  place.axes = static_cast<std::size_t>(std::min(axes, 3));
  place.frame.dims = {1.0, 1.0, 1.0};
  for (int axis = 1; axis <= axes; ++axis) {
    const auto n = static_cast<std::size_t>(axis);
    const int voxels = header.at<std::int16_t>(40 + 2 * n);
    if (voxels < 1)
      refuse_volume(path, "the header says ", voxels, " voxels along axis ", axis, "; ", kDamaged);
    if (axis > 3) {
      if (voxels == 1) continue;
      refuse_volume(path, "the file has ", axes, " axes, the ", axis, "th with ", voxels,
                    " entries; save one three-dimensional volume of it");
    }
    const double spacing = header.real(76, n);
    if (axis > 1 && axis == std::min(axes, 3) && voxels == 1 && spacing == 0.0) {
      place.axes = n - 1;
      continue;
    }
    place.frame.dims[n - 1] = voxels;
    if (spacing > 0.0) {
      place.frame.spacing[axis - 1] = spacing;
      continue;
    }
    if (voxels > 1 || spacing < 0.0) {
      refuse_volume(path, "the header says a voxel spacing of ", spacing, " along axis ", axis,
                    "; it must be above 0. Correct the header or export the volume again");
    }
    std::ostringstream note;
    note << "the header's voxel size along axis " << axis << " is " << spacing
         << "; another was put in its place";
    place.notes.push_back(note.str());
  }
}

// Method 2 of nifti1.h: the steps are a rotation times the voxel sizes.
NiftiAffine affine_of_qform(const NiftiHeader& header, const glm::dvec3& spacing) {
  double b = header.real(256), c = header.real(260), d = header.real(264);
  const double rest = 1.0 - b * b - c * c - d * d;
  const double length = std::sqrt(b * b + c * c + d * d);
  const double a = rest > 1e-7 ? std::sqrt(rest) : 0.0;
  if (rest <= 1e-7 && length > 0.0) {  // half a turn, up to rounding
    b /= length;
    c /= length;
    d /= length;
  }
  const double left = header.real(76) < 0.0 ? -1.0 : 1.0;
  NiftiAffine affine;
  affine.steps[0] = glm::dvec3(a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c));
  affine.steps[1] = glm::dvec3(2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b));
  affine.steps[2] =
      left * glm::dvec3(2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c);
  for (int axis = 0; axis < 3; ++axis) affine.steps[axis] *= spacing[axis];
  affine.origin = {header.real(268), header.real(272), header.real(276)};
  return affine;
}

// Method 3 of nifti1.h: the steps are arbitrary vectors.
NiftiAffine affine_of_sform(const NiftiHeader& header) {
  NiftiAffine affine;
  for (int row = 0; row < 3; ++row) {
    const std::size_t at = 280 + 16 * static_cast<std::size_t>(row);
    for (int axis = 0; axis < 3; ++axis)
      affine.steps[axis][row] = header.real(at, static_cast<std::size_t>(axis));
    affine.origin[row] = header.real(at, 3);
  }
  return affine;
}

// Are the steps at right angles, and as long as the header's voxel sizes?
bool is_rectangular(const NiftiAffine& affine, const glm::dvec3& spacing, std::size_t axes) {
  constexpr double kStepRounding = 1e-3;  // relative; headers hold single precision
  for (int a = 0; a < static_cast<int>(axes); ++a) {
    const double length = glm::length(affine.steps[a]);
    if (!(std::abs(length - spacing[a]) <= kStepRounding * spacing[a])) return false;
    for (int b = 0; b < a; ++b) {
      const double cosine =
          glm::dot(affine.steps[a], affine.steps[b]) / (length * glm::length(affine.steps[b]));
      if (!(std::abs(cosine) <= kStepRounding)) return false;
    }
  }
  return true;
}

// True if qform and sform put a voxel in different places. Programs differ in which of the two they use.
bool differ(const NiftiAffine& p, const NiftiAffine& q, const glm::dvec3& spacing) {
  const double size = std::max({spacing.x, spacing.y, spacing.z});
  double off = 0.0;
  for (int row = 0; row < 3; ++row) {
    off = std::max(off, std::abs(p.origin[row] - q.origin[row]));
    for (int axis = 0; axis < 3; ++axis)
      off = std::max(off, std::abs(p.steps[axis][row] - q.steps[axis][row]));
  }
  return off > 0.01 * size;
}

// Sets the frame in LPS. The sform is used if it is rectangular and gives scanner coordinates, or if there is
// no qform. Otherwise the qform is used. ITK makes the same choice, so programs built on ITK show the volume
// at the same place.
void read_nifti_frame(const fs::path& path, const NiftiHeader& header, VoxelPlace& place) {
  constexpr int kScanner = 1;                   // NIFTI_XFORM_SCANNER_ANAT
  constexpr double kQuaternionRounding = 1e-3;  // headers hold single precision
  check_nifti_frame(path, header);
  FileFrame& frame = place.frame;
  if (header.qform() <= 0 && header.sform() <= 0) {
    place.directions_known = false;
    place.notes.emplace_back(
        "the header has neither qform nor sform: anatomical directions are unknown, and the axes of the file "
        "are taken for left, back and head");
    return;
  }
  const NiftiAffine q = affine_of_qform(header, frame.spacing), s = affine_of_sform(header);
  const bool rectangular = header.sform() > 0 && is_rectangular(s, frame.spacing, place.axes);
  if (header.qform() <= 0 && !rectangular) {
    refuse_volume(
        path,
        "the axes that the header's sform gives are not at right angles, or not as long as its voxel "
        "sizes; correct the header, or resample the volume onto a rectangular lattice first");
  }
  if (header.qform() > 0 && header.sform() > 0 && differ(q, s, frame.spacing)) {
    place.notes.emplace_back(
        "the header's qform and sform put the volume in different places; look whether it lies "
        "where it should");
  }
  const bool takes_s = rectangular && (header.sform() == kScanner || header.qform() <= 0);
  const double length = glm::length(glm::dvec3(header.real(256), header.real(260), header.real(264)));
  if (!takes_s && length > 1.0 + kQuaternionRounding) {
    refuse_volume(path, "the header's qform has a quaternion of length ", length,
                  " without its real part, which is no rotation; ", kDamaged);
  }
  const NiftiAffine& affine = takes_s ? s : q;
  const glm::dvec3 to_lps(-1.0, -1.0, 1.0);
  frame.origin = affine.origin * to_lps;
  for (int axis = 0; axis < static_cast<int>(place.axes); ++axis)
    frame.direction[axis] = glm::normalize(affine.steps[axis] * to_lps);
  complete_axes(frame, place.axes);
}

void read_nifti_unit(const NiftiHeader& header, VoxelPlace& place) {
  switch (header.bytes[123] & 7U) {  // the low bits are the unit of length, the others that of time
    case 0:
      return;
    case 1:
      place.unit_m = 1.0;
      break;
    case 2:
      place.unit_m = 1e-3;
      break;
    case 3:
      place.unit_m = 1e-6;
      break;
    default:
      break;
  }
  place.stated_unit = "unit number " + std::to_string(header.bytes[123] & 7U);
}

// A slope of 0 means that the numbers are not scaled and the intercept is ignored. SPM writes NaN instead of
// 0.
void read_nifti_scaling(const fs::path& path, const NiftiHeader& header, VoxelPlace& place) {
  const double slope = header.real(112), intercept = header.real(116);
  if (slope == 0.0 || std::isnan(slope)) return;
  if (!std::isfinite(slope) || !std::isfinite(intercept)) {
    refuse_volume(path, "the header scales the numbers by ", slope, " and ", intercept,
                  ", which must be finite; ", kDamaged);
  }
  place.slope = slope;
  place.intercept = intercept;
}

}  // namespace

void inspect_nifti(const fs::path& path, VoxelPlace& place) {
  const NiftiHeader header = read_nifti_header(path);
  read_nifti_axes(path, header, place);
  read_nifti_frame(path, header, place);
  read_nifti_unit(header, place);
  place.stored = nifti_component(path, header);
  read_nifti_scaling(path, header, place);
  place.swapped = header.swapped;
  if (ends_with(lower_case(path.string()), ".gz")) place.packing = VoxelPlace::Packing::deflate;
  const double offset = header.real(108);
  const double most = place.packing == VoxelPlace::Packing::raw ? 1.0 : kMostPacked;
  // An offset of 0 is common. The voxels then follow the header directly.
  if (!(offset >= 0.0 && offset <= most * static_cast<double>(place.file_bytes)))
    refuse_volume(path, "the header says the voxels begin at byte ", offset, "; ", kDamaged);
  const auto begin = std::max<std::uint64_t>(static_cast<std::uint64_t>(offset), kNiftiBytes);
  (place.packing == VoxelPlace::Packing::raw ? place.offset : place.skipped) = begin;
}

}  // namespace voxel
