// SPDX-License-Identifier: GPL-3.0-or-later
// After the build, a tick allocates nothing, takes no lock, waits for no thread, throws nothing, and neither
// reads nor writes a file. This program counts all such calls while its thread is watched.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <time.h>  // NOLINT(modernize-deprecated-headers): nanosleep() is POSIX
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <mutex>
#include <new>
#include <ostream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/player.h"
#include "hybrid/session/session.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/world/edits.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/shared_data.h"

namespace {

struct Calls {
  std::size_t allocations = 0, locks = 0, waits = 0, throws = 0, files = 0;
  bool operator==(const Calls&) const = default;
};
std::ostream& operator<<(std::ostream& out, const Calls& c) {
  return out << c.allocations << " allocations, " << c.locks << " locks, " << c.waits << " waits, "
             << c.throws << " throws, " << c.files << " reads or writes";
}

thread_local bool watched = false;
thread_local Calls calls;
void count(std::size_t Calls::*of) noexcept {
  if (watched) ++(calls.*of);
}
void count() noexcept {
  count(&Calls::allocations);
}

// The next definition of the function `name` in the order of the loaded libraries.
template <class Function>
Function* next(const char* name) noexcept {
  const bool was = std::exchange(watched, false);
  auto* const found = reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
  watched = was;
  return found;
}

}  // namespace

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define COUNTS_CALLS 0  // sanitizers have their own versions
#else
#define COUNTS_CALLS 1
// The GNU C library's names of the functions that are replaced here.
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

// These cover std::mutex and its relatives, std::condition_variable and semaphores. std::atomic::wait() calls
// syscall().
#define COUNTED(of, result, name, parameters, ...)            \
  result name parameters noexcept {                           \
    static auto* const real = next<result parameters>(#name); \
    count(&Calls::of);                                        \
    return real(__VA_ARGS__);                                 \
  }
COUNTED(locks, int, pthread_mutex_lock, (pthread_mutex_t * lock), lock)
COUNTED(locks, int, pthread_mutex_trylock, (pthread_mutex_t * lock), lock)
COUNTED(locks, int, pthread_rwlock_rdlock, (pthread_rwlock_t * lock), lock)
COUNTED(locks, int, pthread_rwlock_wrlock, (pthread_rwlock_t * lock), lock)
COUNTED(locks, int, pthread_spin_lock, (pthread_spinlock_t * lock), lock)
COUNTED(waits, int, sem_wait, (sem_t * semaphore), semaphore)
COUNTED(waits, int, sched_yield, (), )
#undef COUNTED
// These functions are cancellation points, so they may throw.
#define COUNTED(of, result, name, parameters, ...)            \
  result name parameters {                                    \
    static auto* const real = next<result parameters>(#name); \
    count(&Calls::of);                                        \
    return real(__VA_ARGS__);                                 \
  }
COUNTED(waits, int, pthread_cond_wait, (pthread_cond_t * condition, pthread_mutex_t* lock), condition, lock)
COUNTED(waits, int, nanosleep, (const timespec* time, timespec* left), time, left)
COUNTED(files, ssize_t, read, (int file, void* to, std::size_t size), file, to, size)
COUNTED(files, ssize_t, write, (int file, const void* from, std::size_t size), file, from, size)
#undef COUNTED
[[noreturn]] void __cxa_throw(void* thrown, void* type, void (*destroy)(void*)) {
  static auto* const real = next<void(void*, void*, void (*)(void*))>("__cxa_throw");
  count(&Calls::throws);
  real(thrown, type, destroy);
  std::abort();  // __cxa_throw does not return
}
long syscall(long number, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, number);
  std::array<long, 6> a{};
  for (long& argument : a) argument = va_arg(arguments, long);
  va_end(arguments);
  static auto* const real = next<long(long, long, long, long, long, long, long)>("syscall");
  count(&Calls::waits);
  return real(number, a[0], a[1], a[2], a[3], a[4], a[5]);
}
}
// NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp,readability-inconsistent-declaration-parameter-name)
#endif

// Not inlined, because the compiler would report free() of memory from new as a mismatch.
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
std::vector<hybrid::EditableValue> values;

TEST(ServoPath, TheCountersCount) {
  std::mutex mutex;
  calls = {};
  watched = true;
  const auto something = std::make_unique<int>(1);
  const std::size_t by_new = calls.allocations;
  void* const memory = std::malloc(10);
  const std::size_t by_malloc = calls.allocations - by_new;
  mutex.lock();
  mutex.unlock();
  std::this_thread::yield();
  try {
    throw 1;
  } catch (int) {
  }
  if (::write(-1, "", 0) == 0) ADD_FAILURE() << "there is no such file";
  watched = false;
  std::free(memory);
  EXPECT_GE(by_new, 1U) << *something;
  if (COUNTS_CALLS == 0) GTEST_SKIP() << "skipped: a sanitizer brings its own functions";
  EXPECT_EQ(by_malloc, 1U);
  EXPECT_EQ(calls.locks, 1U);
  EXPECT_EQ(calls.waits, 1U);
  EXPECT_EQ(calls.throws, 1U);
  EXPECT_EQ(calls.files, 1U);
}

// Edits the scene's values in turn. Each is set a little above or below its value in the scene.
void edit_in_turns(const hybrid::BuiltScene& built, std::uint64_t tick) {
  if (tick % 10 != 0 || values.empty()) return;
  const hybrid::EditableValue& value = values[tick / 10 % values.size()];
  const double changed = std::min(value.in_scene * (tick % 20 == 0 ? 0.9 : 1.1), value.range.high);
  hybrid::apply_edit(*built.world, *built.state, {tick, value.object, value.quantity, changed});
}

void watch_ticks(const hybrid::Scene& scene, const hybrid::BuiltScene& built, bool asynchronous,
                 bool edited = false) {
  values = hybrid::editable_values(*built.world, *built.state);
  const auto device = hybrid::scene_device(scene, hybrid::scene_path(scene));
  hybrid::set_flush_to_zero();
  hybrid::begin_session(scene, *built.world, *built.state, device->read().position_m);
  // The tick itself does the other thread's work here, so that this work is watched too.
  if (asynchronous) hybrid::start_async_relaxation(*built.state, hybrid::Arrival::counted);
  const double dt = 1.0 / scene.rate_hz;
  std::size_t felt_ticks = 0;
  calls = {};
  watched = true;
  for (int tick = 0; tick < kTicks; ++tick) {
    if (edited) edit_in_turns(built, static_cast<std::uint64_t>(tick));
    const hybrid::TickResult felt = hybrid::haptic_tick(*built.world, *built.state, device->read(), dt);
    device->write(felt.force_N, dt);
    felt_ticks += felt.contacts != 0 ? 1 : 0;
  }
  watched = false;
  EXPECT_EQ(calls, Calls{});
  EXPECT_GT(felt_ticks, 500U) << "the path is meant to touch something";
  EXPECT_EQ(built.state->nonfinite, 0U);
  EXPECT_EQ(built.state->faults, 0U);
}

class ServoPathOf : public ::testing::TestWithParam<const char*> {
 protected:
  static void watch(bool asynchronous);
};

TEST_P(ServoPathOf, AllItsTicks) {
  watch(false);
}

TEST_P(ServoPathOf, AllItsTicksRelaxedApart) {
  watch(true);
}

void ServoPathOf::watch(bool asynchronous) {
  std::unique_ptr<hybrid::Scene> scene;
  try {
    scene = std::make_unique<hybrid::Scene>(
        hybrid::load_scene(std::filesystem::path(HYBRID_SOURCE_DIR) / "scenes" / GetParam()));
  } catch (const hybrid::SceneError& error) {
    // The head is the only scene that needs a file from outside the repository.
    NEED_DATA(std::string(GetParam()) != "head.toml", error.what());
    throw;
  }
  const hybrid::BuiltScene built = hybrid::build_scene(*scene);
  if (asynchronous && built.state->soft.empty()) GTEST_SKIP() << "skipped: nothing soft in it";
  watch_ticks(*scene, built, asynchronous);
}

// Features that no shipped scene has.
class ServoPathIn : public tests::SceneFile {
 protected:
  static std::string scene(const std::string& soft) {
    return "format = 1\n[material.gel]\nyoung = 10000\npoisson = 0.3\nstretch = [0.9, 1.1]\nshear = 0.1\n"
           "[material.plate]\nyoung = 10000\npoisson = 0.3\nstretch = [1, 1]\nshear = 0\n"
           "[[soft]]\nname = \"block\"\nformula = \"block\"\nmaterial = \"gel\"\n" +
           soft +
           "[tool]\nradius = 8\n[path]\nkind = \"waypoints\"\nspeed = 100\npoints = [[0, 0, 50], [0, 0, 36], "
           "[12, 5, 34], [12, 5, 50], [-9, 3, 36, 0.2], [-9, 3, 50], [0, 0, 36, 8]]\n";
  }
};

TEST_F(ServoPathIn, AllTicksOfAContactOnACompositeGrid) {
  const hybrid::Scene grid = load(scene("size = [64, 64, 64]\nspacing = 1\n"));
  const hybrid::BuiltScene built = hybrid::build_scene(grid);
  ASSERT_TRUE(built.state->soft[0]->uses_patches());
  watch_ticks(grid, built, true);
}

TEST_F(ServoPathIn, AllTicksBetweenEdits) {
  const hybrid::Scene felt =
      load("format = 1\n" + tests::block +
           "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [20, 20, 10]\nposition = [30, 0, 0]\n"
           "friction = 0.4\ndamping = 1\ntexture = { pattern = \"bumps\", size = 3, height = 0.3 }\n"
           "[path]\nkind = \"waypoints\"\nspeed = 60\npoints = [[0, 0, 20], [0, 0, 5, 1], [30, 0, 20], [28, "
           "0, 4], "
           "[34, 2, 4, 2]]\n");
  for (const bool asynchronous : {false, true})
    watch_ticks(felt, hybrid::build_scene(felt), asynchronous, true);
}

// The session of a window takes edits and requests, records, and passes on every tick.
TEST_F(ServoPathIn, AllTicksOfAPlayer) {
  const hybrid::Scene pressed =
      load("format = 1\n" + tests::block + tests::ball + "position = [12, 0, 8]\n" + tests::path);
  hybrid::BuiltScene built = hybrid::build_scene(pressed);
  const hybrid::DrawnScene drawn = hybrid::drawn_scene(pressed, built, "");
  hybrid::Player player(pressed, built, drawn, nullptr);
  player.relax_at_once();
  calls = {};
  watched = true;
  for (std::uint32_t n = 0; n < 3000; ++n) {
    if (n % 7 == 0)
      player.edit({0, hybrid::Edit::kTool, hybrid::EditedQuantity::coupling_stiffness, 500.0 + 0.1 * n});
    player.step({.dragging = n > 1500,
                 .paused = n % 50 == 49,
                 .speed = n < 1000 ? 0.5 : 1.0,
                 .restarts = n / 1000,
                 .goal_m = {2e-3, 0.0, 4e-3}});
  }
  watched = false;
  EXPECT_EQ(calls, Calls{});
  EXPECT_GT(player.samples().refused() + player.ticks(), 2000U);
}

TEST_F(ServoPathIn, AllTicksOfAPartWithoutSlack) {
  const hybrid::Scene layers =
      load(scene("size = [64, 64, 64]\nspacing = 4\nlabel = 1\nlayers = [{ thickness = 52, label = 1 }, { "
                 "thickness = 12, label = 2 }]\nmaterials = { \"2\" = \"plate\" }\n"));
  for (const bool asynchronous : {false, true}) {
    const hybrid::BuiltScene built = hybrid::build_scene(layers);
    ASSERT_EQ(built.state->soft[0]->lattice().block_count(), 1U);
    watch_ticks(layers, built, asynchronous);
  }
}

INSTANTIATE_TEST_SUITE_P(ShippedScenes, ServoPathOf,
                         ::testing::Values("cube.toml", "sheet.toml", "ball-and-block.toml", "two-soft.toml",
                                           "head.toml", "thin-sheet.toml", "convex-edge.toml",
                                           "textured-plate.toml", "moving.toml", "wall.toml", "tissue.toml",
                                           "edge-of-bone.toml", "tissue-on-bone.toml", "cleft.toml",
                                           "pushed-tissue.toml", "dropped-weight.toml", "layers.toml"),
                         [](const auto& scene) {
                           std::string name = scene.param;
                           name.resize(name.find('.'));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// The list must contain every shipped scene.
TEST(ServoPath, KnowsEveryShippedScene) {
  std::size_t scenes = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(HYBRID_SOURCE_DIR) / "scenes")) {
    scenes += entry.path().extension() == ".toml" ? 1 : 0;
  }
  EXPECT_EQ(scenes, 17U) << "add the new scene to the list above";
}

}  // namespace
