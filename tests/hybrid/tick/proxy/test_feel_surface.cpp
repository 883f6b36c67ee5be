// SPDX-License-Identifier: GPL-3.0-or-later
// Shading, texture and damping in the whole tick. The shaded force is along the normal of the surface that
// the facets approximate. The force over a relief has the wavelength of the relief. Damping only resists.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "hybrid/base/png_file.h"
#include "tests/hybrid/fixtures/feel_scene.h"

namespace {

using namespace tests;  // NOLINT(google-build-using-namespace): these tests use the whole fixture

// ---- shading

struct Slide {
  std::vector<double> degrees,
      step_N;  // [tick] angle between force and sphere's normal; change of the force in this tick
  double least_N = 1e9, most_N = 0.0;
};

// Runs the path `slide`. The device is 5 mm below the sphere, and the contact moves at 0.1 m/s along a spiral
// from pole to pole.
Slide slide_spiral(Touch& touch) {
  const double th0 = 0.3, duration = 20.0, rate = (glm::pi<double>() - 2.0 * th0) / duration, speed = 0.1;
  const double around = std::sqrt(speed * speed - kBall * kBall * rate * rate);
  const auto direction = [&](double t) {
    const double th = th0 + rate * t;
    const double phi =
        around / (kBall * rate) * (std::log(std::tan(0.5 * th)) - std::log(std::tan(0.5 * th0)));
    return dvec3(std::sin(th) * std::cos(phi), std::sin(th) * std::sin(phi), std::cos(th));
  };
  touch.go((kBall + 0.012) * direction(0.0), 1e-3);
  touch.go((kBall - 5e-3) * direction(0.0), 1e-4);
  Slide slide;
  dvec3 before(0.0);
  for (int n = 0; n < 20'000; ++n) {
    const TickResult felt = touch.at((kBall - 5e-3) * direction((n + 1) * 1e-3));
    slide.degrees.push_back(degrees_between(felt.force_N, felt.proxy_m));
    if (n > 0) slide.step_N.push_back(glm::length(felt.force_N - before));
    before = felt.force_N;
    slide.least_N = std::min(slide.least_N, glm::length(before));
    slide.most_N = std::max(slide.most_N, glm::length(before));
  }
  std::sort(slide.degrees.begin(), slide.degrees.end());
  std::sort(slide.step_N.begin(), slide.step_N.end());
  return slide;
}
double p99(const std::vector<double>& sorted) {
  return sorted[sorted.size() * 99 / 100];
}

class Shading : public Feel, public ::testing::WithParamInterface<double> {};

// The reference normal is the sphere's normal at the proxy, the direction from the ball's centre to the
// proxy. The sphere's normal at the device is the same within the measured angle, because the force points
// from the device to the proxy.
TEST_P(Shading, TurnsTheForceToTheSphereThatTheFacetsStandFor) {
  RigidDescription flat = ball(), smooth = ball();
  smooth.feel.shading = true;
  Touch with_facets(scene_of({flat}, GetParam()), {0, 0, 0.08}),
      shaded(scene_of({smooth}, GetParam()), {0, 0, 0.08});
  const Slide before = slide_spiral(with_facets), after = slide_spiral(shaded);
  for (const auto* s : {&before, &after}) {
    std::printf(
        "tool of %g mm, %-8s direction off by %.3f (p50) %.3f (p99) %.3f (max) degrees; force step %.4f "
        "(p50) "
        "%.4f (p99) %.4f (max) N; %.2f to %.2f N\n",
        1e3 * GetParam(), s == &before ? "facets:" : "shaded:", s->degrees[s->degrees.size() / 2],
        p99(s->degrees), s->degrees.back(), s->step_N[s->step_N.size() / 2], p99(s->step_N), s->step_N.back(),
        s->least_N, s->most_N);
  }
  EXPECT_LE(after.degrees.back(), 1.0);
  EXPECT_LE(p99(after.step_N), 0.11);
  EXPECT_LT(p99(after.degrees), 0.5 * p99(before.degrees));
  EXPECT_EQ(shaded.state().faults, 0U);
  EXPECT_EQ(shaded.state().truncated_ticks, 0U);
}
INSTANTIATE_TEST_SUITE_P(Tools, Shading, ::testing::Values(0.0, 2e-3),
                         [](const auto& tool) { return tool.param > 0.0 ? "ABallOf2mm" : "APoint"; });

// A force along shaded normals has no potential, but it can give only little energy.
TEST_F(Feel, ShadingOnARoughBallGivesTheHandNothing) {
  RigidDescription smooth = rough(ball());
  smooth.feel.shading = true;
  const auto around = [](double turn, double tilt, double depth) {
    const dvec3 out(std::cos(turn) * std::cos(tilt), std::sin(turn) * std::cos(tilt), std::sin(tilt));
    return (kBall + kRadius - depth) * out;
  };
  const std::vector<Way> ways{
      {"a circle", [=](double p) { return around(0.3 * cowave(p), 0.3 * wave(p), 4e-3); }},
      {"an eight, deeper at its ends",
       [=](double p) { return around(0.4 * cowave(p), 0.2 * wave(p, 2.0), 3e-3 + 2e-3 * wave(p, 2.0)); }}};
  for (const bool friction : {true, false}) {
    if (!friction) smooth.feel.static_friction = smooth.feel.dynamic_friction = 0.0;
    for (const Way& way : ways) {
      Touch touch(scene_of({smooth}, kRadius), {0.08, 0, 0});
      const Gain gain = closed_way(touch, {0.06, 0, 0}, way.at, 3, 1e-5);
      if (friction) {
        expect_no_gain(std::string("shaded and rough, ") + way.name, gain);
      } else {
        std::printf("energy, shaded, %s: the hand gains %+.4g mJ\n", way.name, 1e3 * gain.work_J);
      }
    }
  }
}

// ---- texture

// The strongest wavelength of a force over a slide of `length_m`.
struct Spectrum {
  double peak_m = 0.0,
         bin = 0.0;  // wavelength of the highest peak; the peak's distance from the wanted line in bins
};
Spectrum strongest(const std::vector<double>& force, double length_m, double wavelength_m) {
  Spectrum out;
  double most = 0.0;
  const std::size_t n = force.size();
  const double wanted = length_m / wavelength_m;
  for (std::size_t k = 1; k < n / 4; ++k) {
    double re = 0.0, im = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 2.0 * glm::pi<double>() * static_cast<double>(k * i % n) / static_cast<double>(n);
      re += force[i] * std::cos(angle);
      im += force[i] * std::sin(angle);
    }
    if (std::hypot(re, im) <= most) continue;
    most = std::hypot(re, im);
    out = {length_m / static_cast<double>(k), std::fabs(static_cast<double>(k) - wanted)};
  }
  return out;
}

class Texture : public Feel {
 protected:
  RigidDescription textured(bool image, hybrid::TextureKind kind) const {
    RigidDescription plate = rigid("plate", hybrid::BoxPrimitive{{0.2, 0.1, 0.02}}, {0, 0, -0.01});
    hybrid::TextureDescription texture;
    texture.mapping = {.kind = kind, .along = hybrid::TextureAlong::z, .size_m = 5e-3, .height_m = 4e-4};
    if (image) {  // an image of one period, bright on the left
      const int side = 64;
      std::vector<std::uint8_t> rgb;
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) rgb.insert(rgb.end(), 3, x < side / 2 ? 255 : 0);
      }
      texture.image = folder_ / "bars.png";
      hybrid::save_png(texture.image, side, side, rgb);
    }
    plate.feel.texture = texture;
    return plate;
  }
};

TEST_F(Texture, TheForceHasItsWavelength) {
  for (const bool image : {false, true}) {
    for (const auto kind : {hybrid::TextureKind::height, hybrid::TextureKind::shading}) {
      for (const bool friction : {false, true}) {
        RigidDescription plate = textured(image, kind);
        Touch touch(scene_of({friction ? rough(plate) : plate}, kRadius), {-0.06, 0, 0.02});
        touch.go({-0.06, 0.001, 1e-3}, 1e-3);
        touch.go({-0.05, 0.001, 1e-3}, 1e-4);
        std::vector<double> along, normal;
        const double length = 0.1;  // (m) 20 periods
        touch.go({-0.05 + length, 0.001, 1e-3}, 1e-4, 0, [&](const TickResult& felt) {
          along.push_back(felt.force_N.x);
          normal.push_back(felt.force_N.z);
        });
        const Spectrum sideways = strongest(along, length, 5e-3);
        std::printf("texture, %s, %s%s: strongest sideways at %.3f mm (%.1f bins off)",
                    image ? "image" : "pattern", kind == hybrid::TextureKind::height ? "height" : "shading",
                    friction ? ", rough" : "", 1e3 * sideways.peak_m, sideways.bin);
        EXPECT_LE(sideways.bin, 1.0);
        if (kind == hybrid::TextureKind::height) {
          const Spectrum up = strongest(normal, length, 5e-3);
          std::printf(", normal at %.3f mm (%.1f bins off)", 1e3 * up.peak_m, up.bin);
          EXPECT_LE(up.bin, 1.0);
        }
        std::printf("\n");
      }
    }
  }
}

TEST_F(Texture, ClosedWaysOverAFlatReliefGiveTheHandNothing) {
  for (const bool image : {false, true}) {
    for (const bool friction : {false, true}) {
      RigidDescription plate = textured(image, hybrid::TextureKind::height);
      plate.feel.texture->mapping.size_m =
          2e-3;  // (m) so fine for its height that a relief could create energy
      plate.feel.texture->mapping.height_m = 5e-4;
      if (friction) plate = rough(plate);
      for (const Way& way : ways_on_the_flat()) {
        Touch touch(scene_of({plate}, kRadius), {0, 0, 0.02});
        const Gain gain = closed_way(touch, {0, 0, 0.01}, way.at, 2, 2e-6);
        std::printf("energy, %s%s, %s: the hand gains %+.3g mJ\n", image ? "image" : "pattern",
                    friction ? ", rough" : "", way.name, 1e3 * gain.work_J);
        // Between ticks the force is not linear along the path. So the trapezoidal rule has an error of a
        // millionth of the exchanged energy. The error vanishes with the step.
        EXPECT_LE(gain.work_J, friction ? 0.0 : 1e-8);
      }
    }
  }
}

// ---- damping

TEST_F(Feel, DampingResistsTheWayInNeverPullsAndEndsWithTheMotion) {
  const double damping = 2.0, depth = 3e-3, speed = 0.1;  // units: N s/m, m, m/s
  RigidDescription plate = box();
  plate.feel.damping_N_s_per_m = damping;
  Touch touch(scene_of({plate}, kRadius), {0, 0, 0.02});
  touch.go({0, 0, kRadius + 1e-4}, 1e-3);
  Work work;
  double least = 1e9, in_error = 0.0;
  int n = 0;
  const auto look = [&](const TickResult& felt) {
    work.add(felt);
    least = std::min(least, felt.force_N.z);
    EXPECT_LE(std::hypot(felt.force_N.x, felt.force_N.y), 1e-9);
    ++n;
  };
  TickResult felt = touch.go({0, 0, kRadius - depth}, 1e-3 * speed, 0, [&](const TickResult& f) {
    look(f);
    const double d = kRadius - f.device_m.z;
    if (n > 3) in_error = std::max(in_error, std::fabs(f.force_N.z - (1e3 * d + damping * speed)));
  });
  EXPECT_LE(in_error, 1e-6) << "K d + B v while it goes in";
  int settled = 0;
  touch.go(felt.device_m, 1e-3, 30, [&](const TickResult& f) {
    look(f);
    if (std::fabs(f.force_N.z - 1e3 * depth) > 1e-9) ++settled;
  });
  EXPECT_LE(settled, 16) << "K d when it stands";
  touch.go({0, 0, 0.01}, 3e-4, 0, look);  // 0.3 m/s outward: B v > K d at the end
  EXPECT_GE(least, 0.0) << "never pulls in";
  std::printf(
      "damping: B v off by %.2g N on the way in, K d after %d ticks at rest, least force %.3g N, the hand "
      "gains %+.4g mJ\n",
      in_error, settled, least, 1e3 * work.gained_J());
  EXPECT_LE(work.gained_J(), 0.0);
}

// A sampled damper lags by half a tick. If it is shaken faster than a third of the rate, it gives energy
// instead of taking it. The tick detects this and suspends the damper (surface_feel.h), so that it gives no
// more energy.
TEST_F(Feel, DampingFeedsNoShaking) {
  RigidDescription plate = box();
  for (const double damping : {1.0, 10.0, 100.0}) {
    plate.feel.damping_N_s_per_m = damping;
    for (const double hz : {1.0, 30.0, 120.0, 330.0, 499.0}) {
      Touch touch(scene_of({plate}, kRadius), {0, 0, 0.02});
      touch.go({0, 0, kRadius - 2e-3}, 1e-4, 50);
      Work work;
      double least = 1e9, first = 0.0;
      for (int n = 0; n <= 4000; ++n) {
        const double z = kRadius - 2e-3 + 5e-4 * std::sin(2.0 * glm::pi<double>() * hz * 1e-3 * n);
        const TickResult felt = touch.at({0, 0, z});
        work.add(felt);
        least = std::min(least, felt.force_N.z);
        if (n == 1000) first = work.gained_J();
      }
      EXPECT_GE(least, 0.0);
      EXPECT_LE(work.gained_J(), first + 1e-12) << damping << " N s/m at " << hz << " Hz";
      EXPECT_LE(work.gained_J(), hz < 333.0 / 2.0 ? 0.0 : 5e-4) << damping << " N s/m at " << hz << " Hz";
    }
  }
}

// ---- everything at once

TEST_F(Texture, AllOfItAtOnceIsFiniteAtAnyTickLength) {
  for (const double dt : {1e-4, 1e-3, 1e-2}) {
    RigidDescription everything = rough(ball(2));
    everything.feel.shading = true;
    everything.feel.damping_N_s_per_m = 5.0;
    everything.feel.texture = hybrid::TextureDescription{};
    everything.feel.texture->mapping = {.size_m = 3e-3, .height_m = 5e-4};
    RigidDescription sheet = rough(rigid("sheet", hybrid::PlanePrimitive{0.2}));
    sheet.feel.damping_N_s_per_m = 5.0;
    Touch touch(scene_of({everything, sheet}, kRadius), {0, 0, 0.08});
    std::mt19937_64 random{99};
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    double most = 0.0, deepest = 0.0;
    dvec3 device(0, 0, 0.08);
    const double reach = 0.2 * std::max(dt, 1e-3);
    for (int n = 0; n < 20'000; ++n) {
      dvec3 to = device + reach * dvec3(any(random), any(random), any(random));
      if (n % 1000 == 999) to = 0.08 * dvec3(any(random), any(random), any(random));
      if (glm::length(to) > 0.08) to *= 0.08 / glm::length(to);
      device = to;
      const TickResult felt = touch.at(device, dt);
      ASSERT_TRUE(tests::finite(felt.force_N) && tests::finite(felt.proxy_m)) << n;
      most = std::max(most, glm::length(felt.force_N));
      deepest = std::max(deepest, glm::length(felt.device_m - felt.proxy_m));
      ASSERT_GE(glm::length(felt.proxy_m), 0.046) << "outside the ball, at " << n;
    }
    std::printf("everything at once, ticks of %g ms: at most %.1f N at a depth of at most %.1f mm\n",
                1e3 * dt, most, 1e3 * deepest);
    EXPECT_EQ(touch.state().nonfinite, 0U);
    EXPECT_EQ(touch.state().faults, 0U);
  }
}

}  // namespace
