// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/validate/specimen.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/lattice/lattice.h"
#include "voxel/volume/label_volume.h"

namespace hybrid {
namespace {

// At rest no voxel has a larger residual force. Unit: the force that doubles the length of a link.
constexpr double kAtRest = 1e-5;
constexpr double kSteady = 1e-6;  // relative change of the energy in a cycle; a smaller change counts as rest
constexpr int kMostCycles = 2000;  // cycles in which a specimen has to come to rest
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
// These limits are so wide that no link reaches them. So the specimen is elastic.
constexpr double kShortest = 0.02, kLongest = 20.0, kMostShear = 20.0;
constexpr double kRounding = 1e-9;  // m; tolerance of positions on the grid

int nodes_along(double length_m, double spacing_m) {
  return static_cast<int>(std::lround(length_m / spacing_m)) + 1;
}

// Does the node belong to a cell whose centre lies in the circle? By this rule every node has a whole cell.
bool in_round_cells(const glm::dvec2& node, double radius_m, double h) {
  for (const double x : {-0.5 * h, 0.5 * h}) {
    for (const double y : {-0.5 * h, 0.5 * h}) {
      if (glm::length(node + glm::dvec2(x, y)) <= radius_m) return true;
    }
  }
  return false;
}

voxel::LabelVolume volume_of(const Specimen& specimen) {
  const double h = specimen.spacing_m;
  const bool round = specimen.shape == Specimen::Shape::cylinder;
  const glm::dvec3 size =
      round ? glm::dvec3(specimen.size_m.x, specimen.size_m.x, specimen.size_m.z) : specimen.size_m;
  voxel::LabelVolume volume;
  volume.dims = {nodes_along(size.x, h), nodes_along(size.y, h), nodes_along(size.z, h)};
  volume.spacing_m = glm::dvec3(h);
  const glm::dvec2 middle(0.5 * h * (volume.dims[0] - 1), 0.5 * h * (volume.dims[1] - 1));
  for (int k = 0; k < volume.dims[2]; ++k) {
    for (int j = 0; j < volume.dims[1]; ++j) {
      for (int i = 0; i < volume.dims[0]; ++i) {
        const glm::dvec2 from_middle = glm::dvec2(i, j) * h - middle;
        const bool inside = !round || in_round_cells(from_middle, 0.5 * size.x, h);
        const std::uint8_t label =
            specimen.label ? specimen.label({from_middle.x, from_middle.y, k * h}) : std::uint8_t{1};
        volume.labels.push_back(inside ? label : std::uint8_t{0});
      }
    }
  }
  return volume;
}

voxel::LatticeOptions options_of(const Specimen& specimen, const voxel::LabelVolume& volume) {
  voxel::LatticeOptions options;
  voxel::LinkMaterial material{.young_Pa = specimen.young_Pa.front(),
                               .poisson = specimen.poisson,
                               .stretch_min = kShortest,
                               .stretch_max = kLongest,
                               .shear = kMostShear,
                               .bricks = specimen.energy == Energy::trilinear};
  options.materials.fill(material);
  for (std::size_t label = 1; label <= specimen.young_Pa.size(); ++label)
    options.materials.at(label).young_Pa = specimen.young_Pa[label - 1];
  if (specimen.slipping_base) {
    options.anchor_voxels.push_back(volume.index(volume.dims[0] / 2, volume.dims[1] / 2, 0));
  } else {
    options.anchor_faces = {"-z"};
  }
  return options;
}

}  // namespace

PressedSpecimen::PressedSpecimen(const Specimen& specimen) : spacing_m_(specimen.spacing_m) {
  voxel::LabelVolume volume = volume_of(specimen);
  dims_ = volume.dims;
  height_m_ = (dims_[2] - 1) * spacing_m_;
  middle_m_ = 0.5 * spacing_m_ * glm::dvec2(dims_[0] - 1, dims_[1] - 1);
  const voxel::LatticeOptions options = options_of(specimen, volume);
  object_ =
      std::make_unique<voxel::SoftObject>(std::make_shared<const voxel::Lattice>(std::move(volume), options));
  object_->reserve_obstacles();
  if (!specimen.slipping_base) return;
  const auto surface = object_->lattice().surface();
  for (std::size_t s = 0; s < surface.size(); ++s) {
    if (object_->lattice().rest(surface[s]).z < 0.5 * spacing_m_)
      object_->set_obstacle(s, {.normal = {0.0F, 0.0F, 1.0F}, .bound = 0.0F});
  }
}

PressedSpecimen::~PressedSpecimen() = default;

double PressedSpecimen::pressed_N(const voxel::ToolInBody& tool, double within_m) {
  std::vector<voxel::VoxelId> near;
  for (const voxel::VoxelId v : object_->lattice().surface()) {
    const glm::dvec3 rest = object_->lattice().rest(v);
    if (rest.z > height_m_ - 0.5 * spacing_m_ && glm::length(glm::dvec2(rest) - middle_m_) <= within_m)
      near.push_back(v);
  }
  object_->touch(near);
  const bool at_rest = object_->settle(tool, kAtRest * object_->lattice().force_scale_N(), kMostCycles);
  return at_rest ? object_->reaction(tool).force_N.z : kUnknown;
}

double PressedSpecimen::on_ball_N(double radius_m, double depth_m) {
  // Contact is at the surface, which is half a spacing outside the lattice.
  voxel::ToolInBody tool;
  tool.radius = radius_m - object_->voxel_radius();
  tool.centre = {middle_m_, height_m_ + radius_m - depth_m};
  return pressed_N(tool, std::sqrt(2.0 * radius_m * depth_m) + 4.0 * spacing_m_);
}

double PressedSpecimen::on_punch_N(double radius_m, double depth_m) {
  voxel::ToolInBody tool;
  tool.shape = voxel::ToolInBody::Shape::punch;
  tool.radius = radius_m;
  tool.centre = {middle_m_, height_m_ + object_->voxel_radius() - depth_m};
  return pressed_N(tool, radius_m + 2.0 * spacing_m_);
}

double PressedSpecimen::under_square_N(double width_m, double depth_m) {
  std::vector<std::uint32_t> pressed;
  const auto surface = object_->lattice().surface();
  for (std::size_t s = 0; s < surface.size(); ++s) {
    const glm::dvec3 rest = object_->lattice().rest(surface[s]);
    const glm::dvec2 apart = glm::abs(glm::dvec2(rest) - middle_m_);
    if (rest.z < height_m_ - 0.5 * spacing_m_ || std::max(apart.x, apart.y) > 0.5 * width_m + kRounding)
      continue;
    object_->set_obstacle(s, {.normal = {0.0F, 0.0F, -1.0F}, .bound = static_cast<float>(depth_m)});
    pressed.push_back(static_cast<std::uint32_t>(s));
  }
  object_->leave_obstacles(pressed);
  double before_J = 0.0;
  for (int cycle = 0; cycle < kMostCycles; ++cycle) {
    object_->relax_cycle();
    const double now_J = object_->energy_J();
    // An elastic body at rest has stored half of (force · depth).
    if (object_->asleep() || std::fabs(now_J - before_J) < kSteady * now_J) return 2.0 * now_J / depth_m;
    before_J = now_J;
  }
  return kUnknown;
}

double PressedSpecimen::top_area_m2() const {
  const voxel::Lattice& lattice = object_->lattice();
  std::size_t cells = 0;
  for (int j = 0; j + 1 < dims_[1]; ++j) {
    for (int i = 0; i + 1 < dims_[0]; ++i) {
      const int k = dims_[2] - 1;
      if (lattice.filled(lattice.at(i, j, k)) && lattice.filled(lattice.at(i + 1, j, k)) &&
          lattice.filled(lattice.at(i, j + 1, k)) && lattice.filled(lattice.at(i + 1, j + 1, k)))
        ++cells;
    }
  }
  return static_cast<double>(cells) * spacing_m_ * spacing_m_;
}

}  // namespace hybrid
