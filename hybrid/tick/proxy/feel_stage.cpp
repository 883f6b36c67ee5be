// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/proxy/feel_stage.h"

#include <algorithm>
#include <array>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "hybrid/feel/height_texture.h"
#include "polygon/proxy/minimise_on_planes.h"

namespace hybrid {
namespace {

constexpr int kShadingPasses = 8;  // sweeps of shade(), at most
constexpr int kSlidingPasses = 8;  // sweeps of apply_friction(), at most
// A tangential pull that exceeds the friction by less than this share of it counts as on the friction cone.
constexpr double kConeTolerance = 1e-4;
constexpr double kShadingConverged =
    1e-6;  // share of the depth; a pass that moves the proxy less is the last

struct Contact {
  const RigidObject* object = nullptr;
  const SurfaceFeel* feel = nullptr;
  std::uint32_t element = 0, number = 0, slot = 0;  // slot: of WorldState::active
  glm::dvec3 normal{0.0};                           // unit, scene frame, away from the surface
  glm::dvec3 felt{0.0};                             // the same, shaded
  double force_N = 0.0;
};

// The proxy's contacts, at most three elements.
struct Contacts {
  std::array<Contact, 3> list;
  std::size_t count = 0;

  [[nodiscard]] const Contact* begin() const noexcept { return list.data(); }
  [[nodiscard]] const Contact* end() const noexcept { return list.data() + count; }
  [[nodiscard]] std::array<glm::dvec3, 3> felt_normals() const noexcept {
    return {list[0].felt, list[1].felt, list[2].felt};
  }
  template <class Is>
  [[nodiscard]] bool any(Is&& is) const noexcept {
    return std::any_of(begin(), end(), [&is](const Contact& c) { return is(*c.feel); });
  }
};

glm::dvec3 shaded(const World& world, const WorldState& state, const Contact& contact,
                  const glm::dvec3& proxy) noexcept {
  if (!contact.feel->shading) return contact.normal;
  const BodyFrame& frame = state.rigid[contact.number].frame;
  const glm::dvec3 on_surface = frame.to_body(proxy - world.contact_radius_m() * contact.normal);
  const glm::dvec3 away = contact.normal * frame.rotation;
  return limit_shaded_normal(
      frame.rotation * contact.object->surface->shaded_normal(contact.element, on_surface, away),
      contact.normal);
}

// The contacts of the last sweep, for a proxy that now is at `proxy`.
Contacts active_contacts(const World& world, const WorldState& state, const glm::dvec3& proxy) noexcept {
  Contacts contacts;
  for (std::uint32_t n = 0; n < state.active_count; ++n) {
    const ActiveElement& active = state.active[n];
    const double force = glm::length(active.force_N);
    if (!(force > 0.0)) continue;
    Contact& c = contacts.list[contacts.count++];
    c = {.object = &world.rigid[active.object],
         .feel = &feel_of(world, state, active.object),
         .element = active.element,
         .number = active.object,
         .slot = n,
         .normal = active.force_N / force,
         .force_N = force};
    c.felt = shaded(world, state, c, proxy);
  }
  return contacts;
}

MixedFeel mixed_feel(const Contacts& contacts) noexcept {
  std::array<FeltSurface, 3> surfaces;
  for (std::size_t n = 0; n < contacts.count; ++n)
    surfaces[n] = {contacts.list[n].feel, contacts.list[n].force_N};
  return mix_feel({surfaces.data(), contacts.count});
}

// The object to which friction and shading are attributed: the one with the largest force of those that have
// either.
std::uint32_t friction_object(const Contacts& contacts) noexcept {
  const Contact* hardest = nullptr;
  for (const Contact& c : contacts) {
    const bool rubs = c.feel->has_friction() || c.feel->shading;
    if (rubs && (hardest == nullptr || c.force_N > hardest->force_N)) hardest = &c;
  }
  return hardest != nullptr ? hardest->number : contacts.list[0].number;
}

// Target of the proxy, and the greatest length of the way there.
struct Goal {
  glm::dvec3 target{0.0};
  glm::dmat3 metric{1.0};
  double travel = 0.0;
};

// The contact forces on a proxy that stays in place: those with which its contact planes, shifted through the
// proxy, resist the pull to the target. Sets each force and returns their sum. The sum is zero if the target
// pulls the proxy off the surface.
glm::dvec3 press_in_place(Contacts& contacts, const glm::dvec3& proxy, const Goal& goal) noexcept {
  const glm::dvec3 way = goal.target - proxy;
  std::array<polygon::ContactPlane, 3> planes;
  for (std::size_t n = 0; n < contacts.count; ++n) {
    planes[n].normal = contacts.list[n].felt;
    contacts.list[n].force_N = 0.0;
  }
  const polygon::PlaneMinimum held = polygon::minimise_on_planes(
      way, goal.metric, {planes.data(), contacts.count}, 1e-12 * glm::length(way));
  if (!held.feasible) return glm::dvec3(0.0);
  for (std::uint32_t n = 0; n < held.active_count; ++n)
    contacts.list[held.active[n]].force_N = held.multiplier[n];
  return goal.metric * (held.point - way);
}

// The proxy stays at `from` with the same contacts, under their present forces.
Sweep hold_in_place(WorldState& state, const Contacts& contacts, const glm::dvec3& from) noexcept {
  Sweep sweep;
  sweep.point = from;
  std::fill(state.rigid_force_N.begin(), state.rigid_force_N.end(), glm::dvec3(0.0));
  for (const Contact& c : contacts) {
    const glm::dvec3 force = c.force_N * c.normal;
    state.active[c.slot].force_N = force;
    state.rigid_force_N[c.number] += force;
    sweep.force_N += force;
  }
  return sweep;
}

// Repeats until the proxy is where the target pulls along the shaded normals.
Sweep shade(const World& world, WorldState& state, const Goal& goal, Sweep sweep) noexcept {
  bool any = false;
  for (int n = 0; n < kShadingPasses; ++n) {
    const Contacts contacts = active_contacts(world, state, sweep.point);
    if (!contacts.any([](const SurfaceFeel& feel) { return feel.shading; })) break;
    any = true;
    const std::array<glm::dvec3, 3> normals = contacts.felt_normals();
    const Sweep next =
        sweep_proxy(world, state, sweep.point, goal.target,
                    shading_metric(goal.metric, {normals.data(), contacts.count}), goal.travel);
    const double moved = glm::length(next.point - sweep.point);
    sweep = {.point = next.point,
             .arrived = next.arrived,
             .force_N = next.force_N,
             .steps = sweep.steps + next.steps,
             .surveys = sweep.surveys + next.surveys,
             .work = sweep.work + next.work};
    if (moved <= kShadingConverged * glm::length(goal.target - sweep.point)) break;
  }
  if (!any) return sweep;
  Contacts contacts = active_contacts(world, state, sweep.point);
  if (press_in_place(contacts, sweep.point, goal) == glm::dvec3(0.0)) return sweep;
  const Sweep pressed = hold_in_place(state, contacts, sweep.point);
  sweep.force_N = pressed.force_N;
  return sweep;
}

// Stores the part of the surfaces' force that friction and shading add to the sweep's part. Returns the sweep
// with the whole force.
Sweep split_force(WorldState& state, const Goal& goal, std::uint32_t from_object, Sweep sweep) noexcept {
  const glm::dvec3 force = goal.metric * (sweep.point - goal.target);
  state.friction_N = force - sweep.force_N;
  state.rubbed = from_object;
  state.rigid_force_N[from_object] += state.friction_N;
  sweep.force_N = force;
  return sweep;
}

// Keeps or slides a proxy that is pressed on `contacts`. False if there is no friction or no pressure.
//
// The slide ends when the pull is on the friction cone. If the surface turns on the way, a pull on the cone
// of the first normal is not on the cone of the last normal. So slides are repeated from the place reached,
// until the pull is on the cone there.
bool apply_friction(const World& world, WorldState& state, Contacts contacts, const Goal& goal,
                    bool first_pass, Sweep& sweep) noexcept {
  const MixedFeel feel = mixed_feel(contacts);
  if (!(feel.static_friction > 0.0)) return false;
  const glm::dvec3 from = state.proxy_m;
  const glm::dvec3 pressed = press_in_place(contacts, from, goal);
  if (pressed == glm::dvec3(0.0)) return false;
  const std::array<ActiveElement, 3> active = state.active;
  const std::uint32_t active_count = state.active_count, object = friction_object(contacts);
  const FrictionStep step = friction_target(from, goal.target, goal.metric, glm::normalize(pressed),
                                            feel.static_friction, feel.dynamic_friction, state.sliding);
  bool stays = step.target == from;
  FrictionStep next = step;
  sweep.point = from;
  for (int n = 0; n < kSlidingPasses && !stays; ++n) {
    const Goal slide{next.target, goal.metric, goal.travel};
    sweep = shade(world, state, slide,
                  sweep_proxy(world, state, sweep.point, slide.target, goal.metric, goal.travel));
    if (!step.sliding) break;
    Contacts now = active_contacts(world, state, sweep.point);
    const glm::dvec3 pressed_now = press_in_place(now, sweep.point, goal);
    const MixedFeel felt = mixed_feel(now);
    if (pressed_now == glm::dvec3(0.0)) break;
    next = friction_target(sweep.point, goal.target, goal.metric, glm::normalize(pressed_now),
                           felt.static_friction, felt.dynamic_friction, true);
    if (next.tangential_N <= felt.dynamic_friction * next.normal_N * (1.0 + kConeTolerance)) break;
  }
  if (step.sliding && !stays) stays = !friction_dissipates(from, sweep.point, goal.target, goal.metric);
  state.stuck = stays;
  state.sliding = (step.sliding && !stays) || (!first_pass && state.sliding);
  if (stays) {
    state.active = active;
    state.active_count = active_count;
    sweep = hold_in_place(state, contacts, from);
  }
  sweep = split_force(state, goal, object, sweep);
  return true;
}

void end_friction(WorldState& state) noexcept {
  state.stuck = state.sliding = false;
  state.friction_N = glm::dvec3(0.0);
}

}  // namespace

Sweep sweep_with_feel(const World& world, WorldState& state, const glm::dvec3& target,
                      const glm::dmat3& metric, double travel, bool first_pass) noexcept {
  const bool held = state.active_count > 0, pushed = state.pushed;
  state.pushed = false;
  Sweep smooth;
  const bool swept = !held || pushed;  // a body pushed the proxy: its contacts may have changed
  if (swept) smooth = sweep_proxy(world, state, state.proxy_m, target, metric, travel);
  if (held) {
    const Contacts contacts = active_contacts(world, state, swept ? smooth.point : state.proxy_m);
    Sweep sweep;
    if (apply_friction(world, state, contacts, {target, metric, travel}, first_pass, sweep)) return sweep;
  }
  end_friction(state);
  if (!swept) smooth = sweep_proxy(world, state, state.proxy_m, target, metric, travel);
  const Contacts touched = active_contacts(world, state, smooth.point);
  if (touched.count == 0) return smooth;
  state.rubbed = friction_object(touched);
  state.stuck = mixed_feel(touched).static_friction > 0.0;  // from now on a body carries it
  if (!touched.any([](const SurfaceFeel& f) { return f.shading; })) return smooth;
  smooth = shade(world, state, {target, metric, travel}, smooth);
  return split_force(state, {target, metric, travel}, state.rubbed, smooth);
}

void mix_stiffness(const World& world, WorldState& state, const glm::dvec3& device_m, double dt_s,
                   Sweep& sweep) noexcept {
  const double of_tool = tool_stiffness_N_per_m(world, state);
  double stiffest = 0.0;
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o)
    stiffest = std::max(stiffest, feel_of(world, state, o).stiffness_N_per_m);
  if (stiffest == 0.0) return;
  stiffest = std::max(stiffest, of_tool);

  std::array<ObjectStiffness, 4> touched;  // the proxy's active elements, and tissue
  for (std::uint32_t n = 0; n < state.active_count; ++n) {
    const double own = feel_of(world, state, state.active[n].object).stiffness_N_per_m;
    touched[n] = {own > 0.0 ? own : of_tool, glm::length(state.active[n].force_N)};
  }
  glm::dvec3 of_tissue(0.0);
  for (const voxel::Reaction& reaction : state.reactions) of_tissue += reaction.force_N;
  touched.back() = {of_tool, glm::length(of_tissue)};

  const double before = coupling_N_per_m(world, state);
  update(state.mixed, glm::length(state.proxy_m - device_m), mean_stiffness(touched, of_tool), stiffest,
         dt_s);
  const double scale = coupling_N_per_m(world, state) / before;
  sweep.force_N *= scale;
  state.friction_N *= scale;
  for (std::uint32_t n = 0; n < state.active_count; ++n) state.active[n].force_N *= scale;
  for (glm::dvec3& force : state.rigid_force_N) force *= scale;
}

glm::dvec3 added_force(const World& world, WorldState& state, const glm::dvec3& device_m,
                       double dt_s) noexcept {
  const Contacts contacts = active_contacts(world, state, state.proxy_m);
  const double k = coupling_N_per_m(world, state);
  const double damping = mixed_feel(contacts).damping_N_s_per_m;
  glm::dvec3 added(0.0), normal(0.0);
  double shares = 0.0;
  for (const Contact& c : contacts) {
    normal += c.force_N * c.normal;
    shares += c.force_N;
  }
  const double pressed = glm::length(normal);
  if (damping > 0.0 && pressed > 0.0) {
    normal /= pressed;
    const double depth = glm::dot(state.proxy_m - device_m, normal);
    added = normal * damping_force(state.damping, k * depth, depth, damping, dt_s, world.encoder_m,
                                   world.damping_account);
    for (const Contact& c : contacts) state.rigid_force_N[c.number] += (c.force_N / shares) * added;
  } else {
    end_damping(state.damping);
  }
  for (const Contact& c : contacts) {
    if (c.feel->texture == nullptr) continue;
    const BodyFrame& frame = state.rigid[c.number].frame;
    // The relief is evaluated at the point of the surface under the device, not at the proxy. Friction or
    // another surface may hold the proxy elsewhere. The relief at the proxy would push the hand although the
    // hand does not move over that relief, and so add energy.
    const double depth = glm::dot(state.proxy_m - device_m, c.normal);
    const glm::dvec3 over = device_m + (depth - world.contact_radius_m()) * c.normal;
    const TexturedContact contact{frame.to_body(over), c.normal * frame.rotation, c.force_N / k, k};
    const glm::dvec3 relief =
        frame.rotation * texture_force(*c.feel->texture, contact, c.feel->texture_share);
    state.rigid_force_N[c.number] += relief;
    added += relief;
  }
  return added;
}

}  // namespace hybrid
