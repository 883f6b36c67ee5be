// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes from real data: bones and organs of a CT, and published meshes, both good and damaged.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <sstream>
#include <vector>

#include "polygon/files/mesh_file.h"

#include "tests/hybrid/fixtures/touch.h"
#include "tests/shared_data.h"

namespace {

using glm::dvec3;
using hybrid::TickResult;
using tests::Touch;

// ---- organs and bones

class Abdomen : public tests::SceneFile {
 protected:
  // `bones` and `organs` are label numbers of totalsegmentator_v2_ct_labels.csv.
  hybrid::Scene scene(const std::string& bones, const std::string& organs) const {
    const auto labels = (tests::shared_data("data/volumes") / "ts_ct_abdomen_3mm_labels.nii.gz").string();
    std::ostringstream text;
    text << "format = 1\n[tool]\nradius = 6\nstiffness = 800\n[material.organ]\nyoung = 4000\npoisson = 0.4\n"
         << "[[rigid]]\nname = \"bones\"\nvolume = \"" << labels << "\"\nlabels = " << bones
         << "\nlargest = false\n"
         << "[[soft]]\nname = \"organ\"\nvolume = \"" << labels << "\"\nlabels = " << organs
         << "\nmaterial = \"organ\"\nanchors = { faces = [\"-z\"], rigid_within = 5 }\n"
         << "[path]\nkind = \"press\"\nfrom = [0, 0, 5000]\nto = [0, 0, 4990]\n";
    return load(text.str());
  }
};

// The vertex of a surface that is furthest along a direction. No part of the object is in front of it.
dvec3 outermost(const polygon::TriangleMesh& mesh, const auto& to_scene, const dvec3& direction) {
  dvec3 best = to_scene(mesh.vertices.front());
  for (const dvec3& v : mesh.vertices) {
    if (glm::dot(to_scene(v), direction) > glm::dot(best, direction)) best = to_scene(v);
  }
  return best;
}

TEST_F(Abdomen, BonesAndOrgansOfACtAreFeltBoth) {
  SKIP_WITHOUT(tests::shared_data("data/volumes"));
  struct Case {
    const char *name, *bones, *organs;
  };
  for (const Case& c :
       {Case{"vertebrae L1 to L5 and the liver", "[27, 28, 29, 30, 31]", "[5]"},
        Case{"right ribs 8 to 12, liver and right kidney", "[111, 112, 113, 114, 115]", "[2, 5]"},
        Case{"sacrum and hips, and the bladder", "[25, 77, 78]", "[21]"}}) {
    SCOPED_TRACE(c.name);
    Touch touch(scene(c.bones, c.organs), {0, 0, 5});
    const auto& bone = touch.world().rigid.at(0);
    const auto& organ = touch.world().soft.at(0);
    std::uint32_t contacts = 0;
    double most = 0.0;
    std::uint64_t in_free_space = 0;
    const auto look = [&](const TickResult& felt) {
      ASSERT_TRUE(tests::finite(felt.force_N) && tests::finite(felt.proxy_m));
      contacts |= felt.contacts;
      most = std::max(most, glm::length(felt.force_N));
      if (felt.contacts == 0) {
        ++in_free_space;
        ASSERT_LE(glm::length(felt.proxy_m - felt.device_m), 1e-9);
      }
    };
    // From the left and from the front, the tool moves towards the outermost point of each object, 4 mm deep,
    // and out again.
    for (const dvec3& direction : {dvec3(1, 0, 0), dvec3(0, -1, 0)}) {
      for (const dvec3& at :
           {outermost(
                *bone.drawn, [&](const dvec3& v) { return bone.to_scene(v); }, direction),
            outermost(
                organ.drawn, [&](const dvec3& v) { return organ.to_scene(v); }, direction)}) {
        touch.go({5, 5, 5}, 10.0);
        touch.go(at + 1.0 * direction, 10.0);
        touch.go(at + 0.02 * direction, 0.05, 40);  // in free space, wherever the proxy is
        touch.go(at + 0.002 * direction, 4e-4, 30, look);
        touch.go(at + 0.02 * direction, 4e-4, 20, look);
      }
    }
    EXPECT_EQ(contacts, 3U) << "both are felt";
    EXPECT_GT(in_free_space, 0U);
    EXPECT_LE(most, touch.world().limits.max_force_N);
    EXPECT_EQ(touch.state().nonfinite, 0U);
    EXPECT_EQ(touch.state().faults, 0U);
    EXPECT_TRUE(touch.state().map.validate());
  }
}

// ---- meshes

class Meshes : public tests::SceneFile {
 protected:
  static std::vector<std::filesystem::path> files(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> all;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      if (entry.is_regular_file()) all.push_back(entry.path());
    }
    std::sort(all.begin(), all.end());
    return all;
  }

  // Does a stroke of 200 ticks from above to the middle of the mesh. The mesh is a rigid object with a
  // longest side of 0.2 m.
  static void stroke(const std::filesystem::path& file) {
    const auto mesh = polygon::load_mesh(file).mesh;
    dvec3 low(1e300), high(-1e300);
    for (const auto& t : mesh.triangles) {
      for (const std::uint32_t v : t) {
        low = glm::min(low, mesh.vertices[v]);
        high = glm::max(high, mesh.vertices[v]);
      }
    }
    const dvec3 size = high - low;
    const double unit = 0.2 / std::max({size.x, size.y, size.z});
    hybrid::Scene scene;
    scene.file = file;
    scene.rigid.push_back({.name = "mesh",
                           .source = hybrid::MeshSource{.file = file, .unit_m = unit},
                           .pose = {},
                           .place = {},
                           .source_place = {}});
    const dvec3 middle = 0.5 * unit * (low + high);
    const dvec3 start(middle.x, middle.y, unit * high.z + 0.02);
    Touch touch(scene, start);
    const double step = glm::length(start - middle) / 150.0;
    std::uint64_t truncated = touch.state().truncated_ticks;
    touch.go(middle, step, 50, [&](const TickResult& felt) {
      ASSERT_TRUE(tests::finite(felt.force_N) && tests::finite(felt.proxy_m));
      ASSERT_LE(glm::length(felt.force_N), touch.world().limits.max_force_N * (1.0 + 1e-12));
      // The proxy minimises the distance to the device. So it is never further away than at the start.
      ASSERT_LE(glm::length(felt.proxy_m - felt.device_m), glm::length(start - middle) + 1e-3);
      // In free space the proxy is at the device, unless the bound on work ended its sweep in this tick.
      const bool is_truncated = touch.state().truncated_ticks > truncated;
      truncated = touch.state().truncated_ticks;
      if (felt.contacts == 0 && !is_truncated) {
        ASSERT_LE(glm::length(felt.proxy_m - felt.device_m), 1e-9);
      }
    });
    EXPECT_EQ(touch.state().nonfinite, 0U);
    EXPECT_EQ(touch.state().faults & ~static_cast<std::uint32_t>(hybrid::fault_triangle_overflow), 0U);
    if (touch.state().faults != 0)
      std::printf("faults of %s: %u\n", file.filename().c_str(), touch.state().faults);
  }
};

TEST_F(Meshes, OfRealObjectsAreTouched) {
  const auto folder = tests::shared_data("data/meshes");
  SKIP_WITHOUT(folder);
  for (const auto& file : files(folder)) {
    SCOPED_TRACE(file.filename());
    ASSERT_NO_THROW(stroke(file));
  }
}

TEST_F(Meshes, ThatAreBadAreTouchedOrRefusedInWords) {
  const auto folder = tests::shared_data("data/meshes_bad");
  SKIP_WITHOUT(folder);
  int touched = 0, refused = 0;
  for (const auto& file : files(folder)) {
    SCOPED_TRACE(file.filename());
    try {
      stroke(file);
      ++touched;
      continue;
    } catch (const polygon::MeshError& error) {
      EXPECT_GT(std::string(error.what()).size(), 20U);
    }
    // A mesh that the loader refuses is also refused in a scene, with its place.
    hybrid::Scene scene;
    scene.file = "scene.toml";
    scene.rigid.push_back({.name = "mesh",
                           .source = hybrid::MeshSource{.file = file},
                           .pose = {},
                           .place = {},
                           .source_place = {7, 3}});
    try {
      (void)hybrid::build_scene(scene);
      ADD_FAILURE() << "not refused";
    } catch (const hybrid::SceneError& error) {
      EXPECT_NE(std::string(error.what()).find("scene.toml:7:3"), std::string::npos) << error.what();
      ++refused;
    }
  }
  EXPECT_GE(touched, 15);
  EXPECT_GE(refused, 1);
}

}  // namespace
