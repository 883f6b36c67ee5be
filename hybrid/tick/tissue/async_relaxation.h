// SPDX-License-Identifier: GPL-3.0-or-later
// The background stage of the tick: tissue away from the contact goes on to its equilibrium, in the tick, by
// a budget of voxel updates, or apart from it, on a thread of its own (voxel/object/shadow_object.h).
//
// Apart, the tick gives what moved and takes what was found; it never waits. When a result is there depends
// on the machine, and nothing else does, so the tick in which one is first taken is recorded, and a session
// that is played again takes it in the same tick.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <thread>
#include <vector>

#include "hybrid/base/triple_buffer.h"
#include "voxel/object/shadow_object.h"

namespace hybrid {

struct World;
struct WorldState;

// When what was given is relaxed, and the result is there to be taken.
enum class Arrival : std::uint8_t {
  counted,   // at once, and after as many ticks as its work is worth: for fixed-step sessions
  thread,    // by the thread, when it is done
  recorded,  // at once, and in the tick that `arrived` says
  played,    // not at all: another thread hands out what was once found, and `arrived` says when it is taken
};

struct RelaxedApart;  // one object, and whose turn it is

struct Apart {
  Apart();
  ~Apart();
  Apart(const Apart&) = delete;
  Apart& operator=(const Apart&) = delete;
  Apart(Apart&&) = delete;
  Apart& operator=(Apart&&) = delete;

  [[nodiscard]] bool has(std::size_t o) const { return o < objects.size() && objects[o] != nullptr; }

  Arrival arrival = Arrival::counted;
  std::vector<std::unique_ptr<RelaxedApart>> objects;  // [soft]; null, or none at all: relaxed in the tick
  // Bit o: in this tick the result of soft object o began to be taken. With Arrival::recorded and ::played
  // said before the tick, else by it.
  std::uint64_t arrived = 0;
  std::uint64_t results = 0;  // taken so far
  bool took = false;          // in the last tick a part of one, near the contact, or all of that
  // Of this tick's processor time, what a thread of its own would have had (us): not counted as the tick's.
  double elsewhere_us = 0.0;
};

// From now on soft objects are relaxed apart; those with a yield, those on a composite grid, and all from the
// 65th on, stay in the tick. Allocates. `arrival` thread: somebody runs a RelaxationThread.
void relax_apart(WorldState& state, Arrival arrival);

// The stage.
void relax_background(const World& world, WorldState& state) noexcept;

// All that was found apart in a session, so that it can be played again with nothing relaxed: its ticks are
// the same to the last bit, whatever the other cores do meanwhile.
class ResultTape {
 public:
  explicit ResultTape(std::size_t objects) : found_(objects), next_(objects, 0) {}

  // After each tick of a session of Arrival::recorded.
  void keep(const Apart& apart);
  // By another thread, in a session of Arrival::played: what was given since the last time is found.
  void hand_out(Apart& apart) noexcept;
  // Is what the next tick takes there?
  [[nodiscard]] static bool ready(const Apart& apart) noexcept;

 private:
  std::vector<std::vector<voxel::Replica::Found>> found_;  // [soft]
  std::vector<std::size_t> next_;                          // [soft] to be handed out
};

// The calling thread goes on at ordinary priority: one that the servo thread made has got its own from it.
void take_ordinary_priority() noexcept;

// Relaxes what the tick gives, until it is destroyed. It looks every 100 us whether there is something: to
// wake it would be a call into the system from the tick.
class RelaxationThread {
 public:
  // [object][vertex of its surface] how far from rest (scene frame, meters); empty where not relaxed apart.
  using Moved = std::vector<std::vector<glm::vec3>>;

  // `surfaces_hz`: how often, between two results, it also says where surfaces are; 0: never.
  RelaxationThread(const World& world, Apart& apart, double surfaces_hz);
  ~RelaxationThread();
  RelaxationThread(const RelaxationThread&) = delete;
  RelaxationThread& operator=(const RelaxationThread&) = delete;
  RelaxationThread(RelaxationThread&&) = delete;
  RelaxationThread& operator=(RelaxationThread&&) = delete;

  // Its own processor time so far (s).
  [[nodiscard]] double busy_s() const { return busy_s_.load(std::memory_order_relaxed); }
  // For one other thread, which draws: the latest. The tick is not asked.
  [[nodiscard]] const Moved& surfaces() noexcept { return surfaces_.take(); }

 private:
  void go();
  bool relax_given() noexcept;
  void say_surfaces();

  const World& world_;
  Apart& apart_;
  double surfaces_hz_;
  HandOver<Moved> surfaces_;
  std::atomic<bool> stop_{false};
  std::atomic<double> busy_s_{0.0};
  std::thread thread_;
};

}  // namespace hybrid
