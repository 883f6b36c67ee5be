// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a scene from files without labels: meshes, and volumes of intensities.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/base/process_memory.h"
#include "hybrid/build/soft_notes.h"
#include "hybrid/compose/parts_from_labels.h"
#include "hybrid/geometry/surface_nets.h"
#include "polygon/files/mesh_file.h"
#include "polygon/mesh/mesh_bounds.h"
#include "polygon/repair/check.h"
#include "voxel/volume/read_volume.h"
#include "voxel/volume/write_volume.h"

namespace hybrid {
namespace {

constexpr double kReadyVoxels = 1.5e6;  // tissue with more voxels is read coarser, unless --spacing is given
// Bins of the histogram; there is one rule per bin, and rules are tried one by one.
constexpr std::size_t kBins = 64;
// A mesh smaller than this when read in mm was probably made in meters.
constexpr double kSmall_m = 5e-3;
constexpr double kBone_HU = 300.0;  // a voxel of a CT from this value on is bone

// The bin above which tissue begins. It splits the histogram into the two classes with the greatest variance
// between them (Otsu 1979).
std::size_t otsu(const std::array<double, kBins>& count) {
  double all = 0.0, moment = 0.0;
  for (std::size_t b = 0; b < kBins; ++b) {
    all += count[b];
    moment += count[b] * static_cast<double>(b);
  }
  double below = 0.0, below_moment = 0.0, most = -1.0;
  std::size_t best = 0;
  for (std::size_t b = 0; b + 1 < kBins; ++b) {
    below += count[b];
    below_moment += count[b] * static_cast<double>(b);
    if (below == 0.0 || below == all) continue;
    const double gap = below_moment / below - (moment - below_moment) / (all - below);
    const double between = below * (all - below) * gap * gap;
    if (between <= most) continue;
    most = between;
    best = b;
  }
  return best;
}

// The intensity from which on a volume is tissue.
double tissue_from(const std::filesystem::path& file, const voxel::VolumeStatistics& statistics) {
  const double width = (statistics.maximum - statistics.minimum) / static_cast<double>(kBins);
  voxel::VolumeFileOptions options;
  options.max_bytes = usable_memory_bytes() / 4;
  // The first rule that fits wins, so bin b gets the values below its upper end.
  for (std::size_t b = 0; b < kBins; ++b) {
    const double upper =
        b + 1 == kBins ? statistics.maximum : statistics.minimum + width * (static_cast<double>(b) + 1.0);
    options.rules.push_back({statistics.minimum, upper, static_cast<std::uint8_t>(b + 1)});
  }
  std::array<double, kBins> count{};
  for (const std::uint8_t label : voxel::load_volume(file, options).labels) {
    if (label > 0) count[label - 1U] += 1.0;
  }
  return statistics.minimum + width * (static_cast<double>(otsu(count)) + 1.0);
}

// Adds a note on bright voxels. Without labels bone cannot be told from tissue. In a CT bone is bright.
void note_bone(const std::filesystem::path& file, const std::string& name, const voxel::LabelVolume& tissue,
               const voxel::VolumeStatistics& statistics, SceneParts& parts) {
  if (statistics.maximum < kBone_HU) return;
  voxel::VolumeFileOptions options;
  options.rules = {{kBone_HU, statistics.maximum, 1}};
  options.spacing_m = tissue.spacing_m;
  options.max_bytes = usable_memory_bytes() / 4;
  const auto count = [](const voxel::LabelVolume& volume) {
    return static_cast<double>(
        std::count_if(volume.labels.begin(), volume.labels.end(), [](auto l) { return l != 0; }));
  };
  const double share = count(voxel::load_volume(file, options)) / std::max(1.0, count(tissue));
  parts.notes.push_back(
      fmt::format("{}: without labels all of it becomes one tissue, bone too: {:.2g} % of it lies above "
                  "{:.0f}, which is bone "
                  "in a CT. For rigid bone give --labels, or write a [[rigid]] object into the scene with "
                  "volume = \"{}\" "
                  "and range = [{:.0f}, {:.6g}]",
                  name, 100.0 * share, kBone_HU, file.string(), kBone_HU, statistics.maximum));
}

}  // namespace

std::optional<double> ready_spacing_m(const voxel::LabelVolume& volume, std::size_t filled,
                                      std::string& why) {
  const glm::dvec3& h = volume.spacing_m;
  const double thick = std::max({h.x, h.y, h.z}), fine = std::min({h.x, h.y, h.z});
  const bool many = static_cast<double>(filled) > kReadyVoxels, uneven = thick > kThickSlices * fine;
  if (!many && !uneven) return std::nullopt;
  why = fmt::format("{} voxels of tissue", filled);
  if (uneven) why += fmt::format(" in slices of {:.3g} mm and pixels of {:.3g} mm", 1e3 * thick, 1e3 * fine);
  // Edge of a cube of the same volume, so the number of voxels stays the same.
  const double now = std::cbrt(h.x * h.y * h.z);
  const double wanted = now * std::cbrt(std::max(1.0, static_cast<double>(filled) / kReadyVoxels));
  // The spacing is rounded up to two digits, because a person reads it.
  const double digit = std::pow(10.0, std::floor(std::log10(wanted)) - 1.0);
  return std::ceil(wanted / digit) * digit;
}

void add_intensities(const std::filesystem::path& file, const std::string& name, const Placement& placement,
                     std::optional<std::array<double, 2>> range, std::optional<double> spacing_m,
                     ComposeFolder& folder, SceneParts& parts, const Progress& progress) {
  parts.of_a_body = voxel::read_volume_header(file).directions_known;
  if (progress) progress(fmt::format("reading {}", file.string()));
  const voxel::VolumeStatistics statistics = voxel::read_volume_statistics(file, usable_memory_bytes() / 4);
  if (!(statistics.maximum > statistics.minimum)) {
    throw ComposeError(fmt::format("{}: every voxel is {:.6g}; give a volume with something in it",
                                   file.string(), statistics.minimum));
  }
  const bool told = range.has_value();
  if (!range) {
    range = {tissue_from(file, statistics), statistics.maximum};
    parts.notes.push_back(
        fmt::format("{}: taken as tissue from {:.4g} on (Otsu's threshold; the file goes from {:.4g} to "
                    "{:.4g}); --range LO,HI "
                    "says otherwise, --labels gives a segmentation",
                    name, (*range)[0], statistics.minimum, statistics.maximum));
  }
  voxel::VolumeFileOptions options;
  options.rules = {{(*range)[0], (*range)[1], 1}};
  options.max_bytes = usable_memory_bytes() / 4;
  if (spacing_m) options.spacing_m = glm::dvec3(*spacing_m);
  std::vector<std::string> of_file;
  voxel::LabelVolume volume = voxel::load_volume(file, options, &of_file);
  for (const std::string& note : of_file) parts.notes.push_back(fmt::format("{}: {}", file.string(), note));
  const auto filled = [&volume] {
    return static_cast<std::size_t>(
        std::count_if(volume.labels.begin(), volume.labels.end(), [](auto l) { return l != 0; }));
  };
  std::string why;
  const auto ready = spacing_m ? std::nullopt : ready_spacing_m(volume, filled(), why);
  if (ready) {
    parts.notes.push_back(fmt::format("{}: {}, read at {:.3g} mm along all axes; --spacing says otherwise",
                                      name, why, *ready * 1e3));
    options.spacing_m = glm::dvec3(*ready);
    volume = voxel::load_volume(file, options);
  }
  if (filled() == 0) {
    throw ComposeError(
        fmt::format("{}: no voxel lies within {:.4g} to {:.4g}; the file goes from {:.4g} to {:.4g}, "
                    "give --range within that, "
                    "or a smaller --spacing",
                    file.string(), (*range)[0], (*range)[1], statistics.minimum, statistics.maximum));
  }
  if (!told) note_bone(file, name, volume, statistics, parts);
  keep_largest_piece(volume, false);
  const Tissue* found = find_tissue(name);
  const Tissue& tissue = found == nullptr || found->bone ? unknown_tissue() : *found;
  SoftPart part{
      .name = name,
      .file = name + ".nii.gz",
      .scan = std::filesystem::absolute(file),
      .materials = {{1, &tissue}},
      .label_names = {{1, name}},
      .anchor_bottom = true,
      .comment = fmt::format("{}, {:.4g} to {:.4g}", file.filename().string(), (*range)[0], (*range)[1]),
      .placement = placement,
      .volume = std::move(volume)};
  const glm::dvec3& h = part.volume.spacing_m;
  part.rigid_within_mm = std::max({h.x, h.y, h.z}) * 1e3;
  voxel::save_volume(folder.claim(part.file), part.volume);
  parts.rows.push_back(
      {.name = name,
       .voxels = label_counts(part.volume)[1],
       .size_m = glm::dvec3(part.volume.dims[0], part.volume.dims[1], part.volume.dims[2]) * h,
       .young_Pa = tissue.young_Pa,
       .poisson = tissue.poisson,
       .source = std::string(tissue.source)});
  parts.soft.push_back(std::move(part));
}

void add_mesh(const std::filesystem::path& file, const std::string& name, const Placement& placement,
              ComposeFolder& folder, SceneParts& parts, const Progress& progress) {
  if (progress) progress(fmt::format("reading {}", file.string()));
  const polygon::MeshFile loaded =
      polygon::load_mesh(file, {.scale = 1e-3, .max_bytes = usable_memory_bytes() / 4});
  const polygon::MeshCheck check = polygon::check_mesh(loaded.mesh);
  for (const auto* findings : {&loaded.findings, &check.findings}) {
    for (const polygon::Finding& f : *findings) {
      if (f.severity != polygon::Severity::info)
        parts.notes.push_back(fmt::format("{}: {}: {} {}", name, f.id, f.count, f.text));
    }
  }
  std::string endings = file.extension().string();
  if (endings == ".gz") endings = file.stem().extension().string() + endings;
  const polygon::MeshBounds bounds = polygon::checked_bounds(loaded.mesh);
  const glm::dvec3 size = bounds.high - bounds.low;
  if (glm::length(size) < kSmall_m) {
    parts.notes.push_back(fmt::format(
        "{}: {:.3g} x {:.3g} x {:.3g} mm is small; if the file is in meters, write unit = \"m\" for it in "
        "the scene",
        name, size.x * 1e3, size.y * 1e3, size.z * 1e3));
  }
  folder.copy(file, name + endings);
  parts.rigid.push_back({.name = name,
                         .file = name + endings,
                         .unit = "mm",
                         .family = name,
                         .comment = fmt::format("{} triangles", loaded.mesh.triangles.size()),
                         .placement = placement});
  parts.rows.push_back({.name = name,
                        .rigid = true,
                        .triangles = loaded.mesh.triangles.size(),
                        .size_m = size,
                        .source = check.oriented ? "closed surface" : "sheet"});
}

}  // namespace hybrid
