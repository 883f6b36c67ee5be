// SPDX-License-Identifier: GPL-3.0-or-later
// A scene as a person wrote it, converted to SI once, on load. Every default of the schema stands here, and
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

// Where in the scene file something was said (1-based; line 0: it was not said, a default holds).
struct SourcePlace {
  std::uint32_t line = 0, column = 0;
};

// A scene that is refused: "file:line:column: what is wrong; what to do".
class SceneError : public std::runtime_error {
 public:
  SceneError(const std::filesystem::path& file, SourcePlace place, const std::string& what_and_remedy);
};

// Of tissue: springs between neighbours, or elastic bricks between eight voxels (voxel/fem/deferred_correction.h).
enum class Energy : std::uint8_t { six_link, trilinear };

struct Material {
  double young_Pa = 5e3;     // > 0
  double poisson = 0.3;      // 0 <= ν < 0.5
  double stretch_min = 0.4;  // shortest a link may become, of its rest length; 0 < min <= 1
  double stretch_max = 1.6;  // longest, >= 1
  double shear = 0.6;        // most a link's ends may slip across it, of its rest length; >= 0
  // Strain beyond which a link keeps what is beyond, once it is at rest; > 0.
  double yield = std::numeric_limits<double>::infinity();
  std::optional<Energy> energy{};  // empty: its object's
  SourcePlace place;
};

// ---- rigid
// -------------------------------------------------------------------------------------------------
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
  double size_m = 0.0;
};  // edge of the square sheet
struct CapsulePrimitive {
  double radius_m = 0.0, length_m = 0.0;
};                 // length between the two centres
struct CutPlane {  // what lies on the side the normal points to is cut away, in the scene frame
  glm::dvec3 normal{0.0, 0.0, 1.0};
  double offset_m = 0.0;
};
// The surface of some labels (or an intensity range) of a volume, as a mesh. With `cuts` it is an open sheet.
struct VolumeSurfaceSource {
  std::filesystem::path file;
  std::vector<voxel::LabelRule> rules;  // which voxels are inside
  std::optional<double> spacing_m;
  double grow_m = 0.0;  // the surface is moved outward by this much
  int smooth = 10;      // smoothing passes
  bool largest = true;  // keep only the largest connected piece, and fill its cavities
  std::vector<CutPlane> cuts;
  double unit_m = 1e-3;  // length unit of the file (medical formats: mm)
};
using RigidSource = std::variant<MeshSource, BallPrimitive, BoxPrimitive, PlanePrimitive, CapsulePrimitive,
                                 VolumeSurfaceSource>;
// A rigid object that moves as the scene says, whatever touches it. `position` and `rotation` are where it
// begins.
struct SpinDescription {           // turns about an axis that is carried along with the path
  glm::dvec3 axis{0.0, 0.0, 1.0};  // unit vector, scene frame
  glm::dvec3 about_m{0.0};         // a point of the axis at the beginning, scene frame
  double rate_rad_per_s = 0.0;     // for ever; or to and fro:
  double amplitude_rad = 0.0, frequency_hz = 0.0;
};
struct PathMotion {
  // Counted from its own first point: where it begins, the object is where its pose puts it.
  std::optional<device::PathDescription> path;
  std::optional<SpinDescription> spin;
};
// A rigid object that is pushed by what touches it.
struct FreeMotion {
  std::optional<double> mass_kg, density_kg_per_m3;  // one of them
  // About the axes of the object through its centre of mass; default: of its closed shape, filled evenly.
  std::optional<glm::dvec3> inertia_kg_m2;
  std::optional<glm::dvec3> centre_m;  // of mass, in the object's own frame; default: of its closed shape
  double drag_N_s_per_m = 0.0, angular_drag_N_m_s = 0.0;
  glm::dvec3 gravity_m_per_s2{0.0};
};
using MotionDescription = std::variant<std::monostate, PathMotion, FreeMotion>;  // monostate: it stays

// What its surface feels like; all of it off by default.
struct TextureDescription {
  std::filesystem::path image;  // a PNG; empty: the pattern
  TexturePattern pattern = TexturePattern::waves;
  TextureMapping mapping;
  SourcePlace place;  // of the key that names the image
};
struct FeelDescription {
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
  SourcePlace motion_place{};  // of what says how it moves
  bool as_mesh = false;        // feel a primitive as its tessellation: of compare, no key of a scene
  SourcePlace place;           // of the table
  SourcePlace source_place;    // of the key that names the source
};

// ---- soft
// --------------------------------------------------------------------------------------------------
struct VolumeSource {
  std::filesystem::path file;
  std::vector<voxel::LabelRule> rules;
  std::optional<glm::dvec3> spacing_m;
  bool largest = true;   // keep only the largest connected piece
  double unit_m = 1e-3;  // length unit of the file (medical formats: mm)
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
  double rigid_within_m = 0.0;  // voxels this near to a rigid surface are held by it; 0: none
};
// Inside of what is stiff, fewer voxels; see voxel/volume/interior_coarsening.h.
struct Thinning {
  std::vector<std::uint8_t> labels;  // empty: those whose material is at least this stiff
  double above_Pa = 0.0;
  int every = 3;
  int shell = 2;  // default: every - 1
  SourcePlace place;
};
// How it is felt: through its voxels, through the proxy as if it were rigid, or whichever is enough.
enum class SoftModel : std::uint8_t { voxels, proxy, automatic };
struct SoftDescription {
  std::string name;
  SoftSource source;
  Pose pose;                                      // applied after the volume's own frame
  std::map<std::uint8_t, std::string> materials;  // label to material name; label absent: `material`
  std::string material;                           // name; empty: the default Material
  Anchors anchors;
  std::uint32_t budget = 12'000;  // voxel updates of background relaxation a tick
  std::optional<Thinning> thinning{};
  Energy energy = Energy::six_link;     // of materials that do not say
  SoftModel model = SoftModel::voxels;  // of what stands in Scene::soft always this: the others were chosen
  SourcePlace place, source_place;
};

// ---- the rest
// ----------------------------------------------------------------------------------------------
// A real PHANToM, by its driver's library.
struct RealDevice {
  std::string name;  // as the driver knows it; empty: its default
  std::optional<double> scale =
      1.0;  // scene meters a meter of the hand; empty: as the scene needs, 1 or more
  SourcePlace place;
};

enum class Overlap : std::uint8_t { carve, refuse };

// What an object with a `model` became, and why.
struct ModelNote {
  std::string object, text;
};

struct Scene {
  std::filesystem::path file;
  std::string title;
  double unit_m = 1e-3;  // length unit of the file's numbers
  std::optional<double>
      occupancy_cell_m;  // default: chosen from the soft spacing, the rigid size and the tool
  SourcePlace occupancy_place;
  Overlap overlap = Overlap::carve;
  std::vector<RigidDescription> rigid;
  std::vector<SoftDescription> soft;
  std::vector<ModelNote> model_notes;
  std::map<std::string, Material> materials;
  Tool tool;
  device::DeviceModel device_model = device::DeviceModel::premium_1_5;  // simulated, unless:
  std::optional<RealDevice> real_device;
  std::optional<device::DeviceLimits> opened_limits;  // of a real device that is open; else the model's
  double rate_hz = 1000.0;
  int delay_ticks = 0;               // of a simulated device, with
  std::optional<double> watchdog_s;  // this and
  device::HandTremor tremor;         // this of its hand
  device::HandModel hand;
  device::PathDescription path;
  SourcePlace path_place;
  device::ForceLimits safety;     // of its deadline, deadline_periods counts
  bool max_force_given = false;   // else the device's own limit holds
  bool max_energy_given = false;  // else an ideal device has no limit: its motion is no answer to a force
  double deadline_periods = 10.0;
  bool passivity = false;
};

// The largest lattice that a soft object may have on this machine: what building it takes for each voxel of
// the bounding box (labels, surface, the copies made on the way; 2.6 bytes in 512³ voxels), within the
// physical memory.
inline constexpr std::size_t lattice_bytes_per_voxel = 4;
std::size_t max_lattice_voxels();

// Whether the scene's device is where its path is, whatever the force.
inline bool is_ideal(const Scene& scene) {
  return !scene.real_device && scene.device_model == device::DeviceModel::ideal;
}

// What the scene's device bears and resolves.
inline device::DeviceLimits scene_limits(const Scene& scene) {
  return scene.opened_limits.value_or(device::device_limits(scene.device_model));
}

// The floor of a just noticeable difference (N) for the scene's device: its friction, and kJndFloor_N at least.
inline double jnd_floor_N(const Scene& scene) {
  return std::max(kJndFloor_N, scene_limits(scene).friction_N);
}

// Reads and checks a scene file. Nothing outside the file is opened except to see that it exists. The model of
// an object is as the file says; load_scene() of hybrid/build also decides "auto". Throws SceneError.
[[nodiscard]] Scene read_scene(const std::filesystem::path& file);

}  // namespace hybrid
