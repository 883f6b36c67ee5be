// SPDX-License-Identifier: GPL-3.0-or-later
// Reads volumes from single files, and dispatches folders to read_dicom.cpp. Every component type goes
// through one buffer of bytes (ImageIOBase), because ITK's image templates compile for minutes. Each ITK
// reader is named here, so that no factory is registered.
#include "voxel/volume/read_volume.h"

#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <memory>

#include "voxel/volume/check_header.h"
#include "voxel/volume/itk_adapter.h"
#include "voxel/volume/slice_stream.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

itk::ImageIOBase::Pointer reader_for(VolumeFormat format) {
  switch (format) {
    case VolumeFormat::nifti:
      return itk::NiftiImageIO::New().GetPointer();
    case VolumeFormat::nrrd:
      return itk::NrrdImageIO::New().GetPointer();
    case VolumeFormat::meta:
      break;
  }
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

// Isolates a packed NIfTI file. The NIfTI library reads the voxels of v.nii.gz from a file v.nii beside it,
// if there is one. In that case v.nii.gz is read through a symbolic link in a temporary folder.
class AloneFile {
 public:
  AloneFile(const fs::path& path, VolumeFormat format) : path_(path) {
    std::error_code error;
    const std::string name = path.string();
    const bool packed = format == VolumeFormat::nifti && path.extension() != ".nii" && name.size() > 3;
    if (!packed || !fs::exists(name.substr(0, name.size() - 3), error)) return;
    std::string pattern = (fs::temp_directory_path() / "hybrid_XXXXXX").string();
    if (mkdtemp(pattern.data()) != nullptr) {
      folder_ = pattern;
      path_ = folder_ / path.filename();
      fs::create_symlink(fs::absolute(path), path_, error);
      if (!error) return;
      remove();
    }
    refuse_volume(path, "'", name.substr(0, name.size() - 3),
                  "' beside it would be read in its place; move one of the two");
  }
  ~AloneFile() { remove(); }
  AloneFile(const AloneFile&) = delete;
  AloneFile& operator=(const AloneFile&) = delete;
  [[nodiscard]] std::string name() const { return path_.string(); }

 private:
  void remove() const {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  fs::path path_, folder_;
};

struct OpenVolume {
  std::unique_ptr<AloneFile> alone;
  itk::ImageIOBase::Pointer io;
  VolumeData data;
  VoxelPlace place;
  double copies = 1.0;  // copies of the voxels in memory during reading
};

OpenVolume open_volume(const fs::path& path, double unit_m) {
  const VolumeFormat format = format_of(path);
  OpenVolume open;
  open.place = inspect_volume(path, format);
  open.io = reader_for(format);
  open.alone = std::make_unique<AloneFile>(path, format);
  open.io->SetFileName(open.alone->name());
  in_words(path, "the header cannot be read", kDamaged, [&] {
    try {
      open.io->ReadImageInformation();
    } catch (const itk::ExceptionObject& error) {
      if (words_of(error).find("orthonormal") == std::string::npos) throw;
      refuse_volume(path,
                    "the axes that the header's sform gives are not at right angles, or not as long as "
                    "its voxel sizes; correct the header, or resample the volume onto a rectangular "
                    "lattice first");
    }
  });
  const std::optional<Component> component = component_of(*open.io);
  if (!component) {
    refuse_volume(path, "each voxel holds ", open.io->GetNumberOfComponents(), " numbers of type ",
                  itk::ImageIOBase::GetComponentTypeAsString(open.io->GetComponentType()),
                  ", where one whole or real number is needed; save one channel of it");
  }
  constexpr std::array<const char*, 3> kNames{"NIfTI", "NRRD", "MetaImage"};
  open.data.header.notes = open.place.notes;
  open.data.header.format = kNames[static_cast<std::size_t>(format)];
  set_frame(path, frame_of(path, *open.io), *component, unit_m, open.data);
  if (open.io->GetNumberOfDimensions() < 3) {
    open.data.header.notes.emplace_back(
        "the file has fewer than three axes; the missing ones have one voxel, one unit long");
  }
  check_file_size(path, open.place, open.data.header);
  // The NIfTI and NRRD libraries read into their own buffer first. Scaled NIfTI needs a third copy.
  if (format != VolumeFormat::meta) open.copies = 2.0;
  if (format == VolumeFormat::nifti && (*component == Component::float32 || *component == Component::float64))
    open.copies = 3.0;
  return open;
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

// Calls use(data, next slice) for a single file. Voxels that need no conversion but byte order are streamed.
// Others (text, bzip2, scaled NIfTI) are read whole into memory by the library.
template <typename Use>
auto with_file_slices(const fs::path& path, double unit_m, const std::optional<glm::dvec3>& spacing_m,
                      std::uint64_t max_bytes, Use use) {
  OpenVolume open = open_volume(path, unit_m);
  const VolumeData& data = open.data;
  const std::size_t component = size_of(data.component);
  const bool packed = open.place.packing == VoxelPlace::Packing::deflate;
  if (open.place.as_they_are && (packed || open.place.packing == VoxelPlace::Packing::raw) &&
      (open.place.voxel_bytes == 0 || open.place.voxel_bytes == component)) {
    check_memory(path, data, 0.0, spacing_m, max_bytes);
    VoxelStream stream(path, open.place, data.header);
    auto result = use(data, [&] { return stream.next(data.slice_bytes(), component); });
    stream.finish();
    return result;
  }
  check_memory(path, data, open.copies, spacing_m, max_bytes);
  if (packed) {  // check completeness: the libraries replace missing voxels by zeros
    VoxelStream whole(path, open.place, data.header);
    const std::uint64_t slice =
        bytes_in_file(open.place, data.header) / static_cast<std::uint64_t>(data.header.dims[2]);
    for (int k = 0; k < data.header.dims[2]; ++k) whole.next(slice, 1);
    whole.finish();
  }
  std::vector<std::byte> bytes;
  in_words(path, "the voxels cannot be read", kDamaged, [&] {
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
auto with_slices(const fs::path& path, double unit_m, const std::optional<glm::dvec3>& spacing_m,
                 std::uint64_t max_bytes, Use use) {
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

VolumeHeader read_volume_header(const fs::path& path, double unit_m) {
  return is_folder(path) ? read_dicom_header(path, unit_m).data.header
                         : open_volume(path, unit_m).data.header;
}

LabelVolume load_volume(const fs::path& path, const VolumeFileOptions& options,
                        std::vector<std::string>* notes) {
  check_options(path, options);
  return with_slices(path, options.unit_m, options.spacing_m, options.max_bytes,
                     [&](const VolumeData& data, const NextSlice& next) {
                       if (notes != nullptr) *notes = data.header.notes;
                       return in_words(path, "the voxels cannot be labelled", kDamaged,
                                       [&] { return label_voxels(path, data, next, options); });
                     });
}

VolumeStatistics read_volume_statistics(const fs::path& path, std::uint64_t max_bytes) {
  return with_slices(path, 1e-3, std::nullopt, max_bytes, statistics_of);
}

}  // namespace voxel
