// SPDX-License-Identifier: GPL-3.0-or-later
// Judges of scenes where rigid and soft meet. They look at where every voxel is after a tick, and share
// nothing with the engine but the lattice at rest, the displacements, and the exact rigid surfaces.
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

#include "hybrid/tick.h"

namespace tests {

// The outermost layer of voxels on one side of a soft object's lattice, as a surface of triangles between
// their centres, wherever they are now.
struct Face {
  std::size_t soft = 0;
  int axis = 2;
  bool up = true;  // the side of the larger coordinates
};

// Every voxel of every soft object against every rigid object, tick by tick.
class ArbitrationWatch {
 public:
  // As a session begins, at rest.
  ArbitrationWatch(const hybrid::World& world, const hybrid::WorldState& state);

  // After each tick.
  void see(const hybrid::WorldState& state, const hybrid::TickResult& felt);

  // How far the ball of a voxel, half its spacing large, was ever in something rigid (spacings); beyond what
  // it was at rest, which is nothing unless anchors were put there.
  [[nodiscard]] double deepest() const { return deepest_; }
  [[nodiscard]] double deepest_now() const { return deepest_now_; }
  [[nodiscard]] std::uint64_t deepest_tick() const { return deepest_tick_; }
  // Voxels whose centre is in a solid now, or crossed a sheet.
  [[nodiscard]] std::size_t passed() const { return passed_; }
  // How far the tool's ball was ever in something rigid (m), and whether its centre crossed a sheet.
  [[nodiscard]] double tool_inside_m() const { return tool_inside_m_; }
  [[nodiscard]] bool tool_crossed() const { return tool_crossed_; }

 private:
  struct Side {  // of a voxel at a sheet: above or below, 0: beyond its edges
    double side = 0.0;
  };
  [[nodiscard]] double depth(const hybrid::WorldState& state, const glm::dvec3& at, double radius,
                             bool& inside) const;

  const hybrid::World& world_;
  std::vector<std::vector<double>> at_rest_m_;   // [soft][surface voxel] depth
  std::vector<std::vector<glm::dvec3>> before_;  // [soft][surface voxel] the tick before, scene frame
  glm::dvec3 tool_before_{0.0};
  bool tool_known_ = false;
  double deepest_ = 0.0, deepest_now_ = 0.0, tool_inside_m_ = 0.0;
  std::uint64_t ticks_ = 0, deepest_tick_ = 0;
  std::size_t passed_ = 0;
  bool tool_crossed_ = false;
};

// How far a point is in front of a face, along the way that faces out of it at rest (m); infinite where it is
// not over it.
double in_front_of(const hybrid::World& world, const hybrid::WorldState& state, const Face& face,
                   const glm::dvec3& point);
// The least of that over all voxels of another face (m).
double in_front_of(const hybrid::World& world, const hybrid::WorldState& state, const Face& face,
                   const Face& other);

// What holds tissue, by displacements and link springs alone (N, scene frame).
struct Bearing {
  glm::dvec3 anchors_N{0.0};  // on the anchors of all objects
  glm::dvec3 rigid_N{0.0};    // on rigid surfaces, across them
  glm::dvec3 tool_N{0.0};     // on the tool, by the voxels that touch it
  glm::dvec3 left_N{0.0};     // on voxels that nothing holds, and along surfaces: 0 at rest
  double worst_left_N = 0.0;  // of one such voxel
  std::size_t tight = 0;      // links at their limits, whose loads springs do not show
};
std::vector<Bearing> bearings(const hybrid::World& world, const hybrid::WorldState& state);

// What is left of a force on the tool when rigid surfaces that it touches, by the exact distance, have taken
// all that they can across themselves (N).
glm::dvec3 beyond_rigid(const hybrid::World& world, const hybrid::WorldState& state,
                        const glm::dvec3& force_N);

// A session of the scene, relaxed apart, as fast as it goes and in real time, is the same to the bit when it
// is played again, and has no fault.
void expect_replays(const std::filesystem::path& file, double seconds);

}  // namespace tests
