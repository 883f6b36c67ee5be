// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of soft objects that a view shows besides surfaces: slices, and the values that colour tissue.
// Names the displacements that these need, and takes them from snapshots. Uses no graphics library.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/tissue/scan_values.h"
#include "hybrid/view/tissue/section.h"
#include "hybrid/view/view_settings.h"

namespace hybrid {

// The scale of colours: from 0 to `end`. 0: nothing is coloured.
struct ColourScale {
  TissueColour colour = TissueColour::displacement;
  double end = 0.0;  // m; for strain and limits a share; for a difference JND

  [[nodiscard]] palette::RampStart start() const {
    return colour == TissueColour::difference ? palette::kRampAtOnce : palette::kOwnFirst;
  }
  friend bool operator==(const ColourScale&, const ColourScale&) = default;
};

struct TissueSlice {
  Section section;
  SectionImage image;
  DrawMesh mesh;                                     // relative to the view's origin
  std::uint64_t image_number = 0;                    // rises when the image changes
  std::uint64_t shape_number = 0, moved_number = 0;  // rise when the net, its places or values change
};

// The surface of one material, in an object whose materials have looks of their own.
struct MaterialSurface {
  std::size_t material = 0;                          // index in DrawnInside::materials
  std::vector<glm::dvec3> at_rest_m;                 // [vertex] scene frame
  DrawMesh mesh;                                     // relative to the view's origin
  float most_moved_m = 0.0F;                         // of a vertex
  std::uint64_t shape_number = 0, moved_number = 0;  // as of TissueSlice
};

class TissueView {
 public:
  // Keeps a reference to the scene. `origin_m`: of the meshes.
  TissueView(const DrawnScene& scene, const glm::dvec3& origin_m);

  // Makes the slices and fields of these settings. Cheap if neither planes nor colouring have changed.
  void set(const ViewSettings& view);
  // The points whose displacements snapshots should carry (Snapshot::asked); null: none.
  [[nodiscard]] const std::shared_ptr<const AskedPoints>& asked() const { return asked_; }
  // Takes the displacements of a snapshot. If it has none for asked(), nothing changes.
  void take(const Snapshot& snapshot);

  [[nodiscard]] const std::vector<TissueSlice>& slices(std::size_t object) const {
    return objects_[object].slices;
  }
  // The surfaces of the visible materials. Empty: the object is drawn as a whole.
  [[nodiscard]] const std::vector<MaterialSurface>& materials(std::size_t object) const {
    return objects_[object].materials;
  }
  // The value at each vertex of the surface. Empty: its displacement.
  [[nodiscard]] const std::vector<float>& values(std::size_t object) const { return objects_[object].values; }
  // Rises when values() changes.
  [[nodiscard]] std::uint64_t values_number(std::size_t object) const {
    return objects_[object].values_number;
  }
  // The scale of the present colouring. Its end is a round number that never falls, so that colours keep
  // their meaning from frame to frame. A few places of tissue may have a larger strain.
  [[nodiscard]] ColourScale scale() const;
  // The progress of reading the scans (Scans::in_words()) if grey values are shown, or a note on a colouring
  // that has nothing to show. Otherwise empty.
  [[nodiscard]] std::string in_words() const;

 private:
  struct Object {
    std::vector<TissueSlice> slices;
    std::vector<float> values;
    std::uint64_t values_number = 0;
    std::optional<TissueField> surface;            // for strain and limits
    std::vector<std::optional<TissueField>> nets;  // [slice] as `surface`
    std::vector<MaterialSurface> materials;
    std::vector<std::optional<TissueField>> material_fields;  // [one of materials] as `surface`
    // [material] at rest; empty: not made yet. They are kept, because making one takes longer than a frame.
    std::vector<std::optional<polygon::TriangleMesh>> made;
    std::vector<glm::vec3> answer;  // the displacements that were taken last
    bool taken = false;             // `answer` belongs to the present points
  };
  void make_fields(std::size_t object, bool surface);
  void make_slices(std::size_t object);
  void make_materials(std::size_t object);
  void paint(std::size_t object);
  void ask();
  void take(std::size_t object, const std::vector<glm::vec3>& moved_m);
  std::vector<float> values_within(const std::optional<TissueField>& field,
                                   std::span<const glm::vec3> at_places, std::span<const glm::vec3> at_field);
  void take_difference(const FeltDifference* difference);
  void note_moved(float moved_m);

  const DrawnScene& scene_;
  glm::dvec3 origin_m_;
  SoftBox box_;
  ViewSettings view_;
  bool fresh_ = true;     // no settings were taken yet
  bool differs_ = false;  // values are those of a difference
  std::vector<Object> objects_;
  std::vector<std::uint8_t> painted_grey_;  // [object] its slices show grey values
  std::shared_ptr<const AskedPoints> asked_;
  Scans scans_;
  std::uint64_t number_ = 0;
  double most_moved_m_ = 0.0, most_strain_ = 0.0, most_jnd_ = 0.0;  // ends of the scales
  std::uint64_t comparison_ = 0, difference_ = 0;  // of the FeltDifference that the values show; 0: of none
};

}  // namespace hybrid
