// SPDX-License-Identifier: GPL-3.0-or-later
// The grey values of the scans that soft objects were made from. A session does not keep them: they are read
// when a view first asks for them, on a thread of their own. Uses no graphics library.
#pragma once

#include <future>
#include <memory>
#include <string>
#include <vector>

#include "hybrid/view/tissue/section.h"

namespace hybrid {

// Grey values in a scan's own grid.
struct ScanVolume {
  std::array<int, 3> dims{};
  glm::dmat3 to_scene{1};                    // rotation
  glm::dvec3 origin_m{0.0}, spacing_m{1.0};  // origin: middle of voxel (0, 0, 0), scene frame
  std::vector<float> values;                 // x fastest
  float dark = 0.0F, bright = 1.0F;          // values that are drawn black and white

  // Interpolated between the voxels around a point (scene frame); the nearest value outside the grid.
  [[nodiscard]] float at(const glm::dvec3& at_m) const noexcept;
};

// Black and white are the 1st and the 99th percentile of the values within the object. Throws
// voxel::VolumeError, std::runtime_error, std::bad_alloc.
[[nodiscard]] ScanVolume read_scan(const DrawnObject& object);

// The image in grey.
[[nodiscard]] SectionImage paint_grey(const Section& section, const ScanVolume& scan);

// The scans of a scene, each read at most once. Reading goes on if the view stops asking.
class Scans {
 public:
  // The scan of an object: null while it is read, if there is none, or if it cannot be read. Starts reading
  // at the first call. Keeps a reference to `object`.
  [[nodiscard]] const ScanVolume* of(std::size_t index, const DrawnObject& object);
  // A line about scans that are being read or cannot be read; empty: none.
  [[nodiscard]] std::string in_words() const;

 private:
  struct Entry {
    std::string name;  // of the file
    std::future<ScanVolume> reading;
    std::unique_ptr<ScanVolume> volume;
    std::string error;
  };
  std::vector<std::unique_ptr<Entry>> entries_;  // [object]; null: not asked for yet
};

}  // namespace hybrid
