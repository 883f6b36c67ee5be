// SPDX-License-Identifier: GPL-3.0-or-later
// Frames, units and scaling as stated by headers, against a volume whose labels lie in known places.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <glm/geometric.hpp>
#include <limits>
#include <sstream>
#include <vector>

#include "tests/voxel/volume/base_volume.h"
#include "tests/voxel/volume/volume_folder.h"
#include "voxel/volume/length_unit.h"
#include "voxel/volume/number_at.h"

namespace {

namespace fs = std::filesystem;
using tests::centre_of;
using tests::counts_of;
using tests::kBaseCounts;
using tests::kCentreOfTwo;
using tests::meta_file;
using tests::NiftiFile;
using tests::nrrd_file;
using tests::refusal_of;
using voxel::LabelVolume;

class VolumeHeaders : public tests::VolumeFolder {
 protected:
  // The notes on the file, one per line.
  static std::string notes_of(const fs::path& path) {
    std::string all;
    for (const std::string& note : voxel::read_volume_header(path).notes) all += note + "\n";
    return all;
  }
  // Expects that the file has the labels of the base volume, in their places and with 2 mm voxels.
  static void expect_base(const fs::path& path, const std::string& what, double tolerance_m = 1e-9) {
    const LabelVolume volume = voxel::load_volume(path, {});
    EXPECT_EQ(counts_of(volume), kBaseCounts) << what;
    EXPECT_LT(glm::distance(volume.spacing_m, glm::dvec3(2e-3)), tolerance_m) << what;
    EXPECT_LT(glm::distance(centre_of(volume, 2), kCentreOfTwo), tolerance_m)
        << what << ": " << centre_of(volume, 2).x << ' ' << centre_of(volume, 2).y << ' '
        << centre_of(volume, 2).z;
    EXPECT_TRUE(voxel::read_volume_header(path).directions_known) << what;
  }
};

std::string vectors(const glm::dvec3& step, const glm::dvec3& origin, const std::string& space,
                    const std::string& more = "", bool with_time = false) {
  const std::string time = with_time ? ",0" : "";
  std::ostringstream out;
  if (!space.empty()) out << "space: " << space << "\n";
  out << "space directions: (" << step.x << ",0,0" << time << ") (0," << step.y << ",0" << time << ") (0,0,"
      << step.z << time << ")\n"
      << more << "space origin: (" << origin.x << ',' << origin.y << ',' << origin.z << time << ")\n";
  return out.str();
}

// ---- NRRD: spaces

struct SpaceCase {
  const char* name;
  glm::dvec3 from_ras;  // factors that turn right, front and head into the coordinates of the space
};

const std::vector<SpaceCase>& anatomical_spaces() {
  static const std::vector<SpaceCase> all{{"right-anterior-superior", {1, 1, 1}},
                                          {"left-anterior-superior", {-1, 1, 1}},
                                          {"left-posterior-superior", {-1, -1, 1}},
                                          {"RAS", {1, 1, 1}},
                                          {"LAS", {-1, 1, 1}},
                                          {"LPS", {-1, -1, 1}},
                                          {"Right-Anterior-Superior", {1, 1, 1}},
                                          {"left anterior superior", {-1, 1, 1}},
                                          {"leftposteriorsuperior", {-1, -1, 1}},
                                          {"las", {-1, 1, 1}}};
  return all;
}

// strtod() of the C locale is the reference.
TEST(NumberAt, ReadsWhatTheCLocaleReads) {
  for (const char* text :
       {"1.5 2", " -3e2", "+7", "1e400", "-1e400", "1e-400", "-1e-400", "0x", "", "nine", "+-1"}) {
    const char* end = nullptr;
    char* expected_end = nullptr;
    const double expected = std::strtod(text, &expected_end);
    EXPECT_EQ(voxel::number_at(text, &end), expected) << text;
    EXPECT_EQ(end, expected_end) << text;
  }
}

TEST_F(VolumeHeaders, EverySpaceOfNrrdPutsLabelsInTheSamePlace) {
  for (const SpaceCase& c : anatomical_spaces()) {
    const glm::dvec3 step = glm::dvec3(2.0) * c.from_ras;
    const glm::dvec3 origin = glm::dvec3(-10.0, -20.0, 30.0) * c.from_ras;
    expect_base(write("v.nrrd", nrrd_file(vectors(step, origin, c.name))), c.name);
    EXPECT_EQ(notes_of(in_folder("v.nrrd")), "") << c.name;
  }
}

TEST_F(VolumeHeaders, SpacesOfNrrdWithTimeAreTheSame) {
  for (const SpaceCase& c :
       {SpaceCase{"right-anterior-superior-time", {1, 1, 1}},
        SpaceCase{"left-anterior-superior-time", {-1, 1, 1}},
        SpaceCase{"left-posterior-superior-time", {-1, -1, 1}}, SpaceCase{"RAST", {1, 1, 1}},
        SpaceCase{"LAST", {-1, 1, 1}}, SpaceCase{"LPST", {-1, -1, 1}}}) {
    const glm::dvec3 step = glm::dvec3(2.0) * c.from_ras;
    const glm::dvec3 origin = glm::dvec3(-10.0, -20.0, 30.0) * c.from_ras;
    expect_base(write("v.nrrd", nrrd_file(vectors(step, origin, c.name, "", true))), c.name);
  }
  // A fourth axis along time. One entry is accepted. Two entries are not a single volume.
  const auto with_axis = [](int times) {
    const std::string data = tests::base_voxels<std::uint8_t>();
    return "NRRD0005\ntype: uint8\ndimension: 4\nsizes: 12 10 8 " + std::to_string(times) +
           "\nencoding: raw\nspace: RAST\nspace directions: (2,0,0,0) (0,2,0,0) (0,0,2,0) (0,0,0,1)\n"
           "space origin: (-10,-20,30,0)\n\n" +
           data + (times == 2 ? data : "");
  };
  expect_base(write("v.nrrd", with_axis(1)), "one time");
  EXPECT_SAYS(refusal_of(write("v.nrrd", with_axis(2))), "save one");
}

TEST_F(VolumeHeaders, SpacesWithoutAnatomyAreSaid) {
  for (const char* space : {"scanner-xyz", "scanner-xyz-time", "3D-right-handed", "3D-right-handed-time",
                            "3D-left-handed", "3D-left-handed-time", ""}) {
    const bool time = std::string(space).find("time") != std::string::npos;
    const bool left = std::string(space).find("left") != std::string::npos;
    const fs::path path =
        write("v.nrrd", nrrd_file(vectors(glm::dvec3(2.0), glm::dvec3(-10, -20, 30), space,
                                          *space == '\0' ? "space dimension: 3\n" : "", time)));
    EXPECT_SAYS(notes_of(path), "anatomical directions are unknown");
    EXPECT_FALSE(voxel::read_volume_header(path).directions_known) << space;
    const LabelVolume volume = voxel::load_volume(path, {});
    EXPECT_EQ(counts_of(volume), kBaseCounts) << space;
    // The volume of a left-handed space is mirrored, so that a left hand stays a left hand.
    EXPECT_NEAR(centre_of(volume, 2).x, left ? -7e-3 : 7e-3, 1e-9) << space;
    EXPECT_NEAR(centre_of(volume, 2).y, -11e-3, 1e-9) << space;
  }
  for (const char* bad : {"RPI", "left-posterior-inferior", "mars"}) {
    const fs::path path = write("v.nrrd", nrrd_file(vectors(glm::dvec3(2.0), glm::dvec3(-10, -20, 30), bad)));
    EXPECT_SAYS(refusal_of(path), bad);
  }
}

TEST_F(VolumeHeaders, AxesOfNrrdWithoutDirectionsAreSaid) {
  const fs::path path = write("v.nrrd", nrrd_file("spacings: 2 2 2\naxis mins: -11 -21 29\n"));
  EXPECT_SAYS(notes_of(path), "anatomical directions are unknown");
  const LabelVolume volume = voxel::load_volume(path, {});
  // The `axis mins` of NRRD is the border of the first voxel, not its centre.
  EXPECT_LT(glm::distance(volume.origin_m, glm::dvec3(-10e-3, -20e-3, 30e-3)), 1e-12);
  const fs::path nodes =
      write("v.nrrd", nrrd_file("spacings: 2 2 2\naxis mins: -10 -20 30\ncenters: node node node\n"));
  EXPECT_LT(glm::distance(voxel::load_volume(nodes, {}).origin_m, volume.origin_m), 1e-12);
}

TEST_F(VolumeHeaders, RemarksInNrrdHeadersAreNoFields) {
  const std::string frame = vectors(glm::dvec3(2.0), glm::dvec3(-10, -20, 30), "RAS");
  expect_base(write("v.nrrd", nrrd_file(frame + "space units:=miles\nspace:=LPS\n")),
              "remark named as a field");
  expect_base(write("v.nrrd",
                    nrrd_file(frame + "Segmentation_ConversionParameters:=" + std::string(3000, 'x') + "\n")),
              "a line of 3,000 characters");
}

// ---- Units

struct UnitCase {
  const char* word;
  double unit_mm;
};

const std::vector<UnitCase>& length_units() {
  static const std::vector<UnitCase> all{
      {"m", 1e3},          {"mm", 1.0},         {"cm", 10.0},         {"um", 1e-3},   {"\xC2\xB5m", 1e-3},
      {"\xCE\xBCm", 1e-3}, {"\xB5m", 1e-3},     {"in", 25.4},         {"inch", 25.4}, {"micron", 1e-3},
      {"microns", 1e-3},   {"MM", 1.0},         {"millimeters", 1.0}, {"metre", 1e3}, {"micrometre", 1e-3},
      {"nm", 1e-6},        {"Centimeter", 10.0}};
  return all;
}

TEST_F(VolumeHeaders, UnitsOfNrrdScaleStepsAndPlace) {
  for (const UnitCase& unit : length_units()) {
    EXPECT_NEAR(voxel::length_unit_m(unit.word).value_or(0.0), unit.unit_mm * 1e-3, 1e-15) << unit.word;
    const glm::dvec3 step(2.0 / unit.unit_mm), origin = glm::dvec3(-10, -20, 30) / unit.unit_mm;
    const std::string word = '"' + std::string(unit.word) + "\" ";
    expect_base(
        write("v.nrrd", nrrd_file(vectors(step, origin, "RAS", "space units: " + word + word + word + "\n"))),
        unit.word, 1e-7);
    // Units are stated per axis, because no space states one.
    std::ostringstream axes;
    axes << "spacings: " << step.x << ' ' << step.y << ' ' << step.z << "\nunits: " << word << word << word
         << "\n";
    const fs::path plain = write("v.nrrd", nrrd_file(axes.str()));
    EXPECT_LT(glm::distance(voxel::read_volume_header(plain).spacing_m, glm::dvec3(2e-3)), 1e-8) << unit.word;
  }
  // Each coordinate may have a unit of its own.
  const std::string mixed =
      "space: RAS\nspace directions: (2,0,0) (0,2000,0) (0,0,0.2)\nspace units: \"mm\" \"um\" \"cm\"\n"
      "space origin: (-10,-20000,3)\n";
  expect_base(write("v.nrrd", nrrd_file(mixed)), "mixed units");
  const std::string no_length = vectors(glm::dvec3(2.0), glm::dvec3(-10, -20, 30), "RAS",
                                        "space units: \"pixel\" \"pixel\" \"pixel\"\n");
  expect_base(write("v.nrrd", nrrd_file(no_length)), "pixel");
  EXPECT_SAYS(notes_of(in_folder("v.nrrd")), "'pixel'");
  const std::string one_unknown =
      vectors(glm::dvec3(2.0), glm::dvec3(-10, -20, 30), "RAS", "space units: \"mm\" \"mm\" \"furlong\"\n");
  expect_base(write("v.nrrd", nrrd_file(one_unknown)), "furlong");
  EXPECT_SAYS(notes_of(in_folder("v.nrrd")), "the unit 'furlong', which is no length known here");
}

TEST_F(VolumeHeaders, UnitsOfNiftiScaleStepsAndPlace) {
  struct Unit {
    std::uint8_t code;
    float per_mm;
  };
  for (const Unit unit : {Unit{1, 1e-3F}, Unit{2, 1.0F}, Unit{3, 1e3F}, Unit{0, 1.0F}, Unit{1 + 8, 1e-3F},
                          Unit{3 + 16, 1e3F}}) {
    for (const bool quaternion : {false, true}) {
      NiftiFile file;
      file.unit = unit.code;
      file.voxel = 2.0F * unit.per_mm;
      file.origin *= unit.per_mm;
      file.qform = quaternion ? 1 : 0;
      file.sform = quaternion ? 0 : 1;
      expect_base(write("v.nii", file.text(tests::base_voxels<std::uint8_t>())),
                  "unit " + std::to_string(unit.code), 1e-8);
      EXPECT_EQ(notes_of(in_folder("v.nii")), "");
    }
  }
}

TEST_F(VolumeHeaders, AUnitThatIsAskedForCountsAndIsSaid) {
  NiftiFile file;
  file.unit = 1;  // meters
  const fs::path path = write("v.nii", file.text(tests::base_voxels<std::uint8_t>()));
  voxel::VolumeFileOptions options;
  options.unit_m = 1e-3;
  std::vector<std::string> notes;
  const LabelVolume volume = voxel::load_volume(path, options, &notes);
  EXPECT_LT(glm::distance(centre_of(volume, 2), kCentreOfTwo), 1e-9);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_SAYS(notes[0], "lengths in m; they are taken in mm");
  EXPECT_NEAR(voxel::read_volume_header(path).spacing_m.x, 2.0, 1e-9);
  options.unit_m = 1.0;
  voxel::load_volume(path, options, &notes);
  EXPECT_TRUE(notes.empty());
}

TEST_F(VolumeHeaders, VoxelSizesOfMetaImage) {
  expect_base(write("v.mha", meta_file("ElementSize = 2 2 2\n")), "size alone");
  EXPECT_EQ(notes_of(in_folder("v.mha")), "");
  expect_base(write("v.mha", meta_file("ElementSpacing = 2 2 2\nElementSize = 1.5 1.5 1.5\n")), "both");
  EXPECT_EQ(notes_of(in_folder("v.mha")), "");
  EXPECT_SAYS(notes_of(write("v.mha", meta_file(""))), "no voxel spacing");
  expect_base(
      write("v.mha", meta_file("ElementSpacing = 2000 2000 2000\nDistanceUnits = um\n", "10000 20000 30000")),
      "um");
  expect_base(write("v.mha", meta_file("ElementSpacing = 2 2 2\nDistanceUnits = ?\n")), "unit not known");
  EXPECT_EQ(notes_of(in_folder("v.mha")), "");
}

TEST_F(VolumeHeaders, AMetaImageWithoutSizesOrTypeIsRefused) {
  for (const char* field : {"DimSize = 12 10 8\n", "ElementType = MET_UCHAR\n"}) {
    std::string text = tests::meta_file("");
    text.erase(text.find(field), std::strlen(field));
    EXPECT_SAYS(refusal_of(write("v.mha", text)), "before ElementDataFile");
    text.insert(text.find("LOCAL\n") + 6, field);  // after the last field of the header
    EXPECT_SAYS(refusal_of(write("v.mha", text)), "before ElementDataFile");
  }
}

// ---- NIfTI: codes and scaling

TEST_F(VolumeHeaders, NiftiWithoutQformAndSformIsSaid) {
  NiftiFile file;
  file.sform = 0;
  const fs::path path = write("v.nii", file.text(tests::base_voxels<std::uint8_t>()));
  EXPECT_SAYS(notes_of(path), "anatomical directions are unknown");
  EXPECT_FALSE(voxel::read_volume_header(path).directions_known);
  file.qform = 1;
  expect_base(write("v.nii", file.text(tests::base_voxels<std::uint8_t>())), "qform");
  EXPECT_EQ(notes_of(in_folder("v.nii")), "");
  file.qform = -1;
  EXPECT_SAYS(notes_of(write("v.nii", file.text(tests::base_voxels<std::uint8_t>()))), "unknown");
}

TEST_F(VolumeHeaders, AQuaternionOfNiftiThatIsNoRotationIsRefused) {
  NiftiFile file;
  file.qform = 1;
  const auto write_it = [&] { return write("v.nii", file.text(tests::base_voxels<std::uint8_t>())); };
  file.sform = 0;
  file.quaternion = {1.0F, 1.0F, 1.0F};
  EXPECT_SAYS(refusal_of(write_it()), "quaternion of length 1.7");
  file.quaternion = {0.0F, 0.0F, 1.00005F};  // half a turn about z, up to rounding
  EXPECT_EQ(refusal_of(write_it()), "");
  file.quaternion = {1.0F, 1.0F, 1.0F};
  file.sform = 1;  // the sform is used
  expect_base(write_it(), "sform");
  EXPECT_SAYS(notes_of(in_folder("v.nii")), "different places");
}

TEST_F(VolumeHeaders, ASlopeOfZeroScalesNothing) {
  NiftiFile file;
  file.type = 4;
  file.bits = 16;
  const std::string numbers = tests::base_voxels<std::int16_t>();
  for (const float slope : {0.0F, std::numeric_limits<float>::quiet_NaN()}) {
    file.slope = slope;
    file.intercept = 5.0F;
    expect_base(write("v.nii", file.text(numbers)), "slope 0");
    EXPECT_EQ(voxel::read_volume_header(in_folder("v.nii")).component, "int16");
  }
  // Related cases: an intercept with a slope of 1, other slopes, and a slope that is not finite.
  file.slope = 1.0F;
  voxel::VolumeStatistics s = voxel::read_volume_statistics(write("v.nii", file.text(numbers)));
  EXPECT_EQ(s.minimum, 5.0);
  EXPECT_EQ(s.maximum, 8.0);
  file.slope = 0.1F;
  file.intercept = 0.0F;
  expect_base(write("v.nii", file.text(tests::base_voxels<std::int16_t>(10))), "slope 0.1");
  file.slope = -2.0F;
  file.intercept = 1.0F;
  s = voxel::read_volume_statistics(write("v.nii", file.text(numbers)));
  EXPECT_EQ(s.minimum, -5.0);
  EXPECT_EQ(s.maximum, 1.0);
  file.slope = std::numeric_limits<float>::infinity();
  EXPECT_SAYS(refusal_of(write("v.nii", file.text(numbers))), "finite");
}

// ---- One slice

// Slice 3 of the base volume, as each format can write it.
TEST_F(VolumeHeaders, ASingleSliceIsAsThickAsItSays) {
  const std::string voxels = tests::base_voxels<std::uint8_t>().substr(3 * 120, 120);
  const auto thick_m = [&](const fs::path& path) {
    const voxel::VolumeHeader header = voxel::read_volume_header(path);
    EXPECT_EQ(header.dims, (std::array{12, 10, 1}));
    EXPECT_NEAR(header.spacing_m.x, 2e-3, 1e-12);
    EXPECT_NEAR(header.spacing_m.y, 2e-3, 1e-12);
    EXPECT_EQ(counts_of(voxel::load_volume(path, {})),
              (std::map<int, std::size_t>{{0, 82}, {1, 18}, {2, 8}, {3, 12}}));
    return header.spacing_m.z;
  };
  const auto nifti = [&](std::int16_t axes, float thickness, bool sform) {
    NiftiFile file;
    file.qform = sform ? 0 : 1;
    file.sform = sform ? 1 : 0;
    std::string bytes = file.text(voxels);
    const std::array<std::int16_t, 4> dims{axes, 12, 10, 1};
    std::memcpy(&bytes[40], dims.data(), sizeof(dims));
    std::memcpy(&bytes[88], &thickness, sizeof(thickness));
    std::memcpy(&bytes[320], &thickness, sizeof(thickness));  // of the sform
    return write("v.nii", bytes);
  };
  for (const bool sform : {true, false}) {
    EXPECT_NEAR(thick_m(nifti(3, 5.0F, sform)), 5e-3, 1e-9);
    EXPECT_EQ(notes_of(in_folder("v.nii")), "");
    for (const std::int16_t axes : {std::int16_t{2}, std::int16_t{3}}) {
      EXPECT_NEAR(thick_m(nifti(axes, 0.0F, sform)), 1e-3, 1e-9);
      EXPECT_SAYS(notes_of(in_folder("v.nii")), "fewer than three axes");
    }
  }
  const auto nrrd = [&](const std::string& sizes, const std::string& lines) {
    std::string text = nrrd_file(lines);
    text.resize(text.size() - 960);
    text.replace(text.find("12 10 8"), 7, sizes);
    if (sizes.size() == 5) text.replace(text.find("dimension: 3"), 12, "dimension: 2");
    return write("v.nrrd", text + voxels);
  };
  EXPECT_NEAR(thick_m(nrrd("12 10 1", "space: RAS\nspace directions: (2,0,0) (0,2,0) (0,0,5)\n")), 5e-3,
              1e-12);
  EXPECT_NEAR(thick_m(nrrd("12 10 1", "spacings: 2 2 5\n")), 5e-3, 1e-12);
  EXPECT_NEAR(thick_m(nrrd("12 10 1", "spacings: 2 2 nan\nthicknesses: nan nan 5\n")), 5e-3, 1e-12);
  EXPECT_NEAR(thick_m(nrrd("12 10", "spacings: 2 2\n")), 1e-3, 1e-12);
  EXPECT_SAYS(notes_of(in_folder("v.nrrd")), "fewer than three axes");
  EXPECT_SAYS(refusal_of(nrrd("12 10 1", "spacings: 2 2 nan\n")), "no voxel spacing");
  const auto meta = [&](const std::string& dims, const std::string& lines) {
    std::string text = meta_file(lines);
    text.resize(text.size() - 960);
    text.replace(text.find("12 10 8"), 7, dims);
    return write("v.mha", text + voxels);
  };
  EXPECT_NEAR(thick_m(meta("12 10 1", "ElementSpacing = 2 2 5\n")), 5e-3, 1e-12);
  EXPECT_NEAR(thick_m(meta("12 10 1", "ElementSize = 2 2 5\n")), 5e-3, 1e-12);
}

// ---- Byte orders

TEST_F(VolumeHeaders, NumbersOfTheOtherByteOrderLieInTheSamePlaces) {
  const auto turned = [](auto zero) {
    std::string bytes = tests::base_voxels<decltype(zero)>();
    for (std::size_t n = 0; n < bytes.size(); n += sizeof(zero))
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(n),
                   bytes.begin() + static_cast<std::ptrdiff_t>(n + sizeof(zero)));
    return bytes;
  };
  const std::string frame = vectors(glm::dvec3(2.0), glm::dvec3(-10, -20, 30), "RAS");
  const auto check = [&](auto zero, const std::string& nrrd_type, const std::string& meta_type) {
    std::string nrrd = nrrd_file("endian: big\n" + frame);
    nrrd.resize(nrrd.size() - 960);
    nrrd.replace(nrrd.find("uint8"), 5, nrrd_type);
    expect_base(write("v.nrrd", nrrd + turned(zero)), nrrd_type);
    std::string meta = meta_file("ElementSpacing = 2 2 2\n");
    meta.resize(meta.size() - 960);
    meta.replace(meta.find("MET_UCHAR"), 9, meta_type);
    meta.replace(meta.find("MSB = False"), 11, "MSB = True");
    expect_base(write("v.mha", meta + turned(zero)), meta_type);
  };
  check(std::int16_t{}, "short", "MET_SHORT");
  check(std::uint16_t{}, "unsigned short", "MET_USHORT");
  check(std::int32_t{}, "int32", "MET_INT");
  check(float{}, "float", "MET_FLOAT");
  check(double{}, "double", "MET_DOUBLE");
}

// ---- Other files in the place of a volume

TEST_F(VolumeHeaders, ForeignFilesAreNamed) {
  const std::string pointer =
      "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a214614ab2935c943f9e0ff69d22e\nsize 12345\n";
  const std::string zip{"PK\x03\x04\x14\x00\x00\x00", 8};
  for (const char* name : {"v.nii", "v.nii.gz", "v.nrrd", "v.nhdr", "v.mha", "v.mhd"}) {
    EXPECT_SAYS(refusal_of(write(name, pointer)), "Git LFS pointer");
    EXPECT_SAYS(refusal_of(write(name, "/annex/objects/MD5E-s1--ab.nii\n")), "git-annex pointer");
    EXPECT_SAYS(refusal_of(write(name, "BZh91AY&SY\x01\x02")), "bzip2");
    EXPECT_SAYS(refusal_of(write(name, zip)), "zip");
    EXPECT_SAYS(refusal_of(write(name, "\n<!DOCTYPE html><html></html>")), "web page");
  }
  EXPECT_SAYS(refusal_of(write("v.mha", "\x1F\x8B\x08")), "gzip");
  // A separate file of voxels may be such a pointer too.
  (void)write("v.raw", pointer);
  const std::string frame = vectors(glm::dvec3(2.0), glm::dvec3(-10, -20, 30), "RAS");
  EXPECT_SAYS(refusal_of(write("v.nhdr", nrrd_file(frame + "data file: v.raw\n"))), "Git LFS pointer");
  std::string packed = nrrd_file(frame);
  packed.replace(packed.find("raw"), 3, "bzip2");
  EXPECT_SAYS(refusal_of(write("v.nrrd", packed)), "bzip2");
  packed.replace(packed.find("bzip2"), 5, "bz2");
  EXPECT_SAYS(refusal_of(write("v.nrrd", packed)), "bzip2");
  // A folder of slices in which one slice or all slices are pointers.
  fs::create_directories(in_folder("slices"));
  (void)write("slices/1.dcm", pointer);
  EXPECT_SAYS(refusal_of(in_folder("slices")), "Git LFS pointer");
}

}  // namespace
