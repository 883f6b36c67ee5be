// SPDX-License-Identifier: GPL-3.0-or-later
// Streams the voxels of a raw or deflated file, slice by slice, in file order. Internal to the readers
// (read_volume.h). A file that ends early or is damaged is always reported. The libraries behind ITK hold a
// whole volume two or three times, and fill missing voxels of a damaged file with zeros.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <vector>

#include "voxel/volume/check_header.h"

namespace voxel {

class VoxelStream {
 public:
  // `place.packing` is raw or deflate. Reads no voxel yet.
  VoxelStream(std::filesystem::path path, const VoxelPlace& place, const VolumeHeader& header);
  ~VoxelStream();
  VoxelStream(const VoxelStream&) = delete;
  VoxelStream& operator=(const VoxelStream&) = delete;

  // The next `count` bytes, in this machine's byte order for components of `component_bytes`. Throws
  // VolumeError if the file ends early or is damaged.
  std::span<const std::byte> next(std::size_t count, std::size_t component_bytes);
  // Call after the last voxel: reads to the end of the packed stream and so verifies its checksum. Throws
  // VolumeError.
  void finish();

 private:
  class Inflater;
  void fill(std::span<std::byte> out);
  void skip(std::uint64_t bytes);
  [[noreturn]] void refuse(const char* what) const;

  std::filesystem::path path_;
  VoxelPlace place_;
  std::uint64_t needed_ = 0, read_ = 0;  // bytes of all voxels; bytes read so far
  std::ifstream file_;
  std::unique_ptr<Inflater> inflater_;  // null if the voxels are raw
  std::vector<std::byte> slice_;
};

}  // namespace voxel
