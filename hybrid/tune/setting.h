// SPDX-License-Identifier: GPL-3.0-or-later
// A setting: the values of a scene's soft objects on which cost and accuracy depend. It is pure data. So it
// can be compared, stored, put into a scene in memory, and written into the scene's file.
#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/scene/scene.h"

namespace hybrid {

// Values of one soft object, as its table in the scene file has them.
struct ObjectSetting {
  std::string object;
  bool proxy = false;  // model: rendered as if rigid; then the other values have no effect
  // In the file's length unit, with at most kSpacingDigits digits, so that the text is the exact value. All
  // 0: the file gives no spacing, and none is written.
  glm::dvec3 spacing{0.0};
  Energy energy = Energy::six_link;
  double work = 1.0;  // share of the work at the contact that a tick does
  int patch =
      kPatchMargin;  // width of the finest nested patch; no effect if the object is kept voxel by voxel

  friend bool operator==(const ObjectSetting& a, const ObjectSetting& b) {
    return a.object == b.object && a.proxy == b.proxy && a.spacing == b.spacing && a.energy == b.energy &&
           a.work == b.work && a.patch == b.patch;
  }
};

struct Setting {
  std::vector<ObjectSetting> objects;  // in the order of the scene's soft objects that may be tuned
  // Stiffness of the tool's coupling, with at most kCouplingDigits digits. It acts on all objects. Empty: as
  // the scene has it.
  std::optional<double> coupling_N_per_m{};

  friend bool operator==(const Setting& a, const Setting& b) {
    return a.objects == b.objects && a.coupling_N_per_m == b.coupling_N_per_m;
  }
};

inline constexpr int kSpacingDigits = 7;   // significant digits of a spacing in the scene's file
inline constexpr int kCouplingDigits = 4;  // of a coupling's stiffness: far finer than a hand can tell

// A soft object that may be tuned, and the values that its table has now.
struct TunableObject {
  ObjectSetting own;
  glm::dvec3 finest{0.0};   // spacing of its source in the file's unit: finer voxels add nothing; 0: no bound
  glm::dvec3 snap_to{0.0};  // edges of a formula, in the file's unit, that its voxels must fill; 0: none
  bool other_energy = false;   // the key `energy` has an effect, and both its values are allowed
  bool other_model = false;    // the object may also be rendered by the proxy
  bool model_written = false;  // the table has the key `model` with a value other than voxels
  std::string note;            // why a value cannot be changed, in words; may be empty
};

// The soft objects of a scene from read_scene(), with models as written. Objects for which the scene asks for
// the proxy are left out. Reads the headers of volumes. Throws SceneError,
// std::exception.
std::vector<TunableObject> tunable_objects(const Scene& as_read);

Setting own_setting(const std::vector<TunableObject>& objects);

// The setting with a coupling of this stiffness, rounded to kCouplingDigits digits.
Setting with_coupling(Setting setting, double stiffness_N_per_m);

// The setting of the object with voxels `scale` times as wide, but no finer than its source. A formula's
// edges stay whole numbers of voxels, so that its surfaces stay in place. Scale 1 is the object's own
// spacing.
ObjectSetting scaled(const TunableObject& object, double scale);
// Spacing of the setting divided by that of the object: geometric mean over the axes; 1 without a spacing.
double scale_of(const TunableObject& object, const ObjectSetting& setting);

// The scene from read_scene() with these values, on an ideal device. All models are decided.
Scene with_setting(const Scene& as_read, const Setting& setting);

// The most accurate scene at this setting's spacing: voxels everywhere, no thinning, the coupling as given,
// and trilinear energy where the materials allow it. Each voxel is divided into split³ parts.
Scene as_reference(const Scene& as_read, const Setting& setting, int split = 1);

// For example "2.5 mm six-link". If several objects differ: "block 2.5 mm six-link, bone proxy".
std::string in_words(const Setting& setting, double unit_m);
// The lines of each object's table and of the tool's, as in a scene file.
std::string as_toml(const Setting& setting);
// A spacing as the text of its key's value: one number, or a list of three.
std::string spacing_text(const glm::dvec3& spacing);
std::string coupling_text(double stiffness_N_per_m);
const char* energy_name(Energy energy);

}  // namespace hybrid
