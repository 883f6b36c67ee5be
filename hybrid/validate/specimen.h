// SPDX-License-Identifier: GPL-3.0-or-later
// A piece of tissue on the program's own lattice. It is pressed to a given depth and relaxed until it is at
// rest. There is no hand, device or coupling: the depth is that of the tool in the tissue.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "hybrid/scene/scene.h"
#include "voxel/object/soft_object.h"

namespace hybrid {

// z is up. The specimen stands on z = 0, with its middle at x = y = 0. There is a voxel at each node of the
// grid, so the lattice has the specimen's size.
struct Specimen {
  enum class Shape : std::uint8_t { block, cylinder } shape = Shape::block;
  glm::dvec3 size_m{0.0};  // size of the block; of a cylinder, x: diameter, z: height
  double spacing_m = 1e-3;
  Energy energy = Energy::six_link;
  double poisson = 0.3;
  // Modulus of each label, from 1 on. Forces are proportional to the moduli as long as no link reaches a
  // limit.
  std::vector<double> young_Pa{1.0};
  std::function<std::uint8_t(const glm::dvec3&)> label{};  // label at a position; empty: 1 everywhere
  // If true, the base slips on a plate, and one voxel in its middle is held. If false, it is bonded to the
  // plate.
  bool slipping_base = false;
};

class PressedSpecimen {
 public:
  // Throws std::invalid_argument if the specimen has no voxels.
  explicit PressedSpecimen(const Specimen& specimen);
  ~PressedSpecimen();
  PressedSpecimen(const PressedSpecimen&) = delete;
  PressedSpecimen& operator=(const PressedSpecimen&) = delete;
  PressedSpecimen(PressedSpecimen&&) = delete;
  PressedSpecimen& operator=(PressedSpecimen&&) = delete;

  // Upward force (N) of the tissue at rest on a frictionless tool that presses the middle of the top by
  // `depth_m`. Depths must grow from call to call. Not a number if the tissue did not come to rest.
  double on_ball_N(double radius_m, double depth_m);
  double on_punch_N(double radius_m, double depth_m);  // flat round punch; one larger than the top is a plate
  // Force (N) when the nodes of the top within a square of this width are pressed to `depth_m` and are free
  // to slip. May be called once, on a fresh specimen.
  double under_square_N(double width_m, double depth_m);

  [[nodiscard]] double top_area_m2() const;  // area of the lattice's whole cells at the top
  [[nodiscard]] double height_m() const { return height_m_; }

 private:
  double pressed_N(const voxel::ToolInBody& tool, double within_m);

  std::array<int, 3> dims_{};
  double spacing_m_ = 0.0, height_m_ = 0.0;
  glm::dvec2 middle_m_{0.0};
  std::unique_ptr<voxel::SoftObject> object_;
};

}  // namespace hybrid
