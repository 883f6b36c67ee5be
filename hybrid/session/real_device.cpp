// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/real_device.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <glm/common.hpp>
#include <thread>

#include "hybrid/session/session.h"
#include "hybrid/tick/proxy/rigid_proxy.h"

namespace hybrid {
namespace {

constexpr int kPathSamples = 500;  // places of the path that the box has to contain

// Box around all places that the hand may want to reach: the path, and all objects enlarged by the tool's
// radius.
device::Box reach_of(const Scene& scene, const World& world) {
  const auto path = scene_path(scene);
  device::Box box{path->position(0.0), path->position(0.0)};
  const auto add = [&box](const glm::dvec3& low, const glm::dvec3& high) {
    box.low_m = glm::min(box.low_m, low);
    box.high_m = glm::max(box.high_m, high);
  };
  for (int i = 1; i <= kPathSamples; ++i) {
    const glm::dvec3 point = path->position(path->duration_s() * i / kPathSamples);
    add(point, point);
  }
  for (std::size_t o = 0; o < world.object_count(); ++o) {
    const ObjectBox object = object_box(world, o);
    add(object.low - world.tool.radius_m, object.high + world.tool.radius_m);
  }
  return box;
}

}  // namespace

void use_device(Scene& scene, const std::string& name) {
  if (name == "phantom") {
    if (!scene.real_device) scene.real_device.emplace();
    return;
  }
  scene.real_device.reset();
  scene.device_model = name == "ideal"   ? device::DeviceModel::ideal
                       : name == "touch" ? device::DeviceModel::touch
                                         : device::DeviceModel::premium_1_5;
}

std::unique_ptr<device::PhantomDevice> open_real_device(Scene& scene, device::PhantomOptions options) {
  if (!scene.real_device) return nullptr;
  options.open.name = scene.real_device->name;
  options.open.rate_hz = scene.rate_hz;
  try {
    auto device = device::open_phantom(options);
    scene.rate_hz = device->info().rate_hz;
    scene.opened_limits = device->limits();
    return device;
  } catch (const device::DeviceError& e) {
    throw SceneError(
        scene.file, scene.real_device->place,
        fmt::format("{}\nWithout the device the scene runs with [device] model = \"premium-1.5\", a "
                    "simulated one (or --device premium-1.5)",
                    e.what()));
  }
}

std::string place_real_device(const Scene& scene, const World& world, device::PhantomDevice& device) {
  const device::PhantomInfo& info = device.info();
  std::string text = fmt::format("{}, by {}, at {:.0f} Hz", device.name(), info.library, info.rate_hz);
  for (const std::string& note : info.notes) text += "; " + note;
  const glm::dvec3 size = info.workspace.high_m - info.workspace.low_m;
  if (!(size.x > 0.0)) {
    device::WorkspaceFit fit;
    const device::Box wanted = reach_of(scene, world);
    fit.scene_centre_m = 0.5 * (wanted.low_m + wanted.high_m);
    fit.scale = scene.real_device->scale.value_or(1.0);
    device.place(fit);
    return text + "; it does not tell its workspace, so its origin lies in the middle of the scene";
  }
  const device::Box wanted = reach_of(scene, world);
  const device::WorkspaceFit fit = device::fit_workspace(info.workspace, wanted, scene.real_device->scale);
  device.place(fit);
  text += fmt::format(
      "; its workspace of {:.0f} x {:.0f} x {:.0f} mm lies over the scene's middle, at scale {:.3g}",
      size.x * 1e3, size.z * 1e3, size.y * 1e3, fit.scale);
  if (!device::covers(fit, info.workspace, wanted)) {
    const double needed = device::fit_workspace(info.workspace, wanted, {}).scale;
    text +=
        fmt::format("; part of the scene is out of its reach: [device] scale = {:.3g}, or \"fit\", covers it",
                    std::ceil(needed * 100.0) / 100.0);
  }
  return text;
}

void await_free_tool(const Scene& scene, const World& world, WorldState& state, device::HapticDevice& device,
                     const Progress& progress, double most_s) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  while (!start_proxy(world, state, device.read().position_m)) {
    const double waited_s = std::chrono::duration<double>(Clock::now() - start).count();
    if (waited_s > most_s) {
      throw SceneError(
          scene.file, scene.real_device ? scene.real_device->place : scene.path_place,
          fmt::format("for {:.0f} s the tool was inside something rigid; move it into free space, and "
                      "start again",
                      waited_s));
    }
    if (progress) progress("the tool is inside something rigid: move it into free space");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

}  // namespace hybrid
