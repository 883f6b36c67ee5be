// SPDX-License-Identifier: GPL-3.0-or-later
// Transforms that ITK itself writes place objects where ITK says. Files that cannot place an object are
// refused.
#include "hybrid/scene/itk_transform.h"

#include <itkAffineTransform.h>
#include <itkHDF5TransformIOFactory.h>
#include <itkTransformFileWriter.h>
#include <itkTxtTransformIOFactory.h>
#include <itkVersorRigid3DTransform.h>

#include <fstream>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>
#include <iterator>
#include <random>

#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::Pose;
using Random = std::mt19937;

class ItkTransformFile : public tests::SceneFile {
 protected:
  void SetUp() override {
    SceneFile::SetUp();
    itk::TxtTransformIOFactory::RegisterOneFactory();
    itk::HDF5TransformIOFactory::RegisterOneFactory();
  }
  // Saves a transform by ITK's own writer.
  template <typename Number, typename Map>
  std::filesystem::path save(const std::string& name, const Map& map) const {
    const auto writer = itk::TransformFileWriterTemplate<Number>::New();
    writer->SetFileName((folder_ / name).string());
    writer->SetInput(map);
    writer->Update();
    return folder_ / name;
  }
  // The refusal of a scene that takes the file's text as its transform.
  [[nodiscard]] std::string refused(const std::string& text, const std::string& name = "t.tfm") const {
    write(name, text);
    return refusal("format = 1\n" + tests::ball + "transform = \"" + name + "\"\n" + tests::path);
  }
};

glm::dvec3 random_point(Random& random, double size) {
  std::uniform_real_distribution<double> one(-size, size);
  return {one(random), one(random), one(random)};
}

// A rotation about a centre, then a shift (mm).
template <typename Map>
typename Map::Pointer random_rigid(Random& random) {
  const glm::dquat turn =
      glm::angleAxis(random_point(random, 3.0).x, glm::normalize(random_point(random, 1.0)));
  const glm::dmat3 matrix = glm::mat3_cast(turn);
  typename Map::MatrixType rows;
  typename Map::InputPointType centre;
  typename Map::OutputVectorType shift;
  const glm::dvec3 c = random_point(random, 300.0), s = random_point(random, 300.0);
  for (unsigned row = 0; row < 3; ++row) {
    for (unsigned column = 0; column < 3; ++column)
      rows(row, column) =
          static_cast<typename Map::ScalarType>(matrix[static_cast<int>(column)][static_cast<int>(row)]);
    centre[row] = static_cast<typename Map::ScalarType>(c[static_cast<int>(row)]);
    shift[row] = static_cast<typename Map::ScalarType>(s[static_cast<int>(row)]);
  }
  const auto map = Map::New();
  map->SetCenter(centre);
  map->SetMatrix(rows);
  map->SetTranslation(shift);
  return map;
}

// ITK's map leads from the scene to the object, and the pose leads back. Returns the largest distance between
// a point and its image under both (m).
template <typename Map>
double greatest_error_m(const Pose& pose, const Map& map, Random& random) {
  double most = 0.0;
  for (int n = 0; n < 20; ++n) {
    const glm::dvec3 scene_mm = random_point(random, 200.0);
    typename Map::InputPointType point;
    for (unsigned a = 0; a < 3; ++a)
      point[a] = static_cast<typename Map::ScalarType>(scene_mm[static_cast<int>(a)]);
    const auto mapped = map.TransformPoint(point);
    const glm::dvec3 object_m = 1e-3 * glm::dvec3(mapped[0], mapped[1], mapped[2]);
    most = std::max(most, glm::distance(pose.position_m + pose.rotation * object_m, 1e-3 * scene_mm));
  }
  return most;
}

TEST_F(ItkTransformFile, EveryRigidTransformOfItkIsReadBack) {
  using Affine = itk::AffineTransform<double, 3>;
  using AffineOfFloats = itk::AffineTransform<float, 3>;
  using Versor = itk::VersorRigid3DTransform<double>;
  Random random(1);
  for (int n = 0; n < 20; ++n) {
    const auto affine = random_rigid<Affine>(random);
    const auto of_floats = random_rigid<AffineOfFloats>(random);
    const auto versor = random_rigid<Versor>(random);
    for (const std::string ending : {".tfm", ".txt"}) {
      const auto read = [&](const std::filesystem::path& file) { return hybrid::load_itk_transform(file); };
      EXPECT_LT(greatest_error_m(read(save<double>("a" + ending, affine)), *affine, random), 1e-12) << ending;
      EXPECT_LT(greatest_error_m(read(save<double>("v" + ending, versor)), *versor, random), 1e-12) << ending;
      // Floats of 300 mm have steps of 3e-8 m.
      EXPECT_LT(greatest_error_m(read(save<float>("f" + ending, of_floats)), *of_floats, random), 2e-6)
          << ending;
    }
  }
}

TEST_F(ItkTransformFile, ASceneTakesItInPlaceOfPositionAndRotation) {
  // The map from the scene to the object is a quarter turn about z, then 10 mm along x. So the object's x
  // axis lies along the scene's -y.
  write("t.tfm",
        "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
        "Parameters: 0 -1 0 1 0 0 0 0 1 10 0 0\nFixedParameters: 0 0 0\n");
  const hybrid::Scene scene = load("format = 1\n" + tests::ball + "transform = \"t.tfm\"\n" + tests::block +
                                   "transform = \"t.tfm\"\n" + tests::path);
  for (const Pose& pose : {scene.rigid[0].pose, scene.soft[0].pose}) {
    EXPECT_LT(glm::distance(pose.position_m, glm::dvec3(0.0, 0.01, 0.0)), 1e-12);
    EXPECT_LT(glm::distance(pose.rotation * glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0)), 1e-12);
  }
}

struct Refused {
  const char *type, *parameters, *fixed, *wrong, *remedy;
};

TEST_F(ItkTransformFile, WhatCannotPlaceAnObjectIsRefusedWithItsReason) {
  const char *kAffine = "AffineTransform_double_3_3", *kZero = "0 0 0";
  const Refused cases[] = {
      {kAffine, "1.1 0 0 0 1 0 0 0 1 0 0 0", kZero, "stretches or shears by 21", "harden"},
      {kAffine, "1 0.01 0 0 1 0 0 0 1 0 0 0", kZero, "stretches or shears by 1 %", "harden"},
      {kAffine, "-1 0 0 0 1 0 0 0 1 0 0 0", kZero, "mirrors", "harden"},
      {kAffine, "1 0 0 0 1 0 0 0 1 0 0", kZero, "damaged: 11 parameters", "save it again"},
      {kAffine, "1 0 0 0 1 0 0 0 1 0 0 nan", kZero, "not finite", "save it again"},
      {kAffine, "1 0 0 0 x 0 0 0 1 0 0 0", kZero, "'x 0 0 0", "save it again"},
      {kAffine, "1 0 0 0 1 0 0 0 1 0 0 1e13", kZero, "moves by more than", "correct it"},
      {kAffine, "1 0 0 0 1 0 0 0 1 0 0 0", "0 0", "2 fixed ones", "save it again"},
      {"BSplineTransform_double_3_3", "0 0 0", kZero, "BSplineTransform_double_3_3", "harden"},
      {"VersorRigid3DTransform_double_3_3", "0.9 0.9 0 0 0 0", kZero, "versor is longer than 1",
       "save it again"}};
  for (const Refused& c : cases) {
    const std::string said =
        refused(std::string("#Insight Transform File V1.0\n#Transform 0\nTransform: ") + c.type +
                "\nParameters: " + c.parameters + "\nFixedParameters: " + c.fixed + "\n");
    EXPECT_NE(said.find(":6:1: 'transform' in [[rigid]] 'ball'"), std::string::npos)
        << c.wrong << ": " << said;
    EXPECT_NE(said.find(c.wrong), std::string::npos) << said;
    EXPECT_NE(said.find(c.remedy), std::string::npos) << said;
  }
  EXPECT_NE(refused("solid bone").find("is no transform file"), std::string::npos);
  EXPECT_NE(refused("#Insight Transform File V1.0\n").find("holds 0 transforms"), std::string::npos);
  Random random(3);
  save<double>("t.h5", random_rigid<itk::AffineTransform<double, 3>>(random));
  const std::string hdf5 = refusal("format = 1\n" + tests::ball + "transform = \"t.h5\"\n" + tests::path);
  EXPECT_NE(hdf5.find("is HDF5, which is not read; save the transform as .tfm"), std::string::npos) << hdf5;
  const std::string both =
      refusal("format = 1\n" + tests::ball + "position = [0, 0, 1]\ntransform = \"t.tfm\"\n" + tests::path);
  EXPECT_NE(both.find("both say where [[rigid]] 'ball' lies"), std::string::npos) << both;
  EXPECT_NE(refusal("format = 1\n" + tests::ball + "transform = \"gone.tfm\"\n" + tests::path)
                .find("does not exist"),
            std::string::npos);
}

TEST_F(ItkTransformFile, DamagedFilesAreReadOrRefused) {
  Random random(2);
  const auto map = random_rigid<itk::AffineTransform<double, 3>>(random);
  std::ifstream in(save<double>("d.tfm", map), std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  for (int n = 0; n < 1000; ++n) {
    std::string bytes = whole;
    for (int k = 0; k < 1 + n % 4; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    if (n % 5 == 0) bytes.resize(random() % bytes.size());
    write("damaged.tfm", bytes);
    try {
      const Pose pose = hybrid::load_itk_transform(folder_ / "damaged.tfm");
      EXPECT_NEAR(glm::length(pose.rotation), 1.0, 1e-9);
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("; "), std::string::npos) << error.what();  // a remedy follows
    }
  }
}

}  // namespace
