// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/feel_stage.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "hybrid/height_texture.h"

namespace hybrid {
namespace {

constexpr int kShadingPasses = 8;
constexpr double kShadingStill =
    1e-7;  // of the way to the goal: a pass that moves the proxy less is the last

struct Contact {
  const RigidObject* object = nullptr;
  std::uint32_t element = 0, number = 0;
  glm::dvec3 normal{0.0};  // unit, scene frame, away from the surface
  double force_N = 0.0;
};

// What holds the proxy, as the last sweep left it.
std::span<const Contact> contacts_of(const World& world, const WorldState& state,
                                     std::array<Contact, 3>& contacts) noexcept {
  std::size_t count = 0;
  for (std::uint32_t n = 0; n < state.active_count; ++n) {
    const ActiveElement& active = state.active[n];
    const double force = glm::length(active.force_N);
    if (!(force > 0.0)) continue;
    contacts[count++] = {&world.rigid[active.object], active.element, active.object, active.force_N / force,
                         force};
  }
  return {contacts.data(), count};
}

glm::dvec3 shaded(const World& world, const WorldState& state, const Contact& contact,
                  const glm::dvec3& proxy) noexcept {
  if (!contact.object->feel.shading) return contact.normal;
  const BodyFrame& frame = state.rigid[contact.number].frame;
  const glm::dvec3 on_surface = frame.to_body(proxy - world.contact_radius_m() * contact.normal);
  const glm::dvec3 away = contact.normal * frame.rotation;
  return limit_shaded_normal(
      frame.rotation * contact.object->surface->shaded_normal(contact.element, on_surface, away),
      contact.normal);
}

MixedFeel mixed(std::span<const Contact> contacts) noexcept {
  std::array<FeltSurface, 3> surfaces;
  for (std::size_t n = 0; n < contacts.size(); ++n)
    surfaces[n] = {&contacts[n].object->feel, contacts[n].force_N};
  return mix_feel({surfaces.data(), contacts.size()});
}

// Until the force lies in the cone of the shaded normals. The shaded goal lies level with the proxy; it is
// sunk by what presses now, so that the proxy stays on the surface.
Sweep shade(const World& world, WorldState& state, const glm::dvec3& target, const glm::dmat3& metric,
            double travel, Sweep sweep) noexcept {
  const glm::dmat3 compliance = glm::inverse(metric);
  for (int n = 0; n < kShadingPasses; ++n) {
    std::array<Contact, 3> held;
    const std::span<const Contact> contacts = contacts_of(world, state, held);
    if (std::none_of(contacts.begin(), contacts.end(),
                     [](const Contact& c) { return c.object->feel.shading; }))
      break;
    std::array<glm::dvec3, 3> normals;
    for (std::size_t c = 0; c < contacts.size(); ++c)
      normals[c] = shaded(world, state, contacts[c], sweep.point);
    const glm::dvec3 level = shaded_goal(target, sweep.point, metric, {normals.data(), contacts.size()});
    const Sweep next =
        sweep_proxy(world, state, sweep.point, level - compliance * sweep.force_N, metric, travel);
    const double moved = glm::length(next.point - sweep.point);
    sweep = {next.point, next.arrived, next.force_N, sweep.steps + next.steps, sweep.surveys + next.surveys};
    if (moved <= kShadingStill * glm::length(target - sweep.point)) break;
  }
  return sweep;
}

}  // namespace

Sweep sweep_with_feel(const World& world, WorldState& state, const glm::dvec3& target,
                      const glm::dmat3& metric, double travel) noexcept {
  const bool held = state.active_count > 0;  // since the last tick
  const glm::dvec3 from = state.proxy_m;
  Sweep sweep = sweep_proxy(world, state, from, target, metric, travel);
  state.friction_N = glm::dvec3(0.0);
  std::array<Contact, 3> contacts;
  std::span<const Contact> touched = contacts_of(world, state, contacts);
  if (std::none_of(touched.begin(), touched.end(), [](const Contact& c) { return c.object->feel.any(); })) {
    state.stuck = state.sliding = false;
    return sweep;
  }
  const MixedFeel feel = mixed(touched);
  const std::uint32_t object = touched[0].number;
  sweep = shade(world, state, target, metric, travel, sweep);

  const glm::dvec3 pressed = metric * (sweep.point - target);
  const double pressure = glm::length(pressed);
  state.stuck = false;
  if (feel.static_friction > 0.0 && held && pressure > 0.0) {
    const FrictionStep step = friction_target(from, target, metric, pressed / pressure, feel.static_friction,
                                              feel.dynamic_friction, state.sliding);
    state.sliding = step.sliding;
    bool stays = step.target == from;
    if (!stays && step.sliding) {
      const Sweep slid = sweep_proxy(world, state, from, step.target, metric, travel);
      stays = !friction_spends(from, slid.point, target, metric);
      if (!stays) sweep = slid;
    }
    if (stays) {
      sweep.point = from;
      state.stuck = true;
      state.sliding = false;
    }
  } else {
    state.sliding = false;
  }

  const glm::dvec3 whole = metric * (sweep.point - target);
  state.friction_N = whole - sweep.force_N;
  state.rigid_force_N[object] += state.friction_N;
  sweep.force_N = whole;
  return sweep;
}

glm::dvec3 added_force(const World& world, WorldState& state, const glm::dvec3& device_m,
                       double dt_s) noexcept {
  std::array<Contact, 3> held;
  const std::span<const Contact> contacts = contacts_of(world, state, held);
  const double k = world.tool.stiffness_N_per_m;
  const double damping = mixed(contacts).damping_N_s_per_m;
  glm::dvec3 added(0.0);
  if (damping > 0.0) {
    glm::dvec3 normal(0.0);
    for (const Contact& c : contacts) normal += c.force_N * c.normal;
    normal = glm::normalize(normal);
    const double depth = glm::dot(state.proxy_m - device_m, normal);
    added += normal * damping_force(state.damping, k * depth, depth, damping, dt_s, world.encoder_m);
  } else {
    end_damping(state.damping);
  }
  for (const Contact& c : contacts) {
    if (c.object->feel.texture == nullptr) continue;
    const BodyFrame& frame = state.rigid[c.number].frame;
    const TexturedContact contact{frame.to_body(state.proxy_m - world.contact_radius_m() * c.normal),
                                  c.normal * frame.rotation, c.force_N / k, k};
    added += frame.rotation * texture_force(*c.object->feel.texture, contact);
  }
  return added;
}

}  // namespace hybrid
