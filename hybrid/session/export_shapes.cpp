// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/export_shapes.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <cstdint>
#include <set>
#include <stdexcept>
#include <string_view>

#include "hybrid/base/file_ending.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/snapshot/fill_snapshot.h"
#include "polygon/files/write_mesh.h"
#include "voxel/volume/warp_labels.h"

namespace hybrid {
namespace {

namespace fs = std::filesystem;

// A soft object as a volume in the frame of its source, slice by slice.
class SoftSlices {
 public:
  SoftSlices(const SoftBody& body, const Pose& pose, const voxel::SoftObject& object) : object_(object) {
    const voxel::Lattice& lattice = object.lattice();
    const glm::dquat back = glm::conjugate(glm::normalize(pose.rotation));
    for (std::size_t a = 0; a < 3; ++a) frame_.dims[a] = lattice.grid().dims[a];
    frame_.spacing_m = lattice.spacing_m();
    frame_.rotation = back * body.pose.rotation;
    frame_.origin_m = back * (body.pose.origin - pose.position_m);
    for (std::size_t n = 0; n < 256; ++n) label_[n] = static_cast<std::uint8_t>(n);
    for (const auto& [strut, label] : body.struts) label_[strut] = label;
  }
  [[nodiscard]] const voxel::VolumeFrame& frame() const { return frame_; }
  [[nodiscard]] std::size_t voxels() const {
    return frame_.slice_size() * static_cast<std::size_t>(frame_.dims[2]);
  }

  void labels(int k, std::span<std::uint8_t> out) const {
    for_each(k, [&](std::size_t n, voxel::VoxelId v) { out[n] = label_[object_.lattice().label(v)]; });
  }
  // Displacement along the volume's axes (unit: meter); 0 where there is no tissue.
  void displacement(int k, std::span<glm::vec3> out) const {
    for_each(k, [&](std::size_t n, voxel::VoxelId v) {
      out[n] = object_.lattice().filled(v) ? glm::vec3(object_.displacement(v)) : glm::vec3(0.0F);
    });
  }

 private:
  template <typename Visit>
  void for_each(int k, Visit visit) const {
    std::size_t n = 0;
    for (int j = 0; j < frame_.dims[1]; ++j) {
      for (int i = 0; i < frame_.dims[0]; ++i, ++n) visit(n, object_.lattice().at(i, j, k));
    }
  }

  const voxel::SoftObject& object_;
  voxel::VolumeFrame frame_;
  std::array<std::uint8_t, 256> label_{};  // [lattice label]; the label in the source
};

std::string as_file_name(std::string name) {
  for (char& c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 128 && std::isalnum(byte) == 0 && c != '-' && c != '_' && c != '.') c = '_';
  }
  return name;
}

enum class SurfaceFormat : std::uint8_t { ply, stl, obj };

SurfaceFormat surface_format(const fs::path& file) {
  const std::string ending = lower_ending(file);
  if (ending == ".stl") return SurfaceFormat::stl;
  return ending == ".obj" ? SurfaceFormat::obj : SurfaceFormat::ply;
}

fs::path before_ending(const fs::path& file, const std::string& more) {
  const std::string name = file.string(), ending = voxel::volume_ending(file);
  return name.substr(0, name.size() - ending.size()) + more + ending;
}

}  // namespace

void save_surfaces(const fs::path& file, const BuiltScene& built) {
  const World& world = *built.world;
  Snapshot now;
  fill_moved(world, *built.state, now);
  polygon::TriangleMesh all;
  const auto add = [&all](const polygon::TriangleMesh& mesh, auto to_scene) {
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) all.vertices.push_back(to_scene(v));
    for (const polygon::TriangleIndices& t : mesh.triangles)
      all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  };
  for (std::size_t o = 0; o < world.rigid.size(); ++o) {
    const Pose& pose = built.state->rigid[o].pose;
    const polygon::TriangleMesh& mesh = *world.rigid[o].drawn;
    add(mesh, [&](std::size_t v) { return pose.position_m + pose.rotation * mesh.vertices[v]; });
  }
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const SoftBody& body = world.soft[o];
    const auto& moved = now.soft_moved_m[world.rigid.size() + o];
    add(body.drawn,
        [&](std::size_t v) { return body.to_scene(body.drawn.vertices[v]) + glm::dvec3(moved[v]); });
  }
  WholeFile out(file);
  const polygon::ByteSink sink = [&out](std::string_view bytes) { out.write(bytes); };
  switch (surface_format(file)) {
    case SurfaceFormat::ply:
      polygon::write_ply(all, sink);
      break;
    case SurfaceFormat::stl:
      polygon::write_stl_in_mm(all, sink);
      break;
    case SurfaceFormat::obj:
      polygon::write_obj_in_mm(all, sink);
      break;
  }
  out.keep();
}

std::vector<fs::path> saved_volume_names(const fs::path& file, const Scene& scene) {
  if (scene.soft.empty())
    throw std::runtime_error(
        "--save-volume: the scene has no soft object, so there is no displacement to save; --save-surface "
        "writes rigid ones");
  std::vector<fs::path> names;
  std::set<std::string> taken;
  for (const SoftDescription& d : scene.soft) {
    std::string more;
    if (scene.soft.size() > 1) {
      more = "-" + as_file_name(d.name);
      while (!taken.insert(more).second) more += "_";
    }
    names.push_back(before_ending(file, more));
    names.push_back(before_ending(file, more + "-labels"));
  }
  return names;
}

std::vector<fs::path> save_volumes(const fs::path& file, const Scene& scene, const BuiltScene& built) {
  std::vector<fs::path> names = saved_volume_names(file, scene);
  for (std::size_t o = 0; o < scene.soft.size(); ++o) {
    const SoftSlices slices(built.world->soft[o], scene.soft[o].pose, *built.state->soft[o]);
    const glm::dmat3 turn = glm::mat3_cast(slices.frame().rotation);
    voxel::write_vectors(names[2 * o], slices.frame(), [&](int k, std::span<glm::vec3> out) {
      slices.displacement(k, out);
      for (glm::vec3& u : out) u = glm::vec3(turn * glm::dvec3(u));
    });
    const voxel::LabelVolume labels = voxel::warp_labels(
        slices.frame(), [&](int k, std::span<std::uint8_t> out) { slices.labels(k, out); },
        [&](int k, std::span<glm::vec3> out) { slices.displacement(k, out); },
        2 * slices.voxels() + 1'000'000);
    voxel::save_volume(names[2 * o + 1], labels);
  }
  return names;
}

}  // namespace hybrid
