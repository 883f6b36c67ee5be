// SPDX-License-Identifier: GPL-3.0-or-later
// A scene as written by a person, converted to SI once, on load. Every default of the schema is here and
// nowhere else; scenes/README.md describes the same keys in words.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "device/loop/force_limit.h"
#include "device/paths/path.h"
#include "device/simulated/simulated.h"
#include "hybrid/feel/height_texture.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/geometry/pose.h"
#include "hybrid/scene/tool.h"
#include "voxel/volume/analytic_shapes.h"
#include "voxel/volume/read_volume.h"

namespace hybrid {

// A place in the scene file (1-based). Line 0: the key is absent, and a default applies.
struct SourcePlace {
  std::uint32_t line = 0, column = 0;
};

// A scene that is refused: "file:line:column: what is wrong; what to do".
class SceneError : public std::runtime_error {
 public:
  SceneError(const std::filesystem::path& file, SourcePlace place, const std::string& what_and_remedy);
};

// Energy model of tissue: springs between neighbours, or elastic bricks between eight voxels
// (voxel/fem/deferred_correction.h).
enum class Energy : std::uint8_t { six_link, trilinear };

struct Material {
  double young_Pa = 5e3;     // > 0
  double poisson = 0.3;      // 0 <= ν < 0.5
  double stretch_min = 0.4;  // shortest length of a link, as a fraction of its rest length; 0 < min <= 1
  double stretch_max = 1.6;  // longest length; >= 1
  double shear = 0.6;        // largest slip of a link's ends across it (unit: its rest length); >= 0
  // Strain beyond which a link at rest keeps the excess as plastic strain; > 0.
  double yield = std::numeric_limits<double>::infinity();
  std::optional<Energy> energy{};  // empty: the object's energy
  SourcePlace place;
};

// ---- rigid objects ----

struct MeshSource {
  std::filesystem::path file;  // resolved against the scene's folder
  double unit_m = 1.0;         // length unit of the file; default: the scene's unit
  bool repair = false;
};
struct BallPrimitive {
  double radius_m = 0.0;
};
struct BoxPrimitive {
  glm::dvec3 size_m{0.0};
};
struct PlanePrimitive {
  double size_m = 0.0;  // edge of the square sheet
};
struct CapsulePrimitive {
  double radius_m = 0.0, length_m = 0.0;  // length: between the two centres
};
struct CutPlane {  // cuts away the half-space that the normal points into; scene frame
  glm::dvec3 normal{0.0, 0.0, 1.0};
  double offset_m = 0.0;
};
// A mesh of the surface of some labels (or an intensity range) of a volume. With `cuts` it is an open sheet.
struct VolumeSurfaceSource {
  std::filesystem::path file;
  std::vector<voxel::LabelRule> rules;  // which voxels are inside
  // True: the surface lies between voxels, where the intensity passes an end of the range. This needs a
  // single range in `rules`. False: it follows the sides of voxels. A grown surface always follows them.
  bool between_voxels = false;
  std::optional<double> spacing_m;
  double grow_m = 0.0;  // the surface is moved outward by this much
  int smooth = 10;      // smoothing passes
  bool largest = true;  // keep only the largest connected piece, and fill its cavities
  std::vector<CutPlane> cuts;
  // Length unit of the file's numbers; default: the unit that the file's header states, otherwise mm.
  std::optional<double> unit_m;
};
using RigidSource = std::variant<MeshSource, BallPrimitive, BoxPrimitive, PlanePrimitive, CapsulePrimitive,
                                 VolumeSurfaceSource>;
// Prescribed motion of a rigid object. No contact changes this motion. The object's `position` and `rotation`
// are its pose at the start.
struct SpinDescription {           // rotation about an axis that follows the path
  glm::dvec3 axis{0.0, 0.0, 1.0};  // unit vector, scene frame
  glm::dvec3 about_m{0.0};         // a point of the axis at the start, scene frame
  double rate_rad_per_s = 0.0;     // rate of endless rotation; used only if amplitude_rad is 0
  double amplitude_rad = 0.0, frequency_hz = 0.0;
};
struct PathMotion {
  // Positions count relative to the path's first point, so at the start the object has its own pose.
  std::optional<device::PathDescription> path;
  std::optional<SpinDescription> spin;
};
// A rigid object that moves under contact forces.
struct FreeMotion {
  std::optional<double> mass_kg, density_kg_per_m3;  // exactly one of them
  // Moments of inertia about axes through the centre of mass that are parallel to the object's axes. Default:
  // those of the closed shape, filled evenly.
  std::optional<glm::dvec3> inertia_kg_m2;
  std::optional<glm::dvec3> centre_m;  // centre of mass in the object's frame; default: of the closed shape
  double drag_N_s_per_m = 0.0, angular_drag_N_m_s = 0.0;
  glm::dvec3 gravity_m_per_s2{0.0};
};
using MotionDescription = std::variant<std::monostate, PathMotion, FreeMotion>;  // monostate: fixed

// The feel of a surface; everything is off by default.
struct TextureDescription {
  std::filesystem::path image;  // a PNG; empty: the pattern
  TexturePattern pattern = TexturePattern::waves;
  TextureMapping mapping;
  SourcePlace place;  // of the key that names the image
};
struct FeelDescription {
  double stiffness_N_per_m = 0.0;                        // of the coupling; 0: the tool's
  double damping_N_s_per_m = 0.0;                        // along the normal
  double static_friction = 0.0, dynamic_friction = 0.0;  // Coulomb; 0 <= dynamic <= static
  bool shading = false;
  std::optional<TextureDescription> texture;

  [[nodiscard]] bool any() const {
    return damping_N_s_per_m > 0.0 || static_friction > 0.0 || shading || texture.has_value();
  }
};

struct RigidDescription {
  std::string name;
  RigidSource source;
  Pose pose;
  FeelDescription feel{};
  MotionDescription motion{};
  SourcePlace motion_place{};  // of the key that sets the motion
  bool as_mesh = false;        // render a primitive as a mesh, for comparisons; not a key of scenes
  SourcePlace place;           // of the table
  SourcePlace source_place;    // of the key that names the source
};

// ---- soft objects ----

struct VolumeSource {
  std::filesystem::path file;
  std::vector<voxel::LabelRule> rules;
  std::optional<glm::dvec3> spacing_m;
  bool largest = true;  // keep only the largest connected piece
  // Length unit of the file's numbers; default: the unit that the file's header states, otherwise mm.
  std::optional<double> unit_m;
  // File with the grey values of the same place, in the same frame. Only pictures use it, and it need not
  // exist.
  std::optional<std::filesystem::path> scan{};
};
struct ClosedMeshSource {
  MeshSource mesh;
  glm::dvec3 spacing_m{0.0};
};
using SoftSource = std::variant<VolumeSource, ClosedMeshSource, voxel::Formula>;

struct Anchors {
  // Any of "-x" "+x" "-y" "+y" "-z" "+z": the outermost layer of voxels on that side of the object's own
  // lattice.
  std::vector<std::string> faces{"-z"};
  std::vector<std::uint8_t> labels;
  double rigid_within_m = 0.0;  // voxels this near to a fixed rigid surface become anchors; 0: none
};
// Fewer voxels in the interior of stiff tissue; see voxel/volume/interior_coarsening.h.
struct Thinning {
  std::vector<std::uint8_t> labels;  // empty: those with Young's modulus of at least above_Pa
  double above_Pa = 0.0;
  int every = 3;
  int shell = 2;  // default: every - 1
  SourcePlace place;
};
// How the object is rendered: by its voxels, by the proxy as a rigid object, or by the proxy if that is
// enough (automatic).
enum class SoftModel : std::uint8_t { voxels, proxy, automatic };
// Widths of the finest nested patch (voxel::SoftObject::use_composite_grid()). A wide tool has a narrower
// patch, because a wider one would exceed the work of a tick.
inline constexpr int kPatchMargin = 6, kLeastPatchMargin = 4, kMostPatchMargin = 10;
inline constexpr double kLeastWork = 0.1;

struct SoftDescription {
  std::string name;
  SoftSource source;
  Pose pose;                                      // applied after the volume's own frame
  std::map<std::uint8_t, std::string> materials;  // label to material name; label absent: `material`
  std::string material;                           // name; empty: the default Material
  Anchors anchors;
  std::uint32_t budget = 12'000;  // voxel updates of background relaxation a tick
  SourcePlace budget_place{};     // of the key; line 0: the default
  double work = 1.0;              // share of the work at the tool's contact that a tick does
  int patch = kPatchMargin;       // on nested patches: voxels of the finest one beyond the contact
  std::optional<Thinning> thinning{};
  // Each voxel of the source is divided into split³ equal ones, so the shape stays. Set by references; there
  // is no such key of a scene.
  int split = 1;
  bool patches = true;               // false: never on nested patches. Set by baselines; no key of a scene.
  Energy energy = Energy::six_link;  // energy of materials that state none
  // As in the file. load_scene() moves objects that are felt through the proxy to Scene::rigid. All objects
  // that stay in Scene::soft are felt through their voxels.
  SoftModel model = SoftModel::voxels;
  SourcePlace place, source_place;
};

// ---- the scene ----

// A real PHANToM, through its driver's library.
struct RealDevice {
  std::string name;  // its name in the driver; empty: the default device
  // Scene meters per meter of the hand; empty: chosen for the scene, 1 or more.
  std::optional<double> scale = 1.0;
  SourcePlace place;
};

enum class Overlap : std::uint8_t { carve, refuse };

// The model that an object with the key `model` got, and why.
struct ModelNote {
  std::string object, text;
};
// A key without effect, its line, and the reason.
struct UnusedKey {
  std::string object, text;  // object: empty for a key of the scene
};

struct Scene {
  std::filesystem::path file;
  std::string title;
  double unit_m = 1e-3;  // length unit of the file's numbers
  // Default: chosen from the soft spacing, the rigid size and the tool.
  std::optional<double> occupancy_cell_m;
  SourcePlace occupancy_place;
  Overlap overlap = Overlap::carve;
  std::vector<RigidDescription> rigid;
  std::vector<SoftDescription> soft;
  std::vector<ModelNote> model_notes;
  std::vector<UnusedKey> unused_keys;
  std::map<std::string, Material> materials;
  Tool tool;
  // Simulated, unless real_device is set.
  device::DeviceModel device_model = device::DeviceModel::premium_1_5;
  std::optional<RealDevice> real_device;
  std::optional<device::DeviceLimits> opened_limits;  // limits of an open real device; empty: the model's
  double rate_hz = 1000.0;
  // Settings of a simulated device and its hand.
  int delay_ticks = 0;
  std::optional<double> watchdog_s;
  device::HandTremor tremor;
  device::HandModel hand;
  device::PathDescription path;
  SourcePlace path_place;
  device::ForceLimits safety;    // its deadline is set by deadline_periods
  bool max_force_given = false;  // false: the device's own limit applies
  // False: an ideal device has no energy limit, because its motion does not depend on the force.
  bool max_energy_given = false;
  double deadline_periods = 10.0;
  bool passivity = false;
};

// Building a lattice takes up to lattice_bytes_per_voxel for each voxel of the bounding box (labels, surface
// and temporary copies; 2.6 bytes with 512³ voxels). max_lattice_voxels() is the largest number of voxels for
// which this fits into the machine's physical memory.
inline constexpr std::size_t lattice_bytes_per_voxel = 4;
std::size_t max_lattice_voxels();

// Does the scene's device follow its path whatever the force?
inline bool is_ideal(const Scene& scene) {
  return !scene.real_device && scene.device_model == device::DeviceModel::ideal;
}

// Force limits and resolution of the scene's device.
inline device::DeviceLimits scene_limits(const Scene& scene) {
  return scene.opened_limits.value_or(device::device_limits(scene.device_model));
}

// Floor of the just noticeable difference (N) for the scene's device: its friction, and at least kJndFloor_N.
inline double jnd_floor_N(const Scene& scene) {
  return std::max(kJndFloor_N, scene_limits(scene).friction_N);
}

// Reads and checks a scene file. Opens no other file, but checks that they exist. Models of objects are left
// as written; load_scene() of hybrid/build also decides "auto". Throws SceneError.
[[nodiscard]] Scene read_scene(const std::filesystem::path& file);

}  // namespace hybrid
