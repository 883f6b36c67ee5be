// SPDX-License-Identifier: GPL-3.0-or-later
// Begin and end of contact. Nothing is felt and nothing moves before the tool's ball meets an object, by
// exact distances. Contact lasts until the tool leaves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "hybrid/build/build_objects.h"
#include "tests/hybrid/fixtures/overlap_checker.h"
#include "tests/hybrid/fixtures/touch.h"
#include "voxel/baseline/thesis_chainmail.h"

namespace {

using glm::dvec3;
using tests::between;
using tests::coupling;
using tests::Touch;

dvec3 direction(std::mt19937& engine) {
  const double z = between(engine, -1.0, 1.0), angle = between(engine, 0.0, 2.0 * std::numbers::pi);
  return {std::sqrt(1.0 - z * z) * std::cos(angle), std::sqrt(1.0 - z * z) * std::sin(angle), z};
}

// Distance from the tool's ball to the nearest surface voxel or rigid surface (m). It is negative inside
// solids and tissue.
double gap(Touch& touch, const dvec3& at) {
  double least = std::numeric_limits<double>::infinity();
  const double radius = touch.world().tool.radius_m;
  for (std::size_t o = 0; o < touch.state().soft.size(); ++o) {
    const voxel::SoftObject& object = *touch.state().soft[o];
    for (const voxel::VoxelId v : object.lattice().surface()) {
      const double away = glm::distance(touch.world().soft[o].to_scene(object.position(v)), at);
      least = std::min(least, away - object.reach(radius));
    }
  }
  for (std::size_t o = 0; o < touch.state().rigid.size(); ++o) {
    const polygon::RigidSurface& surface = *touch.world().rigid[o].surface;
    const dvec3 p = touch.state().rigid[o].frame.to_body(at);
    polygon::NearPoint near;
    if (!surface.nearest(p, 1.0, near)) continue;
    const double away = glm::distance(p, near.point);
    least = std::min(least, (surface.inside(p) ? -away : away) - radius);
  }
  return least;
}

bool moved(const voxel::SoftObject& object) {
  const auto surface = object.lattice().surface();
  return std::any_of(surface.begin(), surface.end(),
                     [&](voxel::VoxelId v) { return object.state().at(v) != dvec3(0.0); });
}

// Centre and half diagonal of the bounds of a soft object's surface voxels (m, scene frame).
std::pair<dvec3, double> extent(Touch& touch, std::size_t o) {
  const voxel::SoftObject& object = *touch.state().soft[o];
  dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const voxel::VoxelId v : object.lattice().surface()) {
    const dvec3 at = touch.world().soft[o].to_scene(object.position(v));
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  return {0.5 * (low + high), 0.5 * glm::distance(low, high)};
}

class Approach : public ::testing::TestWithParam<const char*> {};

// The build has removed all overlap, so no object presses on another at rest. The tool approaches from random
// directions.
TEST_P(Approach, NothingIsFeltBeforeContact) {
  constexpr int kWays = 40;
  constexpr double kStep = 2e-4, kFast = 1e-3;  // steps (m per tick) near the object and far from it
  constexpr double kRounding = 1e-9;            // (m) because positions are floats
  const hybrid::Scene scene = hybrid::load_scene(tests::source_folder / GetParam());
  std::mt19937 engine(6);
  double latest = 0.0;
  Touch at_rest(scene, dvec3(0.0, 0.0, 1.0));
  for (int n = 0; n < kWays; ++n) {
    const auto [middle, size] = extent(at_rest, static_cast<std::size_t>(n) % at_rest.state().soft.size());
    const dvec3 way = direction(engine);
    // The tool moves towards a random place in the inner part of the object.
    const dvec3 to = middle + 0.25 * size * direction(engine), from = to - (1.5 * size + 0.02) * way;
    ASSERT_GT(gap(at_rest, from), 0.0) << "way " << n << " begins within an object";
    Touch touch(scene, from, n % 2 == 1);
    dvec3 at = from;
    double left = gap(touch, at);
    bool felt = false;
    while (!felt && left > -5.0 * kStep) {
      at += (left > kFast + kStep ? kFast : kStep) * way;
      left = gap(touch, at);
      const bool shifted_before = std::any_of(touch.state().soft.begin(), touch.state().soft.end(),
                                              [](const auto& object) { return moved(*object); });
      const dvec3 force = coupling(touch.at(at));
      felt = force != dvec3(0.0);
      if (left > kRounding) {
        EXPECT_FALSE(felt) << glm::length(force) << " N, " << left << " m before contact, way " << n;
        EXPECT_FALSE(shifted_before) << left << " m before contact, way " << n;
      }
    }
    EXPECT_TRUE(felt) << "not felt by " << -left << " m after contact, way " << n;
    latest = std::max(latest, -left);
  }
  std::printf("%s: felt %.3f mm after contact at the latest, in steps of %.3f mm\n", GetParam(), 1e3 * latest,
              1e3 * kStep);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Approach,
                         ::testing::Values("tests/hybrid/tick/arbitration/carved.toml",
                                           "tests/hybrid/tick/arbitration/kept.toml",
                                           "tests/hybrid/tick/arbitration/soft_on_soft.toml",
                                           "scenes/edge-of-bone.toml", "scenes/two-soft.toml",
                                           "scenes/cleft.toml"),
                         [](const auto& file) {
                           std::string name(file.param);
                           name = name.substr(name.rfind('/') + 1);
                           name = name.substr(0, name.find('.'));
                           std::erase_if(name, [](char c) { return c == '-' || c == '_'; });
                           return name;
                         });

class Stroke : public ::testing::TestWithParam<std::tuple<const char*, bool>> {};

// The tool presses, drags, holds and lifts somewhere on the top of the tissue. Contact must be continuous
// from its first tick to its last (in the thesis's Fig 20 the tool bounced). The tool must stay on top (in
// Fig 21 it slipped between voxels). Half of the strokes lift quickly until the tool hardly touches. Tissue
// that lags would lose contact there.
TEST_P(Stroke, IsOneContact) {
  constexpr int kStrokes = 60;
  const auto [file, asynchronous] = GetParam();
  const hybrid::Scene scene = hybrid::load_scene(tests::source_folder / file);
  std::mt19937 engine(20);
  double deepest = 0.0;
  for (int n = 0; n < kStrokes; ++n) {
    // The block's top is at z = 6 mm, and the ball's radius is 4 mm. So on top its centre is at 10 mm.
    const bool up_fast = n % 2 == 1;
    const double speed = std::exp(between(engine, std::log(up_fast ? 0.2 : 0.01), std::log(0.5)));
    const double depth = between(engine, up_fast ? 2.0 : 0.2, 4.5);
    const double last =
        between(engine, 0.25, up_fast ? 0.5 : std::max(0.25, depth));  // (mm) bumps are 0.2 mm high
    const auto place = [&](double deep) {
      return dvec3(between(engine, -12.0, 12.0), between(engine, -6.0, 6.0), 10.0 - deep);
    };
    const dvec3 first = place(depth), second = place(last);
    const dvec3 up(0.0, 0.0, 4.0 + depth);
    Touch touch(scene, 1e-3 * (first + up), asynchronous);
    int contacts = 0, ticks = 0;
    bool before = false;
    double lowest = 1.0, front = 1.0;
    const auto see = [&](const hybrid::TickResult& felt) {
      const bool now = coupling(felt) != dvec3(0.0);
      contacts += now && !before ? 1 : 0;
      before = now;
      ticks += now ? 1 : 0;
      lowest = std::min(lowest, felt.proxy_m.z);
      front = std::min(front, tests::in_front_of(touch.world(), touch.state(), {0, 2, true}, felt.proxy_m));
    };
    touch.go(1e-3 * first, 1e-3 * speed, 60, see);
    touch.go(1e-3 * second, 1e-3 * speed, 60, see);
    touch.go(1e-3 * (second + up), 1e-3 * speed, 20, see);
    EXPECT_EQ(contacts, 1) << "stroke " << n << ", " << depth << " mm deep at " << speed << " m/s, " << ticks
                           << " ticks";
    EXPECT_FALSE(before) << "still felt after it left, stroke " << n;
    EXPECT_GT(ticks, 100);
    EXPECT_GT(front, 0.0) << "between voxels, stroke " << n;
    // The tool is never deeper than the device.
    EXPECT_GE(lowest, 1e-3 * std::min(first.z, second.z) - 1e-9);
    deepest = std::max(deepest, depth);
  }
  std::printf("%d strokes, at most %.1f mm deep\n", kStrokes, deepest);
}

INSTANTIATE_TEST_SUITE_P(Blocks, Stroke,
                         ::testing::Combine(::testing::Values("tests/hybrid/tick/arbitration/kept.toml"),
                                            ::testing::Bool()),
                         [](const auto& s) {
                           return std::string(std::get<1>(s.param) ? "relaxedApart" : "relaxedInTheTick");
                         });

// A device with the mass of a Premium. A hand pulls it along by a spring and a damper.
struct Hand {
  static constexpr double kMass_kg = 0.075, kStiffness_N_per_m = 300.0, kDamping_Ns_per_m = 3.0, kDt_s = 1e-3;
  dvec3 at_m, velocity{0.0};

  void step(const dvec3& target_m, const dvec3& felt_N) {
    const dvec3 force = kStiffness_N_per_m * (target_m - at_m) - kDamping_Ns_per_m * velocity + felt_N;
    velocity += kDt_s / kMass_kg * force;
    at_m += kDt_s * velocity;
  }
};

// Numbers of lost contacts in strokes of such a hand, while pressing and while dragging.
struct Lost {
  int pressing = 0, drawing = 0;
};

// Strokes over a block whose top the tool meets at z = `top_m`. `begin` starts a stroke, and `feel` returns
// contact and force at a position.
template <class Begin, class Feel>
Lost strokes_of_a_hand(int count, double top_m, Begin&& begin, Feel&& feel) {
  Lost lost;
  std::mt19937 engine(21);
  for (int n = 0; n < count; ++n) {
    const double speed = between(engine, 0.02, 0.2);
    const auto place = [&] {
      return dvec3(1e-3 * between(engine, -12.0, 12.0), 1e-3 * between(engine, -6.0, 6.0),
                   top_m - 1e-3 * between(engine, 2.0, 8.0));
    };
    const dvec3 first = place(), second = place(), above(first.x, first.y, top_m + 2e-3);
    begin(above);
    Hand hand{above};
    bool before = false;
    const auto go = [&](const dvec3& from, const dvec3& to, int hold, int& losses) {
      const int steps = static_cast<int>(std::ceil(glm::distance(from, to) / (1e-3 * speed)));
      for (int k = 1; k <= steps + hold; ++k) {
        const auto [contact, force] = feel(hand.at_m);
        losses += before && !contact ? 1 : 0;
        before = contact;
        hand.step(k < steps ? from + (to - from) * (static_cast<double>(k) / steps) : to, force);
      }
    };
    go(above, first, 100, lost.pressing);
    go(first, second, 100, lost.drawing);
  }
  return lost;
}

// The thesis's contact check with one point loses contact, as the thesis reports. The project's own tissue
// does not. The six-point check is printed for comparison.
TEST(Hands, LoseContactAsInTheThesisAndNotHere) {
  constexpr int kStrokes = 30;
  constexpr double kTop = 6e-3;
  const hybrid::Scene scene =
      hybrid::load_scene(tests::source_folder / "tests" / "hybrid" / "tick" / "arbitration" / "kept.toml");
  const hybrid::SoftDescription& soft = scene.soft.front();
  const double radius = scene.tool.radius_m;
  std::vector<hybrid::BuildNote> notes;
  const voxel::LabelVolume volume = hybrid::build_volume(soft, notes);
  const auto classic = [&](bool six_points) {
    voxel::ThesisChainMail object(volume, hybrid::lattice_options(scene, soft),
                                  {.damping = 0.5, .six_points = six_points});
    const auto feel = [&](const dvec3& at) {
      const auto felt = object.touch(at - volume.origin_m, radius);
      object.relax_in_turn(soft.budget);
      return std::pair(felt.contact, felt.force_N);
    };
    return strokes_of_a_hand(
        kStrokes, six_points ? kTop + radius : kTop, [&](const dvec3&) { object.reset(); }, feel);
  };
  const Lost point = classic(false), points = classic(true);
  std::unique_ptr<Touch> touch;
  const Lost ours = strokes_of_a_hand(
      kStrokes, kTop + radius, [&](const dvec3& from) { touch = std::make_unique<Touch>(scene, from, true); },
      [&](const dvec3& at) {
        const dvec3 force = coupling(touch->at(at));
        return std::pair(force != dvec3(0.0), force);
      });
  std::printf(
      "%d strokes of a hand, contact lost while pressing and drawing along: by a point %d and %d times, by "
      "six "
      "%d and %d, here %d and %d\n",
      kStrokes, point.pressing, point.drawing, points.pressing, points.drawing, ours.pressing, ours.drawing);
  EXPECT_GT(point.pressing, 0) << "Fig 20";
  EXPECT_GT(point.drawing, 0) << "Fig 21";
  EXPECT_EQ(ours.pressing, 0);
  EXPECT_EQ(ours.drawing, 0);
}

}  // namespace
