// SPDX-License-Identifier: GPL-3.0-or-later
// The constant part of a rigid object's motion, made once from the scene. A path is a pure function of
// simulated time. A free body's state (FreeBodyState) belongs to the session's state.
#pragma once

#include <memory>
#include <optional>

#include "device/paths/path.h"
#include "hybrid/scene/scene.h"
#include "hybrid/world/free_body.h"
#include "polygon/mesh/mesh.h"

namespace hybrid {

class RigidMotion {
 public:
  enum class Kind : std::uint8_t { fixed, path, free };

  RigidMotion() = default;  // fixed at the scene's origin
  // `start`: the pose in which the object is built. `shape`: its surface in its own frame. `closed`: the
  // surface encloses a volume and is oriented outward. Throws std::exception with a message if a path cannot
  // be followed, or if mass or inertia are impossible.
  RigidMotion(const RigidDescription& description, const Pose& start, const polygon::TriangleMesh& shape,
              bool closed);

  [[nodiscard]] Kind kind() const noexcept { return kind_; }
  [[nodiscard]] bool moves() const noexcept { return kind_ != Kind::fixed; }
  [[nodiscard]] const Pose& start() const noexcept { return start_; }

  // The pose at simulated time `t_s` (s). At time 0 it is exactly start(); without a path it is start() at
  // any time. Pure, allocates nothing.
  [[nodiscard]] Pose pose_at(double t_s) const noexcept;
  // Time until the path ends; infinite for a spin, 0 without a path.
  [[nodiscard]] double duration_s() const noexcept;

  // Bound on the straight distance that any point of the object moves between the two poses (m).
  [[nodiscard]] double displacement_bound(const Pose& before, const Pose& after) const noexcept;

  // Only for Kind::free.
  [[nodiscard]] const FreeBody& free_body() const noexcept { return free_; }

 private:
  Kind kind_ = Kind::fixed;
  Pose start_;
  std::shared_ptr<const device::Path> path_;
  std::optional<SpinDescription> spin_;
  FreeBody free_;
  glm::dvec3 middle_in_body_{0.0};  // middle of the object's box
  double lever_m_ = 0.0;            // distance of the object's farthest point from middle_in_body_
};

}  // namespace hybrid
