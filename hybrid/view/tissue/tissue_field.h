// SPDX-License-Identifier: GPL-3.0-or-later
// A quantity of a soft object, from the displacements of its voxels: strain, or how near links are to their
// limits. Uses no graphics library.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// The quantity that colours tissue, over the colours of its materials.
enum class TissueColour : std::uint8_t {
  material,      // none
  displacement,  // from rest (m)
  strain,        // the principal strain of largest magnitude
  limits,        // difference along or across a link, as a share of the link's limit: the largest at a voxel
  difference,    // felt between two models (Snapshot::difference) (JND)
};
inline constexpr std::array<std::string_view, 5> kTissueColours{"material", "displacement", "strain",
                                                                "limits", "difference"};
[[nodiscard]] std::optional<TissueColour> tissue_colour_named(std::string_view name);

// The voxels nearest to some places of an object, and the links of these voxels.
class TissueField {
 public:
  // `places_m`: at rest (scene frame). A place without a voxel within two spacings has the value 0.
  TissueField(const DrawnInside& inside, std::span<const glm::dvec3> places_m);

  // Rest points (scene frame) whose displacements value() needs.
  [[nodiscard]] const std::vector<glm::dvec3>& points_m() const { return points_m_; }
  // Strain or limits at each place, from the displacements of points_m() (scene frame).
  [[nodiscard]] std::vector<float> values(TissueColour colour, std::span<const glm::vec3> moved_m) const;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  struct Stencil {
    std::uint32_t voxel = 0;              // index in points_m_
    std::array<std::uint32_t, 6> ends{};  // of the links 2·d towards +, 2·d + 1 towards −; kNone: no link
    std::array<std::array<float, 3>, 6> limits_m{};  // of each link: shortest, longest, across
  };
  [[nodiscard]] float strain_at(const Stencil& stencil, std::span<const glm::vec3> moved_m) const;
  [[nodiscard]] float limits_at(const Stencil& stencil, std::span<const glm::vec3> moved_m) const;

  glm::dmat3 to_scene_{1};
  glm::dvec3 spacing_m_{1.0};
  std::vector<Stencil> stencils_;
  std::vector<std::uint32_t> of_place_;  // index in stencils_, or kNone
  std::vector<glm::dvec3> points_m_;
};

}  // namespace hybrid
