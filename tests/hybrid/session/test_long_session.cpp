// SPDX-License-Identifier: GPL-3.0-or-later
// A tool moves as wildly as a hand can, for HYBRID_LONG_TICKS ticks, while another thread relaxes the tissue.
// Everything must stay finite, the map exact and the memory constant. The same session on one thread must be
// equal bit by bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hybrid/session/relaxation_thread.h"
#include "hybrid/session/result_tape.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using glm::dvec3;

constexpr double kDt_s = 1e-3;
constexpr std::size_t kStretches = 10;  // a check follows each stretch of ticks

std::size_t long_ticks() {
  const char* ticks = std::getenv("HYBRID_LONG_TICKS");
  return ticks != nullptr ? std::strtoull(ticks, nullptr, 10) : 20'000;
}

// A hand that moves between random places at 0.02 to 2 m/s. Every fourth leg is a rest, and every fiftieth
// begins with a jump.
class WildHand {
 public:
  explicit WildHand(std::uint64_t seed) : random_(seed) {}

  dvec3 next() {
    if (left_ == 0) choose();
    --left_;
    at_ += step_;
    return at_;
  }

 private:
  void choose() {
    const auto number = [this](double low, double high) {
      return low + (high - low) * static_cast<double>(random_() >> 11U) * 0x1p-53;
    };
    const dvec3 goal(number(-0.035, 0.045), number(-0.025, 0.025), number(-0.02, 0.03));
    ++legs_;
    if (legs_ % 50 == 0) at_ = goal;
    const double speed = 0.02 * std::pow(100.0, number(0.0, 1.0));
    left_ = 1 + static_cast<std::uint64_t>(glm::distance(goal, at_) / (speed * kDt_s));
    step_ = (goal - at_) / static_cast<double>(left_);
    if (legs_ % 4 != 0) return;
    step_ = dvec3(0.0);
    left_ = 1 + random_() % 300;
  }

  std::mt19937_64 random_;
  dvec3 at_{0.0, 0.0, 0.06}, step_{0.0};
  std::uint64_t left_ = 0, legs_ = 0;
};

// Resident memory of this process without mapped files (bytes).
std::size_t resident_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word != "RssAnon:") continue;
    std::size_t kb = 0;
    status >> kb;
    return 1024 * kb;
  }
  return 0;
}

// Expects that the map equals one that is built from the present positions.
void expect_exact(const hybrid::World& world, const hybrid::WorldState& state) {
  ASSERT_TRUE(state.map.validate());
  hybrid::OccupancyMap fresh(state.map.cell_m(), state.map.origin());
  std::vector<dvec3> at;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    for (const voxel::VoxelId v : state.soft[o]->lattice().surface())
      at.push_back(world.soft[o].to_scene(state.soft[o]->position(v)));
  }
  fresh.add_soft(static_cast<std::uint32_t>(at.size()));
  for (std::uint32_t n = 0; n < at.size(); ++n) fresh.place(n, at[n]);
  std::vector<std::uint32_t> of_map(at.size()), of_fresh(at.size());
  const auto ask = [](const hybrid::OccupancyMap& map, const dvec3& low, const dvec3& high,
                      std::vector<std::uint32_t>& out) {
    out.resize(out.capacity());
    out.resize(map.soft_in(low, high, out));
    std::sort(out.begin(), out.end());
  };
  for (std::uint32_t n = 0; n < at.size(); ++n) {
    const dvec3 half(1e-4 * static_cast<double>(n % 50));
    ask(state.map, at[n] - half, at[n] + half, of_map);
    ask(fresh, at[n] - half, at[n] + half, of_fresh);
    ASSERT_TRUE(std::binary_search(of_map.begin(), of_map.end(), n)) << "voxel " << n << " was missed";
    ASSERT_EQ(of_map, of_fresh);
  }
}

struct LongSession {
  std::vector<std::uint64_t> hash;  // [stretch] hash after it
  std::size_t contact_ticks = 0, bytes = 0, bytes_after_first = 0;
  std::uint64_t results = 0;
};

// The ticks in which relaxation results arrived. The live session passes them to the replay that runs at the
// same time.
struct Arrivals {
  explicit Arrivals(std::size_t ticks) : arrived(ticks, 1) {}

  void say(std::size_t tick, std::uint64_t bits) {
    arrived[tick] = static_cast<std::uint8_t>(bits);
    said.store(tick + 1, std::memory_order_release);
  }
  // Waits for the entry of a tick. Returns false if the live session ended before.
  bool wait_for(std::size_t tick, std::uint64_t& bits) const {
    while (said.load(std::memory_order_acquire) <= tick) {
      if (ended.load(std::memory_order_acquire) && said.load(std::memory_order_acquire) <= tick) return false;
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    bits = arrived[tick];
    return true;
  }

  std::vector<std::uint8_t> arrived;  // [tick] bits of the arrived results; allocated at the start
  std::atomic<std::size_t> said{0};
  std::atomic<bool> ended{false};
};

enum class Relaxed : std::uint8_t { by_another_thread, as_it_arrived };

LongSession feel(std::size_t ticks, Relaxed relaxed, Arrivals& arrivals) {
  const bool plays = relaxed == Relaxed::as_it_arrived;
  tests::Touch touch(hybrid::load_scene(tests::source_folder / "tests/hybrid/session/vigorous.toml"),
                     dvec3(0, 0, 0.06));
  hybrid::WorldState& state = touch.state();
  hybrid::start_async_relaxation(state, plays ? hybrid::Arrival::recorded : hybrid::Arrival::thread);
  LongSession result;
  std::optional<hybrid::RelaxationThread> thread;
  if (!plays) thread.emplace(touch.world(), state.async, 60.0);
  WildHand hand(11);
  std::uint64_t hash = hybrid::kHashBegin;
  for (std::size_t n = 0; n < ticks; ++n) {
    if (plays && !arrivals.wait_for(n, state.async.arrived)) return result;
    const hybrid::TickResult felt = touch.at(hand.next(), kDt_s);
    if (!plays) arrivals.say(n, state.async.arrived);
    hash = hybrid::hash_tick(hash, felt);
    if (felt.contacts != 0) ++result.contact_ticks;
    if (!tests::finite(felt.force_N) || !tests::finite(felt.proxy_m)) {
      ADD_FAILURE() << "tick " << n;
      return result;
    }
    if ((n + 1) % (ticks / kStretches) != 0) continue;
    hash = hybrid::hash_state(hash, state);
    result.hash.push_back(hash);
    result.bytes = resident_bytes();
    if (result.bytes_after_first == 0) result.bytes_after_first = result.bytes;
  }
  EXPECT_EQ(state.nonfinite, 0U);
  EXPECT_EQ(state.faults, 0U);
  result.results = state.async.results;
  // Ticks without contact, until the map's time slices have covered all voxels once.
  for (int n = 0; n < 3000; ++n) {
    if (plays) state.async.arrived = 0;
    touch.at({0, 0, 0.2});
  }
  expect_exact(touch.world(), state);
  return result;
}

// Both sessions run at once, and the single-threaded one is some ticks behind. The measured memory is that of
// both.
TEST(LongSession, IsFiniteExactFlatAndTheSameOnOneThread) {
  const std::size_t ticks = long_ticks();
  Arrivals arrivals(ticks);
  LongSession one;
  std::thread player([&] { one = feel(ticks, Relaxed::as_it_arrived, arrivals); });
  const LongSession two = feel(ticks, Relaxed::by_another_thread, arrivals);
  arrivals.ended.store(true, std::memory_order_release);
  player.join();
  ASSERT_EQ(two.hash.size(), kStretches);
  EXPECT_GT(two.contact_ticks, ticks / 4);
  EXPECT_GT(two.results, ticks / 200);
  EXPECT_LT(two.bytes, two.bytes_after_first + (1U << 20));
  EXPECT_LT(one.bytes, one.bytes_after_first + (1U << 20));
  EXPECT_EQ(one.hash, two.hash);
  std::printf("%zu ticks, %zu in contact, %llu results, %zu kB of memory and %zu kB after a tenth\n", ticks,
              two.contact_ticks, static_cast<unsigned long long>(two.results), two.bytes >> 10,
              two.bytes_after_first >> 10);
}

}  // namespace
