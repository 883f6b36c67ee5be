// SPDX-License-Identifier: GPL-3.0-or-later
// A scene's real device. It is opened before the scene is built and placed in the scene afterwards.
#pragma once

#include <memory>
#include <string>

#include "device/phantom/phantom.h"
#include "hybrid/build/build_world.h"

namespace hybrid {

// The names that `--device` takes.
inline constexpr const char* kDeviceNames[] = {"phantom", "premium-1.5", "touch", "ideal"};
// Gives the scene another device. `name` is one of those names.
void use_device(Scene& scene, const std::string& name);

// Opens the scene's real device. The scene takes over the device's rate and limits. Returns null for a
// simulated device. Throws SceneError that names the missing part and the remedy, and says that the scene
// also runs with a simulated device.
std::unique_ptr<device::PhantomDevice> open_real_device(Scene& scene, device::PhantomOptions options = {});

// Maps the device's workspace onto the scene's objects and its path, centre to centre. Returns a text about
// the mapping and about objects out of reach.
std::string place_real_device(const Scene& scene, const World& world, device::PhantomDevice& device);

// Waits until the hand has moved the tool out of all rigid objects. Throws SceneError after the given time.
void await_free_tool(const Scene& scene, const World& world, WorldState& state, device::HapticDevice& device,
                     const Progress& progress, double most_s = 30.0);

}  // namespace hybrid
