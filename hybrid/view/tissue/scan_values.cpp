// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/tissue/scan_values.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "voxel/volume/intensity_volume.h"

namespace hybrid {
namespace {

constexpr double kDarkShare = 0.01, kBrightShare = 0.99;  // percentiles of the values within the object

// Largest number of the object's voxels that are sampled for the values of black and white.
constexpr std::size_t kMostSampled = 200'000;

void choose_black_and_white(ScanVolume& scan, const DrawnInside& inside) {
  std::vector<float> within;
  const std::size_t stride = std::max<std::size_t>(scan.values.size() / kMostSampled, 1);
  for (std::size_t n = 0; n < scan.values.size(); n += stride) {
    const auto x = n % static_cast<std::size_t>(scan.dims[0]),
               rest = n / static_cast<std::size_t>(scan.dims[0]);
    const auto y = rest % static_cast<std::size_t>(scan.dims[1]),
               z = rest / static_cast<std::size_t>(scan.dims[1]);
    const glm::dvec3 at = scan.origin_m + scan.to_scene * (glm::dvec3(x, y, z) * scan.spacing_m);
    if (std::isfinite(scan.values[n]) && inside.material_at(at)) within.push_back(scan.values[n]);
  }
  if (within.empty()) return;
  const auto percentile = [&](double share) {
    const auto at =
        within.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(within.size() - 1));
    std::nth_element(within.begin(), at, within.end());
    return *at;
  };
  scan.dark = percentile(kDarkShare);
  scan.bright = percentile(kBrightShare);
}

}  // namespace

float ScanVolume::at(const glm::dvec3& at_m) const noexcept {
  const glm::dvec3 place = ((at_m - origin_m) * to_scene) / spacing_m;  // v · R is Rᵀ v
  std::array<std::size_t, 3> low{}, step{};
  std::array<float, 3> part{};
  const std::array<std::size_t, 3> strides{
      1, static_cast<std::size_t>(dims[0]),
      static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1])};
  for (std::size_t d = 0; d < 3; ++d) {
    const double in_grid = std::clamp(place[static_cast<int>(d)], 0.0, static_cast<double>(dims[d] - 1));
    low[d] = static_cast<std::size_t>(in_grid);
    part[d] = static_cast<float>(in_grid - static_cast<double>(low[d]));
    step[d] = low[d] + 1 < static_cast<std::size_t>(dims[d]) ? strides[d] : 0;
  }
  const std::size_t first = low[0] + low[1] * strides[1] + low[2] * strides[2];
  float sum = 0.0F;
  for (unsigned corner = 0; corner < 8; ++corner) {
    float weight = 1.0F;
    std::size_t from = first;
    for (std::size_t d = 0; d < 3; ++d) {
      const bool high = (corner >> d & 1U) != 0;
      weight *= high ? part[d] : 1.0F - part[d];
      from += high ? step[d] : 0;
    }
    if (weight > 0.0F) sum += weight * values[from];
  }
  return sum;
}

ScanVolume read_scan(const DrawnObject& object) {
  const DrawnScan& from = object.scan.value();
  voxel::VolumeFileOptions options;
  options.unit_m = from.unit_m;
  options.rules = {{}};  // the labels are not used; without a rule the file would have to hold labels
  voxel::IntensityVolume read = voxel::load_intensities(from.file, options);
  if (read.intensities.empty())
    throw std::runtime_error(from.file.string() + ": its grey values do not fit into memory");
  ScanVolume scan{.dims = read.labels.dims,
                  .to_scene = from.to_scene * glm::mat3_cast(read.labels.rotation),
                  .origin_m = from.origin_m + from.to_scene * read.labels.origin_m,
                  .spacing_m = read.labels.spacing_m,
                  .values = std::move(read.intensities)};
  choose_black_and_white(scan, object.inside);
  return scan;
}

SectionImage paint_grey(const Section& section, const ScanVolume& scan) {
  SectionImage image{.width = section.width, .height = section.height, .pixels = {}};
  image.pixels.reserve(section.materials.size());
  const float range = std::max(scan.bright - scan.dark, 1e-30F);
  for (int y = 0; y < section.height; ++y) {
    for (int x = 0; x < section.width; ++x) {
      if (section.materials[image.pixels.size()] == 0) {
        image.pixels.push_back({});
        continue;
      }
      const float share = (scan.at(section.pixel_m(x, y)) - scan.dark) / range;
      const auto grey = static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(share, 0.0F, 1.0F)));
      image.pixels.push_back({grey, grey, grey, 255});
    }
  }
  return image;
}

const ScanVolume* Scans::of(std::size_t index, const DrawnObject& object) {
  if (!object.scan) return nullptr;
  if (entries_.size() <= index) entries_.resize(index + 1);
  std::unique_ptr<Entry>& entry = entries_[index];
  if (entry == nullptr) {
    entry = std::make_unique<Entry>();
    entry->name = object.scan->file.filename().string();
    entry->reading = std::async(std::launch::async, [&object] { return read_scan(object); });
    return nullptr;
  }
  if (entry->reading.valid() &&
      entry->reading.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    try {
      entry->volume = std::make_unique<ScanVolume>(entry->reading.get());
    } catch (const std::exception& why) {
      entry->error = why.what();
    }
  }
  return entry->volume.get();
}

std::string Scans::in_words() const {
  for (const auto& entry : entries_) {
    if (entry == nullptr) continue;
    if (entry->reading.valid()) return "reading the grey values of " + entry->name;
    if (!entry->error.empty())
      return "slices show materials, because the scan cannot be read: " + entry->error;
  }
  return {};
}

}  // namespace hybrid
