// SPDX-License-Identifier: GPL-3.0-or-later
// How a rigid object moves: the constant half, made once from the scene. A path is a pure function of
// simulated time; a free body has its state (FreeBodyState) with whoever runs the session.
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
  // `start`: the pose in which the object is built. `shape`: its surface in its own frame; `closed`: it
  // encloses a volume and looks outward. Throws std::exception in words: a path that cannot be followed, a
  // mass or inertia that cannot be had.
  RigidMotion(const RigidDescription& description, const Pose& start, const polygon::TriangleMesh& shape,
              bool closed);

  [[nodiscard]] Kind kind() const noexcept { return kind_; }
  [[nodiscard]] bool moves() const noexcept { return kind_ != Kind::fixed; }
  [[nodiscard]] const Pose& start() const noexcept { return start_; }

  // The pose at simulated time `t_s`: exactly start() at 0 and for anything but a path. Pure, allocates
  // nothing.
  [[nodiscard]] Pose pose_at(double t_s) const noexcept;
  // Until the path ends; infinite for a spin, 0 for what has no path.
  [[nodiscard]] double duration_s() const noexcept;

  // No point of the object moves further between the two poses (straight, in meters).
  [[nodiscard]] double displacement_bound(const Pose& before, const Pose& after) const noexcept;

  // Of Kind::free.
  [[nodiscard]] const FreeBody& free_body() const noexcept { return free_; }

 private:
  Kind kind_ = Kind::fixed;
  Pose start_;
  std::shared_ptr<const device::Path> path_;
  std::optional<SpinDescription> spin_;
  FreeBody free_;
  glm::dvec3 middle_in_body_{0.0};  // of the object's box
  double lever_m_ = 0.0;            // farthest point of the object from there
};

}  // namespace hybrid
