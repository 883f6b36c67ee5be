// SPDX-License-Identifier: GPL-3.0-or-later
// The voxels of a file in the order that they are there, slice by slice. Internal to volume_file: the
// libraries behind ITK read a volume whole, two or three times over, and fill up with zeros what a damaged
// file lacks.
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
  // For raw and deflate. Nothing is read yet.
  VoxelStream(std::filesystem::path path, const VoxelPlace& place, const VolumeHeader& header);
  ~VoxelStream();
  VoxelStream(const VoxelStream&) = delete;
  VoxelStream& operator=(const VoxelStream&) = delete;

  // The next `count` bytes, in this machine's byte order for components of `component_bytes`. Throws
  // VolumeError where the file ends before, or is damaged.
  std::span<const std::byte> next(std::size_t count, std::size_t component_bytes);
  // After the last voxel: reads on to the end of the packed stream, where its checksum is. Throws
  // VolumeError.
  void finish();

 private:
  class Inflater;
  void fill(std::span<std::byte> out);
  void skip(std::uint64_t bytes);
  [[noreturn]] void refuse(const char* what) const;

  std::filesystem::path path_;
  VoxelPlace place_;
  std::uint64_t needed_ = 0, read_ = 0;  // (unit: byte) of the voxels
  std::ifstream file_;
  std::unique_ptr<Inflater> inflater_;  // where the voxels are packed
  std::vector<std::byte> slice_;
};

}  // namespace voxel
