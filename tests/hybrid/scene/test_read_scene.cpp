// SPDX-License-Identifier: GPL-3.0-or-later
// The values of a scene file get into the Scene in SI units. test_scene_refusals.cpp tests the refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iostream>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/build/load_scene.h"
#include "hybrid/scene/scene.h"
#include "hybrid/scene/toml_tree.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/shared_data.h"

namespace {

using hybrid::load_scene;
using hybrid::Scene;
using hybrid::SceneError;

using tests::ball;
using tests::block;
using tests::path;
using tests::SceneFile;
using tests::source_folder;

void expect_near(const glm::dvec3& a, const glm::dvec3& b) {
  EXPECT_LT(glm::distance(a, b), 1e-12);
}

TEST_F(SceneFile, DefaultsAreThoseOfTheHeader) {
  const Scene scene = load("format = 1\n" + block + path);
  const Scene defaults;
  EXPECT_EQ(scene.title, "scene");
  EXPECT_EQ(scene.unit_m, 1e-3);
  EXPECT_EQ(scene.overlap, hybrid::Overlap::carve);
  EXPECT_FALSE(scene.occupancy_cell_m.has_value());
  EXPECT_EQ(scene.tool.radius_m, defaults.tool.radius_m);
  EXPECT_EQ(scene.tool.stiffness_N_per_m, defaults.tool.stiffness_N_per_m);
  EXPECT_EQ(scene.device_model, defaults.device_model);
  EXPECT_EQ(scene.rate_hz, defaults.rate_hz);
  EXPECT_EQ(scene.hand.mass_kg, defaults.hand.mass_kg);
  EXPECT_EQ(scene.safety.max_force_N, defaults.safety.max_force_N);
  EXPECT_FALSE(scene.max_force_given);
  ASSERT_EQ(scene.soft.size(), 1U);
  EXPECT_EQ(scene.soft[0].anchors.faces, std::vector<std::string>{"-z"});
  EXPECT_EQ(scene.soft[0].budget, hybrid::SoftDescription().budget);
  EXPECT_EQ(scene.soft[0].place.line, 2U);
  EXPECT_EQ(scene.soft[0].source_place.line, 4U);
  EXPECT_EQ(std::get<device::PressPath>(scene.path).speed_m_per_s, device::PressPath().speed_m_per_s);
}

TEST_F(SceneFile, EveryUnitBecomesMeters) {
  const std::vector<std::pair<std::string, double>> units = {
      {"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}};
  for (const auto& [name, meters] : units) {
    const Scene scene = load(hybrid::words("format = 1\nunits = \"", name,
                                           "\"\n[occupancy]\ncell = 3\n[tool]\nradius = 2\nstiffness = 700\n",
                                           ball, "position = [1, 2, 3]\n", block, path, "speed = 40\n"));
    EXPECT_DOUBLE_EQ(scene.unit_m, meters);
    EXPECT_DOUBLE_EQ(scene.occupancy_cell_m.value_or(0.0), 3.0 * meters);
    EXPECT_DOUBLE_EQ(scene.tool.radius_m, 2.0 * meters);
    EXPECT_EQ(scene.tool.stiffness_N_per_m, 700.0);  // in N/m, whatever the unit of length
    EXPECT_DOUBLE_EQ(std::get<hybrid::BallPrimitive>(scene.rigid.at(0).source).radius_m, 4.0 * meters);
    expect_near(scene.rigid.at(0).pose.position_m, glm::dvec3(1.0, 2.0, 3.0) * meters);
    const auto& formula = std::get<voxel::Formula>(scene.soft.at(0).source);
    expect_near(formula.size_m, glm::dvec3(20.0, 20.0, 10.0) * meters);
    expect_near(formula.spacing_m, glm::dvec3(2.0) * meters);
    EXPECT_DOUBLE_EQ(std::get<device::PressPath>(scene.path).speed_m_per_s, 40.0 * meters);
  }
}

TEST_F(SceneFile, OtherTablesAreRead) {
  const Scene scene = load(
      "format = 1\ntitle = \"Two\"\noverlap = \"refuse\"\n"
      "[tool]\nshape = \"punch\"\n[device]\nmodel = \"touch\"\nrate = 2000\n"
      "[hand]\nmass = 0.1\ndamping = 3\nstiffness = 400\n"
      "[safety]\nmax_force = 3\nmax_slew = 1000\nsoft_start = 0.2\n"
      "[material.gel]\nyoung = 4000\npoisson = 0.45\nstretch = [1, 1]\nshear = 0\nyield = 0.15\n"
      "[material.spring]\nyoung = 4000\n" +
      block + "material = \"gel\"\n" + path + "hold = 2\nrepeat = 3\n");
  EXPECT_EQ(scene.title, "Two");
  EXPECT_EQ(scene.overlap, hybrid::Overlap::refuse);
  EXPECT_EQ(scene.tool.shape, hybrid::Tool::Shape::punch);
  EXPECT_EQ(scene.device_model, device::DeviceModel::touch);
  EXPECT_EQ(scene.rate_hz, 2000.0);
  EXPECT_EQ(scene.hand.mass_kg, 0.1);
  EXPECT_EQ(scene.hand.damping_N_s_per_m, 3.0);
  EXPECT_EQ(scene.hand.stiffness_N_per_m, 400.0);
  EXPECT_TRUE(scene.max_force_given);
  EXPECT_EQ(scene.safety.max_force_N, 3.0);
  EXPECT_EQ(scene.safety.max_slew_N_per_s, 1000.0);
  EXPECT_EQ(scene.safety.soft_start_s, 0.2);
  const hybrid::Material& gel = scene.materials.at("gel");
  EXPECT_EQ(gel.young_Pa, 4000.0);
  EXPECT_EQ(gel.poisson, 0.45);
  EXPECT_EQ(gel.stretch_min, 1.0);
  EXPECT_EQ(gel.stretch_max, 1.0);
  EXPECT_EQ(gel.shear, 0.0);
  EXPECT_EQ(gel.yield, 0.15);
  EXPECT_EQ(scene.materials.at("spring").yield, std::numeric_limits<double>::infinity()) << "never";
  EXPECT_EQ(scene.soft.at(0).material, "gel");
  EXPECT_EQ(std::get<device::PressPath>(scene.path).hold_s, 2.0);
  EXPECT_EQ(std::get<device::PressPath>(scene.path).repeat, 3);
}

TEST_F(SceneFile, DelayWatchdogGripTremorAndSafetyAreRead) {
  const Scene scene = load(
      "format = 1\n[device]\ndelay_ticks = 2\nwatchdog_ms = 20\n"
      "[hand]\ngrip = \"firm\"\ndamping = 3\ntremor_mm = 0.05\ntremor_hz = 9\n"
      "[safety]\npassivity = true\nmax_energy = 0.2\nenergy_window = 0.05\ndeadline_periods = 4\n" +
      block + path);
  EXPECT_EQ(scene.delay_ticks, 2);
  EXPECT_DOUBLE_EQ(scene.watchdog_s.value_or(0.0), 0.02);
  EXPECT_EQ(scene.hand.mass_kg, 8.7e-3);
  EXPECT_EQ(scene.hand.damping_N_s_per_m, 3.0) << "a figure of its own stands before the grip's";
  EXPECT_EQ(scene.hand.stiffness_N_per_m, 1255.0);
  EXPECT_DOUBLE_EQ(scene.tremor.amplitude_m, 0.05e-3);
  EXPECT_EQ(scene.tremor.frequency_hz, 9.0);
  EXPECT_TRUE(scene.passivity);
  EXPECT_EQ(scene.safety.max_energy_J, 0.2);
  EXPECT_EQ(scene.safety.energy_window_s, 0.05);
  EXPECT_EQ(scene.deadline_periods, 4.0);
  const Scene usual = load("format = 1\n" + block + path);
  EXPECT_EQ(usual.hand.stiffness_N_per_m, 600.0);
  EXPECT_FALSE(usual.passivity);
  EXPECT_FALSE(usual.watchdog_s.has_value());
}

// The rotation is extrinsic about x, then y, then z. It equals three rotation matrices applied in this order.
TEST_F(SceneFile, RotationIsAboutTheFixedAxesXThenYThenZ) {
  const Scene scene = load("format = 1\n" + ball + "rotation = [30, -50, 110]\n" + path);
  const double x = 30.0 * M_PI / 180.0, y = -50.0 * M_PI / 180.0, z = 110.0 * M_PI / 180.0;
  glm::dvec3 p(0.3, -1.2, 2.0);
  const glm::dvec3 turned = scene.rigid.at(0).pose.rotation * p;
  p = {p.x, std::cos(x) * p.y - std::sin(x) * p.z, std::sin(x) * p.y + std::cos(x) * p.z};
  p = {std::cos(y) * p.x + std::sin(y) * p.z, p.y, -std::sin(y) * p.x + std::cos(y) * p.z};
  p = {std::cos(z) * p.x - std::sin(z) * p.y, std::sin(z) * p.x + std::cos(z) * p.y, p.z};
  expect_near(turned, p);
}

TEST_F(SceneFile, RigidSources) {
  write("bone.ply", "ply");
  write("head.nii", "x");
  const Scene scene = load(
      "format = 1\n"
      "[[rigid]]\nname = \"a\"\nmesh = \"bone.ply\"\nunit = \"m\"\nrepair = true\n"
      "[[rigid]]\nname = \"b\"\nprimitive = \"box\"\nsize = [1, 2, 3]\n"
      "[[rigid]]\nname = \"c\"\nprimitive = \"plane\"\nsize = 50\n"
      "[[rigid]]\nname = \"d\"\nprimitive = \"capsule\"\nradius = 2\nlength = 9\n"
      "[[rigid]]\nname = \"e\"\nvolume = \"head.nii\"\nlabels = [3, 1001]\nspacing = 2\n"
      "grow = 1.5\nsmooth = 0\nlargest = false\nunit = \"um\"\n"
      "cut = [{ normal = [0, 3, 4], offset = 7 }]\n" +
      path);
  ASSERT_EQ(scene.rigid.size(), 5U);
  const auto& mesh = std::get<hybrid::MeshSource>(scene.rigid[0].source);
  EXPECT_EQ(mesh.file, folder_ / "bone.ply");
  EXPECT_EQ(mesh.unit_m, 1.0);
  EXPECT_TRUE(mesh.repair);
  expect_near(std::get<hybrid::BoxPrimitive>(scene.rigid[1].source).size_m, glm::dvec3(1e-3, 2e-3, 3e-3));
  EXPECT_DOUBLE_EQ(std::get<hybrid::PlanePrimitive>(scene.rigid[2].source).size_m, 0.05);
  EXPECT_DOUBLE_EQ(std::get<hybrid::CapsulePrimitive>(scene.rigid[3].source).length_m, 9e-3);
  const auto& volume = std::get<hybrid::VolumeSurfaceSource>(scene.rigid[4].source);
  ASSERT_EQ(volume.rules.size(), 2U);
  EXPECT_EQ(volume.rules[1].lower, 1001.0);
  EXPECT_EQ(volume.rules[1].label, 1);  // a surface needs only inside and outside
  EXPECT_DOUBLE_EQ(volume.spacing_m.value_or(0.0), 2e-3);
  EXPECT_DOUBLE_EQ(volume.grow_m, 1.5e-3);
  EXPECT_EQ(volume.smooth, 0);
  EXPECT_FALSE(volume.largest);
  EXPECT_EQ(volume.unit_m, 1e-6);
  ASSERT_EQ(volume.cuts.size(), 1U);
  expect_near(volume.cuts[0].normal, glm::dvec3(0.0, 0.6, 0.8));
  EXPECT_DOUBLE_EQ(volume.cuts[0].offset_m, 7e-3);
}

TEST_F(SceneFile, SoftSources) {
  write("bone.ply", "ply");
  write("head.nii", "x");
  const Scene scene = load(
      "format = 1\n[material.a]\n[material.b]\n"
      "[[soft]]\nname = \"v\"\nvolume = \"head.nii\"\nspacing = [1, 1, 3]\nlargest = false\n"
      "ranges = [{ range = [-50, 100], label = 2 }, { range = [200, 900], label = 9 }]\n"
      "materials = { \"9\" = \"b\", 2 = \"a\" }\nanchors = { labels = [9], rigid_within = 2 }\nbudget = 5\n"
      "work = 0.25\npatch = 8\n"
      "[[soft]]\nname = \"l\"\nvolume = \"head.nii\"\nlabels = [7, 4]\n"
      "[[soft]]\nname = \"all\"\nvolume = \"head.nii\"\nmaterials = { \"200\" = \"b\" }\n"
      "[[soft]]\nname = \"m\"\nmesh = \"bone.ply\"\nspacing = 2\n"
      "[[soft]]\nname = \"f\"\nformula = \"ball\"\nsize = 30\nspacing = 1\nenergy = \"trilinear\"\n"
      "inclusions = [{ shape = \"box\", centre = [1, 2, 3], size = [4, 5, 6], label = 3 }]\n"
      "[[soft]]\nname = \"g\"\nformula = \"block\"\nsize = 30\nspacing = 1\nlabel = 5\n"
      "layers = [{ thickness = 10, label = 2 }]\n" +
      path);
  ASSERT_EQ(scene.soft.size(), 6U);
  const auto& volume = std::get<hybrid::VolumeSource>(scene.soft[0].source);
  ASSERT_EQ(volume.rules.size(), 2U);
  EXPECT_EQ(volume.rules[0].lower, -50.0);
  EXPECT_EQ(volume.rules[1].label, 9);
  ASSERT_TRUE(volume.spacing_m.has_value());
  expect_near(*volume.spacing_m, glm::dvec3(1e-3, 1e-3, 3e-3));
  EXPECT_EQ(scene.soft[0].materials.at(9), "b");
  EXPECT_EQ(scene.soft[0].materials.at(2), "a");
  EXPECT_TRUE(scene.soft[0].anchors.faces.empty());  // anchors in the file replace all default anchors
  EXPECT_EQ(scene.soft[0].anchors.labels, std::vector<std::uint8_t>{9});
  EXPECT_DOUBLE_EQ(scene.soft[0].anchors.rigid_within_m, 2e-3);
  EXPECT_EQ(scene.soft[0].budget, 5U);
  EXPECT_DOUBLE_EQ(scene.soft[0].work, 0.25);
  EXPECT_EQ(scene.soft[0].patch, 8);
  EXPECT_EQ(scene.soft[1].patch, hybrid::kPatchMargin);
  EXPECT_EQ(std::get<hybrid::VolumeSource>(scene.soft[1].source).rules.at(0).label, 4);
  EXPECT_TRUE(std::get<hybrid::VolumeSource>(scene.soft[2].source).rules.empty());
  expect_near(std::get<hybrid::ClosedMeshSource>(scene.soft[3].source).spacing_m, glm::dvec3(2e-3));
  const auto& formula = std::get<voxel::Formula>(scene.soft[4].source);
  EXPECT_EQ(formula.shape, voxel::Formula::Shape::ball);
  expect_near(formula.inclusions.at(0).centre_m, glm::dvec3(1e-3, 2e-3, 3e-3));
  EXPECT_EQ(formula.inclusions[0].label, 3);
  EXPECT_EQ(scene.soft[4].energy, hybrid::Energy::trilinear);
  EXPECT_EQ(scene.soft[5].energy, hybrid::Energy::six_link);
  const auto& layered = std::get<voxel::Formula>(scene.soft[5].source);
  expect_near(layered.size_m, glm::dvec3(0.03));
  EXPECT_EQ(layered.label, 5);
  EXPECT_DOUBLE_EQ(layered.layers.at(0).thickness_m, 0.01);
}

TEST_F(SceneFile, TheFeelOfARigidSurface) {
  write("relief.png", "an image is only opened when the scene is built");
  const auto feel_of = [this](const std::string& keys) {
    return load("format = 1\n" + ball + keys + path).rigid.at(0).feel;
  };
  EXPECT_FALSE(feel_of("").any()) << "off unless asked for";
  const hybrid::FeelDescription all = feel_of(
      "stiffness = 350\ndamping = 2.5\nfriction = [0.5, 0.4]\nshading = true\n[rigid.texture]\nimage = "
      "\"relief.png\"\n"
      "size = 20\nheight = 0.3\nkind = \"shading\"\nalong = \"y\"\n");
  EXPECT_EQ(all.stiffness_N_per_m, 350.0);
  EXPECT_EQ(all.damping_N_s_per_m, 2.5);
  EXPECT_EQ(all.static_friction, 0.5);
  EXPECT_EQ(all.dynamic_friction, 0.4);
  EXPECT_TRUE(all.shading);
  ASSERT_TRUE(all.texture.has_value());
  EXPECT_EQ(all.texture->image, folder_ / "relief.png");
  EXPECT_EQ(all.texture->mapping.kind, hybrid::TextureKind::shading);
  EXPECT_EQ(all.texture->mapping.along, hybrid::TextureAlong::y);
  EXPECT_DOUBLE_EQ(all.texture->mapping.size_m, 0.02);
  EXPECT_DOUBLE_EQ(all.texture->mapping.height_m, 3e-4);

  EXPECT_EQ(feel_of("friction = 0.3\n").dynamic_friction, 0.3);
  EXPECT_EQ(feel_of("friction = { static = 0.3 }\n").dynamic_friction, 0.3);
  EXPECT_EQ(feel_of("friction = { static = 0.3, dynamic = 0.1 }\n").dynamic_friction, 0.1);
  const auto pattern = feel_of("texture = { pattern = \"bumps\", size = 4, height = 0.2 }\n").texture;
  ASSERT_TRUE(pattern.has_value());
  EXPECT_EQ(pattern->pattern, hybrid::TexturePattern::bumps);
  EXPECT_EQ(pattern->mapping.kind, hybrid::TextureKind::height);
  EXPECT_EQ(pattern->mapping.along, hybrid::TextureAlong::box);
}

TEST_F(SceneFile, Paths) {
  write("motion.csv", "t,x,y,z\n");
  const auto path_of = [this](const std::string& text) {
    return load("format = 1\n" + ball + "[path]\n" + text).path;
  };
  const auto slide = std::get<device::SlidePath>(
      path_of("kind = \"slide\"\nfrom = [0, 0, 0]\nto = [10, 0, 0]\nlift = [0, 0, 5]\nspeed = 20\n"));
  expect_near(slide.lift_m, glm::dvec3(0.0, 0.0, 5e-3));
  const auto way = std::get<device::WaypointPath>(
      path_of("kind = \"waypoints\"\npoints = [[1, 2, 3], [4, 5, 6, 0.25]]\n"));
  ASSERT_EQ(way.points.size(), 2U);
  EXPECT_EQ(way.points[0].hold_s, 0.0);
  EXPECT_EQ(way.points[1].hold_s, 0.25);
  expect_near(way.points[1].position_m, glm::dvec3(4e-3, 5e-3, 6e-3));
  const auto lissajous = std::get<device::LissajousPath>(
      path_of("kind = \"lissajous\"\ncentre = [0, 0, 5]\namplitude = [1, 1, 0]\nfrequency = [1, 2, 0]\n"
              "phase = [0, 90, 0]\nduration = 4\n"));
  EXPECT_DOUBLE_EQ(lissajous.phase_rad.y, M_PI / 2.0);
  EXPECT_EQ(lissajous.frequency_hz.y, 2.0);
  EXPECT_EQ(lissajous.duration_s, 4.0);
  const auto csv =
      std::get<device::CsvPath>(path_of("kind = \"csv\"\nfile = \"motion.csv\"\noffset = [1, 0, 0]\n"));
  EXPECT_EQ(csv.unit_m, 1e-3);
  EXPECT_EQ(csv.file, folder_ / "motion.csv");
  expect_near(csv.offset_m, glm::dvec3(1e-3, 0.0, 0.0));
}

TEST_F(SceneFile, ExtremesThatAreSaidClearlyAreTaken) {
  EXPECT_NO_THROW((void)load("format = 1\nunits = \"um\"\n" + block + path));  // a spacing of 2 um
  EXPECT_NO_THROW((void)load("format = 1\nunits = \"m\"\n" + block + path));   // a spacing of 2 m
  EXPECT_NO_THROW(
      (void)load("format = 1\n" + block + "position = [1e9, -1e9, 0]\n" + path));  // 1,000 km away
  EXPECT_NO_THROW((void)load("format = 1\n[tool]\nstiffness = 25000000\n" + block + path));
  EXPECT_NO_THROW(
      (void)load("\xEF\xBB\xBF"
                 "format = 1\n" +
                 block + path));  // begins with the byte-order mark of UTF-8
  std::string windows = "format = 1\n" + block + path;
  for (std::size_t at = 0; (at = windows.find('\n', at)) != std::string::npos; at += 2)
    windows.insert(at, "\r");
  EXPECT_NO_THROW((void)load(windows));
}

// At least 512 cubed voxels must be allowed. At 4 bytes per voxel they need 0.54 GB, which every build
// machine has.
TEST_F(SceneFile, TheLimitOfALatticeIsThatOfTheMachine) {
  const std::size_t most = hybrid::max_lattice_voxels();
  EXPECT_GE(most, std::size_t{1} << 27);
  const double edge = std::cbrt(static_cast<double>(most));
  const auto cube = [](double voxels) {
    std::ostringstream out;
    out << "format = 1\n[[soft]]\nname = \"a\"\nformula = \"block\"\nspacing = 1\nsize = "
        << std::round(voxels) << "\n";
    return out.str() + path;
  };
  EXPECT_EQ(refusal(cube(0.99 * edge)), "");
  EXPECT_NE(refusal(cube(1.01 * edge)).find("bytes"), std::string::npos);
}

// A plate without slack is rendered correctly, on tissue or alone. So there is no warning.
TEST_F(SceneFile, TissueWithoutSlackNeedsNoWarning) {
  const auto warnings = [&](const std::string& stretch, const std::string& shear, double below) {
    std::ostringstream out;
    out << "format = 1\n[material.plate]\nstretch = " << stretch << "\nshear = " << shear
        << "\n[material.tissue]\n[[soft]]\nname = \"a\"\nformula = \"block\"\nspacing = 1\nsize = 8\n"
        << "material = \"tissue\"\nmaterials = { \"2\" = \"plate\" }\nlayers = [";
    if (below > 0.0) out << "{ thickness = " << below << ", label = 1 }, ";
    out << "{ thickness = " << 8.0 - below << ", label = 2 }]\n" << path;
    std::string all;
    for (const auto& note : hybrid::build_scene(load(out.str())).notes) {
      if (note.severity == polygon::Severity::warning) all += note.object + ": " + note.text;
    }
    return all;
  };
  EXPECT_EQ(warnings("[1, 1]", "0", 4.0), "");
  EXPECT_EQ(warnings("[0.95, 1.05]", "0.05", 4.0), "");
  EXPECT_EQ(warnings("[1, 1]", "0", 0.0), "");  // the plate stands on its anchors
}

TEST(Scenes, AllThatComeWithTheProgramLoad) {
  std::size_t scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(source_folder / "scenes")) {
    if (entry.path().extension() != ".toml") continue;
    ++scenes;
    std::ifstream in(entry.path());
    std::string first;
    std::getline(in, first);
    EXPECT_EQ(first.substr(0, 2), "# ") << entry.path() << " begins with what it is for";
    const std::filesystem::path templates = "/usr/share/mricron/templates";
    const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const bool wants_templates = text.find(templates.string()) != std::string::npos;
    if (wants_templates && !std::filesystem::is_directory(templates)) {
      EXPECT_FALSE(tests::data_are_expected()) << entry.path() << " needs Debian's mricron-data";
      std::cout << "skipped: " << entry.path() << " needs Debian's mricron-data\n";
      continue;
    }
    try {
      (void)load_scene(entry.path());
    } catch (const SceneError& error) {
      ADD_FAILURE() << error.what();
    }
  }
  EXPECT_GE(scenes, 5U);
}

}  // namespace
