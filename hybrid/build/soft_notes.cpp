// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/build/soft_notes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace hybrid {
namespace {

constexpr double kAlike = 1.0 + 1e-6;  // a felt radius up to this is not reported (unit: the tool's radius)

double largest(const glm::dvec3& h) {
  return std::max({h.x, h.y, h.z});
}
double smallest(const glm::dvec3& h) {
  return std::min({h.x, h.y, h.z});
}

}  // namespace

FeltLattice felt_lattice(const glm::dvec3& spacing_m, double tool_radius_m, double reach_m) {
  const double thick = largest(spacing_m), fine = smallest(spacing_m);
  // The tool rests on two voxels at once, half a spacing to each side.
  const double square = reach_m * reach_m - 0.25 * thick * thick;
  return {.inside_m = 0.5 * thick + tool_radius_m - reach_m,
          .dip_m = reach_m - std::sqrt(std::max(0.0, square)),
          .felt_radius_m = reach_m - 0.5 * fine};
}

void note_felt_surface(const Tool& tool, const std::string& name, const voxel::SoftObject& object,
                       std::vector<BuildNote>& notes) {
  const glm::dvec3 h = object.lattice().spacing_m();
  const double thick = largest(h), fine = smallest(h);
  const bool ball = tool.shape == Tool::Shape::ball;
  // A punch is pressed by balls whose radius is half the smallest spacing, whatever the punch's radius.
  const double reach = ball ? object.reach(tool.radius_m) : tool.radius_m + object.voxel_radius();
  const FeltLattice felt = felt_lattice(h, tool.radius_m, reach);
  if (thick > kThickSlices * fine) {
    notes.push_back(
        {name, polygon::Severity::warning,
         fmt::format(
             "slices of {:.3g} mm and pixels of {:.3g} mm move the felt surface: across the slices the tool "
             "meets it {:.2g} mm {} of where it is drawn{}; give it the same spacing along all axes, {:.2g} "
             "mm "
             "for as many voxels",
             1e3 * thick, 1e3 * fine, 1e3 * std::abs(felt.inside_m),
             felt.inside_m < 0.0 ? "outside" : "inside",
             ball ? fmt::format(", and between two slices the tool sinks {:.2g} mm further", 1e3 * felt.dip_m)
                  : std::string(),
             1e3 * std::cbrt(h.x * h.y * h.z))});
  }
  if (ball && felt.felt_radius_m > kAlike * tool.radius_m) {
    notes.push_back(
        {name, polygon::Severity::warning,
         fmt::format(
             "the tool of {:.3g} mm radius is felt as one of {:.3g} mm, the smallest that cannot slip "
             "between voxels {:.3g} mm apart; use a larger tool, or a spacing of {:.2g} mm at most",
             1e3 * tool.radius_m, 1e3 * felt.felt_radius_m, 1e3 * thick, 1e3 * tool.radius_m)});
  }
}

void note_missing_labels(const SoftDescription& description, const voxel::LabelVolume& volume,
                         std::vector<BuildNote>& notes) {
  std::array<bool, 256> present{};
  for (const std::uint8_t label : volume.labels) present[label] = true;
  const auto note = [&](std::string_view key, std::uint8_t label) {
    if (present[label]) return;
    notes.push_back({description.name, polygon::Severity::warning,
                     fmt::format("no voxel has label {}, which '{}' names, so that has no effect; `hybrid "
                                 "check` of the volume lists its labels",
                                 label, key)});
  };
  if (const auto* file = std::get_if<VolumeSource>(&description.source)) {
    std::set<std::uint8_t> chosen;
    for (const voxel::LabelRule& rule : file->rules) chosen.insert(rule.label);
    for (const std::uint8_t label : chosen) note("labels or ranges", label);
  }
  for (const auto& [label, material] : description.materials) note("materials", label);
  for (const std::uint8_t label : description.anchors.labels) note("anchors", label);
}

void note_missing_anchors(const SoftDescription& description, std::span<const std::size_t> near_rigid,
                          std::vector<BuildNote>& notes) {
  if (!(description.anchors.rigid_within_m > 0.0) || !near_rigid.empty()) return;
  notes.push_back(
      {description.name, polygon::Severity::warning,
       fmt::format("no voxel lies within {:.3g} mm of a fixed rigid object, so 'rigid_within' has "
                   "no effect",
                   1e3 * description.anchors.rigid_within_m)});
}

void note_patches(const SoftDescription& description, const voxel::SoftObject& object,
                  const std::string& why_not, std::vector<BuildNote>& notes) {
  if (why_not.empty()) {
    notes.push_back(
        {description.name, polygon::Severity::info,
         fmt::format(
             "contacts are kept on nested patches: a tick takes the same time for any depth and size (in "
             "trials, forces within {:.0f} % of those on wider patches)",
             std::max(1.0, std::ceil(100.0 * object.patch_error())))});
    return;
  }
  notes.push_back({description.name, polygon::Severity::info,
                   fmt::format("contacts are kept voxel by voxel, not on nested patches: {}", why_not)});
  if (description.patch == kPatchMargin) return;
  notes.push_back({description.name, polygon::Severity::warning,
                   "'patch' has no effect, as its contacts are kept voxel by voxel; remove it"});
}

}  // namespace hybrid
