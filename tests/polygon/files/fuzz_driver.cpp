// SPDX-License-Identifier: GPL-3.0-or-later
// Fuzzes mesh files: fuzz_mesh --seconds N --seed S [--keep DIR] [FILE…]. If files are named, only these are
// tested, unchanged. Otherwise inputs are mutated in batches, each batch in its own process. An input that
// crashes, violates an invariant or takes too long is written to DIR, and the next batch continues. An input
// with new behaviour (other findings, another error) joins the pool and is mutated further. The same seed
// makes the same inputs. Build it with sanitizers (preset asan), because other builds do not show memory
// errors.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <new>
#include <random>
#include <string>
#include <vector>

#include "tests/polygon/files/fuzz_seeds.h"
#include "tests/polygon/files/fuzz_target.h"

namespace {

using Clock = std::chrono::steady_clock;

constexpr unsigned kLimit_s = 60;      // time for one input, including the cost of sanitizers
constexpr unsigned kBatch = 500;       // inputs per process
constexpr std::size_t kMaxPool = 400;  // inputs kept for further mutation
constexpr std::size_t kSlots = 1U << 16U;

// State shared between the processes, so that it survives a crash.
struct Shared {
  std::uint64_t executions = 0, loaded = 0;
  double slowest_s = 0.0;
  std::uint64_t slowest_bytes = 0, slowest_size = 0;
  std::uint64_t signatures = 0;
  char name[512] = {};  // name of the current input
  bool seen[kSlots] = {};
};

// CPU time of this process. Unlike elapsed time, it does not depend on other processes.
double processor_s() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

struct Fuzzer {
  std::filesystem::path folder, keep;
  std::vector<tests::FuzzInput> pool;
  Shared* shared = nullptr;

  void try_one(const tests::FuzzInput& input, std::mt19937_64& random) {
    const std::string name = "input" + input.extension + (input.packed ? ".gz" : "");
    const std::filesystem::path file = folder / name;
    std::string bytes = input.packed ? tests::packed_bytes(input.bytes) : input.bytes;
    if (input.packed && random() % 8 == 0) bytes = tests::mutated({bytes, ""}, {bytes, ""}, random).bytes;
    std::ofstream(file, std::ios::binary) << bytes;
    std::strncpy(shared->name, file.c_str(), sizeof(shared->name) - 1);
    ::alarm(kLimit_s);
    const double start_s = processor_s();
    const tests::FuzzOutcome outcome = tests::fuzz_file(file);
    const double took = processor_s() - start_s;
    ::alarm(0);
    ++shared->executions;
    shared->loaded += outcome.loaded ? 1 : 0;
    if (took > shared->slowest_s) {
      shared->slowest_s = took;
      shared->slowest_bytes = bytes.size();
      shared->slowest_size = outcome.size;
      std::filesystem::copy_file(file, keep / ("slowest-" + name),
                                 std::filesystem::copy_options::overwrite_existing);
    }
    bool& seen = shared->seen[std::hash<std::string>{}(input.extension + outcome.signature) % kSlots];
    if (!seen) {
      seen = true;
      ++shared->signatures;
      // Written by this process and read by the next batch.
      std::ofstream(folder / ("new-" + std::to_string(shared->signatures) + input.extension +
                              (input.packed ? ".packed" : ".plain")),
                    std::ios::binary)
          << input.bytes;
    }
  }

  // Takes the last batch's new inputs into the pool. They replace the oldest inputs that are not seeds.
  void take_new(std::size_t seeds, std::mt19937_64& random) {
    std::vector<std::filesystem::path> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().filename().string().starts_with("new-")) found.push_back(entry.path());
    }
    std::sort(found.begin(), found.end());
    for (const std::filesystem::path& path : found) {
      std::ifstream in(path, std::ios::binary);
      tests::FuzzInput input{{std::istreambuf_iterator<char>(in), {}},
                             path.stem().extension().string(),
                             path.extension() == ".packed"};
      std::filesystem::remove(path);
      if (pool.size() < kMaxPool) {
        pool.push_back(std::move(input));
      } else {
        pool[seeds + random() % (kMaxPool - seeds)] = std::move(input);
      }
    }
  }
};

// `only`: the extension of the seeds; empty: all.
int fuzz(double seconds, std::uint64_t seed, const std::filesystem::path& keep, const std::string& only) {
  Fuzzer fuzzer;
  fuzzer.folder = std::filesystem::temp_directory_path() / ("hybrid-fuzz-" + std::to_string(::getpid()));
  fuzzer.keep = keep.empty() ? fuzzer.folder : keep;
  std::filesystem::create_directories(fuzzer.folder);
  std::filesystem::create_directories(fuzzer.keep);
  void* memory = ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return 2;
  fuzzer.shared = new (memory) Shared;
  fuzzer.pool = tests::fuzz_seeds();
  std::erase_if(fuzzer.pool, [&](const auto& input) { return !only.empty() && input.extension != only; });
  if (fuzzer.pool.empty()) return 2;
  const std::size_t seeds = fuzzer.pool.size();
  const Clock::time_point start = Clock::now();
  double said_s = 0.0;
  std::uint64_t failures = 0;
  for (std::uint64_t batch = 0; seconds_since(start) < seconds; ++batch) {
    std::mt19937_64 random(seed * 1000003 + batch);
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child < 0) return 2;
    if (child == 0) {
      for (unsigned i = 0; i < kBatch && seconds_since(start) < seconds; ++i) {
        const tests::FuzzInput& base = fuzzer.pool[random() % fuzzer.pool.size()];
        const tests::FuzzInput& other = fuzzer.pool[random() % fuzzer.pool.size()];
        fuzzer.try_one(batch == 0 && i < seeds ? fuzzer.pool[i] : tests::mutated(base, other, random),
                       random);
      }
      std::_Exit(0);  // without leak checks and destructors; only the parent runs them
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    if (status != 0) {
      ++failures;
      const std::filesystem::path input = fuzzer.shared->name;
      const bool slow = WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM;
      const std::filesystem::path kept =
          fuzzer.keep /
          ((slow ? "slow-" : "crash-") + std::to_string(failures) + "-" + input.filename().string());
      std::error_code ignored;
      std::filesystem::copy_file(input, kept, std::filesystem::copy_options::overwrite_existing, ignored);
      std::printf("%s in batch %llu: %s\n", slow ? "TOO SLOW" : "CRASH",
                  static_cast<unsigned long long>(batch), kept.c_str());
    }
    fuzzer.take_new(seeds, random);
    const double now_s = seconds_since(start);
    if (now_s - said_s > 60.0 || now_s >= seconds) {
      said_s = now_s;
      const Shared& s = *fuzzer.shared;
      std::printf(
          "%6.0f s: %llu inputs, %llu loaded, %llu behaviours, %llu failures; slowest "
          "%.2f s (%llu bytes, size %llu)\n",
          now_s, static_cast<unsigned long long>(s.executions), static_cast<unsigned long long>(s.loaded),
          static_cast<unsigned long long>(s.signatures), static_cast<unsigned long long>(failures),
          s.slowest_s, static_cast<unsigned long long>(s.slowest_bytes),
          static_cast<unsigned long long>(s.slowest_size));
    }
    std::fflush(stdout);
  }
  if (fuzzer.keep != fuzzer.folder || failures == 0) std::filesystem::remove_all(fuzzer.folder);
  return failures == 0 ? 0 : 1;
}

int usage(const char* program) {
  std::fprintf(stderr, "usage: %s [--seconds N] [--seed S] [--keep DIR] [--only .EXTENSION] [FILE...]\n",
               program);
  return 2;
}

void test_named(const char* file) {
  const Clock::time_point start = Clock::now();
  const tests::FuzzOutcome outcome = tests::fuzz_file(file);
  std::printf("%s: %s, size %zu, %.3f s, %s\n", file, outcome.loaded ? "loaded" : "refused", outcome.size,
              seconds_since(start), outcome.signature.c_str());
}

}  // namespace

int main(int argc, char** argv) try {
  double seconds = 10.0;
  std::uint64_t seed = 1;
  std::filesystem::path keep;
  std::string only;
  bool named = false;
  for (int i = 1; i < argc; ++i) {
    const std::string option = argv[i];
    if (!option.starts_with("--")) {
      named = true;
      test_named(argv[i]);
      continue;
    }
    if (++i == argc) return usage(argv[0]);
    if (option == "--seconds") {
      seconds = std::strtod(argv[i], nullptr);
    } else if (option == "--seed") {
      seed = std::strtoull(argv[i], nullptr, 10);
    } else if (option == "--keep") {
      keep = argv[i];
    } else if (option == "--only") {
      only = argv[i];
    } else {
      return usage(argv[0]);
    }
  }
  return named ? 0 : fuzz(seconds, seed, keep, only);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
