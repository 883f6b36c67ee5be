// SPDX-License-Identifier: GPL-3.0-or-later
// The time that the C interface adds to a tick, beside the same ticks without it, in one run.
//
//   bench_interface [--rounds N]     prints one row for each way to call a tick
//
// The scene is a rigid ball. Its tick takes only about a microsecond, so the time of a call is visible beside
// it. The three ways take turns. In each round every way plays the same path. Times are processor time of the
// thread. A row has the least and the median of the rounds, and their ratios to those of direct ticks.
#include <hybrid.h>
#include <time.h>  // NOLINT(modernize-deprecated-headers): clock_gettime() is POSIX

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/build/build_world.h"
#include "hybrid/build/load_scene.h"
#include "hybrid/session/session.h"
#include "hybrid/stress/scratch_folder.h"
#include "hybrid/tick/tick.h"

namespace {

constexpr int kTicks = 1000;        // in each round
constexpr double kPeriod_s = 1e-3;  // length of a tick
constexpr const char* kScene =
    "format = 1\n[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 20\n"
    "[path]\nkind = \"press\"\nfrom = [0, 0, 40]\nto = [0, 0, 10]\n";

double processor_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

void must(hybrid_code code) {
  if (code != HYBRID_OK) throw std::runtime_error(hybrid_error_text());
}

// A path into the ball. Each round begins at another place.
std::vector<glm::dvec3> path_of(int round) {
  std::vector<glm::dvec3> path_m;
  const glm::dvec3 from(1e-4 * round, 0.0, 0.04), to(0.0, 0.0, 0.019);
  for (int n = 1; n <= kTicks; ++n) path_m.push_back(from + (to - from) * (static_cast<double>(n) / kTicks));
  return path_m;
}

// One way to play a path, with its time per tick (µs) in each round.
struct Way {
  const char* name;
  std::vector<double> round_us{};
};

template <typename Play>
void measure(Way& way, Play play) {
  const double start_us = processor_us();
  play();
  way.round_us.push_back((processor_us() - start_us) / kTicks);
}

class Interface {
 public:
  explicit Interface(const std::string& file)
      : scene_(hybrid::load_scene(file)), built_(hybrid::build_scene(scene_)) {
    hybrid_options options{};
    options.size = sizeof options;
    must(hybrid_open(file.c_str(), &options, &session_));
    const glm::dvec3 start_m(0.0, 0.0, 0.04);
    must(hybrid_begin(session_, &start_m.x));
    hybrid::begin_session(scene_, *built_.world, *built_.state, start_m);
    felt_.resize(kTicks);
    felt_.front().size = sizeof(hybrid_felt);
  }
  ~Interface() { (void)hybrid_close(session_); }
  Interface(const Interface&) = delete;
  Interface& operator=(const Interface&) = delete;
  Interface(Interface&&) = delete;
  Interface& operator=(Interface&&) = delete;

  void round(std::span<const glm::dvec3> path_m, std::span<Way> ways) {
    measure(ways[0], [&] {
      for (const glm::dvec3& at_m : path_m)
        sum_N_ +=
            hybrid::haptic_tick(*built_.world, *built_.state, {.position_m = at_m}, kPeriod_s).force_N.z;
    });
    measure(ways[1], [&] {
      for (const glm::dvec3& at_m : path_m) {
        must(hybrid_tick(session_, &at_m.x, nullptr, kPeriod_s, felt_.data()));
        sum_N_ -= felt_.front().force_N[2];
      }
    });
    measure(ways[2],
            [&] { must(hybrid_play(session_, &path_m.front().x, path_m.size(), kPeriod_s, felt_.data())); });
  }
  // Sum of the forces of direct ticks, minus that of the forces through the interface. 0 if all are equal.
  [[nodiscard]] double difference_N() const { return sum_N_; }

 private:
  hybrid::Scene scene_;
  hybrid::BuiltScene built_;
  hybrid_session* session_ = nullptr;
  std::vector<hybrid_felt> felt_;
  double sum_N_ = 0.0;
};

void print(std::span<Way> ways) {
  std::printf("| a tick | least us | median us | least, ratio | median, ratio |\n|---|---|---|---|---|\n");
  for (Way& way : ways) std::ranges::sort(way.round_us);
  const std::size_t middle = ways[0].round_us.size() / 2;
  for (const Way& way : ways) {
    std::printf("| %s | %.3f | %.3f | %.2f | %.2f |\n", way.name, way.round_us[0], way.round_us[middle],
                way.round_us[0] / ways[0].round_us[0], way.round_us[middle] / ways[0].round_us[middle]);
  }
}

int compare(int rounds) {
  const hybrid::ScratchFolder folder("bench_interface");
  const std::string file = (folder.path() / "ball.toml").string();
  std::ofstream(file) << kScene;
  Interface interface(file);
  std::vector<Way> ways{{"direct"}, {"hybrid_tick()"}, {"hybrid_play()"}};
  const hybrid::ScopedFlushToZero flushed;
  for (int round = 0; round < rounds; ++round) interface.round(path_of(round % 100), ways);
  print(ways);
  std::printf("\nthe forces differ by %g N in all\n", interface.difference_N());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> words(argv + 1, argv + argc);
    const int rounds = words.size() == 2 && words[0] == "--rounds" ? std::atoi(words[1].c_str()) : 301;
    if ((!words.empty() && words.size() != 2) || rounds < 1) {
      std::fprintf(stderr, "usage: bench_interface [--rounds N]\n");
      return 2;
    }
    return compare(rounds);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
