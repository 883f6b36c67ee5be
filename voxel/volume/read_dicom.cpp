// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a folder with one DICOM series. Slices, whether files or frames of files, are ordered by their
// positions along the slice normal. GDCM runs only in child processes, so that a damaged file cannot end the
// caller.
#include "voxel/volume/read_dicom.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <map>
#include <new>
#include <sstream>
#include <type_traits>

#include "voxel/volume/dicom_frames.h"
#include "voxel/volume/foreign_file.h"
#include "voxel/volume/itk_adapter.h"
#include "voxel/volume/subprocess.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

std::string name_of(const DicomSlice& slice) {
  const std::string name = slice.path.filename().string();
  return slice.file.frames == 1 ? name : name + ", frame " + std::to_string(slice.index + 1);
}

// The state of one file, as a child process returns it. Trivially copyable, because it lies in shared memory.
struct SharedFile {
  bool done = false;
  std::array<char, 1000> refusal{};
  std::array<char, 100> series{};
};
static_assert(std::is_trivially_copyable_v<SharedFile> && std::is_trivially_copyable_v<DicomFrame>);

template <std::size_t Size>
void copy_text(const std::string& text, std::array<char, Size>& to) {
  text.copy(to.data(), Size - 1);
}

// Calls `call(n)` for every file, all in one child process. Throws VolumeError for the first file that `call`
// refuses or that ends the child.
template <typename Call>
void for_each_apart(const fs::path& folder, const std::vector<fs::path>& files, SharedFile* shared,
                    Call call) {
  const auto seconds = static_cast<unsigned>(60 + 10 * files.size());
  const int ended = run_in_subprocess(
      [&] {
        for (std::size_t n = 0; n < files.size(); ++n) {
          try {
            in_words(files[n], "the slice cannot be read", kDamaged, [&] { call(n); });
          } catch (const std::exception& error) {
            copy_text(error.what(), shared[n].refusal);
            return;
          }
          shared[n].done = true;
        }
      },
      seconds);
  if (ended < 0) {
    refuse_volume(folder,
                  "no process could be started to read the DICOM series; close other programs and try again");
  }
  for (std::size_t n = 0; n < files.size(); ++n) {
    if (shared[n].done) continue;
    if (shared[n].refusal[0] != '\0') throw VolumeError(shared[n].refusal.data());
    refuse_volume(files[n], "the DICOM library gave up on this slice (signal ", ended, "); ", kDamaged);
  }
}

// The regular files of a folder, sorted by name.
std::vector<fs::path> files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->is_regular_file(error)) files.push_back(entry->path());
  }
  if (error)
    refuse_volume(folder, "the folder cannot be read (", error.message(), "); check its permissions");
  std::sort(files.begin(), files.end());
  return files;
}

// Throws VolumeError if a file stands in the place of a slice (foreign_file.h). Other files that are no DICOM
// images are left out.
void check_left_out(const std::vector<fs::path>& others, const std::vector<fs::path>& images) {
  for (const fs::path& file : others) {
    if (images.empty() || file.extension() == images[0].extension()) refuse_foreign_file(file, false);
  }
}

// The slices of the only series in the folder, unordered. GDCMSeriesFileNames is not used: it would read
// every file of the folder unchecked.
std::vector<DicomSlice> read_slices(const fs::path& folder, VolumeHeader& header) {
  std::vector<fs::path> images, others;
  std::vector<DicomFile> kinds;
  std::vector<std::size_t> first;  // index of each file's first frame in the list of all frames
  std::size_t frames = 0;
  for (const fs::path& file : files_of(folder)) {
    const DicomFile kind = check_dicom(file);
    if (kind.kind != DicomKind::image) {
      others.push_back(file);
      continue;
    }
    images.push_back(file);
    kinds.push_back(kind);
    first.push_back(frames);
    frames += kind.frames;
  }
  check_left_out(others, images);
  if (images.empty()) {
    refuse_volume(folder, "the folder holds no DICOM series; give the folder that directly holds the slices");
  }
  const SharedMemory memory(images.size() * sizeof(SharedFile)), planes(frames * sizeof(DicomFrame));
  auto* shared = new (memory.data()) SharedFile[images.size()];
  auto* shared_frames = reinterpret_cast<DicomFrame*>(planes.data());
  for_each_apart(folder, images, shared, [&](std::size_t n) {
    const DicomHeader read = read_dicom_frames(images[n], kinds[n]);
    copy_text(read.series, shared[n].series);
    std::copy(read.frames.begin(), read.frames.end(), shared_frames + first[n]);
  });
  std::vector<DicomSlice> slices;
  std::map<std::string, std::size_t> series;
  for (std::size_t n = 0; n < images.size(); ++n) {
    for (std::size_t index = 0; index < kinds[n].frames; ++index)
      slices.push_back({images[n], kinds[n], index, shared_frames[first[n] + index], 0.0});
    ++series[shared[n].series.data()];
  }
  if (series.size() > 1) {
    std::ostringstream text;
    std::size_t named = 0;
    for (const auto& [name, count] : series) {
      if (named++ < 8)
        text << (named == 1 ? "" : ", ") << (name.empty() ? "without identifier" : name) << " (" << count
             << " files)";
    }
    refuse_volume(folder, "the folder holds ", series.size(), " DICOM series: ", text.str(),
                  named > 8 ? ", ..." : "", "; put the files of one of them into a folder of their own");
  }
  if (!others.empty())
    header.notes.push_back(std::to_string(others.size()) +
                           " files of the folder are not DICOM images and were left out");
  return slices;
}

// Several slices must state their positions, which give their order and distance. A single slice need not
// state a position.
void check_places(const fs::path& folder, const std::vector<DicomSlice>& slices, VolumeHeader& header) {
  bool spacing = true, orientation = true;
  for (const DicomSlice& slice : slices) {
    spacing = spacing && slice.frame.has_spacing;
    orientation = orientation && slice.frame.has_orientation;
    header.directions_known = header.directions_known && slice.frame.has_orientation;
    if (slice.frame.has_position || slices.size() == 1) continue;
    refuse_volume(
        folder, "slice ", name_of(slice),
        " does not say where it lies (it has no Image Position (Patient)), so the order and the distance "
        "of the slices are unknown; export the series again with the positions of its slices");
  }
  if (!spacing)
    header.notes.emplace_back("the slices do not say how large their pixels are; 1 mm was put in its place");
  if (!orientation)
    header.notes.emplace_back(
        "the slices have no Image Orientation (Patient): anatomical directions are unknown, and their rows "
        "and "
        "columns are taken to run to the left and to the back");
}

void check_alike(const fs::path& folder, const DicomSlice& first, const DicomSlice& slice) {
  const auto same = [](double a, double b) { return std::abs(a - b) <= 1e-4 * std::max(std::abs(a), 1e-3); };
  bool alike = first.frame.plane.dims == slice.frame.plane.dims;
  for (int axis = 0; axis < 2; ++axis) {
    alike = alike && same(first.frame.plane.spacing[axis], slice.frame.plane.spacing[axis]) &&
            glm::distance(first.frame.plane.direction[axis], slice.frame.plane.direction[axis]) < 1e-3;
  }
  if (alike) return;
  const auto& a = first.frame.plane;
  const auto& b = slice.frame.plane;
  refuse_volume(folder, "slice ", name_of(slice), " (", b.dims[0], " x ", b.dims[1], " x ", b.dims[2],
                " voxels of ", b.spacing.x, " x ", b.spacing.y,
                ") differs in size, spacing or orientation from slice ", name_of(first), " (", a.dims[0],
                " x ", a.dims[1], " x ", a.dims[2], " of ", a.spacing.x, " x ", a.spacing.y,
                "); put the slices of one volume into a folder of their own");
}

// The uniform step between slices along their normal (unit: the file's). Throws VolumeError for uneven
// slices.
double slice_step(const fs::path& folder, const std::vector<DicomSlice>& slices) {
  std::vector<double> steps;
  for (std::size_t n = 1; n < slices.size(); ++n) steps.push_back(slices[n].height - slices[n - 1].height);
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const double usual = sorted[sorted.size() / 2];
  for (std::size_t n = 0; n < steps.size(); ++n) {
    const DicomSlice& below = slices[n];
    const DicomSlice& above = slices[n + 1];
    const double step = steps[n];
    if (step <= 1e-3 * std::max(usual, 1e-3)) {
      refuse_volume(folder, "slices ", name_of(below), " and ", name_of(above), " lie in the same place (at ",
                    below.height,
                    "); the folder holds more than one volume, or slices twice: keep one of each");
    }
    if (std::abs(step - usual) > 0.01 * usual + 1e-3) {
      const double missing = std::round(step / usual) - 1.0;
      refuse_volume(
          folder, "between slices ", name_of(below), " (at ", below.height, ") and ", name_of(above), " (at ",
          above.height, ") the step is ", step, ", elsewhere it is ", usual,
          missing >= 1.0 ? ": slices are missing (about " + std::to_string(static_cast<long>(missing)) + ")"
                         : std::string(": slices are uneven"),
          "; add the missing files, or resample the series onto an even lattice");
    }
    const glm::dvec3 aside =
        above.frame.plane.origin - below.frame.plane.origin - below.frame.plane.direction[2] * step;
    if (glm::length(aside) > 0.01 * usual + 1e-3) {
      refuse_volume(folder, "slice ", name_of(above), " is shifted sideways by ", glm::length(aside),
                    " against the one before it, as with a tilted gantry; resample the series onto a "
                    "rectangular lattice");
    }
  }
  return (slices.back().height - slices.front().height) / (static_cast<double>(slices.size()) - 1.0);
}

// The smallest type that holds the rescaled numbers of all slices. It is the stored type if no slice is
// rescaled, and a whole-number type if all slopes and intercepts are whole. Otherwise it is double.
Component common_component(const std::vector<DicomSlice>& slices) {
  const Component stored = slices.front().frame.stored;
  bool as_stored = true, whole = true;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const DicomSlice& slice : slices) {
    const DicomFrame& f = slice.frame;
    as_stored = as_stored && f.stored == stored && f.slope == 1.0 && f.intercept == 0.0;
    whole = whole && f.slope == std::floor(f.slope) && f.intercept == std::floor(f.intercept);
    for (const double end : {f.lowest, f.highest}) {
      low = std::min(low, f.slope * end + f.intercept);
      high = std::max(high, f.slope * end + f.intercept);
    }
  }
  if (as_stored) return stored;
  const auto holds = [&](auto zero) {
    using Limits = std::numeric_limits<decltype(zero)>;
    return whole && low >= static_cast<double>(Limits::min()) && high <= static_cast<double>(Limits::max());
  };
  if (holds(std::uint8_t{})) return Component::uint8;
  if (holds(std::int8_t{})) return Component::int8;
  if (holds(std::uint16_t{})) return Component::uint16;
  if (holds(std::int16_t{})) return Component::int16;
  if (holds(std::uint32_t{})) return Component::uint32;
  if (holds(std::int32_t{})) return Component::int32;
  return Component::float64;
}

// The thickness of a single slice: the size of its voxels along the normal (unit: the file's).
double single_thickness(const DicomSlice& slice, std::vector<std::string>& notes) {
  const double thickness = slice.frame.plane.spacing.z;
  std::ostringstream note;
  note << "the series has a single slice; ";
  if (thickness > 0.0) {
    note << "its thickness, " << thickness << " mm, is taken from its header";
  } else {
    note << "it does not say how thick it is, and 1 mm was put in its place";
  }
  notes.push_back(note.str());
  return thickness > 0.0 ? thickness : 1.0;
}

}  // namespace

DicomSeries read_dicom_header(const fs::path& folder, const std::optional<double>& unit_m) {
  DicomSeries series;
  VolumeHeader& header = series.data.header;
  std::vector<DicomSlice> slices = read_slices(folder, header);
  header.format = "DICOM series";
  check_places(folder, slices, header);
  for (DicomSlice& slice : slices) {
    slice.height = glm::dot(slice.frame.plane.origin, slices.front().frame.plane.direction[2]);
    if (slices.size() > 1) check_alike(folder, slices.front(), slice);
  }
  std::stable_sort(slices.begin(), slices.end(),
                   [](const DicomSlice& a, const DicomSlice& b) { return a.height < b.height; });
  FileFrame frame = slices.front().frame.plane;
  frame.dims[2] = static_cast<double>(slices.size());
  frame.spacing.z =
      slices.size() > 1 ? slice_step(folder, slices) : single_thickness(slices.front(), header.notes);
  constexpr double kMillimeter = 1e-3;
  set_frame(folder, frame, common_component(slices), unit_m.value_or(kMillimeter), series.data);
  series.slices = std::move(slices);
  return series;
}

std::unique_ptr<SharedMemory> read_dicom_voxels(const fs::path& folder, const DicomSeries& series) {
  const VolumeData& data = series.data;
  const std::size_t slice_bytes = data.slice_bytes();
  const std::size_t voxels = slice_bytes / size_of(data.component);
  std::map<fs::path, std::vector<std::size_t>> slices_of;  // each file is read once
  for (std::size_t k = 0; k < series.slices.size(); ++k) slices_of[series.slices[k].path].push_back(k);
  std::vector<fs::path> files;
  files.reserve(slices_of.size());
  for (const auto& [file, slices] : slices_of) files.push_back(file);
  const SharedMemory states(files.size() * sizeof(SharedFile));
  auto memory = std::make_unique<SharedMemory>(data.header.bytes);
  auto* shared = new (states.data()) SharedFile[files.size()];
  for_each_apart(folder, files, shared, [&](std::size_t n) {
    const std::vector<std::size_t>& here = slices_of.at(files[n]);
    const DicomSlice& any = series.slices[here.front()];
    const std::size_t frame_bytes = voxels * size_of(any.frame.stored);
    const std::vector<std::byte> numbers =
        read_dicom_numbers(files[n], any.file, any.frame.stored, frame_bytes * any.file.frames);
    for (const std::size_t k : here) {
      const DicomSlice& slice = series.slices[k];
      rescale_voxels(slice.frame.stored,
                     std::span<const std::byte>(numbers).subspan(slice.index * frame_bytes, frame_bytes),
                     slice.frame.slope, slice.frame.intercept, data.component,
                     std::span<std::byte>(memory->data() + k * slice_bytes, slice_bytes));
    }
  });
  return memory;
}

}  // namespace voxel
