// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid bodies made in code, touched tick by tick, and judged by what shares nothing with the proxy: CGAL's
// exact distances and crossings, and the first-order reference.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "hybrid/rigid_step.h"
#include "hybrid/world.h"
#include "polygon/exact_mesh.h"
#include "polygon/first_order.h"

namespace tests {

struct TruthBody {
  polygon::TriangleMesh mesh;
  bool solid = true;
  hybrid::Pose pose{};
  hybrid::MotionDescription motion{};
  hybrid::SurfaceFeel feel{};
  std::shared_ptr<const polygon::RigidSurface> surface{};  // in place of the mesh's own
};

// The judge of one mesh, in its own frame.
struct Judge {
  explicit Judge(const polygon::TriangleMesh& mesh) : exact(mesh), reference(mesh) {}
  polygon::ExactMesh exact;
  polygon::FirstOrderReference reference;
};

struct TruthOptions {
  double tool_radius_m = 0.0;  // 0: a point
  double stiffness_N_per_m = 1000.0;
  bool use_map = true;
};

class TruthWorld {
 public:
  TruthWorld(std::vector<TruthBody> bodies, const TruthOptions& options);

  // False when the tool cannot be free there.
  bool start(const glm::dvec3& at_m);
  // The rigid part of one tick. The way its sweep took is in trail().
  hybrid::RigidStep step(const glm::dvec3& goal_m);

  // From where the proxy was before the last step() to where it is.
  [[nodiscard]] const std::vector<glm::dvec3>& trail() const { return trail_; }

  // ---- the judges' words ----
  // Least distance of the proxy from any body less the tool's radius; negative: it is in there.
  [[nodiscard]] double clearance(const glm::dvec3& at_m) const;
  // The same all along the trail of the last step. Dear.
  [[nodiscard]] double trail_clearance() const;
  // Did the trail's centre line pass through a triangle?
  [[nodiscard]] bool trail_crosses() const;
  [[nodiscard]] bool inside(const glm::dvec3& at_m) const;
  // Of one body alone (the reference knows one mesh), in its frame.
  [[nodiscard]] polygon::NearestOptimum optimum(std::uint32_t body, const glm::dvec3& goal_m,
                                                double search_m) const;

  [[nodiscard]] const hybrid::World& world() const { return world_; }
  [[nodiscard]] hybrid::WorldState& state() { return *state_; }
  [[nodiscard]] const hybrid::WorldState& state() const { return *state_; }
  [[nodiscard]] double radius() const { return world_.contact_radius_m(); }
  [[nodiscard]] double extent() const { return extent_; }
  [[nodiscard]] const TruthBody& body(std::uint32_t b) const { return bodies_[b]; }

 private:
  [[nodiscard]] glm::dvec3 in_body(std::size_t b, const glm::dvec3& p) const {
    return state_->rigid[b].frame.to_body(p);
  }

  std::vector<TruthBody> bodies_;
  std::vector<std::unique_ptr<Judge>> judges_;
  hybrid::World world_;
  std::unique_ptr<hybrid::WorldState> state_;
  double extent_ = 0.0;
  std::array<glm::dvec3, 128> steps_{};
  std::vector<glm::dvec3> trail_;
};

}  // namespace tests
