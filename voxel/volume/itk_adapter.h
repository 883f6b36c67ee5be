// SPDX-License-Identifier: GPL-3.0-or-later
// What read_volume.cpp and read_dicom.cpp share of ITK. No other file includes this one.
#pragma once

#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "voxel/volume/subprocess.h"
#include "voxel/volume/raw_volume.h"
#include "voxel/volume/check_header.h"

namespace itk {
class ImageIOBase;  // NOLINT(cppcoreguidelines-virtual-class-destructor): ITK's own, reported where it is
                    // first named
}

namespace voxel {

// The component of what ITK is about to read, if it is one number a voxel of a type that we know.
std::optional<Component> component_of(const itk::ImageIOBase& io);

// ITK's and GDCM's words for what went wrong, without their source file, class and address.
std::string words_of(const std::exception& error);

// Reads the voxels that ReadImageInformation announced, and no more.
void read_voxels(itk::ImageIOBase& io, std::vector<std::byte>& bytes);

// Calls `call` and turns whatever the libraries throw into a VolumeError: "file: doing: what; remedy".
template <typename Call>
auto in_words(const std::filesystem::path& path, const char* doing, const char* remedy, Call call) {
  try {
    return call();
  } catch (const VolumeError&) {
    throw;
  } catch (const std::bad_alloc&) {
    refuse_volume(path, doing,
                  ": this machine has not enough memory; crop the volume or use a larger spacing");
  } catch (const std::exception& error) {
    refuse_volume(path, doing, ": ", words_of(error), "; ", remedy);
  }
}

// One DICOM series in a folder (read_dicom.cpp), its files in order along the slice normal.
struct DicomSeries {
  std::vector<std::string> files;
  VolumeData data;  // without voxels
};
DicomSeries read_dicom_header(const std::filesystem::path& folder, double unit_m);
// All voxels, slice after slice.
std::unique_ptr<SharedMemory> read_dicom_voxels(const std::filesystem::path& folder,
                                                const DicomSeries& series);

}  // namespace voxel
