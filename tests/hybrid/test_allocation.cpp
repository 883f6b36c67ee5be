// SPDX-License-Identifier: GPL-3.0-or-later
// Once a scene is built, its ticks allocate nothing. This program counts every call of operator new and
// malloc that its thread makes while it is watched.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <new>
#include <string>

#include "hybrid/session.h"

namespace {
thread_local bool watched = false;
thread_local std::size_t allocations = 0;
void count() noexcept {
  if (watched) ++allocations;
}
}  // namespace

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define COUNTS_MALLOC 0  // sanitizers bring their own
#else
#define COUNTS_MALLOC 1
// The GNU C library's own names for what it would have called.
// NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp,readability-inconsistent-declaration-parameter-name)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);

void* malloc(std::size_t size) noexcept {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) noexcept {
  count();
  return __libc_calloc(number, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  count();
  return __libc_realloc(memory, size);
}
}
// NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp,readability-inconsistent-declaration-parameter-name)
#endif

// Not inlined: where the compiler sees free() meet new it takes them for a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  count();
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t& /*nothrow*/) noexcept {
  count();
  return std::malloc(size == 0 ? 1 : size);
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  count();
  const auto step = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(step, (size / step + 1) * step)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t /*alignment*/) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/,
                                       std::align_val_t /*alignment*/) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t /*size*/) noexcept {
  std::free(memory);
}

namespace {

constexpr int kTicks = 10'000;

TEST(Allocation, TheCounterCounts) {
  watched = true;
  const auto something = std::make_unique<int>(1);
  const std::size_t by_new = allocations;
  void* const memory = std::malloc(10);
  const std::size_t by_malloc = allocations - by_new;
  watched = false;
  std::free(memory);
  EXPECT_GE(by_new, 1U) << *something;
  EXPECT_EQ(by_malloc, static_cast<std::size_t>(COUNTS_MALLOC));
}

class AllocationOf : public ::testing::TestWithParam<const char*> {};

TEST_P(AllocationOf, AllItsTicks) {
  std::unique_ptr<hybrid::Scene> scene;
  try {
    scene = std::make_unique<hybrid::Scene>(
        hybrid::load_scene(std::filesystem::path(HYBRID_SOURCE_DIR) / "scenes" / GetParam()));
  } catch (const hybrid::SceneError& error) {
    // The head is the only one that needs a file that is not in the repository.
    if (std::string(GetParam()) == "head.toml") GTEST_SKIP() << "skipped: " << error.what();
    throw;
  }
  const hybrid::BuiltScene built = hybrid::build_scene(*scene);
  const auto device = hybrid::scene_device(*scene, hybrid::scene_path(*scene));
  hybrid::flush_denormals();
  hybrid::begin_session(*scene, *built.world, *built.state, device->read().position_m);
  const double dt = 1.0 / scene->rate_hz;
  std::size_t felt_ticks = 0;
  allocations = 0;
  watched = true;
  for (int tick = 0; tick < kTicks; ++tick) {
    const hybrid::TickResult felt = hybrid::haptic_tick(*built.world, *built.state, device->read(), dt);
    device->write(felt.force_N, dt);
    felt_ticks += felt.contacts != 0 ? 1 : 0;
  }
  watched = false;
  EXPECT_EQ(allocations, 0U);
  EXPECT_GT(felt_ticks, 500U) << "the path is meant to touch something";
  EXPECT_EQ(built.state->nonfinite, 0U);
  EXPECT_EQ(built.state->faults, 0U);
}

INSTANTIATE_TEST_SUITE_P(ShippedScenes, AllocationOf,
                         ::testing::Values("cube.toml", "sheet.toml", "ball-and-block.toml", "two-soft.toml",
                                           "head.toml", "thin-sheet.toml", "convex-edge.toml",
                                           "textured-plate.toml", "moving.toml", "wall.toml", "tissue.toml"),
                         [](const auto& scene) {
                           std::string name = scene.param;
                           name.resize(name.find('.'));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// A scene that is shipped later is watched too.
TEST(Allocation, KnowsEveryShippedScene) {
  std::size_t scenes = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(HYBRID_SOURCE_DIR) / "scenes")) {
    scenes += entry.path().extension() == ".toml" ? 1 : 0;
  }
  EXPECT_EQ(scenes, 11U) << "add the new scene to the list above";
}

}  // namespace
