// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes of rigid objects, made in code: SI, an ideal device, no limits on the force.
#pragma once

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <string>
#include <utility>
#include <vector>

#include "polygon/mesh_file.h"
#include "touch.h"

namespace tests {

inline constexpr double kToolStiffness = 1000.0;

inline hybrid::RigidDescription rigid(const std::string& name, hybrid::RigidSource source,
                                      const glm::dvec3& at = glm::dvec3(0.0)) {
  return {.name = name, .source = std::move(source), .pose = {at}, .place = {}, .source_place = {}};
}

inline hybrid::Scene scene_of(std::vector<hybrid::RigidDescription> objects, double tool_radius_m,
                              double stiffness = kToolStiffness) {
  hybrid::Scene scene;
  scene.file = "in the test";
  scene.rigid = std::move(objects);
  scene.tool = {
      .shape = hybrid::Tool::Shape::ball, .radius_m = tool_radius_m, .stiffness_N_per_m = stiffness};
  scene.device_model = device::DeviceModel::ideal;
  scene.max_force_given = true;
  scene.safety = {.max_force_N = 1e9, .max_slew_N_per_s = 1e15, .soft_start_s = 0.0};
  return scene;
}

// Meshes go through a file, as a user's do.
class RigidScene : public SceneFile {
 protected:
  hybrid::RigidDescription mesh(const std::string& name, const polygon::TriangleMesh& m,
                                const glm::dvec3& at = glm::dvec3(0.0)) const {
    polygon::save_ply(folder_ / (name + ".ply"), m);
    return rigid(name, hybrid::MeshSource{.file = folder_ / (name + ".ply")}, at);
  }
};

// What the hand gains along the way, by the trapezoidal rule (J).
class Work {
 public:
  void add(const hybrid::TickResult& felt) {
    if (started_) gained_J_ += 0.5 * glm::dot(felt.force_N + force_N_, felt.device_m - device_m_);
    started_ = true;
    force_N_ = felt.force_N;
    device_m_ = felt.device_m;
  }
  [[nodiscard]] double gained_J() const { return gained_J_; }

 private:
  bool started_ = false;
  double gained_J_ = 0.0;
  glm::dvec3 force_N_{0.0}, device_m_{0.0};
};

inline double degrees_between(const glm::dvec3& a, const glm::dvec3& b) {
  // By the sine: the cosine knows no angle below 1e-8.
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180.0 / glm::pi<double>();
}

// The normal where the proxy touches: the mean of what holds it, by its force.
inline glm::dvec3 contact_normal(const hybrid::WorldState& state) {
  glm::dvec3 sum(0.0);
  for (std::uint32_t n = 0; n < state.active_count; ++n) sum += state.active[n].force_N;
  return glm::normalize(sum);
}

}  // namespace tests
