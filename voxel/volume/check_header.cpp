// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/check_header.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>

namespace voxel {
namespace {

namespace fs = std::filesystem;

// Deflate packs at most 1,032 bytes into one byte; with some margin.
constexpr double kMostPacked = 1100.0;
constexpr const char* kNoSpacing = "the header gives no voxel spacing; one unit was put in its place";
constexpr bool kLittle = std::endian::native == std::endian::little;

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

bool starts_with(const std::string& text, const std::string& start) {
  return text.rfind(start, 0) == 0;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// ---- Text headers: NRRD and MetaImage

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// The "key = value" or "key: value" lines; keys are in lower case without blanks.
struct TextHeader {
  std::map<std::string, std::string> fields;
  std::uint64_t bytes = 0;  // length of the header in its file

  [[nodiscard]] bool has(const std::string& key) const { return fields.count(key) != 0; }
  [[nodiscard]] std::string text(const std::string& key) const {
    const auto field = fields.find(key);
    return field == fields.end() ? "" : field->second;
  }
  // `otherwise` if the field is absent; NaN if it is not a number.
  [[nodiscard]] double number(const std::string& key, double otherwise) const {
    const auto field = fields.find(key);
    if (field == fields.end()) return otherwise;
    char* end = nullptr;
    const double value = std::strtod(field->second.c_str(), &end);
    return end == field->second.c_str() ? std::nan("") : value;
  }
};

// Reads to the end of the header: an empty line (NRRD) or the line of `last_key` (MetaImage).
TextHeader read_text_header(const fs::path& path, char separator, const std::string& last_key) {
  constexpr std::size_t kLongestLine = 1000;  // MetaIO has a buffer of 1,024 and does not check
  constexpr std::size_t kMostLines = 1000;
  std::ifstream file(path, std::ios::binary);
  TextHeader header;
  std::string line;
  for (std::size_t lines = 1; lines <= kMostLines && file; ++lines) {
    line.clear();
    for (int c = file.get(); c != '\n' && c != EOF; c = file.get()) {
      ++header.bytes;
      const bool text = c >= 0x20 || c == '\t' || c == '\r';
      if (!text || line.size() >= kLongestLine) {
        refuse_volume(path, "line ", lines, " of the header is ",
                      text ? "longer than 1,000 characters" : "not text", "; ", kDamaged);
      }
      line.push_back(static_cast<char>(c));
    }
    ++header.bytes;
    if (trimmed(line).empty()) break;
    const auto at = line.find(separator);
    if (at == std::string::npos || line[0] == '#') continue;
    std::string key = lower_case(line.substr(0, at));
    key.erase(std::remove_if(key.begin(), key.end(), [](char c) { return c == ' ' || c == '\t'; }),
              key.end());
    if (!header.fields.emplace(key, trimmed(line.substr(at + 1))).second) {
      refuse_volume(path, "the header gives '", key, "' twice; correct it");
    }
    if (key == last_key) break;
  }
  return header;
}

std::uint64_t size_of_file(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(path, error);
  return error ? 0 : bytes;
}

// Finds the file of the voxels that the header names.
void find_data_file(const fs::path& header, const std::string& name, VoxelPlace& place) {
  const std::string word = lower_case(name);
  if (name.empty() || word == "local") return;
  // LIST and printf patterns name several files. The libraries pass patterns to printf unchecked.
  if (starts_with(word, "list") || name.find('%') != std::string::npos) {
    refuse_volume(header, "the voxels are spread over several files ('", name,
                  "'); save the volume as one file");
  }
  place.file = header.parent_path() / name;
  place.offset = 0;
  std::error_code error;
  if (!fs::is_regular_file(place.file, error)) {
    refuse_volume(header, "the voxels should be in '", place.file.string(),
                  "', which is not there; put it back beside the header");
  }
  place.file_bytes = size_of_file(place.file);
}

void check_axes(const fs::path& path, double axes) {
  if (axes >= 1.0 && axes <= 7.0 && axes == std::floor(axes))
    return;  // the reader checks later that it is one volume
  refuse_volume(path, "the header says ", axes, " axes; a volume has three. ", kDamaged);
}

// A byte count in a header; 0 if absent. -1 means that the voxels are at the end of the file and gives 0,
// too.
std::uint64_t bytes_to_skip(const fs::path& path, const TextHeader& header, const std::string& key) {
  const double bytes = header.number(key, 0.0);
  if (!(bytes >= -1.0 && bytes <= 1e15)) {
    refuse_volume(path, "the header's '", key, "' is ", header.text(key), "; ", kDamaged);
  }
  return bytes > 0.0 ? static_cast<std::uint64_t>(bytes) : 0;
}

void inspect_meta(const fs::path& path, VoxelPlace& place) {
  const TextHeader header = read_text_header(path, '=', "elementdatafile");
  if (!header.has("elementdatafile")) refuse_volume(path, "the header has no ElementDataFile; ", kDamaged);
  check_axes(path, header.number("ndims", std::nan("")));
  place.offset = header.bytes;
  find_data_file(path, header.text("elementdatafile"), place);
  const std::string compressed = lower_case(header.text("compresseddata"));
  if (starts_with(compressed, "t") || starts_with(compressed, "1"))
    place.packing = VoxelPlace::Packing::deflate;
  const std::string binary = lower_case(header.text("binarydata"));
  if (starts_with(binary, "f") || starts_with(binary, "0")) place.packing = VoxelPlace::Packing::text;
  place.offset += bytes_to_skip(path, header, "headersize");
  if (header.number("headersize", 0.0) < 0.0)
    place.as_they_are = false;  // the voxels are at the end of the file
  if (!header.has("elementspacing")) place.notes.emplace_back(kNoSpacing);
  for (const char* key : {"binarydatabyteordermsb", "elementbyteordermsb"}) {
    const std::string order = lower_case(header.text(key));
    if (starts_with(order, "t") || starts_with(order, "1")) place.swapped = kLittle;
  }
  const double packed = header.number("compresseddatasize", 0.0);
  if (!(packed >= 0.0 && packed <= static_cast<double>(place.file_bytes))) {
    refuse_volume(path, "the header says ", header.text("compresseddatasize"),
                  " bytes of compressed voxels, but '", place.file.string(), "' has ", place.file_bytes, "; ",
                  kDamaged);
  }
}

void inspect_nrrd(const fs::path& path, VoxelPlace& place) {
  const TextHeader header = read_text_header(path, ':', "");
  check_axes(path, header.number("dimension", std::nan("")));
  place.offset = header.bytes;
  find_data_file(path, header.has("datafile") ? header.text("datafile") : header.text("data file"), place);
  using Packing = VoxelPlace::Packing;
  const std::map<std::string, Packing> packings{
      {"raw", Packing::raw},   {"gzip", Packing::deflate}, {"gz", Packing::deflate}, {"ascii", Packing::text},
      {"text", Packing::text}, {"txt", Packing::text},     {"hex", Packing::text}};
  const auto packing = packings.find(lower_case(header.text("encoding")));
  place.packing = packing == packings.end() ? Packing::other : packing->second;
  bytes_to_skip(path, header, "lineskip");
  const std::uint64_t skipped = bytes_to_skip(path, header, "byteskip");
  (place.packing == Packing::deflate ? place.skipped : place.offset) += skipped;
  const std::string directions = lower_case(header.text("spacedirections"));
  const std::string spacings = lower_case(header.text("spacings"));
  if (directions.find("nan") != std::string::npos || spacings.find("nan") != std::string::npos)
    refuse_volume(path, "the header gives no voxel spacing along an axis (nan); correct it");
  if (directions.empty() && spacings.empty()) place.notes.emplace_back(kNoSpacing);
  // An axis without a direction is not a space axis. Three space axes are needed.
  std::size_t none = 0;
  for (auto at = directions.find("none"); at != std::string::npos; at = directions.find("none", at + 4))
    ++none;
  if (none > 0 && header.number("dimension", 0.0) - static_cast<double>(none) < 3.0)
    refuse_volume(path, "the header gives no direction for one of the volume's three axes; correct it");
  place.swapped = (lower_case(header.text("endian")) == "big") == kLittle && header.has("endian");
  if (header.has("lineskip") || header.number("byteskip", 0.0) < 0.0) place.as_they_are = false;
  if (header.has("lineskip") && place.packing == Packing::deflate) place.packing = Packing::other;
}

// ---- NIfTI

// The number at byte `at` of a header; its bytes are reversed if `swapped`.
template <typename T, std::size_t Bytes>
T field_at(const std::array<unsigned char, Bytes>& header, std::size_t at, bool swapped) {
  std::array<unsigned char, sizeof(T)> bytes{};
  std::copy_n(header.begin() + static_cast<std::ptrdiff_t>(at), sizeof(T), bytes.begin());
  if (swapped) std::reverse(bytes.begin(), bytes.end());
  T value;
  std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

// Refuses a frame that is not finite or overflows in its decomposition: ITK would end the program.
template <std::size_t Bytes>
void check_nifti_frame(const fs::path& path, const std::array<unsigned char, Bytes>& header, bool swapped) {
  const auto check = [&](const char* what, std::size_t at, std::size_t count) {
    for (std::size_t n = 0; n < count; ++n) {
      const float value = field_at<float>(header, at + 4 * n, swapped);
      if (std::isfinite(value) && std::abs(value) < 1e12F) continue;
      refuse_volume(path, "the header's ", what, " has an entry of ", value, "; ", kDamaged);
    }
  };
  check("voxel size", 80, 3);
  if (field_at<std::int16_t>(header, 252, swapped) > 0) check("qform", 256, 6);
  if (field_at<std::int16_t>(header, 254, swapped) > 0) check("sform", 280, 12);
}

// Refuses valid files whose name is wrong, or whose kind is not supported.
template <std::size_t Bytes>
void check_nifti_kind(const fs::path& path, const std::array<unsigned char, Bytes>& header) {
  const bool named_packed = ends_with(lower_case(path.string()), ".gz");
  std::ifstream file(path, std::ios::binary);
  const bool packed = file.get() == 0x1f && file.get() == 0x8b;
  if (packed && !named_packed) refuse_volume(path, "the file is packed by gzip; let its name end in .nii.gz");
  if (!packed && named_packed && field_at<std::int32_t>(header, 0, false) == 348)
    refuse_volume(path, "the file is not packed, as its name says; let it end in .nii");
  for (const bool swapped : {false, true}) {
    if (field_at<std::int32_t>(header, 0, swapped) == 540)
      refuse_volume(path, "this is NIfTI-2, which is not read; save it as NIfTI-1, NRRD or MetaImage");
  }
  if (std::memcmp(&header[344], "ni1", 4) == 0)
    refuse_volume(path, "the voxels are in a file of their own (.img); save it as one .nii file");
}

// Do qform and sform put a voxel in different places? Programs differ in which of the two they use.
template <std::size_t Bytes>
bool frames_differ(const std::array<unsigned char, Bytes>& header, bool swapped) {
  const auto at = [&](std::size_t byte, std::size_t n) {
    return static_cast<double>(field_at<float>(header, byte + 4 * n, swapped));
  };
  if (field_at<std::int16_t>(header, 252, swapped) <= 0 || field_at<std::int16_t>(header, 254, swapped) <= 0)
    return false;
  const double b = at(256, 0), c = at(256, 1), d = at(256, 2);
  const double a = std::sqrt(std::max(0.0, 1.0 - b * b - c * c - d * d));  // nifti1.h, method 2
  const double left = at(76, 0) < 0.0 ? -1.0 : 1.0;
  const std::array<std::array<double, 3>, 3> turn{
      {{a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)},
       {2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)},
       {2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c}}};
  double off = 0.0, size = 0.0;
  for (std::size_t row = 0; row < 3; ++row) {
    off = std::max(off, std::abs(at(268, row) - at(280 + 16 * row, 3)));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double step = turn[row][axis] * at(80, axis) * (axis == 2 ? left : 1.0);
      off = std::max(off, std::abs(step - at(280 + 16 * row, axis)));
      size = std::max(size, std::abs(at(80, axis)));
    }
  }
  return off > 0.01 * size;
}

void inspect_nifti(const fs::path& path, VoxelPlace& place) {
  constexpr std::int32_t kHeaderBytes = 348;
  std::array<unsigned char, kHeaderBytes> header{};
  const gzFile file = gzopen(path.c_str(), "rb");  // also reads unpacked files
  const int got = file == nullptr ? 0 : gzread(file, header.data(), header.size());
  if (file != nullptr) gzclose(file);
  check_nifti_kind(path, header);
  const bool swapped = field_at<std::int32_t>(header, 0, true) == kHeaderBytes;
  const bool magic = std::memcmp(&header[344], "n+1", 4) == 0;
  if (got != kHeaderBytes || (!swapped && field_at<std::int32_t>(header, 0, false) != kHeaderBytes) ||
      !magic) {
    refuse_volume(path, "this is not a NIfTI-1 file with header and voxels together; ", kDamaged);
  }
  const int axes = field_at<std::int16_t>(header, 40, swapped);
  check_axes(path, axes);
  for (int axis = 1; axis <= axes; ++axis) {
    const int voxels = field_at<std::int16_t>(header, 40 + 2 * static_cast<std::size_t>(axis), swapped);
    if (voxels < 1)
      refuse_volume(path, "the header says ", voxels, " voxels along axis ", axis, "; ", kDamaged);
    const float spacing = field_at<float>(header, 76 + 4 * static_cast<std::size_t>(axis), swapped);
    if (axis > 3 || spacing > 0.0F) continue;
    if (voxels > 1 && spacing == 0.0F) {
      refuse_volume(path, "the header says a voxel spacing of 0 along axis ", axis,
                    "; it must be above 0. Correct the header or export the volume again");
    }
    std::ostringstream note;
    note << "the header's voxel size along axis " << axis << " is " << spacing
         << "; another was put in its place";
    place.notes.push_back(note.str());
  }
  check_nifti_frame(path, header, swapped);
  if (frames_differ(header, swapped))
    place.notes.emplace_back(
        "the header's qform and sform put the volume in different places; look whether it lies "
        "where it should");
  if (ends_with(lower_case(path.string()), ".gz")) place.packing = VoxelPlace::Packing::deflate;
  const float offset = field_at<float>(header, 108, swapped);
  const double most = place.packing == VoxelPlace::Packing::raw ? 1.0 : kMostPacked;
  // 0 is common: the voxels follow the header and its four bytes of extension flags.
  if (!(offset >= 0.0F && offset <= most * static_cast<double>(place.file_bytes))) {
    refuse_volume(path, "the header says the voxels begin at byte ", offset, "; ", kDamaged);
  }
  const std::map<int, std::uint64_t> type_bytes{{2, 1},   {4, 2},   {8, 4},   {16, 4},   {64, 8},
                                                {256, 1}, {512, 2}, {768, 4}, {1024, 8}, {1280, 8}};
  const auto type = type_bytes.find(field_at<std::int16_t>(header, 70, swapped));
  if (type != type_bytes.end())
    place.voxel_bytes = type->second;  // other types are refused after ITK has named them
  // With a slope, ITK converts the voxels to floats.
  const float slope = field_at<float>(header, 112, swapped),
              intercept = field_at<float>(header, 116, swapped);
  place.as_they_are = slope == 0.0F || (slope == 1.0F && intercept == 0.0F);
  place.swapped = swapped;
  const auto begin = std::max<std::uint64_t>(static_cast<std::uint64_t>(offset), kHeaderBytes);
  (place.packing == VoxelPlace::Packing::raw ? place.offset : place.skipped) = begin;
}

}  // namespace

std::uint64_t bytes_in_file(const VoxelPlace& place, const VolumeHeader& header) {
  if (place.voxel_bytes == 0) return header.bytes;
  std::uint64_t bytes = place.voxel_bytes;
  for (const int n : header.dims) bytes *= static_cast<std::uint64_t>(n);
  return bytes;
}

VolumeFormat format_of(const fs::path& path) {
  const std::string name = lower_case(path.filename().string());
  if (ends_with(name, ".nii") || ends_with(name, ".nii.gz")) return VolumeFormat::nifti;
  if (ends_with(name, ".nrrd") || ends_with(name, ".nhdr")) return VolumeFormat::nrrd;
  if (ends_with(name, ".mha") || ends_with(name, ".mhd")) return VolumeFormat::meta;
  if (ends_with(name, ".dcm") || ends_with(name, ".ima")) {
    refuse_volume(path, "this is one slice of a DICOM series; give the folder that holds the series");
  }
  refuse_volume(path, "the name's ending is not one of a volume; ", kVolumeFormats);
}

VoxelPlace inspect_volume(const fs::path& path, VolumeFormat format) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) refuse_volume(path, "there is no such file; correct the path");
  if (!fs::is_regular_file(status))
    refuse_volume(path, "this is neither a file nor a folder; ", kVolumeFormats);
  if (!std::ifstream(path)) refuse_volume(path, "the file cannot be opened; check its permissions");
  VoxelPlace place;
  place.file = path;
  place.file_bytes = size_of_file(path);
  if (place.file_bytes == 0) refuse_volume(path, "the file is empty; copy or export it again");
  switch (format) {
    case VolumeFormat::nifti:
      inspect_nifti(path, place);
      break;
    case VolumeFormat::nrrd:
      inspect_nrrd(path, place);
      break;
    case VolumeFormat::meta:
      inspect_meta(path, place);
      break;
  }
  return place;
}

void check_file_size(const fs::path& path, const VoxelPlace& place, VolumeHeader& header) {
  const std::uint64_t left = place.file_bytes > place.offset ? place.file_bytes - place.offset : 0;
  // As text, a voxel of up to eight bytes takes at least one digit and a blank.
  const bool raw = place.packing == VoxelPlace::Packing::raw;
  const double most = raw ? 1.0 : place.packing == VoxelPlace::Packing::text ? 8.0 : kMostPacked;
  const std::uint64_t needed = bytes_in_file(place, header);
  if (static_cast<double>(needed) <= most * static_cast<double>(left)) {
    if (raw && place.as_they_are && left > needed) {
      header.notes.push_back("the file goes on for " + std::to_string(left - needed) +
                             " bytes behind the last voxel; look whether the header's sizes are right");
    }
    return;
  }
  refuse_volume(path, "the header says ", header.dims[0], " x ", header.dims[1], " x ", header.dims[2],
                " voxels of ", header.component, ", ", needed, " bytes, but '", place.file.string(),
                "' has only ", left, raw ? " bytes of them; " : " packed bytes; ", kDamaged);
}

}  // namespace voxel
