// SPDX-License-Identifier: GPL-3.0-or-later
// Reads volumes from single files, and dispatches folders to read_dicom.cpp. Every component type goes
// through one buffer of bytes (ImageIOBase), because ITK's image templates compile for minutes. Each ITK
// reader is named here, so that no factory is registered.
#include "voxel/volume/read_volume.h"

#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "voxel/volume/check_header.h"
#include "voxel/volume/intensity_volume.h"
#include "voxel/volume/itk_adapter.h"
#include "voxel/volume/length_unit.h"
#include "voxel/volume/read_dicom.h"
#include "voxel/volume/slice_stream.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

// The library of a format. NIfTI needs none: its header is read by inspect_nifti.cpp, and its voxels are
// streamed.
itk::ImageIOBase::Pointer library_of(VolumeFormat format) {
  if (format == VolumeFormat::nrrd) return itk::NrrdImageIO::New().GetPointer();
  return itk::MetaImageIO::New().GetPointer();
}

FileFrame frame_of(const fs::path& path, const itk::ImageIOBase& io) {
  const unsigned axes = io.GetNumberOfDimensions();
  for (unsigned axis = 3; axis < axes; ++axis) {
    if (io.GetDimensions(axis) == 1) continue;
    refuse_volume(path, "the file has ", axes, " axes, the ", axis + 1, "th with ", io.GetDimensions(axis),
                  " entries; save one three-dimensional volume of it");
  }
  FileFrame frame;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<int>(axis);
    frame.dims[axis] = axis < axes ? static_cast<double>(io.GetDimensions(axis)) : 1.0;
    if (axis >= axes) continue;  // a single slice or row gets spacing 1 (unit: the file's)
    frame.spacing[a] = io.GetSpacing(axis);
    frame.origin[a] = io.GetOrigin(axis);
    const std::vector<double> direction = io.GetDirection(axis);
    for (unsigned row = 0; row < 3; ++row) {
      frame.direction[a][static_cast<int>(row)] = row < direction.size() ? direction[row] : 0.0;
    }
  }
  return frame;
}

struct OpenVolume {
  VolumeFormat format = VolumeFormat::nifti;
  itk::ImageIOBase::Pointer io;  // for MetaImage it reads the header, too
  VolumeData data;
  VoxelPlace place;
};

// Reads the header of a MetaImage by its library.
void open_meta(const fs::path& path, OpenVolume& open) {
  open.io = library_of(open.format);
  open.io->SetFileName(path.string());
  in_words(path, "the header cannot be read", kDamaged, [&] { open.io->ReadImageInformation(); });
  open.place.stored = component_of(*open.io);
  if (!open.place.stored) {
    refuse_volume(path, "each voxel holds ", open.io->GetNumberOfComponents(), " numbers of type ",
                  itk::ImageIOBase::GetComponentTypeAsString(open.io->GetComponentType()),
                  ", where one whole or real number is needed; save one channel of it");
  }
  open.place.frame = frame_of(path, *open.io);
  open.place.axes = std::min<std::size_t>(open.io->GetNumberOfDimensions(), 3);
}

// Type of the voxels once they are scaled. Whole numbers of up to 16 bits become floats, which hold them.
Component scaled_component(const VoxelPlace& place) {
  if (place.slope == 1.0 && place.intercept == 0.0) return *place.stored;
  return *place.stored == Component::float32 || size_of(*place.stored) <= 2 ? Component::float32
                                                                            : Component::float64;
}

// The length unit of the header's numbers (unit: meter).
double unit_of(const VoxelPlace& place, const std::optional<double>& asked_m,
               std::vector<std::string>& notes) {
  constexpr double kMillimeter = 1e-3;
  if (!asked_m) return place.unit_m.value_or(kMillimeter);
  if (place.unit_m && std::abs(*place.unit_m - *asked_m) > 1e-9 * *asked_m) {
    notes.push_back("the header gives its lengths in " + unit_in_words(*place.unit_m) +
                    "; they are taken in " + unit_in_words(*asked_m) + ", as asked");
  }
  return *asked_m;
}

OpenVolume open_volume(const fs::path& path, const std::optional<double>& unit_m) {
  constexpr std::array<const char*, 3> kNames{"NIfTI", "NRRD", "MetaImage"};
  OpenVolume open;
  open.format = format_of(path);
  open.place = inspect_volume(path, open.format);
  if (open.format == VolumeFormat::meta) open_meta(path, open);
  VolumeHeader& header = open.data.header;
  header.notes = open.place.notes;
  header.format = kNames[static_cast<std::size_t>(open.format)];
  header.directions_known = open.place.directions_known;
  set_frame(path, open.place.frame, scaled_component(open.place), unit_of(open.place, unit_m, header.notes),
            open.data);
  if (open.place.axes < 3) {
    header.notes.emplace_back(
        "the file has fewer than three axes; the missing ones have one voxel, one unit long");
  }
  check_file_size(path, open.place, header);
  return open;
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

// Calls use(data, next slice) for a single file. Raw and deflated voxels are streamed. The format's library
// reads other voxels whole into memory: text, and voxels whose place only the library can find.
template <typename Use>
auto with_file_slices(const fs::path& path, const std::optional<double>& unit_m,
                      const std::optional<glm::dvec3>& spacing_m, std::uint64_t max_bytes, Use use) {
  OpenVolume open = open_volume(path, unit_m);
  const VolumeData& data = open.data;
  const Component stored = *open.place.stored;
  const bool packed = open.place.packing == VoxelPlace::Packing::deflate;
  if (open.place.as_they_are && (packed || open.place.packing == VoxelPlace::Packing::raw)) {
    check_memory(path, data, 0.0, spacing_m, max_bytes);
    VoxelStream stream(path, open.place, data.header);
    const std::size_t slice_bytes = data.slice_bytes() / size_of(data.component) * size_of(stored);
    const bool scaled = open.place.slope != 1.0 || open.place.intercept != 0.0;
    std::vector<std::byte> slice(scaled ? data.slice_bytes() : 0);
    auto result = use(data, [&]() -> std::span<const std::byte> {
      const std::span<const std::byte> numbers = stream.next(slice_bytes, size_of(stored));
      if (!scaled) return numbers;
      rescale_voxels(stored, numbers, open.place.slope, open.place.intercept, data.component, slice);
      return slice;
    });
    stream.finish();
    return result;
  }
  // The NRRD library reads into its own buffer first.
  check_memory(path, data, open.format == VolumeFormat::nrrd ? 2.0 : 1.0, spacing_m, max_bytes);
  if (packed) {  // check completeness: the libraries replace missing voxels by zeros
    VoxelStream whole(path, open.place, data.header);
    for (int k = 0; k < data.header.dims[2]; ++k) whole.next(data.slice_bytes(), 1);
    whole.finish();
  }
  std::vector<std::byte> bytes;
  in_words(path, "the voxels cannot be read", kDamaged, [&] {
    if (!open.io) {
      open.io = library_of(open.format);
      open.io->SetFileName(path.string());
      open.io->ReadImageInformation();
      if (component_of(*open.io) != data.component)
        throw std::runtime_error("the library of the format reads the header otherwise");
    }
    bytes.resize(data.header.bytes);
    read_voxels(*open.io, bytes);
  });
  std::size_t at = 0;
  return use(data, [&] {
    const std::size_t begin = at;
    at += data.slice_bytes();
    return std::span<const std::byte>(bytes).subspan(begin, data.slice_bytes());
  });
}

// Calls use(data, next slice) for a file or a folder, within the limit.
template <typename Use>
auto with_slices(const fs::path& path, const std::optional<double>& unit_m,
                 const std::optional<glm::dvec3>& spacing_m, std::uint64_t max_bytes, Use use) {
  if (!is_folder(path)) return with_file_slices(path, unit_m, spacing_m, max_bytes, use);
  const DicomSeries series = read_dicom_header(path, unit_m);
  check_memory(path, series.data, 1.0, spacing_m, max_bytes);  // 1 copy: shared with the child process
  const auto voxels =
      in_words(path, "the voxels cannot be read", kDamaged, [&] { return read_dicom_voxels(path, series); });
  std::size_t at = 0;
  return use(series.data, [&] {
    const std::size_t begin = at;
    at += series.data.slice_bytes();
    return std::span<const std::byte>(voxels->data() + begin, series.data.slice_bytes());
  });
}

}  // namespace

std::optional<Component> component_of(const itk::ImageIOBase& io) {
  if (io.GetNumberOfComponents() != 1) return std::nullopt;
  using Itk = itk::IOComponentEnum;
  switch (io.GetComponentType()) {
    case Itk::UCHAR:
      return Component::uint8;
    case Itk::CHAR:
      return Component::int8;
    case Itk::USHORT:
      return Component::uint16;
    case Itk::SHORT:
      return Component::int16;
    case Itk::UINT:
      return Component::uint32;
    case Itk::INT:
      return Component::int32;
    case Itk::ULONG:
      return sizeof(long) == 8 ? Component::uint64 : Component::uint32;
    case Itk::LONG:
      return sizeof(long) == 8 ? Component::int64 : Component::int32;
    case Itk::ULONGLONG:
      return Component::uint64;
    case Itk::LONGLONG:
      return Component::int64;
    case Itk::FLOAT:
      return Component::float32;
    case Itk::DOUBLE:
      return Component::float64;
    default:
      return std::nullopt;
  }
}

std::string words_of(const std::exception& any) {
  const auto* itk_error = dynamic_cast<const itk::ExceptionObject*>(&any);
  if (itk_error == nullptr) return any.what();
  const itk::ExceptionObject& error = *itk_error;
  std::string text = error.GetDescription();
  const std::string prefix = "ITK ERROR: ";
  if (text.rfind(prefix, 0) == 0) text.erase(0, prefix.size());
  const auto address = text.find("): ");  // NiftiImageIO(0x55…): words
  if (address != std::string::npos && text.find("(0x") < address) text.erase(0, address + 3);
  const auto last_word = text.rfind("[nrrd] ");  // keep the last entry of NRRD's error stack
  if (last_word != std::string::npos) text.erase(0, last_word + 7);
  for (char& c : text) c = c == '\n' || c == '\r' ? ' ' : c;
  const auto last = text.find_last_not_of(" .");
  return text.substr(0, last == std::string::npos ? 0 : last + 1);
}

void read_voxels(itk::ImageIOBase& io, std::vector<std::byte>& bytes) {
  const unsigned axes = io.GetNumberOfDimensions();
  itk::ImageIORegion region(axes);
  for (unsigned axis = 0; axis < axes; ++axis) {
    region.SetIndex(axis, 0);
    region.SetSize(axis, io.GetDimensions(axis));
  }
  io.SetIORegion(region);
  if (static_cast<std::uint64_t>(io.GetImageSizeInBytes()) != bytes.size()) {
    throw std::runtime_error("the header changed while it was read");
  }
  io.Read(bytes.data());
}

VolumeHeader read_volume_header(const fs::path& path, const std::optional<double>& unit_m) {
  return is_folder(path) ? read_dicom_header(path, unit_m).data.header
                         : open_volume(path, unit_m).data.header;
}

namespace {

IntensityVolume load_labels(const fs::path& path, const VolumeFileOptions& options, bool intensities,
                            std::vector<std::string>* notes) {
  check_options(path, options);
  return with_slices(
      path, options.unit_m, options.spacing_m, options.max_bytes,
      [&](const VolumeData& data, const NextSlice& next) {
        if (notes != nullptr) *notes = data.header.notes;
        IntensityVolume volume;
        volume.whole_numbers = data.component != Component::float32 && data.component != Component::float64;
        volume.labels = in_words(path, "the voxels cannot be labelled", kDamaged, [&] {
          return label_voxels(path, data, next, options, intensities ? &volume.intensities : nullptr);
        });
        return volume;
      });
}

}  // namespace

LabelVolume load_volume(const fs::path& path, const VolumeFileOptions& options,
                        std::vector<std::string>* notes) {
  return load_labels(path, options, false, notes).labels;
}

IntensityVolume load_intensities(const fs::path& path, const VolumeFileOptions& options,
                                 std::vector<std::string>* notes) {
  return load_labels(path, options, true, notes);
}

VolumeStatistics read_volume_statistics(const fs::path& path, std::uint64_t max_bytes) {
  return with_slices(path, std::nullopt, std::nullopt, max_bytes, statistics_of);
}

}  // namespace voxel
