// SPDX-License-Identifier: GPL-3.0-or-later
// A scene's real device: opened before the scene is built, placed in it after.
#pragma once

#include <memory>
#include <string>

#include "device/phantom/phantom.h"
#include "hybrid/build/build_world.h"

namespace hybrid {

// The names that `--device` takes.
inline constexpr const char* kDeviceNames[] = {"phantom", "premium-1.5", "touch", "ideal"};
// The scene with another device than it says. `name` is one of those.
void use_device(Scene& scene, const std::string& name);

// Opens the scene's real device; the scene takes its rate and its limits. Nothing where the scene has a
// simulated one. Throws SceneError: what is missing, the remedy, and that the scene also runs with a
// simulated device.
std::unique_ptr<device::PhantomDevice> open_real_device(Scene& scene, device::PhantomOptions options = {});

// Lays the device's workspace over the scene's objects and its path, centre to centre; says how, and what is
// out of its reach.
std::string place_real_device(const Scene& scene, const World& world, device::PhantomDevice& device);

// Waits until the hand has the tool out of everything rigid, at most so long. Throws SceneError when it has
// not.
void await_free_tool(const Scene& scene, const World& world, WorldState& state, device::HapticDevice& device,
                     const Progress& progress, double most_s = 30.0);

}  // namespace hybrid
