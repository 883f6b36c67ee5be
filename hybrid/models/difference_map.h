// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the places on an object's surface where a hand can tell two models apart. The tool is pressed to the
// same depth in both models at many places, and the forces at rest are compared.
#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/models/surface_places.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Why two models cannot be compared at rest, in words; empty: they can.
[[nodiscard]] std::string why_no_difference_map(const World& a, const World& b);

class DifferenceMap {
 public:
  // `surface`: surface of `object`, from which depths are measured. It may differ from the surfaces in `a`
  // and `b`. Both scenes must be at rest. `depth_m`: depth of the tool below the surface. `floor_N`: lower
  // bound of the JND, whose reference is `a`. Keeps references to both scenes.
  DifferenceMap(const std::string& object, const polygon::TriangleMesh& surface, const BuiltScene& a,
                const BuiltScene& b, double depth_m, double floor_N);

  // Presses at `places` further places, on `threads` threads of the caller's priority. Places and forces are
  // the same for any number of threads. False: the surface is covered, or `stop` became true. Places that
  // were not pressed because of `stop` are not known.
  bool press(std::size_t places, std::size_t threads, const std::atomic<bool>& stop);

  // The result so far, without `object`, `comparison` and `number`.
  [[nodiscard]] FeltDifference now() const;
  [[nodiscard]] std::size_t places() const { return places_.given(); }

 private:
  struct Pressed {
    SurfacePlace at;
    bool known = false;  // the tool can reach the place in both models
    double jnd = 0.0, a_N = 0.0, b_N = 0.0;
  };
  void press_at(Pressed& place, const std::atomic<bool>& stop) const;

  const BuiltScene &a_, &b_;
  bool a_soft_, b_soft_;  // the object is felt by its voxels
  SurfacePlaces places_;
  double depth_m_, floor_N_, radius_m_;
  double gap_m_;       // greatest distance from a vertex to its nearest place on a covered surface
  double most_way_m_;  // greatest distance from the tool's start to a free place
  std::vector<Pressed> pressed_;
};

}  // namespace hybrid
