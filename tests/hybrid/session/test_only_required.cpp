// SPDX-License-Identifier: GPL-3.0-or-later
// A scene allocates memory only for the objects that it contains. Rigid objects allocate nothing in the voxel
// code, and soft objects nothing in the polygon code. This program attributes each allocation during the
// build and touch of a scene to the parts on the call stack.
#include <dlfcn.h>
#include <execinfo.h>
#include <gtest/gtest.h>
#include <sys/mman.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <string_view>
#include <unordered_map>

#include "hybrid/session/session.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define COUNTS_MALLOC 0  // sanitizers have their own malloc
#else
#define COUNTS_MALLOC 1
#endif

namespace {

enum Part : unsigned { part_voxel = 1, part_polygon = 2, part_embree = 4 };

struct Bytes {
  std::size_t all = 0, voxel = 0, polygon = 0, embree = 0;
};

thread_local bool watched = false;
thread_local Bytes counted;

// The parts to which a return address belongs.
unsigned part_of(void* address) {
  static std::unordered_map<void*, unsigned> known;
  const auto [at, fresh] = known.try_emplace(address, 0U);
  if (!fresh) return at->second;
  Dl_info info{};
  if (dladdr(address, &info) == 0) return 0;
  const std::string_view file = info.dli_fname != nullptr ? info.dli_fname : "";
  const std::string_view name = info.dli_sname != nullptr ? info.dli_sname : "";
  // Mangled names contain _ZN5voxel… or _ZNK5voxel…. Templates of the standard library with an argument of
  // these namespaces count as well.
  if (name.find("5voxel") != std::string_view::npos) at->second |= part_voxel;
  if (name.find("7polygon") != std::string_view::npos) at->second |= part_polygon;
  if (file.find("embree") != std::string_view::npos) at->second |= part_embree;
  return at->second;
}

[[maybe_unused]] void count(std::size_t bytes) noexcept {
  if (!watched) return;
  watched = false;  // allocations of this function are not counted
  std::array<void*, 64> stack{};
  const int depth = backtrace(stack.data(), static_cast<int>(stack.size()));
  unsigned parts = 0;
  for (int n = 0; n < depth; ++n) parts |= part_of(stack[static_cast<std::size_t>(n)]);
  counted.all += bytes;
  if ((parts & part_voxel) != 0) counted.voxel += bytes;
  if ((parts & part_polygon) != 0) counted.polygon += bytes;
  if ((parts & part_embree) != 0) counted.embree += bytes;
  watched = true;
}

}  // namespace

#if COUNTS_MALLOC
// The GNU C library's names of the functions that are replaced here.
// NOLINTBEGIN(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp,readability-inconsistent-declaration-parameter-name)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t number, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) noexcept {
  count(size);
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) noexcept {
  count(number * size);
  return __libc_calloc(number, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  count(size);
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  count(size);
  return __libc_memalign(alignment, size);
}
void* mmap(void* at, std::size_t bytes, int protection, int flags, int file, off_t offset) noexcept {
  using Mmap = void* (*)(void*, std::size_t, int, int, int, off_t);
  static const auto next = reinterpret_cast<Mmap>(dlsym(RTLD_NEXT, "mmap"));
  count(bytes);
  return next(at, bytes, protection, flags, file, offset);
}
}
// NOLINTEND(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp,readability-inconsistent-declaration-parameter-name)
#endif

namespace {

constexpr const char* kRigid = R"([[rigid]]
name = "ball"
primitive = "ball"
radius = 10
[[rigid]]
name = "block"
mesh = "block.ply"
position = [0, 0, -20]
)";
constexpr const char* kSoft = R"([material.gel]
young = 5000
[[soft]]
name = "gel"
formula = "block"
size = [30, 30, 20]
spacing = 2
position = [0, 0, 0]
material = "gel"
)";

class OnlyRequired : public tests::SceneFile {
 protected:
  Bytes bytes_of(const std::string& objects) {
    write("block.ply",
          "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
          "element face 4\nproperty list uchar int vertex_indices\nend_header\n-20 -20 0\n20 -20 0\n0 20 0\n"
          "0 0 10\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n");
    const std::string scene_text = "format = 1\n[tool]\nradius = 3\n" + objects +
                                   "[path]\nkind = \"press\"\nfrom = [0, 0, 30]\nto = [0, 0, 8]\n";
    const hybrid::Scene scene = load(scene_text);
    counted = {};
    watched = true;
    hybrid::BuiltScene built = hybrid::build_scene(scene);
    const hybrid::SessionResult result = hybrid::run_session(scene, built, {.seconds = {}, .progress = {}});
    watched = false;
    EXPECT_GT(result.contact_ticks, 100U);
    std::printf("%zu bytes; voxels %zu, polygons %zu, Embree %zu\n", counted.all, counted.voxel,
                counted.polygon, counted.embree);
    return counted;
  }
  void SetUp() override {
    if (COUNTS_MALLOC == 0) GTEST_SKIP() << "skipped: a sanitizer brings its own malloc";
    tests::SceneFile::SetUp();
    std::array<void*, 4> stack{};
    backtrace(stack.data(), 4);  // the first call of backtrace() allocates, so it is made here
  }
};

TEST_F(OnlyRequired, RigidObjectsTakeNoByteForVoxels) {
  const Bytes bytes = bytes_of(kRigid);
  EXPECT_EQ(bytes.voxel, 0U);
  EXPECT_GT(bytes.polygon, 1000U);
  EXPECT_GT(bytes.embree, 1000U);
}

TEST_F(OnlyRequired, SoftObjectsTakeNoByteForPolygons) {
  const Bytes bytes = bytes_of(kSoft);
  EXPECT_GT(bytes.voxel, 10'000U);
  EXPECT_EQ(bytes.polygon, 0U);
  EXPECT_EQ(bytes.embree, 0U);
}

TEST_F(OnlyRequired, AMixedSceneTakesBoth) {
  const Bytes bytes = bytes_of(std::string(kRigid) + kSoft);
  EXPECT_GT(bytes.voxel, 10'000U);
  EXPECT_GT(bytes.polygon, 1000U);
}

}  // namespace
