// SPDX-License-Identifier: GPL-3.0-or-later
// Source of the elements: DICOM PS3.3, annexes C.7.6.2 (plane), C.7.6.16 (functional groups), C.8.8.3 (dose).
#include "voxel/volume/dicom_frames.h"

#include <gdcmImageHelper.h>
#include <gdcmImageReader.h>
#include <gdcmSequenceOfItems.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>

#include "voxel/volume/check_header.h"
#include "voxel/volume/number_at.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;
using gdcm::Tag;

const Tag kPosition(0x0020, 0x0032), kOrientation(0x0020, 0x0037), kSpacing(0x0028, 0x0030),
    kThickness(0x0018, 0x0050), kSliceStep(0x0018, 0x0088), kIntercept(0x0028, 0x1052),
    kSlope(0x0028, 0x1053);

std::string text_of(const gdcm::DataSet& set, const Tag& tag) {
  if (!set.FindDataElement(tag)) return {};
  const gdcm::ByteValue* value = set.GetDataElement(tag).GetByteValue();
  if (value == nullptr) return {};
  std::string text(value->GetPointer(), value->GetLength());
  while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
  return text;
}

// The numbers of a decimal string; empty if there is no such element, or nothing in it. Throws VolumeError if
// an entry is not a number, such as 0,7 with a decimal comma.
std::vector<double> numbers_of(const fs::path& path, const gdcm::DataSet& set, const Tag& tag) {
  const std::string text = text_of(set, tag);
  std::vector<double> values;
  const char* at = text.c_str();
  while (*at != '\0') {
    const char* end = nullptr;
    values.push_back(number_at(at, &end));
    while (*end == ' ') ++end;
    if (end == at || !std::isfinite(values.back()) || (*end != '\0' && *end != '\\')) {
      const std::string name = tag.PrintAsContinuousString();
      refuse_volume(path, "DICOM element (", name.substr(0, 4), ",", name.substr(4), ") holds '", text,
                    "', where numbers are needed; ", kDamaged);
    }
    at = *end == '\0' ? end : end + 1;
  }
  return values;
}

// Items of a sequence; empty if there is no such sequence.
class DicomItems {
 public:
  DicomItems(const gdcm::DataSet& set, const Tag& tag) {
    if (set.FindDataElement(tag)) items_ = set.GetDataElement(tag).GetValueAsSQ();
  }
  [[nodiscard]] std::size_t size() const { return items_ ? items_->GetNumberOfItems() : 0; }
  // Null if there is no such item.
  [[nodiscard]] const gdcm::DataSet* at(std::size_t n) const {
    return n < size() ? &items_->GetItem(n + 1).GetNestedDataSet() : nullptr;
  }

 private:
  gdcm::SmartPointer<gdcm::SequenceOfItems> items_;
};

// Finds the elements of a frame. They lie in the file itself or in functional groups: one for each frame and
// one that all frames share.
class FrameElements {
 public:
  FrameElements(const fs::path& path, const gdcm::DataSet& set)
      : path_(path), set_(set), shared_(set, Tag(0x5200, 0x9229)), each_(set, Tag(0x5200, 0x9230)) {}

  [[nodiscard]] bool in_groups() const { return shared_.size() > 0 || each_.size() > 0; }
  [[nodiscard]] std::size_t frames() const { return each_.size(); }

  [[nodiscard]] std::vector<double> numbers(std::size_t frame, const Tag& group, const Tag& tag) const {
    if (!in_groups()) return numbers_of(path_, set_, tag);
    for (const gdcm::DataSet* outer : {each_.at(frame), shared_.at(0)}) {
      if (outer == nullptr) continue;
      const DicomItems inner(*outer, group);
      if (inner.size() == 0) continue;
      std::vector<double> values = numbers_of(path_, *inner.at(0), tag);
      if (!values.empty()) return values;
    }
    return {};
  }
  [[nodiscard]] double number(std::size_t frame, const Tag& group, const Tag& tag, double otherwise) const {
    const std::vector<double> values = numbers(frame, group, tag);
    return values.empty() ? otherwise : values[0];
  }

 private:
  const fs::path& path_;
  const gdcm::DataSet& set_;
  DicomItems shared_, each_;
};

void open_dicom(const fs::path& path, gdcm::ImageReader& reader) {
  gdcm::ImageHelper::SetForceRescaleInterceptSlope(true);  // reads both from every kind of image
  reader.SetFileName(path.c_str());
  if (!reader.Read())
    refuse_volume(path, "the slice cannot be read: the DICOM library does not understand its image; ",
                  kDamaged);
}

Component stored_component(const fs::path& path, const gdcm::PixelFormat& format) {
  switch (format.GetScalarType()) {
    case gdcm::PixelFormat::UINT8:
      return Component::uint8;
    case gdcm::PixelFormat::INT8:
      return Component::int8;
    case gdcm::PixelFormat::UINT12:
    case gdcm::PixelFormat::UINT16:
      return Component::uint16;
    case gdcm::PixelFormat::INT12:
    case gdcm::PixelFormat::INT16:
      return Component::int16;
    case gdcm::PixelFormat::UINT32:
      return Component::uint32;
    case gdcm::PixelFormat::INT32:
      return Component::int32;
    default:
      refuse_volume(path, "the slice cannot be read: its pixels are ", format.GetScalarTypeAsString(),
                    ", not whole numbers of 8, 16 or 32 bits; export the series again");
  }
}

// The axes of a plane from its direction cosines, which headers round. Throws VolumeError.
glm::dmat3 axes_of(const fs::path& path, const std::vector<double>& cosines) {
  constexpr double kCosineRounding = 0.01;  // cosines have a few digits
  const glm::dvec3 row(cosines[0], cosines[1], cosines[2]), column(cosines[3], cosines[4], cosines[5]);
  const double a = glm::length(row), b = glm::length(column);
  if (!(std::abs(a - 1.0) <= kCosineRounding && std::abs(b - 1.0) <= kCosineRounding &&
        std::abs(glm::dot(row, column)) <= kCosineRounding)) {
    refuse_volume(path,
                  "the slice's rows and columns (Image Orientation (Patient)) are not at right angles; ",
                  kDamaged);
  }
  const glm::dvec3 normal = glm::normalize(glm::cross(row, column));
  const glm::dvec3 x = row / a;
  return {x, glm::cross(normal, x), normal};
}

// Reads the pixel spacing and the slice thickness. Throws VolumeError if a pixel spacing is not above 0.
void read_pixel_spacing(const fs::path& path, const FrameElements& elements, std::size_t n,
                        const gdcm::DataSet& set, const gdcm::Image& image, DicomFrame& frame) {
  const Tag measures(0x0028, 0x9110);
  const std::vector<double> spacing = elements.numbers(n, measures, kSpacing);
  for (const double value : spacing) {
    if (value > 0.0) continue;
    refuse_volume(path, "the header says a pixel spacing of ", value,
                  "; it must be above 0. Correct the header or export the series again");
  }
  if (spacing.size() == 1) {
    refuse_volume(path, "the header says one pixel spacing, ", spacing[0],
                  ", where those of rows and of columns are needed; correct it or export the series again");
  }
  if (spacing.size() >= 2) {
    frame.plane.spacing.x = spacing[1];  // the header states the spacing of rows first
    frame.plane.spacing.y = spacing[0];
    frame.has_spacing = true;
  } else if (!elements.in_groups()) {
    // GDCM knows where other kinds of image state their spacing. If there is none, it gives 1 mm.
    frame.plane.spacing.x = image.GetSpacing(0);
    frame.plane.spacing.y = image.GetSpacing(1);
    frame.has_spacing = !text_of(set, Tag(0x0018, 0x1164)).empty() || frame.plane.spacing.x != 1.0 ||
                        frame.plane.spacing.y != 1.0;
  }
  const double thickness = elements.number(n, measures, kThickness, 0.0);
  const double step = std::abs(elements.number(n, measures, kSliceStep, 0.0));
  frame.plane.spacing.z = thickness > 0.0 ? thickness : step;
}

void read_plane(const fs::path& path, const FrameElements& elements, std::size_t n, const gdcm::Image& image,
                DicomFrame& frame) {
  std::vector<double> position = elements.numbers(n, Tag(0x0020, 0x9113), kPosition);
  std::vector<double> cosines = elements.numbers(n, Tag(0x0020, 0x9116), kOrientation);
  frame.has_position = position.size() == 3;
  frame.has_orientation = cosines.size() == 6;
  // GDCM knows where other kinds of image state their position and orientation. If they state none, GDCM
  // gives the origin and the axes of the coordinate system.
  if (!frame.has_position) position.assign(image.GetOrigin(), image.GetOrigin() + 3);
  if (!frame.has_orientation) cosines.assign(image.GetDirectionCosines(), image.GetDirectionCosines() + 6);
  frame.plane.origin = {position[0], position[1], position[2]};
  frame.plane.direction = axes_of(path, cosines);
}

void read_rescaling(const fs::path& path, const FrameElements& elements, std::size_t n,
                    const gdcm::Image& image, DicomFrame& frame) {
  const Tag transformation(0x0028, 0x9145);
  const bool grouped = elements.in_groups();
  frame.slope = grouped ? elements.number(n, transformation, kSlope, 1.0) : image.GetSlope();
  frame.intercept = grouped ? elements.number(n, transformation, kIntercept, 0.0) : image.GetIntercept();
  const std::vector<double> stated = elements.numbers(n, transformation, kSlope);
  if (std::isfinite(frame.slope) && std::isfinite(frame.intercept) && frame.slope != 0.0 &&
      (stated.empty() || stated[0] != 0.0))
    return;
  refuse_volume(path, "the header's rescale slope is ", stated.empty() ? frame.slope : stated[0],
                ", so that all voxels would be alike; correct the header or export the series again");
}

// Places the frames of a file that states one place for all of them: a dose, or a stack of evenly spaced
// frames.
void place_frames(const fs::path& path, const gdcm::DataSet& set, std::vector<DicomFrame>& frames) {
  const glm::dvec3 normal = frames[0].plane.direction[2];
  const std::vector<double> offsets = numbers_of(path, set, Tag(0x3004, 0x000c));
  const std::vector<double> step = numbers_of(path, set, kSliceStep);
  for (std::size_t n = 0; n < frames.size(); ++n) {
    double height = 0.0;
    if (offsets.size() == frames.size()) {
      // Offsets are relative to the first frame, or they are coordinates along z.
      height = offsets[n] - offsets[0];
    } else if (!step.empty() && step[0] != 0.0) {
      height = static_cast<double>(n) * step[0];
    } else {
      refuse_volume(
          path, "the file has ", frames.size(),
          " frames and does not say how far apart they lie; they may be moments in time. Export them "
          "as a series of slices");
    }
    frames[n].plane.origin += normal * height;
    frames[n].has_position = true;
  }
}

// Brings numbers of a big-endian file into this machine's byte order. If the pixels are stated as words, GDCM
// has already swapped the bytes of each 16-bit word. If they are stated as bytes, it has swapped nothing.
void turn_numbers(std::vector<std::byte>& numbers, std::size_t size, bool as_bytes) {
  const std::size_t word = as_bytes ? 1 : 2;
  if (size <= word) return;
  for (std::size_t n = 0; n + size <= numbers.size(); n += size) {
    for (std::size_t low = 0, high = size - word; low < high; low += word, high -= word) {
      for (std::size_t b = 0; b < word; ++b) std::swap(numbers[n + low + b], numbers[n + high + b]);
    }
  }
}

}  // namespace

DicomHeader read_dicom_frames(const fs::path& path, const DicomFile& file) {
  gdcm::ImageReader reader;
  open_dicom(path, reader);
  const gdcm::Image& image = reader.GetImage();
  const gdcm::DataSet& set = reader.GetFile().GetDataSet();
  const gdcm::PixelFormat& format = image.GetPixelFormat();
  const bool palette = image.GetPhotometricInterpretation() == gdcm::PhotometricInterpretation::PALETTE_COLOR;
  if (format.GetSamplesPerPixel() != 1 || palette) {
    refuse_volume(path, "each voxel holds ", palette ? 3 : format.GetSamplesPerPixel(),
                  " numbers; only slices of single intensities make a volume");
  }
  if (text_of(set, Tag(0x0008, 0x0008)).find("MOSAIC") != std::string::npos) {
    refuse_volume(
        path,
        "the picture is a mosaic, in which the slices of a volume lie side by side; convert the series "
        "to NIfTI (as dcm2niix does) or export it as slices");
  }
  const std::size_t frames = image.GetNumberOfDimensions() == 3 ? image.GetDimension(2) : 1;
  const FrameElements elements(path, set);
  if (frames != file.frames || (elements.frames() > 0 && elements.frames() != frames)) {
    refuse_volume(path, "the file says it has ", file.frames, " frames, but describes ",
                  elements.frames() > 0 ? elements.frames() : frames, "; ", kDamaged);
  }
  DicomHeader header;
  header.series = text_of(set, Tag(0x0020, 0x000e));
  header.frames.resize(frames);
  for (std::size_t n = 0; n < frames; ++n) {
    DicomFrame& frame = header.frames[n];
    frame.plane.dims = {static_cast<double>(image.GetDimension(0)),
                        static_cast<double>(image.GetDimension(1)), 1.0};
    frame.stored = stored_component(path, format);
    frame.lowest = static_cast<double>(format.GetMin());
    frame.highest = static_cast<double>(format.GetMax());
    read_pixel_spacing(path, elements, n, set, image, frame);
    read_plane(path, elements, n, image, frame);
    read_rescaling(path, elements, n, image, frame);
  }
  if (frames > 1 && !elements.in_groups()) place_frames(path, set, header.frames);
  return header;
}

std::vector<std::byte> read_dicom_numbers(const fs::path& path, const DicomFile& file, Component stored,
                                          std::size_t bytes) {
  gdcm::ImageReader reader;
  open_dicom(path, reader);
  std::vector<std::byte> numbers(reader.GetImage().GetBufferLength());
  if (numbers.size() != bytes || !reader.GetImage().GetBuffer(reinterpret_cast<char*>(numbers.data()))) {
    refuse_volume(path, "the slice cannot be read: its pixels are ", numbers.size(), " bytes where ", bytes,
                  " are expected, or cannot be unpacked; ", kDamaged);
  }
  if (file.big_endian) turn_numbers(numbers, size_of(stored), file.pixels_as_bytes);
  return numbers;
}

}  // namespace voxel
