// SPDX-License-Identifier: GPL-3.0-or-later
// A small volume whose labels lie in known places, and files of it in every format. It has 12 x 10 x 8 voxels
// of 2 mm, with three blocks of labels.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <glm/vec3.hpp>
#include <map>
#include <string>
#include <vector>

#include "voxel/volume/label_volume.h"

namespace tests {

inline constexpr std::array<int, 3> kBaseDims{12, 10, 8};
// Centre of label 2 in LPS, if the axes run right, front and head from (-10, -20, 30) mm (RAS).
inline const glm::dvec3 kCentreOfTwo{-7e-3, 11e-3, 37e-3};
inline const std::map<int, std::size_t> kBaseCounts{{0, 768}, {1, 108}, {2, 48}, {3, 36}};

inline int base_label(int i, int j, int k) {
  const auto inside = [](int n, int first, int last) { return n >= first && n <= last; };
  if (inside(i, 1, 6) && inside(j, 2, 4) && inside(k, 1, 6)) return 1;
  if (inside(i, 8, 9) && inside(j, 3, 6) && inside(k, 1, 6)) return 2;
  if (inside(i, 1, 6) && inside(j, 6, 7) && inside(k, 2, 4)) return 3;
  return 0;
}

// All labels times `scale`, as the bytes of numbers of type T, x fastest.
template <typename T>
std::string base_voxels(T scale = 1) {
  std::string out;
  for (int k = 0; k < kBaseDims[2]; ++k) {
    for (int j = 0; j < kBaseDims[1]; ++j) {
      for (int i = 0; i < kBaseDims[0]; ++i) {
        const T value = static_cast<T>(static_cast<T>(base_label(i, j, k)) * scale);
        out.append(reinterpret_cast<const char*>(&value), sizeof(T));
      }
    }
  }
  return out;
}

inline std::map<int, std::size_t> counts_of(const voxel::LabelVolume& volume) {
  std::map<int, std::size_t> counts;
  for (const std::uint8_t label : volume.labels) ++counts[label];
  return counts;
}

// Mean place of the voxels with a label, in the scene's frame (m).
inline glm::dvec3 centre_of(const voxel::LabelVolume& volume, int label) {
  glm::dvec3 sum(0.0);
  double count = 0.0;
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      for (int i = 0; i < volume.dims[0]; ++i) {
        if (volume.labels[volume.index(i, j, k)] != label) continue;
        sum += volume.origin_m + volume.rotation * (glm::dvec3(i, j, k) * volume.spacing_m);
        count += 1.0;
      }
    }
  }
  return sum / count;
}

// A NIfTI-1 file: a header followed by voxels. Lengths are in the file's unit.
struct NiftiFile {
  std::int16_t type = 2, bits = 8;
  float voxel = 2.0F;
  glm::vec3 origin{-10.0F, -20.0F, 30.0F};
  std::int16_t qform = 0, sform = 1;
  std::uint8_t unit = 2;
  float slope = 0.0F, intercept = 0.0F;
  glm::vec3 quaternion{0.0F};  // b, c and d

  [[nodiscard]] std::string text(const std::string& voxels) const {
    std::string out(352, '\0');
    const auto put = [&](std::size_t at, auto value) { std::memcpy(&out[at], &value, sizeof(value)); };
    put(0, std::int32_t{348});
    const std::array<std::int16_t, 8> dims{3, 12, 10, 8, 1, 1, 1, 1};
    put(40, dims);
    put(70, type);
    put(72, bits);
    put(76, std::array<float, 8>{1.0F, voxel, voxel, voxel, 1.0F, 1.0F, 1.0F, 1.0F});
    put(108, 352.0F);
    put(112, slope);
    put(116, intercept);
    put(123, unit);
    put(252, qform);
    put(254, sform);
    put(256, std::array<float, 3>{quaternion.x, quaternion.y, quaternion.z});
    put(268, std::array<float, 3>{origin.x, origin.y, origin.z});
    put(280, std::array<float, 12>{voxel, 0, 0, origin.x, 0, voxel, 0, origin.y, 0, 0, voxel, origin.z});
    std::memcpy(&out[344], "n+1", 4);
    return out + voxels;
  }
};

// An NRRD file: a header with these lines, followed by the base volume's labels.
inline std::string nrrd_file(const std::string& lines) {
  return "NRRD0005\ntype: uint8\ndimension: 3\nsizes: 12 10 8\nencoding: raw\n" + lines + "\n" +
         base_voxels<std::uint8_t>();
}

// A MetaImage file: a header with these lines, followed by the base volume's labels. Its axes run as
// described at kCentreOfTwo.
inline std::string meta_file(const std::string& lines, const std::string& offset = "10 20 30") {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
         "TransformMatrix = -1 0 0 0 -1 0 0 0 1\nOffset = " +
         offset + "\nDimSize = 12 10 8\nElementType = MET_UCHAR\n" + lines + "ElementDataFile = LOCAL\n" +
         base_voxels<std::uint8_t>();
}

}  // namespace tests
