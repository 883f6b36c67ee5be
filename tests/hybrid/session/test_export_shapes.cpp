// SPDX-License-Identifier: GPL-3.0-or-later
// The files that a session writes for other programs are read back. The effect of thinning on a scene is
// tested too.
#include "hybrid/session/export_shapes.h"

#include <array>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>

#include "hybrid/session/session.h"
#include "polygon/files/mesh_file.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "voxel/volume/read_volume.h"
#include "voxel/volume/write_volume.h"

namespace {

namespace fs = std::filesystem;

class SavedShapes : public tests::SceneFile {
 protected:
  [[nodiscard]] fs::path in_folder(const std::string& name) const { return folder_ / name; }
};

// The vectors (m) of an unpacked NIfTI file of this project. It has three volumes of floats in mm after 352
// bytes.
std::vector<glm::dvec3> read_vectors(const fs::path& file, std::size_t voxels) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  EXPECT_EQ(bytes.size(), 352 + 12 * voxels);
  std::vector<glm::dvec3> out(voxels, glm::dvec3(0.0));
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t n = 0; n < voxels; ++n) {
      float value = 0.0F;
      std::memcpy(&value, &bytes[352 + 4 * (c * voxels + n)], 4);
      out[n][static_cast<int>(c)] = 1e-3 * static_cast<double>(value);
    }
  }
  return out;
}

const std::string kHeld =
    "[path]\nkind = \"waypoints\"\nspeed = 400\npoints = [[0, 0, 12], [0, 0, 4, 1]]\n[device]\nmodel = "
    "\"ideal\"\n[tool]\nradius = 4\n";

TEST_F(SavedShapes, AtRestTheFieldIsZeroAndTheLabelsAreTheVolumes) {
  voxel::LabelVolume volume;
  volume.dims = {8, 7, 6};
  volume.spacing_m = {2e-3, 1e-3, 1.5e-3};
  volume.origin_m = {0.03, -0.02, 0.01};
  volume.rotation = glm::normalize(glm::dquat(0.9, 0.2, 0.1, -0.3));
  for (std::size_t n = 0; n < 8 * 7 * 6; ++n) volume.labels.push_back(static_cast<std::uint8_t>(1 + n % 3));
  voxel::save_volume(in_folder("v.nrrd"), volume);
  const hybrid::Scene scene = load(
      "format = 1\n[[soft]]\nname = \"v\"\nvolume = \"v.nrrd\"\nposition = [50, 60, 70]\nrotation = [10, 20, "
      "30]\n" +
      tests::path);
  const hybrid::BuiltScene built = hybrid::build_scene(scene, {});
  const auto names = hybrid::save_volumes(in_folder("out.nii"), scene, built);
  ASSERT_EQ(names, (std::vector<fs::path>{in_folder("out.nii"), in_folder("out-labels.nii")}));
  for (const glm::dvec3& u : read_vectors(names[0], volume.labels.size())) EXPECT_EQ(u, glm::dvec3(0.0));
  // Labels are written on the volume of the object's source, independent of the object's pose in the scene.
  const voxel::LabelVolume back = voxel::load_volume(names[1], {});
  EXPECT_EQ(back.dims, volume.dims);
  EXPECT_EQ(back.labels, volume.labels);
  EXPECT_LT(glm::distance(back.origin_m, volume.origin_m), 1e-7);
  EXPECT_NEAR(std::abs(glm::dot(back.rotation, volume.rotation)), 1.0, 1e-6);
}

TEST_F(SavedShapes, APressedObjectIsSavedAsItIs) {
  for (const char* turn : {"[0, 0, 0]", "[0, 0, 90]"}) {
    const hybrid::Scene scene = load(
        std::string("format = 1\n").append(tests::block).append("rotation = ").append(turn).append("\n") +
        kHeld);
    hybrid::BuiltScene built = hybrid::build_scene(scene, {});
    hybrid::run_session(scene, built, {.seconds = 0.1, .progress = {}});
    const auto names = hybrid::save_volumes(in_folder("out.nii"), scene, built);
    const auto field = read_vectors(names[0], 10 * 10 * 5);
    const voxel::SoftObject& object = *built.state->soft[0];
    double deepest = 0.0;
    for (std::size_t n = 0; n < field.size(); ++n) {
      const std::array<std::size_t, 3> at{n % 10, n / 10 % 10, n / 100};
      const glm::dvec3 rest = 2e-3 * glm::dvec3(at[0], at[1], at[2]);
      EXPECT_LT(glm::distance(field[n], object.displacement_at(rest)),
                1e-8);  // vectors are in the object's frame
      deepest = std::min(deepest, field[n].z);
    }
    EXPECT_LT(deepest, -2e-3);  // 5 mm deep into voxels of 2 mm
    const voxel::LabelVolume labels = voxel::load_volume(names[1], {});
    EXPECT_EQ(labels.labels[labels.index(0, 0, 0)], 1);
    // At the tool, in the middle of the top, there is no longer any tissue.
    const glm::dvec3 top(0.0, 0.0, 4.5e-3);
    const glm::dvec3 c = glm::round((top - labels.origin_m) / labels.spacing_m);
    const int k = static_cast<int>(c.z);
    if (k < labels.dims[2]) {
      EXPECT_EQ(labels.labels[labels.index(static_cast<int>(c.x), static_cast<int>(c.y), k)], 0);
    }
  }
}

TEST_F(SavedShapes, SeveralObjectsHaveFilesOfTheirOwn) {
  const hybrid::Scene scene =
      load("format = 1\n" + tests::block +
           "[[soft]]\nname = \"a/b c\"\nformula = \"ball\"\nsize = 10\nspacing = 1\nposition = [40, 0, 0]\n" +
           tests::path);
  EXPECT_EQ(hybrid::saved_volume_names("x/out.nii.gz", scene),
            (std::vector<fs::path>{"x/out-block.nii.gz", "x/out-block-labels.nii.gz", "x/out-a_b_c.nii.gz",
                                   "x/out-a_b_c-labels.nii.gz"}));
  EXPECT_THROW(hybrid::saved_volume_names("x/out.png", scene), voxel::VolumeError);
  const hybrid::Scene rigid = load("format = 1\n" + tests::ball + tests::path);
  EXPECT_THROW(hybrid::saved_volume_names("x/out.nii", rigid), std::runtime_error);
}

TEST_F(SavedShapes, SurfacesHoldEveryObjectWhereItIs) {
  const hybrid::Scene scene =
      load("format = 1\n" + tests::block + tests::ball + "position = [0, 30, 0]\n" + kHeld);
  hybrid::BuiltScene built = hybrid::build_scene(scene, {});
  const auto save = [&](const char* name) {
    hybrid::save_surfaces(in_folder(name), built);
    return polygon::load_mesh(in_folder(name), {}).mesh;
  };
  const auto before = save("before.ply");
  hybrid::run_session(scene, built, {.seconds = 0.1, .progress = {}});
  const auto after = save("after.ply");
  const std::size_t of_ball = built.world->rigid[0].drawn->vertices.size();
  EXPECT_EQ(before.vertices.size(), of_ball + built.world->soft[0].drawn.vertices.size());
  ASSERT_EQ(after.vertices.size(), before.vertices.size());
  EXPECT_EQ(after.triangles.size(),
            built.world->rigid[0].drawn->triangles.size() + built.world->soft[0].drawn.triangles.size());
  double dent = 0.0;
  for (std::size_t v = 0; v < before.vertices.size(); ++v) {
    const double moved = glm::distance(before.vertices[v], after.vertices[v]);
    if (v < of_ball) {
      EXPECT_NEAR(glm::distance(after.vertices[v], glm::dvec3(0.0, 0.03, 0.0)), 4e-3, 1e-6);
    } else {
      dent = std::max(dent, moved);
    }
  }
  EXPECT_GT(dent, 2e-3);
  // STL and OBJ files are in millimeters, the unit in which scenes read them.
  for (const char* name : {"after.stl", "AFTER.OBJ"}) {
    hybrid::save_surfaces(in_folder(name), built);
    const polygon::TriangleMesh in_mm = polygon::load_mesh(in_folder(name), {.scale = 1e-3}).mesh;
    ASSERT_EQ(in_mm.vertices.size(), after.vertices.size()) << name;
    EXPECT_EQ(in_mm.triangles.size(), after.triangles.size()) << name;
  }
}

// ---- thinning

const std::string kBone =
    "format = 1\n[material.bone]\nyoung = 1e6\n[[soft]]\nname = \"leg\"\nformula = \"block\"\nsize = 40\n"
    "spacing = 1\ninclusions = [{ shape = \"box\", size = 30, label = 2 }]\nmaterials = { \"2\" = \"bone\" "
    "}\n";

TEST_F(SavedShapes, ThinnedObjectsKeepLabelsAnchorsAndMaterials) {
  const hybrid::Scene scene = load(
      kBone + "anchors = { labels = [2] }\nthinning = { above = 1e5, every = 4, shell = 1 }\n" + tests::path);
  const hybrid::BuiltScene built = hybrid::build_scene(scene, {});
  const voxel::Lattice& lattice = built.state->soft[0]->lattice();
  // Inside the shell, the bone has voxels 6 to 33 on each axis. A voxel remains as a strut if two of its
  // coordinates are multiples of 4. In the outermost layers of the inside (coordinate 6 or 33), one other
  // coordinate is enough.
  const std::size_t inside = 28;
  std::size_t frame = 0;
  for (int k = 6; k <= 33; ++k) {
    for (int j = 6; j <= 33; ++j) {
      for (int i = 6; i <= 33; ++i) {
        const auto on = [](int c) { return c % 4 == 0; };
        const auto outermost = [](int c) { return c == 6 || c == 33; };
        const bool strut = (on(i) && on(j)) || (on(j) && on(k)) || (on(k) && on(i));
        const bool line = (outermost(i) && (on(j) || on(k))) || (outermost(j) && (on(k) || on(i))) ||
                          (outermost(k) && (on(i) || on(j)));
        frame += strut || line ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(built.world->soft[0].thinned, inside * inside * inside - frame);
  EXPECT_EQ(lattice.voxel_count(), 64000 - built.world->soft[0].thinned);
  // The shell and its struts are anchored like the bone.
  EXPECT_EQ(lattice.anchored_count(), 27000 - built.world->soft[0].thinned);
  ASSERT_FALSE(built.notes.empty());
  EXPECT_NE(built.notes[0].text.find("thinning left out"), std::string::npos);
  const auto names = hybrid::save_volumes(in_folder("out.nii"), scene, built);
  const voxel::LabelVolume labels = voxel::load_volume(names[1], {});
  for (const std::uint8_t label : labels.labels) EXPECT_LE(label, 2);
}

TEST_F(SavedShapes, ThinningThatCannotBeIsRefusedAtItsPlace) {
  const auto said = [&](const std::string& thinning, const std::string& more = "") {
    const std::string text = kBone + "thinning = " + thinning + "\n" + tests::path + more;
    try {
      hybrid::build_scene(load(text), {});
    } catch (const hybrid::SceneError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(said("{ labels = [2] }"), "");
  EXPECT_NE(said("{ labels = [3] }").find("has label 3"), std::string::npos);
  EXPECT_NE(said("{ }").find("in one way"), std::string::npos);
  EXPECT_NE(said("{ labels = [2], above = 1e5 }").find("in one way"), std::string::npos);
  EXPECT_NE(said("{ labels = [2], every = 1 }").find("every"), std::string::npos);
  EXPECT_NE(said("{ lables = [2] }").find("did you mean 'labels'"), std::string::npos);
  EXPECT_NE(said("{ above = 1e9 }").find("scene.toml:11:1"), std::string::npos) << said("{ above = 1e9 }");
  EXPECT_NE(said("{ labels = [2] }", "[tool]\nradius = 0.1\n").find("fits between"), std::string::npos);
}

}  // namespace
