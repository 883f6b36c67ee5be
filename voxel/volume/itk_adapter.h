// SPDX-License-Identifier: GPL-3.0-or-later
// Functions for ITK's readers, and for exceptions of ITK and GDCM. These exceptions become a VolumeError with
// file, action, cause and remedy. Only read_volume.cpp and read_dicom.cpp include this header.
#pragma once

#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "voxel/volume/check_header.h"
#include "voxel/volume/raw_volume.h"

namespace itk {
class ImageIOBase;  // NOLINT(cppcoreguidelines-virtual-class-destructor): ITK's class, reported at its
                    // first declaration
}

namespace voxel {

// The component type that ITK will read; none if a voxel holds several numbers or its type is unknown.
std::optional<Component> component_of(const itk::ImageIOBase& io);

// The error text of ITK or GDCM, without source file, class and address.
std::string words_of(const std::exception& error);

// Reads the voxels that ReadImageInformation announced. Throws std::runtime_error if their size is not that
// of `bytes`.
void read_voxels(itk::ImageIOBase& io, std::vector<std::byte>& bytes);

// Calls `call` and turns any exception of the libraries into a VolumeError: "file: doing: what; remedy".
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

}  // namespace voxel
