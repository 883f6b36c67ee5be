// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/build/build_objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <memory>
#include <stdexcept>

#include "hybrid/base/process_memory.h"
#include "hybrid/geometry/surface_nets.h"
#include "polygon/files/mesh_file.h"
#include "polygon/repair/check.h"
#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"
#include "voxel/volume/intensity_volume.h"
#include "voxel/volume/read_volume.h"

namespace hybrid {
namespace {

constexpr int kBallSubdivisions = 4;  // 5,120 triangles for drawing and the map; contact is exact
// Bytes per touched voxel. Measured with 160³ voxels: 61 with one label, 96 with four labels in layers, 179
// with labels mixed voxel by voxel, 228 with plasticity. Bricks take 24 more.
constexpr double kTouchedBytes = 60.0, kTouchedMixedBytes = 180.0, kYieldBytes = 50.0, kBrickBytes = 25.0;

std::string in_words(const polygon::Finding& f) {
  return fmt::format("{}: {} {}", f.id, f.count, f.text);
}

void add_findings(const std::string& object, const std::vector<polygon::Finding>& findings,
                  std::vector<BuildNote>& notes) {
  for (const polygon::Finding& f : findings) notes.push_back({object, f.severity, in_words(f)});
}

polygon::TriangleMesh read_mesh(const std::string& object, const MeshSource& source,
                                std::vector<BuildNote>& notes) {
  polygon::MeshFile file =
      polygon::load_mesh(source.file, {.scale = source.unit_m, .max_bytes = usable_memory_bytes() / 4});
  add_findings(object, file.findings, notes);
  if (!source.repair) return std::move(file.mesh);
  polygon::RepairedMesh repaired = polygon::repair_mesh(file.mesh);
  add_findings(object, repaired.changes, notes);
  if (repaired.mesh.empty())
    throw std::runtime_error("repair left no triangle of this mesh; look at it with `hybrid check`");
  return std::move(repaired.mesh);
}

std::shared_ptr<const polygon::TriangleMesh> kept(polygon::TriangleMesh mesh) {
  return std::make_shared<const polygon::TriangleMesh>(std::move(mesh));
}

// The rendered surface and the drawn mesh share one mesh.
RigidObject surface_object(const RigidDescription& d, const Pose& pose, polygon::TriangleMesh mesh,
                           bool solid) {
  RigidObject object{.name = d.name, .surface = nullptr, .pose = pose, .drawn = kept(std::move(mesh))};
  return_freed_memory();
  object.surface =
      polygon::make_mesh_surface(object.drawn, {.solid = solid, .vertex_normals = d.feel.shading});
  object.surface_is_drawn = true;
  return object;
}

RigidObject mesh_object(const RigidDescription& d, const Pose& pose, polygon::TriangleMesh mesh,
                        std::vector<BuildNote>& notes) {
  const polygon::MeshCheck check = polygon::check_mesh(mesh);
  for (const polygon::Finding& f : check.findings) {
    if (f.severity != polygon::Severity::info) notes.push_back({d.name, f.severity, in_words(f)});
  }
  return surface_object(d, pose, std::move(mesh), check.oriented);
}

voxel::VolumeFileOptions volume_options(const std::vector<voxel::LabelRule>& rules,
                                        const std::optional<double>& unit_m,
                                        const std::optional<glm::dvec3>& spacing) {
  return {.unit_m = unit_m, .rules = rules, .spacing_m = spacing, .max_bytes = usable_memory_bytes() / 4};
}

// Adds a note for the user on each repair by the file's reader.
void add_notes(const std::string& object, const std::filesystem::path& file,
               const std::vector<std::string>& of_file, std::vector<BuildNote>& notes) {
  for (const std::string& note : of_file)
    notes.push_back({object, polygon::Severity::warning, fmt::format("{}: {}", file.string(), note)});
}
voxel::LabelVolume read_volume(const std::string& object, const std::filesystem::path& file,
                               const voxel::VolumeFileOptions& options, std::vector<BuildNote>& notes) {
  std::vector<std::string> of_file;
  voxel::LabelVolume volume = voxel::load_volume(file, options, &of_file);
  add_notes(object, file, of_file, notes);
  return volume;
}

// intensity_surface() and label_surface() return the surface in the frame of `volume`, which receives the
// labels.
polygon::TriangleMesh intensity_surface(const std::string& object, const VolumeSurfaceSource& s,
                                        const voxel::VolumeFileOptions& options, voxel::LabelVolume& volume,
                                        std::vector<BuildNote>& notes) {
  std::vector<std::string> of_file;
  voxel::IntensityVolume read = voxel::load_intensities(s.file, options, &of_file);
  add_notes(object, s.file, of_file, notes);
  volume = std::move(read.labels);
  if (s.largest) keep_largest_piece(volume, true);
  if (read.intensities.empty()) {
    notes.push_back(
        {object, polygon::Severity::warning,
         "its surface follows the voxels, because their intensities do not fit into memory; with a larger "
         "spacing it would lie between them"});
    return surface_from_labels(volume, s.smooth);
  }
  // Whole numbers are rounded intensities: 300 stands for 299.5 to 300.5.
  const double rounded = read.whole_numbers ? 0.5 : 0.0;
  return surface_from_intensities(
      volume, {read.intensities, s.rules[0].lower - rounded, s.rules[0].upper + rounded}, s.smooth);
}

polygon::TriangleMesh label_surface(const std::string& object, const VolumeSurfaceSource& s,
                                    const voxel::VolumeFileOptions& options, voxel::LabelVolume& volume,
                                    std::vector<BuildNote>& notes) {
  volume = read_volume(object, s.file, options, notes);
  if (s.largest) keep_largest_piece(volume, true);
  if (s.grow_m > 0.0) volume = grow_labels(volume, s.grow_m);
  return surface_from_labels(volume, s.smooth);
}

RigidObject volume_surface_object(const RigidDescription& d, const VolumeSurfaceSource& s,
                                  std::vector<BuildNote>& notes) {
  const std::optional<glm::dvec3> spacing =
      s.spacing_m ? std::optional<glm::dvec3>(glm::dvec3(*s.spacing_m)) : std::nullopt;
  const voxel::VolumeFileOptions options = volume_options(s.rules, s.unit_m, spacing);
  voxel::LabelVolume volume;
  const bool between_voxels = s.between_voxels && s.grow_m == 0.0;
  const auto surface = between_voxels ? intensity_surface : label_surface;
  polygon::TriangleMesh mesh = surface(d.name, s, options, volume, notes);
  const Pose frame{d.pose.position_m + d.pose.rotation * volume.origin_m, d.pose.rotation * volume.rotation};
  if (mesh.empty())
    throw std::runtime_error(
        "no voxel of the volume is in the given labels or range; `hybrid check` lists what it holds");
  if (!s.cuts.empty()) {
    mesh = cut_mesh(mesh, frame, s.cuts);
    if (mesh.empty())
      throw std::runtime_error(
          "the cuts leave nothing of this surface; a cut removes the side its normal points to");
  }
  // A cut surface is open on purpose, so its open edges are not reported.
  if (s.cuts.empty()) return mesh_object(d, frame, std::move(mesh), notes);
  return surface_object(d, frame, std::move(mesh), false);
}

struct RigidBuilder {
  const RigidDescription& d;
  std::vector<BuildNote>& notes;

  RigidObject operator()(const MeshSource& s) const {
    return mesh_object(d, d.pose, read_mesh(d.name, s, notes), notes);
  }
  RigidObject operator()(const BallPrimitive& s) const {
    return {d.name, polygon::make_ball_surface(s.radius_m), d.pose,
            kept(polygon::make_ball_mesh(s.radius_m, kBallSubdivisions))};
  }
  RigidObject operator()(const BoxPrimitive& s) const {
    return {d.name, polygon::make_box_surface(0.5 * s.size_m), d.pose,
            kept(polygon::make_box_mesh(0.5 * s.size_m, 8))};
  }
  RigidObject operator()(const PlanePrimitive& s) const {
    return {d.name, polygon::make_plane_surface(0.5 * s.size_m), d.pose,
            kept(polygon::make_plane_mesh(0.5 * s.size_m, 16))};
  }
  RigidObject operator()(const CapsulePrimitive& s) const {
    return {d.name, polygon::make_capsule_surface(s.radius_m, 0.5 * s.length_m), d.pose,
            kept(polygon::make_capsule_mesh(s.radius_m, 0.5 * s.length_m, 32))};
  }
  RigidObject operator()(const VolumeSurfaceSource& s) const { return volume_surface_object(d, s, notes); }
};

struct VolumeBuilder {
  const SoftDescription& d;
  std::vector<BuildNote>& notes;

  voxel::LabelVolume operator()(const VolumeSource& s) const {
    voxel::LabelVolume volume =
        read_volume(d.name, s.file, volume_options(s.rules, s.unit_m, s.spacing_m), notes);
    if (s.largest) keep_largest_piece(volume, false);
    return volume;
  }
  voxel::LabelVolume operator()(const ClosedMeshSource& s) const {
    return voxelise_mesh(read_mesh(d.name, s.mesh, notes), s.spacing_m, 1, max_lattice_voxels());
  }
  voxel::LabelVolume operator()(const voxel::Formula& s) const {
    return voxel::make_volume(s, max_lattice_voxels());
  }
};

}  // namespace

RigidObject build_rigid(const RigidDescription& description, std::vector<BuildNote>& notes) {
  RigidObject object = std::visit(RigidBuilder{description, notes}, description.source);
  if (description.as_mesh && !std::holds_alternative<PlanePrimitive>(description.source)) {
    object.surface =
        polygon::make_mesh_surface(object.drawn, {.solid = true, .vertex_normals = description.feel.shading});
    object.surface_is_drawn = true;
  }
  return object;
}

RigidMotion build_motion(const RigidDescription& description, const RigidObject& object) {
  // Closedness matters only for the mass of a free body.
  const bool closed =
      std::holds_alternative<FreeMotion>(description.motion) && polygon::check_mesh(*object.drawn).oriented;
  return {description, object.pose, *object.drawn, closed};
}

double map_margin_m(const RigidDescription& description) {
  // Sagitta of the tessellations: triangles of 4 degrees on a ball, of 11 degrees on a capsule.
  if (const auto* ball = std::get_if<BallPrimitive>(&description.source)) return 1.5e-3 * ball->radius_m;
  if (const auto* capsule = std::get_if<CapsulePrimitive>(&description.source))
    return 1.2e-2 * capsule->radius_m;
  return 0.0;
}

namespace {

voxel::LabelVolume divided(const voxel::LabelVolume& volume, int parts) {
  voxel::LabelVolume fine;
  for (std::size_t d = 0; d < 3; ++d) fine.dims[d] = volume.dims[d] * parts;
  fine.spacing_m = volume.spacing_m / static_cast<double>(parts);
  fine.rotation = volume.rotation;
  fine.origin_m = volume.origin_m - volume.rotation * (0.5 * (volume.spacing_m - fine.spacing_m));
  double voxels = 1.0;
  for (const int n : fine.dims) voxels *= n;
  if (voxels > static_cast<double>(max_lattice_voxels()))
    throw std::runtime_error(
        fmt::format("divided into {} parts along each axis, its voxels do not fit", parts));
  fine.labels.reserve(static_cast<std::size_t>(voxels));
  for (int k = 0; k < fine.dims[2]; ++k) {
    for (int j = 0; j < fine.dims[1]; ++j) {
      for (int i = 0; i < fine.dims[0]; ++i)
        fine.labels.push_back(volume.labels[volume.index(i / parts, j / parts, k / parts)]);
    }
  }
  return fine;
}

}  // namespace

voxel::LabelVolume build_volume(const SoftDescription& description, std::vector<BuildNote>& notes) {
  voxel::LabelVolume volume = std::visit(VolumeBuilder{description, notes}, description.source);
  if (description.split > 1) volume = divided(volume, description.split);
  const Pose& pose = description.pose;
  volume.origin_m = pose.position_m + pose.rotation * volume.origin_m;
  volume.rotation = pose.rotation * volume.rotation;
  return volume;
}

std::uint64_t soft_load_bytes(const std::array<int, 3>& dims) {
  double voxels = 1.0;
  for (const int n : dims) voxels *= n;
  return static_cast<std::uint64_t>(voxels * static_cast<double>(lattice_bytes_per_voxel));
}

std::uint64_t soft_touched_bytes(const std::array<int, 3>& dims) {
  double voxels = 1.0;
  for (const int n : dims) voxels *= n;
  return static_cast<std::uint64_t>(voxels * kTouchedBytes);
}

std::uint64_t soft_touched_bytes(const voxel::Lattice& lattice) {
  double bytes = 0.0;
  for (voxel::RowId row = 0; row < lattice.grid().rows(); ++row) {
    if (lattice.filled_in(row) == 0) continue;
    bytes += voxel::kRow *
             ((lattice.inside(row) != 0 ? kTouchedBytes : kTouchedMixedBytes) +
              (lattice.has_plasticity() ? kYieldBytes : 0.0) + (lattice.has_bricks() ? kBrickBytes : 0.0));
  }
  return static_cast<std::uint64_t>(bytes);
}

polygon::TriangleMesh cut_mesh(const polygon::TriangleMesh& mesh, const Pose& to_scene,
                               const std::vector<CutPlane>& cuts) {
  polygon::TriangleMesh result = mesh;
  for (const CutPlane& cut : cuts) {
    const glm::dvec3 normal = glm::normalize(cut.normal);
    const auto height = [&](const glm::dvec3& v) {
      return glm::dot(normal, to_scene.position_m + to_scene.rotation * v) - cut.offset_m;
    };
    polygon::TriangleMesh kept;
    std::vector<std::uint32_t> renumbered(result.vertices.size(), 0xFFFFFFFFU);
    // One new vertex per cut edge.
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> crossings;
    std::vector<double> heights(result.vertices.size());
    for (std::size_t v = 0; v < heights.size(); ++v) heights[v] = height(result.vertices[v]);
    const auto keep = [&](std::uint32_t v) {
      if (renumbered[v] == 0xFFFFFFFFU) {
        renumbered[v] = static_cast<std::uint32_t>(kept.vertices.size());
        kept.vertices.push_back(result.vertices[v]);
      }
      return renumbered[v];
    };
    const auto cross = [&](std::uint32_t a, std::uint32_t b) {
      const auto key = std::minmax(a, b);
      const auto [at, fresh] =
          crossings.try_emplace({key.first, key.second}, static_cast<std::uint32_t>(kept.vertices.size()));
      if (fresh) {
        const double t = heights[key.first] / (heights[key.first] - heights[key.second]);
        kept.vertices.push_back(result.vertices[key.first] +
                                t * (result.vertices[key.second] - result.vertices[key.first]));
      }
      return at->second;
    };
    for (const polygon::TriangleIndices& t : result.triangles) {
      std::array<std::uint32_t, 4> corner{};
      std::uint32_t corners = 0;
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t a = t[e], b = t[(e + 1) % 3];
        if (heights[a] <= 0.0) corner[corners++] = keep(a);
        if ((heights[a] < 0.0 && heights[b] > 0.0) || (heights[a] > 0.0 && heights[b] < 0.0))
          corner[corners++] = cross(a, b);
      }
      for (std::uint32_t c = 2; c < corners; ++c)
        kept.triangles.push_back({corner[0], corner[c - 1], corner[c]});
    }
    result = std::move(kept);
  }
  return result;
}

voxel::LatticeOptions lattice_options(const Scene& scene, const SoftDescription& description) {
  const auto link = [&](const std::string& name) {
    const auto found = scene.materials.find(name);
    const Material m = found == scene.materials.end() ? Material{} : found->second;
    const bool bricks = m.energy.value_or(description.energy) == Energy::trilinear;
    return voxel::LinkMaterial{m.young_Pa, m.poisson, m.stretch_min, m.stretch_max, m.shear, m.yield, bricks};
  };
  voxel::LatticeOptions options;
  options.materials.fill(link(description.material));
  for (const auto& [label, name] : description.materials) options.materials[label] = link(name);
  options.anchor_faces = description.anchors.faces;
  options.anchor_labels = description.anchors.labels;
  return options;
}

}  // namespace hybrid
