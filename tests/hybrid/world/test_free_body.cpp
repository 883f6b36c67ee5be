// SPDX-License-Identifier: GPL-3.0-or-later
// Compares free bodies with closed forms, and tests extreme masses, stiffnesses and time steps.
#include "hybrid/world/free_body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <vector>

namespace {

using glm::dquat;
using glm::dvec3;
using hybrid::BodyContact;
using hybrid::FreeBody;
using hybrid::FreeBodyState;

FreeBody box_body(const dvec3& size, double mass_kg) {
  FreeBody body;
  body.mass = hybrid::with_mass(hybrid::mass_of_box(size, 1000.0), mass_kg);
  return body;
}

dvec3 random_vector(std::mt19937_64& random, double half) {
  std::uniform_real_distribution<double> u(-half, half);
  const double x = u(random), y = u(random), z = u(random);
  return {x, y, z};
}

TEST(FreeBody, FallsAsSemiImplicitEulerFalls) {
  FreeBody body = box_body(dvec3(0.02), 0.1);
  body.gravity_m_per_s2 = {0.0, 0.0, -9.81};
  FreeBodyState state;
  const double dt = 1e-3;
  const int ticks = 500;
  for (int n = 0; n < ticks; ++n) ASSERT_TRUE(step_free_body(body, state, {}, dt));
  const double t = ticks * dt;
  EXPECT_NEAR(state.velocity_m_per_s.z, -9.81 * t, 1e-12);
  // The time step gives g t (t + dt)/2, which differs from the exact solution by g t dt/2.
  EXPECT_NEAR(state.centre_m.z, -0.5 * 9.81 * t * (t + dt), 1e-12);
  EXPECT_EQ(state.rotation, dquat(1.0, 0.0, 0.0, 0.0));
}

TEST(FreeBody, DragSlowsItExponentially) {
  FreeBody body = box_body(dvec3(0.02), 0.1);
  body.drag_N_s_per_m = 0.4;  // a time constant of 0.25 s
  const double inertia = body.mass.inertia_kg_m2[0][0];
  body.angular_drag_N_m_s = inertia / 0.125;
  FreeBodyState state;
  state.velocity_m_per_s = {0.3, -0.1, 0.2};
  state.spin_rad_per_s = {0.0, 5.0, 0.0};
  const double dt = 1e-4;
  const int ticks = 5000;
  for (int n = 0; n < ticks; ++n) ASSERT_TRUE(step_free_body(body, state, {}, dt));
  const double kept = std::exp(-0.5 / 0.25);
  EXPECT_NEAR(glm::length(state.velocity_m_per_s - kept * dvec3(0.3, -0.1, 0.2)), 0.0, 1e-3 * kept);
  EXPECT_NEAR(state.spin_rad_per_s.y, 5.0 * std::exp(-0.5 / 0.125), 5e-3 * 5.0 * std::exp(-4.0));
  // The distance is v₀ m/c (1 − kept), up to an error of the order of the step.
  EXPECT_NEAR(state.centre_m.x, 0.3 * 0.25 * (1.0 - kept), 1e-4);
  // Even with very large drag, the body does not reverse.
  body.drag_N_s_per_m = 1e6;
  const double before = state.velocity_m_per_s.x;
  ASSERT_TRUE(step_free_body(body, state, {}, 0.01));
  EXPECT_GE(state.velocity_m_per_s.x, 0.0);
  EXPECT_LT(state.velocity_m_per_s.x, 1e-4 * before);
}

// A push through the centre causes no rotation. Any other push causes one in proportion to its lever arm. A
// step transfers the full momentum, however light the body is.
TEST(FreeBody, TakesTheMomentumOfWhatPushesIt) {
  std::mt19937_64 random(4);
  for (int n = 0; n < 1000; ++n) {
    const dvec3 size = glm::abs(random_vector(random, 0.05)) + 0.002;
    const FreeBody body = box_body(size, std::pow(10.0, -4.0 + 4.0 * (n % 10) / 9.0));
    FreeBodyState state;
    state.rotation = glm::normalize(dquat(1.0, random_vector(random, 1.0)));
    state.centre_m = random_vector(random, 1.0);
    BodyContact contact;
    contact.point_m = state.centre_m + state.rotation * (0.5 * size * random_vector(random, 1.0));
    contact.normal = glm::normalize(random_vector(random, 1.0));
    contact.force_N = 1e-5;
    const FreeBodyState before = state;
    const double dt = 1e-3;
    ASSERT_TRUE(step_free_body(body, state, std::span(&contact, 1), dt));
    const dvec3 impulse = dt * contact.force_N * contact.normal;
    EXPECT_LE(glm::length(body.mass.mass_kg * state.velocity_m_per_s - impulse),
              1e-12 * glm::length(impulse));
    const dvec3 turned = glm::cross(contact.point_m - before.centre_m, impulse);
    EXPECT_LE(glm::length(angular_momentum(body, state) - turned), 1e-12 * glm::length(impulse) * 0.1);
  }
}

// Without torque, momentum and energy of every shape stay constant to rounding over 20 s. This holds also for
// turns about the unstable axis.
TEST(FreeBody, TurnsByItselfWithoutLossOrGain) {
  const std::array<dvec3, 4> shapes{dvec3(0.01, 0.02, 0.05), dvec3(0.05, 0.05, 0.001),
                                    dvec3(0.001, 0.001, 0.1), dvec3(0.03)};
  for (const dvec3& size : shapes) {
    for (const double speed : {0.5, 20.0, 250.0}) {
      const FreeBody body = box_body(size, 0.05);
      FreeBodyState state;
      state.rotation = glm::normalize(dquat(0.9, 0.1, -0.3, 0.2));
      state.spin_rad_per_s = state.rotation * (speed * glm::normalize(dvec3(0.01, 1.0, 0.02)));
      const double energy = kinetic_energy_J(body, state);
      const dvec3 momentum = angular_momentum(body, state);
      double drift = 0.0, turned = 0.0;
      for (int n = 0; n < 20'000; ++n) {
        ASSERT_TRUE(step_free_body(body, state, {}, 1e-3));
        drift = std::max(drift, std::fabs(kinetic_energy_J(body, state) / energy - 1.0));
        turned = std::max(turned, glm::length(angular_momentum(body, state) - momentum));
      }
      EXPECT_LE(drift, 1e-9) << size.x << " " << speed;
      EXPECT_LE(turned, 1e-9 * glm::length(momentum)) << size.x << " " << speed;
      EXPECT_NEAR(glm::length(state.rotation), 1.0, 1e-14);
    }
  }
}

// A symmetric top precesses about its momentum at the rate |L| / I.
TEST(FreeBody, PrecessesAtTheRateOfTheTop) {
  const FreeBody body = box_body({0.02, 0.02, 0.06}, 0.1);
  const double across = body.mass.inertia_kg_m2[0][0];
  FreeBodyState state;
  state.spin_rad_per_s = {3.0, 0.0, 8.0};
  const dvec3 momentum = angular_momentum(body, state), pole = glm::normalize(momentum);
  const double rate = glm::length(momentum) / across, seconds = 1.0, dt = 1e-4;
  const dvec3 axis = {0.0, 0.0, 1.0};
  for (int n = 0; n < 10'000; ++n) ASSERT_TRUE(step_free_body(body, state, {}, dt));
  const dvec3 expected = glm::angleAxis(rate * seconds, pole) * axis;
  EXPECT_LE(glm::distance(state.rotation * axis, expected), 1e-5);
}

// A springy floor. It pushes each corner of a body that is below the floor, and never pulls.
struct Springs {
  dvec3 half_size{0.005};
  double floor_m = 0.0;  // z
  double stiffness_N_per_m = 25e3;

  [[nodiscard]] double energy_J(const FreeBodyState& state, std::vector<BodyContact>* contacts) const {
    double energy = 0.0;
    if (contacts != nullptr) contacts->clear();
    for (int c = 0; c < 8; ++c) {
      const dvec3 corner =
          state.centre_m + state.rotation * (half_size * dvec3((c & 1) != 0 ? 1 : -1, (c & 2) != 0 ? 1 : -1,
                                                               (c & 4) != 0 ? 1 : -1));
      const double depth = floor_m - corner.z;
      energy += 0.5 * stiffness_N_per_m * std::max(depth, 0.0) * std::max(depth, 0.0);
      if (contacts != nullptr)
        contacts->push_back({corner, {0.0, 0.0, 1.0}, stiffness_N_per_m * depth, stiffness_N_per_m});
    }
    return energy;
  }
};

// A body of 0.1 g on 25 kN/m has a resonance of 2.5 kHz, far above what a step can resolve. The contacts push
// through the centre of mass, so energy must never grow beyond rounding.
TEST(FreeBody, StiffContactsNeverGiveALightBodyEnergy) {
  std::mt19937_64 random(8);
  const FreeBody body = box_body(dvec3(0.01), 1e-4);
  for (const double dt : {1e-4, 1e-3, 1e-2}) {
    for (const double k : {2.5, 25.0, 2.5e3, 25e3, 1e7}) {
      for (int start = 0; start < 40; ++start) {
        // Three springy walls around the body overlap, so that it always touches at least one.
        const std::array<dvec3, 3> walls{dvec3(1, 0, 0), glm::normalize(dvec3(-1, 1, 0.2)),
                                         glm::normalize(dvec3(-0.2, -1, -1))};
        FreeBodyState state;
        state.centre_m = random_vector(random, 1e-3);
        state.velocity_m_per_s = random_vector(random, 0.2);
        std::vector<BodyContact> contacts;
        const auto energy_now = [&] {
          double energy = kinetic_energy_J(body, state);
          contacts.clear();
          for (const dvec3& n : walls) {
            const double depth = 2e-4 - glm::dot(n, state.centre_m);
            energy += 0.5 * k * std::max(depth, 0.0) * std::max(depth, 0.0);
            contacts.push_back({state.centre_m, n, k * depth, k});
          }
          return energy;
        };
        double energy = energy_now();
        for (int n = 0; n < 1000; ++n) {
          ASSERT_TRUE(step_free_body(body, state, contacts, dt));
          const double now = energy_now();
          ASSERT_LE(now, energy * (1.0 + 1e-12)) << "dt " << dt << ", k " << k << ", tick " << n;
          energy = now;
        }
      }
    }
  }
}

// A body that hits with its corners also rotates. A corner moves along an arc, which the step approximates by
// a line. The error is of second order in the rotation of one tick. Energy may vary by that much, and the
// body must still come to rest.
TEST(FreeBody, StiffContactsAtCornersNeverMakeALightBodyFly) {
  std::mt19937_64 random(8);
  for (const double dt : {1e-4, 1e-3, 1e-2}) {
    for (const double stiffness : {25.0, 2.5e3, 25e3, 1e7}) {
      double worst = 0.0;  // relative to the initial energy
      for (int start = 0; start < 40; ++start) {
        const FreeBody body = [] {
          FreeBody b = box_body(dvec3(0.01), 1e-4);
          b.gravity_m_per_s2 = {0.0, 0.0, -9.81};
          return b;
        }();
        Springs springs;
        springs.stiffness_N_per_m = stiffness;
        FreeBodyState state;
        state.rotation = glm::normalize(dquat(1.0, random_vector(random, 1.0)));
        state.centre_m = {0.0, 0.0, 0.0085 + 0.004 * (start % 5) / 5.0};
        state.velocity_m_per_s = random_vector(random, 0.2);
        state.spin_rad_per_s = random_vector(random, 5.0);
        std::vector<BodyContact> contacts;
        const auto total = [&] {
          const double lifted = body.mass.mass_kg * 9.81 * (state.centre_m.z + 0.05);
          return springs.energy_J(state, &contacts) + kinetic_energy_J(body, state) + lifted;
        };
        const double first = total();
        for (int n = 0; n < 3000; ++n) {
          ASSERT_TRUE(step_free_body(body, state, contacts, dt));
          worst = std::max(worst, total() / first);
        }
      }
      // Only at four hundred times the stiffness of a rigid contact does the error of the arc show.
      EXPECT_LE(worst, stiffness > 25e3 ? 1.03 : 1.0) << "dt " << dt << ", k " << stiffness;
    }
  }
}

// A body on a springy contact comes to rest at the depth where the contact force and gravity balance, for any
// time step.
TEST(FreeBody, RestsWhereForcesBalance) {
  for (const double dt : {1e-4, 1e-3, 1e-2}) {
    const FreeBody body = [] {
      FreeBody b = box_body(dvec3(0.01), 1e-4);
      b.gravity_m_per_s2 = {0.0, 0.0, -9.81};
      b.drag_N_s_per_m = 0.02;
      return b;
    }();
    const double k = 25e3;
    FreeBodyState state;
    state.centre_m = {0.0, 0.0, 1e-4};
    for (int n = 0; n < 20'000; ++n) {
      const double depth = -state.centre_m.z;
      const BodyContact contact{state.centre_m, {0, 0, 1}, k * depth, k};
      ASSERT_TRUE(step_free_body(body, state, std::span(&contact, 1), dt));
    }
    EXPECT_NEAR(state.centre_m.z, -1e-4 * 9.81 / k, 1e-3 * 1e-4 * 9.81 / k + 1e-12) << dt;
    EXPECT_LE(glm::length(state.velocity_m_per_s), 1e-9);
  }
}

// Contacts push and never pull, so a contact does not slow down a body that leaves it.
TEST(FreeBody, ContactsLetGo) {
  const FreeBody body = box_body(dvec3(0.01), 1e-3);
  FreeBodyState state;
  state.velocity_m_per_s = {0.0, 0.0, 1.0};
  const BodyContact contact{{0, 0, -0.005}, {0, 0, 1}, 1e-3, 25e3};  // 40 nm deep
  ASSERT_TRUE(step_free_body(body, state, std::span(&contact, 1), 1e-3));
  EXPECT_NEAR(state.velocity_m_per_s.z, 1.0, 1e-9);
  // The same contact stops a body that approaches.
  state = {};
  state.velocity_m_per_s = {0.0, 0.0, -1.0};
  ASSERT_TRUE(step_free_body(body, state, std::span(&contact, 1), 1e-3));
  EXPECT_NEAR(state.velocity_m_per_s.z, 0.0, 0.05);
}

TEST(FreeBody, IsBoundedWhateverPushesIt) {
  std::mt19937_64 random(15);
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  const std::array<double, 9> odd{0.0, 1e-300, 1e-3, 1.0, 1e6, 1e150, 1e300, inf, nan};
  const FreeBody body = box_body({0.01, 0.02, 0.03}, 1e-4);
  FreeBodyState state;
  std::array<BodyContact, 100> contacts;
  int refused = 0;
  for (int n = 0; n < 20'000; ++n) {
    const auto pick = [&] { return odd[static_cast<std::size_t>(random()) % (n % 2 == 0 ? odd.size() : 5)]; };
    for (BodyContact& c : contacts) {
      c = {random_vector(random, 1.0), glm::normalize(random_vector(random, 1.0)), pick(), pick()};
    }
    const std::size_t used = static_cast<std::size_t>(random()) % contacts.size();
    const double dt = n % 50 == 0 ? pick() : 1e-3;
    refused += step_free_body(body, state, std::span(contacts).first(used), dt) ? 0 : 1;
    ASSERT_TRUE(std::isfinite(glm::length(state.centre_m))) << n;
    ASSERT_LE(glm::length(state.velocity_m_per_s), body.max_speed_m_per_s * (1.0 + 1e-12));
    ASSERT_LE(glm::length(state.spin_rad_per_s), body.max_spin_rad_per_s * (1.0 + 1e-9) * 30.0);
    ASSERT_NEAR(glm::length(state.rotation), 1.0, 1e-12);
  }
  EXPECT_GT(refused, 1000) << "what is not finite is told apart";
}

TEST(FreeBody, PoseAndStateAreTheSame) {
  FreeBody body = box_body({0.01, 0.02, 0.03}, 0.1);
  body.mass.centre_m = {0.004, -0.01, 0.002};
  const hybrid::Pose pose{{0.1, 0.2, 0.3}, glm::normalize(dquat(0.3, 0.5, -0.2, 0.7))};
  const FreeBodyState state = state_at(body, pose);
  const hybrid::Pose back = pose_of(body, state);
  EXPECT_LE(glm::distance(back.position_m, pose.position_m), 1e-16);
  EXPECT_LE(glm::distance(state.centre_m, pose.position_m + pose.rotation * body.mass.centre_m), 1e-16);
}

}  // namespace
