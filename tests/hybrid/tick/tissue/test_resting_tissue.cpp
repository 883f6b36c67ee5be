// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue that rests on bone, in a whole session with asynchronous relaxation: a brain in its skull, pressed
// until its chain is tight and then released. Resting tissue must stay at rest, and tissue that came down on
// bone must stay outside it.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <vector>

#include "hybrid/session/clearance.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

struct Course {
  std::vector<double> force_N;  // [tick] coupling force
  std::vector<double> gap_m;    // [tick / kEvery] between brain and skull, negative if they overlap
  double cell_m = 0.0;
};
constexpr std::size_t kEvery = 5;

Course session() {
  const hybrid::Scene scene =
      hybrid::load_scene(std::filesystem::path(HYBRID_SOURCE_DIR) / "scenes" / "head.toml");
  const auto path = hybrid::scene_path(scene);
  tests::Touch touch(scene, path->position(0.0), true);
  Course course;
  course.cell_m = touch.state().soft[0]->lattice().min_spacing_m();
  for (std::size_t n = 0; static_cast<double>(n) * 1e-3 < path->duration_s(); ++n) {
    const hybrid::TickResult felt = touch.at(path->position(static_cast<double>(n) * 1e-3));
    course.force_N.push_back(glm::length(tests::coupling(felt)));
    if (n % kEvery == 0) course.gap_m.push_back(hybrid::clearance(touch.world(), touch.state()).rigid_m);
  }
  return course;
}

TEST(RestingTissue, ABrainStaysOutsideItsSkullAndComesToRest) {
  const Course course = session();
  const double cell = course.cell_m;
  const auto gap_from = [&](double t_s) {
    return course.gap_m.begin() + static_cast<std::ptrdiff_t>(t_s * 1e3 / static_cast<double>(kEvery));
  };
  const double deepest = *std::min_element(course.gap_m.begin(), course.gap_m.end());
  std::cout << "overlap with the skull at most " << -100.0 * deepest / cell << " % of a cell\n";
  EXPECT_GT(deepest, -0.05 * cell);

  // The tool is away from 3.4 s on. The brain then rises off the skull. Its gap to the skull may only grow,
  // because it must not oscillate.
  double falls = 0.0, highest = *gap_from(3.6);
  for (auto gap = gap_from(3.6); gap != course.gap_m.end(); ++gap) {
    highest = std::max(highest, *gap);
    falls = std::max(falls, highest - *gap);
  }
  EXPECT_LT(falls, 0.01 * cell);
  EXPECT_NEAR(course.gap_m.back(), course.gap_m.front(), 0.02 * cell);

  // While the tool is held at the depth of its first press, the force hardly changes from tick to tick.
  double step = 0.0;
  for (std::size_t n = 900; n < 1040; ++n)
    step = std::max(step, std::fabs(course.force_N[n] - course.force_N[n - 1]));
  // Soon after the tool stopped, asynchronous results still arrive. Each result is applied in parts, and no
  // part changes the force noticeably (by more than 7 %).
  double result = 0.0;
  for (std::size_t n = 700; n < 1040; ++n)
    result = std::max(result, std::fabs(course.force_N[n] - course.force_N[n - 1]));
  std::cout << "with results: " << 1e3 * result << " mN\n";
  EXPECT_LT(result, 0.07 * course.force_N[1000]);
  std::cout << "steps while held: " << 1e3 * step << " mN of " << 1e3 * course.force_N[1000] << '\n';
  EXPECT_LT(step, 1e-3);
}

}  // namespace
