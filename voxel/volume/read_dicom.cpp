// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a folder with one DICOM series. Slices are ordered by their positions along the slice normal. GDCM
// runs only in child processes, so that a damaged file cannot end the caller.
#include <itkGDCMImageIO.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <map>
#include <new>
#include <sstream>
#include <type_traits>

#include "voxel/volume/check_dicom.h"
#include "voxel/volume/itk_adapter.h"
#include "voxel/volume/subprocess.h"

namespace voxel {
namespace {

namespace fs = std::filesystem;

struct Slice {
  std::string file;
  std::string series;  // series instance UID
  FileFrame frame;
  Component component = Component::int16;
  double height = 0.0;  // (unit: the file's) along the slice normal
};

std::string name_of(const Slice& slice) {
  return fs::path(slice.file).filename().string();
}

// Header of one slice as a child process returns it. Trivially copyable, because it lies in shared memory.
struct SharedSlice {
  bool done = false;
  std::array<char, 1000> refusal{};
  std::array<char, 100> series{};
  Component component = Component::int16;
  bool no_spacing = false;  // the header seems to have no pixel spacing
  FileFrame frame;
};
static_assert(std::is_trivially_copyable_v<SharedSlice>);

template <std::size_t Size>
void copy_text(const std::string& text, std::array<char, Size>& to) {
  text.copy(to.data(), Size - 1);
}

void read_slice_header(const std::string& file, SharedSlice& slice) {
  const fs::path path = file;
  const auto io = itk::GDCMImageIO::New();
  io->SetFileName(file);
  in_words(path, "the slice cannot be read", kDamaged, [&] { io->ReadImageInformation(); });
  const std::optional<Component> component = component_of(*io);
  if (!component) {
    refuse_volume(path, "each voxel holds ", io->GetNumberOfComponents(),
                  " numbers; only slices of single intensities make a volume");
  }
  slice.component = *component;
  std::string series;
  io->GetValueFromTag("0020|000e", series);
  copy_text(series, slice.series);
  // GDCM replaces a spacing that is 0 or missing by 1 mm.
  std::string spacing;
  io->GetValueFromTag("0028|0030", spacing);
  std::istringstream in(spacing);
  for (double value = 0.0; in >> value; in.ignore(1, '\\')) {
    if (value > 0.0) continue;
    refuse_volume(path, "the header says a pixel spacing of ", value,
                  "; it must be above 0. Correct the header or export the series again");
  }
  std::string of_detector;
  io->GetValueFromTag("0018|1164", of_detector);
  slice.no_spacing =
      spacing.empty() && of_detector.empty() && io->GetSpacing(0) == 1.0 && io->GetSpacing(1) == 1.0;
  const unsigned axes = std::min(io->GetNumberOfDimensions(), 3U);
  slice.frame.dims = {1.0, 1.0, 1.0};
  for (unsigned axis = 0; axis < axes; ++axis) {
    const auto a = static_cast<int>(axis);
    slice.frame.dims[axis] = static_cast<double>(io->GetDimensions(axis));
    slice.frame.spacing[a] = io->GetSpacing(axis);
    slice.frame.origin[a] = io->GetOrigin(axis);
    const std::vector<double> direction = io->GetDirection(axis);
    for (unsigned row = 0; row < std::min<std::size_t>(direction.size(), 3); ++row) {
      slice.frame.direction[a][static_cast<int>(row)] = direction[row];
    }
  }
}

// Calls `call(n)` for every file, all in one child process. Throws VolumeError for the first file that `call`
// refuses or that ends the child.
template <typename Call>
void for_each_apart(const fs::path& folder, const std::vector<std::string>& files, SharedSlice* slices,
                    Call call) {
  for (std::size_t n = 0; n < files.size(); ++n) slices[n].done = false;
  const auto seconds = static_cast<unsigned>(60 + 10 * files.size());
  const int ended = run_in_subprocess(
      [&] {
        for (std::size_t n = 0; n < files.size(); ++n) {
          try {
            call(n);
          } catch (const std::exception& error) {
            copy_text(error.what(), slices[n].refusal);
            return;
          }
          slices[n].done = true;
        }
      },
      seconds);
  if (ended < 0) {
    refuse_volume(folder,
                  "no process could be started to read the DICOM series; close other programs and try again");
  }
  for (std::size_t n = 0; n < files.size(); ++n) {
    if (slices[n].done) continue;
    if (slices[n].refusal[0] != '\0') throw VolumeError(slices[n].refusal.data());
    refuse_volume(files[n], "the DICOM library gave up on this slice (signal ", ended, "); ", kDamaged);
  }
}

// The slices of the only series in the folder, unordered. GDCMSeriesFileNames is not used: it would read
// every file of the folder unchecked.
std::vector<Slice> read_slices(const fs::path& folder, std::vector<std::string>& notes) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->is_regular_file(error)) files.push_back(entry->path());
  }
  if (error)
    refuse_volume(folder, "the folder cannot be read (", error.message(), "); check its permissions");
  std::sort(files.begin(), files.end());
  std::vector<std::string> images;
  for (const fs::path& file : files) {
    if (check_dicom(file) == DicomKind::image) images.push_back(file.string());
  }
  const std::size_t others = files.size() - images.size();
  const SharedMemory memory(images.size() * sizeof(SharedSlice));
  auto* shared = new (memory.data()) SharedSlice[images.size()];
  for_each_apart(folder, images, shared, [&](std::size_t n) { read_slice_header(images[n], shared[n]); });
  std::vector<Slice> slices;
  std::map<std::string, std::size_t> series;
  for (std::size_t n = 0; n < images.size(); ++n) {
    slices.push_back({images[n], shared[n].series.data(), shared[n].frame, shared[n].component, 0.0});
    ++series[slices.back().series];
  }
  if (slices.empty()) {
    refuse_volume(folder, "the folder holds no DICOM series; give the folder that directly holds the slices");
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
  if (shared[0].no_spacing)
    notes.emplace_back("the slices do not say how large their pixels are; 1 mm was put in its place");
  if (others > 0)
    notes.push_back(std::to_string(others) + " files of the folder are not DICOM images and were left out");
  return slices;
}

void check_alike(const fs::path& folder, const Slice& first, const Slice& slice) {
  const auto same = [](double a, double b) { return std::abs(a - b) <= 1e-4 * std::max(std::abs(a), 1e-3); };
  bool alike = first.frame.dims == slice.frame.dims && slice.frame.dims[2] == 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    alike = alike && same(first.frame.spacing[axis], slice.frame.spacing[axis]) &&
            glm::distance(first.frame.direction[axis], slice.frame.direction[axis]) < 1e-3;
  }
  if (alike) return;
  const auto& a = first.frame;
  const auto& b = slice.frame;
  refuse_volume(folder, "slice ", name_of(slice), " (", b.dims[0], " x ", b.dims[1], " x ", b.dims[2],
                " voxels of ", b.spacing.x, " x ", b.spacing.y,
                ") differs in size, spacing or orientation from slice ", name_of(first), " (", a.dims[0],
                " x ", a.dims[1], " x ", a.dims[2], " of ", a.spacing.x, " x ", a.spacing.y,
                "); put the slices of one volume into a folder of their own");
}

// The uniform step between slices along their normal (unit: the file's). Throws VolumeError for uneven
// slices.
double slice_step(const fs::path& folder, const std::vector<Slice>& slices) {
  std::vector<double> steps;
  for (std::size_t n = 1; n < slices.size(); ++n) steps.push_back(slices[n].height - slices[n - 1].height);
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const double usual = sorted[sorted.size() / 2];
  for (std::size_t n = 0; n < steps.size(); ++n) {
    const Slice& below = slices[n];
    const Slice& above = slices[n + 1];
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
    const glm::dvec3 aside = above.frame.origin - below.frame.origin - below.frame.direction[2] * step;
    if (glm::length(aside) > 0.01 * usual + 1e-3) {
      refuse_volume(folder, "slice ", name_of(above), " is shifted sideways by ", glm::length(aside),
                    " against the one before it, as with a tilted gantry; resample the series onto a "
                    "rectangular lattice");
    }
  }
  return (slices.back().height - slices.front().height) / (static_cast<double>(slices.size()) - 1.0);
}

}  // namespace

DicomSeries read_dicom_header(const fs::path& folder, double unit_m) {
  itk::Object::SetGlobalWarningDisplay(false);  // relevant findings go to notes and errors
  DicomSeries series;
  std::vector<Slice> slices = read_slices(folder, series.data.header.notes);
  series.data.header.format = "DICOM series";
  Component component = slices.front().component;
  for (Slice& slice : slices) {
    slice.height = glm::dot(slice.frame.origin, slices.front().frame.direction[2]);
    if (slices.size() > 1) check_alike(folder, slices.front(), slice);
    // Each slice may have its own rescale (PET), which decides its type.
    if (slice.component != component) component = Component::float64;
  }
  std::stable_sort(slices.begin(), slices.end(),
                   [](const Slice& a, const Slice& b) { return a.height < b.height; });
  FileFrame frame = slices.front().frame;
  if (slices.size() > 1) {
    frame.spacing.z = slice_step(folder, slices);
    frame.dims[2] = static_cast<double>(slices.size());
  } else if (frame.dims[2] == 1.0) {
    series.data.header.notes.emplace_back(
        "the series has a single slice; its thickness is taken from its header");
  }
  set_frame(folder, frame, component, unit_m, series.data);
  for (const Slice& slice : slices) series.files.push_back(slice.file);
  return series;
}

std::unique_ptr<SharedMemory> read_dicom_voxels(const fs::path& folder, const DicomSeries& series) {
  const VolumeData& data = series.data;
  const std::vector<std::string>& files = series.files;
  const std::size_t voxels = data.header.bytes / size_of(data.component) / files.size();
  const std::size_t slice_bytes = voxels * size_of(data.component);
  const SharedMemory states(files.size() * sizeof(SharedSlice));
  auto memory = std::make_unique<SharedMemory>(data.header.bytes);
  auto* shared = new (states.data()) SharedSlice[files.size()];
  for_each_apart(folder, files, shared, [&](std::size_t n) {
    Component component{};
    std::vector<std::byte> bytes;
    in_words(files[n], "the slice cannot be read", kDamaged, [&] {
      const auto io = itk::GDCMImageIO::New();
      io->SetFileName(files[n]);
      io->ReadImageInformation();
      component = component_of(*io).value();
      bytes.resize(voxels * size_of(component));
      read_voxels(*io, bytes);
    });
    if (component != data.component) bytes = as_doubles(component, bytes);
    std::copy_n(bytes.begin(), std::min(bytes.size(), slice_bytes),
                memory->data() + static_cast<std::ptrdiff_t>(n * slice_bytes));
  });
  return memory;
}

}  // namespace voxel
