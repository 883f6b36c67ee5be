// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid surfaces of volume files. The surface of an intensity range lies where the scan passes an end of the
// range. A surface of labels follows the voxels.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <string>

#include "hybrid/build/build_objects.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using tests::some_path;
using tests::unlimited;

constexpr int kVoxels = 20;
constexpr double kSpacing_mm = 2.0;
const glm::dvec3 kBallMiddle_mm(19.4, 18.7, 19.1);

class VolumeSurface : public tests::SceneFile {
 protected:
  // A ball whose intensity is 300 at the radius, and rises by 200 per mm inward up to 1000.
  void write_ball(double radius_mm) const {
    std::string text = fmt::format(
        "NRRD0004\ntype: int16\ndimension: 3\nspace: left-posterior-superior\nsizes: {0} {0} {0}\n"
        "space directions: ({1},0,0) (0,{1},0) (0,0,{1})\nspace origin: (0,0,0)\nencoding: ascii\n\n",
        kVoxels, kSpacing_mm);
    for (int n = 0; n < kVoxels * kVoxels * kVoxels; ++n) {
      const glm::dvec3 p(n % kVoxels, n / kVoxels % kVoxels, n / (kVoxels * kVoxels));
      const double depth_mm = radius_mm - glm::length(kSpacing_mm * p - kBallMiddle_mm);
      text += fmt::format("{}\n", std::lround(std::clamp(300.0 + 200.0 * depth_mm, -500.0, 1000.0)));
    }
    write("ball.nrrd", text);
  }
  // Root mean square of the distance from the ball's surface, in spacings.
  double rms_off(const std::string& keys, double radius_mm) const {
    const hybrid::Scene scene =
        load("format = 1\n" + unlimited + "[[rigid]]\nname = \"ball\"\nvolume = \"ball.nrrd\"\n" + keys +
             some_path);
    std::vector<hybrid::BuildNote> notes;
    const hybrid::RigidObject ball = hybrid::build_rigid(scene.rigid.at(0), notes);
    double sum = 0.0;
    for (const glm::dvec3& vertex : ball.drawn->vertices) {
      const glm::dvec3 p_mm = 1e3 * (ball.pose.position_m + ball.pose.rotation * vertex);
      const double off = (glm::length(p_mm - kBallMiddle_mm) - radius_mm) / kSpacing_mm;
      sum += off * off;
    }
    return std::sqrt(sum / static_cast<double>(ball.drawn->vertices.size()));
  }
};

TEST_F(VolumeSurface, OfARangeIsWithinATenthOfASpacing) {
  for (const double radius_mm : {9.3, 14.8}) {
    write_ball(radius_mm);
    EXPECT_LT(rms_off("range = [300, 3000]\n", radius_mm), 0.1) << radius_mm;
    EXPECT_LT(rms_off("range = [300, 3000]\nsmooth = 0\n", radius_mm), 0.1) << radius_mm;
    // A surface that is grown by half a spacing follows the voxels, not the intensities. It still lies near
    // the larger ball.
    EXPECT_LT(rms_off("range = [300, 3000]\ngrow = 1\n", radius_mm + 1.0), 0.6) << radius_mm;
  }
}

// Another threshold gives another surface. The intensity reaches 500 one millimeter further in.
TEST_F(VolumeSurface, FollowsTheThreshold) {
  write_ball(14.8);
  EXPECT_LT(rms_off("range = [500, 3000]\n", 13.8), 0.1);
  EXPECT_LT(rms_off("range = [200, 3000]\n", 15.3), 0.1);
}

}  // namespace
