// SPDX-License-Identifier: GPL-3.0-or-later
// A soft block and a tool that presses its top, brought to equilibrium.
#pragma once

#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "tests/voxel/sparse/lattice_scenes.h"
#include "voxel/sparse/soft_object.h"

namespace tests {

struct SoftBlock {
  std::array<int, 3> dims;
  double h;
  std::shared_ptr<const voxel::sparse::Lattice> lattice;
  std::unique_ptr<voxel::sparse::SoftObject> object;

  SoftBlock(const std::array<int, 3>& size, double spacing, const voxel::sparse::LinkMaterial& material)
      : dims(size),
        h(spacing),
        lattice(
            std::make_shared<voxel::sparse::Lattice>(block(size, glm::dvec3(spacing)), made_of(material))),
        object(std::make_unique<voxel::sparse::SoftObject>(lattice)) {}

  // Centres of the voxels of the top; its surface lies half a spacing above.
  [[nodiscard]] double top() const { return (dims[2] - 1) * h; }
  [[nodiscard]] glm::dvec2 middle() const { return {0.5 * (dims[0] - 1) * h, 0.5 * (dims[1] - 1) * h}; }

  // A tool over the middle, `depth` below where it first touches.
  [[nodiscard]] voxel::sparse::ToolInBody ball(double radius, double depth) const {
    voxel::sparse::ToolInBody tool;
    tool.radius = radius;
    tool.centre = {middle().x, middle().y, top() + object->reach(radius) - depth};
    return tool;
  }
  [[nodiscard]] voxel::sparse::ToolInBody punch(double radius, double depth) const {
    voxel::sparse::ToolInBody tool = ball(radius, 0.0);
    tool.shape = voxel::sparse::ToolInBody::Shape::punch;
    tool.centre.z = top() + object->voxel_radius() - depth;
    return tool;
  }

  // What a broad phase would hand over: surface voxels that stand within `range` of the tool's axis, on the
  // top.
  void touch(const voxel::sparse::ToolInBody& tool, double range) const {
    std::vector<voxel::sparse::VoxelId> near;
    for (const voxel::sparse::VoxelId v : lattice->surface()) {
      const glm::dvec3 rest = lattice->rest(v);
      if (rest.z > top() - 0.5 * h && glm::length(glm::dvec2(rest - tool.centre)) <= range) near.push_back(v);
    }
    object->touch(near);
  }

  // Relaxed until nothing but rounding is left; what the tool then feels.
  voxel::sparse::Reaction press(const voxel::sparse::ToolInBody& tool, double range, double tolerance = 3e-5,
                                int cycles = 400) {
    touch(tool, range);
    settled = object->settle(tool, tolerance * lattice->force_scale_N(), cycles);
    return object->reaction(tool);
  }
  bool settled = false;  // did the last press() come to rest?
};

}  // namespace tests
