// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes in single files. Every component type goes through one buffer of bytes (ImageIOBase), not through
// ITK's image templates, which would compile for minutes; and each reader is named here, so that no factory
// is registered.
#include "voxel/volume_file.h"

#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <map>

#include "voxel/volume_itk.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

enum class Format { nifti, nrrd, meta };

constexpr const char* kFormats =
    "give a NIfTI file (.nii, .nii.gz), NRRD (.nrrd, .nhdr), MetaImage (.mha, .mhd) or a folder with one "
    "DICOM series";

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

Format format_of(const fs::path& path) {
  const std::string name = lower_case(path.filename().string());
  if (ends_with(name, ".nii") || ends_with(name, ".nii.gz")) return Format::nifti;
  if (ends_with(name, ".nrrd") || ends_with(name, ".nhdr")) return Format::nrrd;
  if (ends_with(name, ".mha") || ends_with(name, ".mhd")) return Format::meta;
  if (ends_with(name, ".dcm") || ends_with(name, ".ima")) {
    refuse_volume(path, "this is one slice of a DICOM series; give the folder that holds the series");
  }
  refuse_volume(path, "the name's ending is not one of a volume; ", kFormats);
}

itk::ImageIOBase::Pointer reader_for(Format format) {
  switch (format) {
    case Format::nifti:
      return itk::NiftiImageIO::New().GetPointer();
    case Format::nrrd:
      return itk::NrrdImageIO::New().GetPointer();
    case Format::meta:
      break;
  }
  return itk::MetaImageIO::New().GetPointer();
}

// ---- Before the libraries see the file
// ------------------------------------------------------------------------- Their parsers trust a header more
// than a damaged file deserves (fixed-size arrays, format strings, other files), so what they would trust is
// checked here.

// The "key = value" or "key: value" lines of a text header, keys in lower case without blanks.
using Fields = std::map<std::string, std::string>;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

Fields text_header(const fs::path& path, char separator, const std::string& last_key) {
  constexpr std::size_t kLongestLine = 1000;  // MetaIO has lines of 1,024 and no check
  constexpr std::size_t kMostLines = 1000;
  std::ifstream file(path, std::ios::binary);
  Fields fields;
  std::string line;
  for (std::size_t lines = 0; lines < kMostLines; ++lines) {
    line.clear();
    for (int c = file.get(); c != '\n' && c != EOF; c = file.get()) {
      const bool text = c >= 0x20 || c == '\t' || c == '\r';
      if (!text || line.size() > kLongestLine) {
        refuse_volume(path, "line ", lines + 1, " of the header is ",
                      text ? "longer than 1,000 characters" : "not text", "; ", kDamaged);
      }
      line.push_back(static_cast<char>(c));
    }
    if (trimmed(line).empty()) break;  // ends a NRRD header, and no MetaImage header has one
    const auto at = line.find(separator);
    if (at != std::string::npos) {
      std::string key = lower_case(line.substr(0, at));
      key.erase(std::remove_if(key.begin(), key.end(), [](char c) { return c == ' ' || c == '\t'; }),
                key.end());
      if (!fields.emplace(key, trimmed(line.substr(at + 1))).second) {
        refuse_volume(path, "the header gives '", key, "' twice; correct it");
      }
      if (key == last_key) break;
    }
    if (!file) break;
  }
  return fields;
}

// Where the voxels of a file are, and whether their size there is their size in memory.
struct VoxelPlace {
  fs::path file;
  std::uint64_t file_bytes = 0;
  bool raw = false;  // one byte in the file for one in memory
  bool text = false;
};

VoxelPlace place_in(const fs::path& header, const std::string& data_file, bool raw) {
  VoxelPlace place;
  place.raw = raw;
  place.file = header;
  const std::string name = lower_case(data_file);
  if (!data_file.empty() && name != "local") {
    // LIST, printf patterns and 'skip' notations name several files; the libraries pass patterns to printf as
    // they are.
    if (name.rfind("list", 0) == 0 || data_file.find('%') != std::string::npos) {
      refuse_volume(header, "the voxels are spread over several files ('", data_file,
                    "'); save the volume as one file");
    }
    place.file = header.parent_path() / data_file;
  }
  std::error_code error;
  if (!fs::is_regular_file(place.file, error)) {
    refuse_volume(header, "the voxels should be in '", place.file.string(),
                  "', which is not there; put it back beside the header");
  }
  place.file_bytes = fs::file_size(place.file, error);
  return place;
}

double number_in(const Fields& fields, const std::string& key, double otherwise) {
  const auto field = fields.find(key);
  if (field == fields.end()) return otherwise;
  try {
    return std::stod(field->second);
  } catch (const std::exception&) {
    return std::nan("");
  }
}

std::string text_in(const Fields& fields, const std::string& key) {
  const auto field = fields.find(key);
  return field == fields.end() ? "" : field->second;
}

void check_axes(const fs::path& path, double axes) {
  if (axes == 2.0 || axes == 3.0 || axes == 4.0) return;  // 4 may be one volume in a row of one
  refuse_volume(path, "the header says ", axes, " axes; a volume has three. ",
                "Save one three-dimensional volume of it");
}

VoxelPlace inspect_meta(const fs::path& path) {
  const Fields fields = text_header(path, '=', "elementdatafile");
  check_axes(path, number_in(fields, "ndims", std::nan("")));
  const std::string compressed = lower_case(text_in(fields, "compresseddata"));
  const bool raw = compressed.empty() || compressed[0] == 'f' || compressed[0] == '0';
  if (fields.count("elementdatafile") == 0)
    refuse_volume(path, "the header has no ElementDataFile; ", kDamaged);
  VoxelPlace place = place_in(path, text_in(fields, "elementdatafile"), raw);
  const double packed = number_in(fields, "compresseddatasize", 0.0);
  if (!(packed >= 0.0 && packed <= static_cast<double>(place.file_bytes))) {
    refuse_volume(path, "the header says ", packed, " bytes of compressed voxels, but '", place.file.string(),
                  "' has ", place.file_bytes, " bytes; ", kDamaged);
  }
  return place;
}

VoxelPlace inspect_nrrd(const fs::path& path) {
  const Fields fields = text_header(path, ':', "");
  check_axes(path, number_in(fields, "dimension", std::nan("")));
  const std::string encoding = lower_case(text_in(fields, "encoding"));
  std::string data_file = text_in(fields, "datafile");
  VoxelPlace place = place_in(path, data_file, encoding == "raw");
  place.text = encoding == "ascii" || encoding == "text" || encoding == "txt" || encoding == "hex";
  return place;
}

VoxelPlace inspect(const fs::path& path, Format format) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) refuse_volume(path, "there is no such file; correct the path");
  if (!fs::is_regular_file(status)) refuse_volume(path, "this is neither a file nor a folder; ", kFormats);
  if (!std::ifstream(path)) refuse_volume(path, "the file cannot be opened; check its permissions");
  if (fs::file_size(path, error) == 0) refuse_volume(path, "the file is empty; copy or export it again");
  switch (format) {
    case Format::meta:
      return inspect_meta(path);
    case Format::nrrd:
      return inspect_nrrd(path);
    case Format::nifti:
      break;
  }
  return place_in(path, "", !ends_with(lower_case(path.string()), ".gz"));
}

// A header that announces more than the file can hold is found before memory is asked for.
void check_file_size(const fs::path& path, const VoxelPlace& place, const VolumeData& data) {
  // Deflate packs at most 1,032 bytes into one; text needs at least half a byte... at least one digit, for
  // each.
  const double most = place.raw ? 1.0 : place.text ? 8.0 : 1100.0;
  const double announced = static_cast<double>(data.header.bytes);
  if (announced <= most * static_cast<double>(place.file_bytes)) return;
  const auto& n = data.header.dims;
  refuse_volume(path, "the header says ", n[0], " x ", n[1], " x ", n[2], " voxels of ",
                data.header.component, ", ", data.header.bytes, " bytes, but '", place.file.string(),
                "' has only ", place.file_bytes, " bytes; ", kDamaged);
}

// ---- Reading
// ---------------------------------------------------------------------------------------------------

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

struct OpenVolume {
  itk::ImageIOBase::Pointer io;
  VolumeData data;
  double copies = 1.0;  // of the voxels in memory while they are read
};

OpenVolume open_volume(const fs::path& path, double unit_m) {
  const Format format = format_of(path);
  const VoxelPlace place = inspect(path, format);
  OpenVolume open;
  open.io = reader_for(format);
  open.io->SetFileName(path.string());
  in_words(path, "the header cannot be read", kDamaged, [&] { open.io->ReadImageInformation(); });
  const std::optional<Component> component = component_of(*open.io);
  if (!component) {
    refuse_volume(path, "each voxel holds ", open.io->GetNumberOfComponents(), " numbers of type ",
                  itk::ImageIOBase::GetComponentTypeAsString(open.io->GetComponentType()),
                  ", where one whole or real number is needed; save one channel of it");
  }
  constexpr std::array<const char*, 3> kNames{"NIfTI", "NRRD", "MetaImage"};
  open.data.header.format = kNames[static_cast<std::size_t>(format)];
  set_frame(path, frame_of(path, *open.io), *component, unit_m, open.data);
  if (open.io->GetNumberOfDimensions() < 3) {
    open.data.header.notes.emplace_back(
        "the file has fewer than three axes; the missing ones have one voxel, one unit long");
  }
  check_file_size(path, place, open.data);
  // NIfTI and NRRD are read into a buffer of their library's own first, and scaled NIfTI into a third.
  if (format != Format::meta) open.copies = 2.0;
  if (format == Format::nifti && (*component == Component::float32 || *component == Component::float64))
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
    check_memory(path, series.data, 1.0, spacing_m, max_bytes);
    in_words(path, "the voxels cannot be read", kDamaged, [&] { read_dicom_voxels(path, series); });
    return std::move(series.data);
  }
  OpenVolume open = open_volume(path, unit_m);
  check_memory(path, open.data, open.copies, spacing_m, max_bytes);
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

std::string words_of(const itk::ExceptionObject& error) {
  std::string text = error.GetDescription();
  const std::string prefix = "ITK ERROR: ";
  if (text.rfind(prefix, 0) == 0) text.erase(0, prefix.size());
  const auto address = text.find("): ");  // NiftiImageIO(0x55…): words
  if (address != std::string::npos && text.find("(0x") < address) text.erase(0, address + 3);
  for (char& c : text) c = c == '\n' || c == '\r' ? ' ' : c;
  return trimmed(text);
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

void save_volume(const fs::path& path, const LabelVolume& volume, double unit_m) {
  const Format format = format_of(path);
  if (!(std::isfinite(unit_m) && unit_m > 0.0)) {
    refuse_volume(path, "the file's length unit is given as ", unit_m,
                  " m; it must be above 0 (1e-3 for mm)");
  }
  double voxels = 1.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int n = volume.dims[axis];
    voxels *= n;
    if (n < 1) refuse_volume(path, "a volume of ", n, " voxels along axis ", axis + 1, " cannot be saved");
    if (format == Format::nifti && n > 32767) {
      refuse_volume(path, "NIfTI cannot hold ", n,
                    " voxels along an axis (at most 32,767); save it as .nrrd");
    }
  }
  if (voxels != static_cast<double>(volume.labels.size())) {
    refuse_volume(path, "a volume of ", voxels, " voxels with ", volume.labels.size(),
                  " labels cannot be saved");
  }
  if (!path.parent_path().empty() && !is_folder(path.parent_path())) {
    refuse_volume(path, "there is no folder '", path.parent_path().string(), "'; make it first");
  }
  if (!std::ofstream(path, std::ios::app)) {
    refuse_volume(path, "the file cannot be written; check the folder's permissions and free space");
  }
  const char* remedy = "check the folder's permissions and free space";
  in_words(path, "the volume cannot be written", remedy, [&] {
    const itk::ImageIOBase::Pointer io = reader_for(format);
    if (format == Format::meta) dynamic_cast<itk::MetaImageIO&>(*io).SetDoublePrecision(17);
    io->SetFileName(path.string());
    io->SetNumberOfDimensions(3);
    io->SetNumberOfComponents(1);
    io->SetPixelType(itk::IOPixelEnum::SCALAR);
    io->SetComponentType(itk::IOComponentEnum::UCHAR);
    io->SetUseCompression(true);
    const glm::dmat3 direction = glm::mat3_cast(glm::normalize(volume.rotation));
    itk::ImageIORegion region(3);
    for (unsigned axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<int>(axis);
      const auto n = static_cast<itk::SizeValueType>(volume.dims[axis]);
      io->SetDimensions(axis, n);
      io->SetSpacing(axis, volume.spacing_m[a] / unit_m);
      io->SetOrigin(axis, volume.origin_m[a] / unit_m);
      io->SetDirection(axis, std::vector<double>{direction[a].x, direction[a].y, direction[a].z});
      region.SetSize(axis, n);
    }
    io->SetIORegion(region);
    io->WriteImageInformation();
    io->Write(volume.labels.data());
  });
  // The NIfTI library reports a full disk to nobody; what was written must read back.
  if (read_volume_header(path, unit_m).dims != volume.dims)
    refuse_volume(path, "the volume was not written; ", remedy);
}

}  // namespace voxel
