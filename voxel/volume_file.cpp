// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes in single files. Every component type goes through one buffer of bytes (ImageIOBase), not through
// ITK's image templates, which would compile for minutes; and each reader is named here, so that no factory
// is registered.
#include "voxel/volume_file.h"

#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <memory>

#include "voxel/volume_inspect.h"
#include "voxel/volume_itk.h"

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
    if (axis >= axes) continue;  // a single slice or row: spacing 1 in the file's unit, along its own axis
    frame.spacing[a] = io.GetSpacing(axis);
    frame.origin[a] = io.GetOrigin(axis);
    const std::vector<double> direction = io.GetDirection(axis);
    for (unsigned row = 0; row < 3; ++row) {
      frame.direction[a][static_cast<int>(row)] = row < direction.size() ? direction[row] : 0.0;
    }
  }
  return frame;
}

// The NIfTI library reads the voxels of v.nii.gz from a v.nii that lies beside it, whatever is in that. So
// where there is one, the file is read through a link in a folder where it is alone.
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
  double copies = 1.0;  // of the voxels in memory while they are read
};

OpenVolume open_volume(const fs::path& path, double unit_m) {
  const VolumeFormat format = format_of(path);
  OpenVolume open;
  open.place = inspect_volume(path, format);
  open.io = reader_for(format);
  open.alone = std::make_unique<AloneFile>(path, format);
  open.io->SetFileName(open.alone->name());
  in_words(path, "the header cannot be read", kDamaged, [&] { open.io->ReadImageInformation(); });
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
  // NIfTI and NRRD are read into a buffer of their library's own first, and scaled NIfTI into a third.
  if (format != VolumeFormat::meta) open.copies = 2.0;
  if (format == VolumeFormat::nifti && (*component == Component::float32 || *component == Component::float64))
    open.copies = 3.0;
  return open;
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

// The header and voxels of a file or a folder, within the limit.
VolumeData read_volume(const fs::path& path, double unit_m, const std::optional<glm::dvec3>& spacing_m,
                       std::uint64_t max_bytes) {
  if (is_folder(path)) {
    DicomSeries series = read_dicom_header(path, unit_m);
    check_memory(path, series.data, 2.0, spacing_m, max_bytes);  // and what the process apart hands over
    in_words(path, "the voxels cannot be read", kDamaged, [&] { read_dicom_voxels(path, series); });
    return std::move(series.data);
  }
  OpenVolume open = open_volume(path, unit_m);
  check_memory(path, open.data, open.copies, spacing_m, max_bytes);
  check_packed(path, open.place, open.data.header);
  in_words(path, "the voxels cannot be read", kDamaged, [&] {
    open.data.bytes.resize(open.data.header.bytes);
    read_voxels(*open.io, open.data.bytes);
  });
  return std::move(open.data);
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

LabelVolume load_volume(const fs::path& path, const VolumeFileOptions& options) {
  check_options(path, options);
  VolumeData data = read_volume(path, options.unit_m, options.spacing_m, options.max_bytes);
  return in_words(path, "the voxels cannot be labelled", kDamaged,
                  [&] { return label_voxels(path, std::move(data), options); });
}

VolumeStatistics read_volume_statistics(const fs::path& path, std::uint64_t max_bytes) {
  return statistics_of(read_volume(path, 1e-3, std::nullopt, max_bytes));
}

}  // namespace voxel
