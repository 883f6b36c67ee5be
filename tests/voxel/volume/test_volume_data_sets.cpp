// SPDX-License-Identifier: GPL-3.0-or-later
// Public data sets and DICOM series, against the values in their lists of sources.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <random>

#include "tests/shared_data.h"
#include "tests/voxel/volume/volume_folder.h"
#include "voxel/volume/read_volume.h"

namespace {

namespace fs = std::filesystem;
using tests::contents;
using tests::place_of;
using tests::refusal;
using tests::refusal_of;
using voxel::LabelVolume;
using voxel::VolumeFileOptions;
using voxel::VolumeHeader;

class VolumeDataSets : public tests::VolumeFolder {};

TEST_F(VolumeDataSets, SharedVolumesAreAsDocumented) {
  const fs::path folder = tests::shared_data("data/volumes");
  SKIP_WITHOUT(folder);
  struct Expected {
    const char* name;
    std::array<int, 3> dims;
    const char* component;
    glm::dvec3 spacing_mm;
    std::array<double, 2> range;
    std::size_t labels;  // number of distinct values; 0 if the file holds intensities
    glm::dvec3 x,
        y;  // first two axes of the result in LPS: -left and -back for RAS files, left and back for LPS
  };
  const glm::dvec3 left(1, 0, 0);
  const glm::dvec3 back(0, 1, 0);
  const std::vector<Expected> all{
      {"allen_labels_0p5mm.nii.gz", {318, 388, 310}, "uint8", glm::dvec3(0.5), {0, 141}, 139, -left, -back},
      {"ts_ct_abdomen_3mm.nii.gz", {122, 101, 112}, "int32", glm::dvec3(3), {-1207, 3382}, 0, -left, -back},
      {"ts_ct_abdomen_3mm_labels.nii.gz",
       {122, 101, 112},
       "uint8",
       glm::dvec3(3),
       {0, 117},
       62,
       -left,
       -back},
      {"ts_ct_aorta_1p5mm.nii.gz", {120, 126, 164}, "int16", glm::dvec3(1.5), {-1078, 3343}, 0, left, back},
      {"ts_ct_aorta_1p5mm_label_T12.nii.gz",
       {120, 126, 164},
       "uint8",
       glm::dvec3(1.5),
       {0, 1},
       2,
       left,
       back},
      {"ts_ct_aorta_1p5mm_label_aorta.nii.gz",
       {120, 126, 164},
       "uint8",
       glm::dvec3(1.5),
       {0, 1},
       2,
       left,
       back},
      {"ts_ct_brain_atlas_1mm.nii.gz", {202, 202, 179}, "int16", glm::dvec3(1), {-30, 385}, 0, -left, -back},
      // LAS is left-handed, so its first axis (left) is reversed.
      {"ts_ct_dicom_labels.nii.gz", {512, 512, 20}, "uint8", {0.9766, 0.9766, 2}, {0, 117}, 32, -left, -back},
  };
  for (const Expected& expected : all) {
    const VolumeHeader header = voxel::read_volume_header(folder / expected.name);
    EXPECT_EQ(header.format, "NIfTI");
    EXPECT_EQ(header.dims, expected.dims) << expected.name;
    EXPECT_EQ(header.component, expected.component) << expected.name;
    EXPECT_LT(glm::distance(header.spacing_m, expected.spacing_mm * 1e-3), 1e-6) << expected.name;
    EXPECT_EQ(header.rotation * left, expected.x) << expected.name;
    EXPECT_EQ(header.rotation * back, expected.y) << expected.name;
    const voxel::VolumeStatistics statistics = voxel::read_volume_statistics(folder / expected.name);
    EXPECT_EQ(statistics.minimum, expected.range[0]) << expected.name;
    EXPECT_EQ(statistics.maximum, expected.range[1]) << expected.name;
    EXPECT_EQ(statistics.label_counts.size(), expected.labels) << expected.name;
    std::size_t counted = 0;
    for (const auto& [label, count] : statistics.label_counts) counted += count;
    if (expected.labels > 0) {
      EXPECT_EQ(counted, header.bytes) << expected.name;  // one byte per voxel
    }
  }
}

TEST_F(VolumeDataSets, DicomSeriesLiesWhereItsLabelsAre) {
  const fs::path folder = tests::shared_data("data/volumes");
  SKIP_WITHOUT(folder);
  const fs::path dicom = folder / "ts_ct_dicom_jpeg2000";
  const VolumeHeader header = voxel::read_volume_header(dicom);
  EXPECT_EQ(header.format, "DICOM series");
  EXPECT_EQ(header.dims, (std::array{512, 512, 20}));
  EXPECT_LT(glm::distance(header.spacing_m, glm::dvec3(0.9766e-3, 0.9766e-3, 2e-3)), 1e-6);
  const voxel::VolumeStatistics statistics = voxel::read_volume_statistics(dicom);
  EXPECT_EQ(statistics.minimum, -1024.0);  // after rescaling
  EXPECT_GT(statistics.maximum, 1000.0);
  // Bone in the CT and bone in the labels lie in the same places, because both frames are read correctly.
  VolumeFileOptions options;
  options.rules = {{250, 4000, 1}};
  const LabelVolume bone = voxel::load_volume(dicom, options);
  options.rules = {
      {25, 50, 1}, {69, 78, 1}, {91, 117, 1}};  // vertebrae, limbs and girdles, skull, ribs, sternum
  const LabelVolume labelled = voxel::load_volume(folder / "ts_ct_dicom_labels.nii.gz", options);
  ASSERT_EQ(labelled.dims, bone.dims);
  std::size_t same = 0;
  std::size_t both = 0;
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 512; ++j) {
      for (int i = 0; i < 512; ++i) {
        if (labelled.labels[labelled.index(i, j, k)] == 0) continue;
        const glm::dvec3 p =
            glm::conjugate(bone.rotation) * (place_of(labelled, i, j, k) - bone.origin_m) / bone.spacing_m;
        const std::array<long, 3> at{std::lround(p.x), std::lround(p.y), std::lround(p.z)};
        ASSERT_TRUE(at[0] >= 0 && at[0] < 512 && at[1] >= 0 && at[1] < 512 && at[2] >= 0 && at[2] < 20);
        ++both;
        same += bone.labels[bone.index(static_cast<int>(at[0]), static_cast<int>(at[1]),
                                       static_cast<int>(at[2]))];
      }
    }
  }
  ASSERT_GT(both, 1000U);
  // Spongy bone is below the threshold, so the overlap is partial. With a wrong frame, hardly any voxel of
  // the labels would be above the threshold.
  EXPECT_GT(static_cast<double>(same), 0.25 * static_cast<double>(both)) << same << " of " << both;
}

TEST_F(VolumeDataSets, DicomFoldersThatAreNotOneWholeSeriesAreRefused) {
  const fs::path folder = tests::shared_data("data/volumes");
  SKIP_WITHOUT(folder);
  std::vector<fs::path> slices;
  for (const auto& entry : fs::directory_iterator(folder / "ts_ct_dicom_jpeg2000"))
    slices.push_back(entry.path());
  std::sort(slices.begin(), slices.end());
  const auto copy = [&](const std::string& name, const std::vector<std::size_t>& which) {
    fs::create_directories(in_folder(name));
    for (const std::size_t n : which) fs::copy_file(slices[n], in_folder(name) / slices[n].filename());
    return in_folder(name);
  };
  EXPECT_SAYS(refusal([&] { voxel::read_volume_header(copy("gap", {0, 1, 2, 5, 6})); }), "missing (about 2)");
  const fs::path twice = copy("twice", {0, 1, 2});
  fs::copy_file(slices[1], twice / "again");
  EXPECT_SAYS(refusal([&] { voxel::read_volume_header(twice); }), "same place");
  EXPECT_EQ(voxel::read_volume_header(copy("single", {3})).dims, (std::array{512, 512, 1}));
  EXPECT_EQ(voxel::read_volume_header(copy("some", {2, 3, 4})).dims[2], 3);

  // These slices have an empty series identifier. The third slice gets one, so it is another series.
  const fs::path two = copy("two", {0, 1});
  std::string bytes = contents(slices[2]);
  const std::string empty{"\x20\x00\x0e\x00UI\x00\x00", 8};
  const std::string named{
      "\x20\x00\x0e\x00UI\x04\x00"
      "1.2\x00",
      12};
  const auto at = bytes.find(empty);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at, empty.size(), named);
  std::ofstream(two / "other", std::ios::binary) << bytes;
  EXPECT_SAYS(refusal([&] { voxel::read_volume_header(two); }), "2 DICOM series");

  // A file that is not DICOM is left out, with a note.
  const fs::path mixed = copy("mixed", {5, 6});
  std::ofstream(mixed / "README") << "two slices";
  ASSERT_EQ(voxel::read_volume_header(mixed).notes.size(), 1U);
  EXPECT_SAYS(voxel::read_volume_header(mixed).notes[0], "1 files");

  // Damaged files, with some bytes changed or cut off.
  std::mt19937 random(4);
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  const std::string whole = contents(slices[0]);
  fs::create_directories(in_folder("damaged"));
  for (int n = 0; n < 60; ++n) {
    std::string damaged = whole;
    for (int change = 0; change < 4; ++change) damaged[random() % 3000] = static_cast<char>(random());
    if (n % 3 == 0) damaged.resize(random() % damaged.size());
    fs::remove(in_folder("damaged") / "slice");
    std::ofstream(in_folder("damaged") / "slice", std::ios::binary) << damaged;
    VolumeFileOptions options;
    options.max_bytes = 64U << 20U;
    options.rules = {{-500, 3000, 1}};
    refusal_of(in_folder("damaged"), options);
  }
  ::testing::internal::GetCapturedStdout();
  ::testing::internal::GetCapturedStderr();
}

TEST_F(VolumeDataSets, TemplatesOfMricronLoad) {
  const fs::path path = "/usr/share/mricron/templates/ch2bet.nii.gz";
  NEED_DATA(fs::exists(path), "the package mricron-data is not installed");
  VolumeFileOptions options;
  options.spacing_m = glm::dvec3(2e-3);
  options.rules = {{20, 255, 3}};
  const LabelVolume volume = voxel::load_volume(path, options);
  EXPECT_EQ(volume.dims, (std::array{91, 109, 91}));
  const auto filled = static_cast<double>(volume.labels.size()) -
                      static_cast<double>(std::count(volume.labels.begin(), volume.labels.end(), 0));
  EXPECT_NEAR(filled * 8e-6, 1.7, 0.5);  // litres: a brain
}

}  // namespace
