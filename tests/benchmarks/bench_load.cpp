// SPDX-License-Identifier: GPL-3.0-or-later
// Time and memory from a mesh file to the first touch. Prints one row per file. Each file is measured in its
// own process.
//
//   bench_load [OPTIONS] FILE…         touches each from above, at its highest vertex
//     --threads N, --unit METERS, --radius METERS (of the tool; 0: a point)
//   bench_load --sphere EDGE FILE.ply  writes a sphere of 12·EDGE² triangles
//
// `peak` is the largest resident memory of the process, and `held` the resident memory at the first touch.
// `object` and `map` are parts of `held`, as the program accounts for them. `cpu` is the CPU time of all
// threads.
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/base/process_memory.h"
#include "hybrid/build/build_world.h"
#include "hybrid/session/session.h"
#include "hybrid/tick/tick.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"

namespace {

struct Options {
  int threads = 0;  // number of processors to use; 0: all
  double unit_m = 1e-3;
  double radius_m = 2e-3;  // of the tool
};

double seconds_of(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void run_on(int processors) {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (int i = 0; i < processors; ++i) CPU_SET(static_cast<unsigned>(i), &set);
  sched_setaffinity(0, sizeof(set), &set);
}

int touch(const std::string& file, const Options& options) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  const double cpu = seconds_of(CLOCK_PROCESS_CPUTIME_ID);
  hybrid::Scene scene;
  scene.file = file;
  scene.tool.radius_m = options.radius_m;
  hybrid::RigidDescription rigid;
  rigid.name = "mesh";
  rigid.source = hybrid::MeshSource{.file = file, .unit_m = options.unit_m};
  scene.rigid.push_back(rigid);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::RigidObject& object = built.world->rigid.front();
  glm::dvec3 top(0.0, 0.0, -1e300);
  for (const glm::dvec3& v : object.drawn->vertices) top = v.z > top.z ? v : top;

  hybrid::set_flush_to_zero();
  const double step_m = std::max(0.05 * options.radius_m, 1e-4);
  glm::dvec3 tool = top + glm::dvec3(0.0, 0.0, options.radius_m + 20.0 * step_m);
  hybrid::begin_session(scene, *built.world, *built.state, tool);
  bool touched = false;
  double tick_us = 0.0;
  for (int tick = 0; tick < 100 && !touched; ++tick) {
    tool.z -= step_m;
    const hybrid::TickResult felt =
        hybrid::haptic_tick(*built.world, *built.state, {.position_m = tool}, 1e-3);
    touched = felt.contacts != 0;
    tick_us = felt.tick_us;
  }
  const double wall = std::chrono::duration<double>(Clock::now() - start).count();
  const double worked = seconds_of(CLOCK_PROCESS_CPUTIME_ID) - cpu;
  std::printf("| %-26.26s | %9zu | %7.3f | %7.3f | %7.1f | %7.1f | %7.1f | %6.1f | %s |\n",
              file.substr(file.find_last_of('/') + 1).c_str(), object.drawn->triangles.size(), wall, worked,
              1e-6 * static_cast<double>(hybrid::peak_memory_bytes()),
              1e-6 * static_cast<double>(hybrid::resident_memory_bytes()),
              1e-6 * static_cast<double>(object.memory_bytes()),
              1e-6 * static_cast<double>(built.state->map.memory_bytes()),
              touched ? (std::to_string(tick_us) + " us").c_str() : "not touched");
  std::fflush(stdout);
  return touched ? 0 : 1;
}

int write_sphere(int edge, const std::string& file) {
  polygon::TriangleMesh mesh = polygon::make_box_mesh(glm::dvec3(1.0), edge);
  for (glm::dvec3& v : mesh.vertices) v = 50.0 * glm::normalize(v);
  polygon::save_ply(file, mesh);
  return 0;
}

int usage() {
  std::fprintf(stderr,
               "usage: bench_load [--threads N] [--unit METERS] [--radius METERS] FILE...\n       bench_load "
               "--sphere EDGE FILE.ply\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  int failed = 0;
  try {
    std::vector<std::string> words(argv + 1, argv + argc);
    if (words.size() == 3 && words[0] == "--sphere")
      return write_sphere(std::atoi(words[1].c_str()), words[2]);
    while (words.size() > 2 && words[0].starts_with("--")) {
      if (words[0] == "--threads") {
        options.threads = std::atoi(words[1].c_str());
      } else if (words[0] == "--unit") {
        options.unit_m = std::atof(words[1].c_str());
      } else if (words[0] == "--radius") {
        options.radius_m = std::atof(words[1].c_str());
      } else {
        return usage();
      }
      words.erase(words.begin(), words.begin() + 2);
    }
    if (words.empty()) return usage();
    if (options.threads > 0) run_on(options.threads);
    std::printf(
        "| mesh | triangles | file to touch s | cpu s | peak MB | held MB | object MB | map MB | touching "
        "tick |\n");
    std::printf("|---|---|---|---|---|---|---|---|---|\n");
    std::fflush(stdout);
    for (const std::string& file : words) {
      const pid_t child = fork();
      if (child == 0) {
        int status = 1;
        try {
          status = touch(file, options);
        } catch (const std::exception& error) {
          std::fprintf(stderr, "%s\n", error.what());
        }
        std::_Exit(status);
      }
      int status = 0;
      waitpid(child, &status, 0);
      failed += status != 0 ? 1 : 0;
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return failed == 0 ? 0 : 1;
}
