// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/read_volume.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <iostream>
#include <limits>
#include <map>
#include <random>
#include <sstream>

#include "tests/voxel/volume/volume_folder.h"

namespace {

namespace fs = std::filesystem;
using tests::contents;
using tests::place_of;
using tests::refusal;
using tests::refusal_of;
using voxel::LabelVolume;
using voxel::VolumeError;
using voxel::VolumeFileOptions;

class VolumeFile : public tests::VolumeFolder {};

LabelVolume random_volume(std::array<int, 3> dims, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  LabelVolume volume;
  volume.dims = dims;
  volume.spacing_m = {1.1e-3, 0.7e-3, 2.3e-3};
  volume.origin_m = {0.1 * unit(random), 0.1 * unit(random), 0.1 * unit(random)};
  volume.rotation = glm::normalize(glm::dquat(unit(random), unit(random), unit(random), unit(random)));
  std::size_t count = 1;
  for (const int n : dims) count *= static_cast<std::size_t>(n);
  volume.labels.resize(count);
  for (auto& label : volume.labels) label = static_cast<std::uint8_t>(random() % 5);
  return volume;
}

constexpr std::array<const char*, 6> kNames{"v.nii", "v.nii.gz", "v.nrrd", "v.nhdr", "v.mha", "v.mhd"};

// ---- Round trips

TEST_F(VolumeFile, RoundTripKeepsLabelsAndFrame) {
  for (const char* name : kNames) {
    for (unsigned seed = 0; seed < 6; ++seed) {
      const LabelVolume volume = random_volume({5, 4, 3}, seed);
      const fs::path path = in_folder(name);
      voxel::save_volume(path, volume);
      const LabelVolume back = voxel::load_volume(path, {});
      EXPECT_EQ(back.dims, volume.dims) << name;
      EXPECT_EQ(back.labels, volume.labels) << name;
      const double tolerance = std::string(name).find(".nii") != std::string::npos ? 1e-7 : 1e-12;
      for (const int corner : {0, 1, 2, 3, 4, 5, 6, 7}) {
        const int i = (corner & 1) * 4;
        const int j = ((corner >> 1) & 1) * 3;
        const int k = (corner >> 2) * 2;
        EXPECT_LT(glm::distance(place_of(back, i, j, k), place_of(volume, i, j, k)), tolerance) << name;
      }
      EXPECT_EQ(voxel::read_volume_header(path).bytes, 60U);
    }
  }
}

TEST_F(VolumeFile, RoundTripOfThinVolumesAndOtherUnits) {
  for (const char* name : kNames) {
    for (const std::array<int, 3> dims : {std::array{1, 1, 1}, {7, 1, 1}, {1, 1, 7}, {4, 5, 1}, {1, 5, 4}}) {
      LabelVolume volume = random_volume(dims, 3);
      volume.rotation = {1.0, 0.0, 0.0, 0.0};
      const fs::path path = in_folder(name);
      voxel::save_volume(path, volume, 1e-6);
      VolumeFileOptions options;
      options.unit_m = 1e-6;
      const LabelVolume back = voxel::load_volume(path, options);
      EXPECT_EQ(back.dims, volume.dims) << name;
      EXPECT_EQ(back.labels, volume.labels) << name;
      EXPECT_LT(glm::distance(back.spacing_m, volume.spacing_m), 1e-9) << name;
      EXPECT_LT(glm::distance(back.origin_m, volume.origin_m), 1e-7) << name;
      EXPECT_LT(glm::distance(voxel::load_volume(path, {}).spacing_m, volume.spacing_m), 1e-9) << name;
    }
  }
}

TEST_F(VolumeFile, QuarterTurnsAreExact) {
  for (const char* name : kNames) {
    LabelVolume volume = random_volume({2, 3, 4}, 1);
    volume.rotation = {0.5, 0.5, 0.5, 0.5};  // maps x to y, y to z, z to x
    voxel::save_volume(in_folder(name), volume);
    const glm::dquat q = voxel::load_volume(in_folder(name), {}).rotation;
    EXPECT_EQ(std::abs(q.w), 0.5) << name;
    EXPECT_TRUE(q.x == q.w && q.y == q.w && q.z == q.w) << name;
    volume.rotation = {1.0, 0.0, 0.0, 0.0};
    voxel::save_volume(in_folder(name), volume);
    EXPECT_EQ(voxel::load_volume(in_folder(name), {}).rotation, volume.rotation) << name;
  }
}

TEST_F(VolumeFile, SavingIsRefusedInWords) {
  LabelVolume volume = random_volume({5, 4, 3}, 0);
  const auto save = [&](const fs::path& path) { return refusal([&] { voxel::save_volume(path, volume); }); };
  EXPECT_SAYS(save(in_folder("v.png")), ".nii.gz");
  EXPECT_SAYS(save(in_folder("nowhere") / "v.nii"), "no folder");
  fs::create_directories(in_folder("folder.nii"));
  EXPECT_SAYS(save(in_folder("folder.nii")), "cannot be written");
  volume.labels.pop_back();
  EXPECT_SAYS(save(in_folder("v.nii")), "59 labels");
  volume = LabelVolume{};
  EXPECT_SAYS(save(in_folder("v.nii")), "0 voxels");
  volume = random_volume({40000, 1, 1}, 0);
  EXPECT_SAYS(save(in_folder("v.nii")), "32,767");
  EXPECT_EQ(save(in_folder("v.nrrd")), "");
}

// ---- Left-handed frames, rules and resampling, with MetaImage files made by hand, against their definition

std::string meta(const std::string& dims, const std::string& spacing, const std::string& matrix,
                 const std::string& type, const std::string& data, const std::string& more = "") {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
         "False\n" +
         more + "TransformMatrix = " + matrix + "\nOffset = 10 20 30\nElementSpacing = " + spacing +
         "\nDimSize = " + dims + "\nElementType = " + type + "\nElementDataFile = LOCAL\n" + data;
}

constexpr const char* kStraight = "1 0 0 0 1 0 0 0 1";

TEST_F(VolumeFile, LeftHandedFramesKeepEachVoxelInItsPlace) {
  std::string data;
  for (int n = 0; n < 24; ++n) data.push_back(static_cast<char>(n));
  const std::array<std::string, 4> matrices{"-1 0 0 0 1 0 0 0 1", "1 0 0 0 -1 0 0 0 1", "0 1 0 1 0 0 0 0 1",
                                            "0.6 0.8 0 -0.8 0.6 0 0 0 -1"};
  for (const std::string& matrix : matrices) {
    const fs::path path = write("v.mha", meta("2 3 4", "1 2 3", matrix, "MET_UCHAR", data));
    const LabelVolume volume = voxel::load_volume(path, {});
    EXPECT_FALSE(voxel::read_volume_header(path).notes.empty());
    std::array<double, 9> m{};
    std::istringstream in(matrix);
    for (double& value : m) in >> value;
    EXPECT_NEAR(glm::length(volume.rotation), 1.0, 1e-12);
    std::map<int, glm::dvec3> places;
    for (int k = 0; k < 4; ++k) {
      for (int j = 0; j < 3; ++j) {
        for (int i = 0; i < 2; ++i) places[volume.labels[volume.index(i, j, k)]] = place_of(volume, i, j, k);
      }
    }
    for (int n = 0; n < 24; ++n) {  // in MetaImage, each axis is three numbers of the matrix
      const std::array<int, 3> index{n % 2, n / 2 % 3, n / 6};
      const glm::dvec3 at(index[0] * 1.0, index[1] * 2.0, index[2] * 3.0);
      glm::dvec3 expected(10.0, 20.0, 30.0);
      for (int axis = 0; axis < 3; ++axis) {
        const std::size_t a = 3 * static_cast<std::size_t>(axis);
        expected += at[axis] * glm::dvec3(m[a], m[a + 1], m[a + 2]);
      }
      EXPECT_LT(glm::distance(places[n], expected * 1e-3), 1e-12) << matrix << ' ' << n;
    }
  }
}

template <typename T>
std::string as_bytes(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

template <typename T>
void expect_rules(const VolumeFile&,
                  const std::function<fs::path(const std::string&, const std::string&)>& write,
                  const std::string& type) {
  const std::vector<T> values{0, 1, 2, 10, 50, 51, 99, 120};
  const fs::path path = write("v.mha", meta("8 1 1", "1 1 1", kStraight, type, as_bytes(values)));
  VolumeFileOptions options;
  options.rules = {{10, 50, 3}, {40, 99, 4}, {-1e300, 0, 5}};
  EXPECT_EQ(voxel::load_volume(path, options).labels, (std::vector<std::uint8_t>{5, 0, 0, 3, 3, 4, 4, 0}))
      << type;
  EXPECT_EQ(voxel::load_volume(path, {}).labels, (std::vector<std::uint8_t>{0, 1, 2, 10, 50, 51, 99, 120}))
      << type;
  const voxel::VolumeStatistics statistics = voxel::read_volume_statistics(path);
  EXPECT_EQ(statistics.maximum, 120.0);
  EXPECT_EQ(statistics.label_counts.size(), 8U);
}

TEST_F(VolumeFile, RulesMapEveryComponentType) {
  const auto put = [&](const std::string& name, const std::string& bytes) { return write(name, bytes); };
  expect_rules<std::uint8_t>(*this, put, "MET_UCHAR");
  expect_rules<std::int8_t>(*this, put, "MET_CHAR");
  expect_rules<std::uint16_t>(*this, put, "MET_USHORT");
  expect_rules<std::int16_t>(*this, put, "MET_SHORT");
  expect_rules<std::uint32_t>(*this, put, "MET_UINT");
  expect_rules<std::int32_t>(*this, put, "MET_INT");
  expect_rules<std::uint64_t>(*this, put, "MET_ULONG_LONG");
  expect_rules<std::int64_t>(*this, put, "MET_LONG_LONG");
  expect_rules<float>(*this, put, "MET_FLOAT");
  expect_rules<double>(*this, put, "MET_DOUBLE");
}

TEST_F(VolumeFile, NotANumberIsEmptyAndIntensitiesAreNotLabels) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const fs::path path = write(
      "v.mha", meta("3 1 1", "1 1 1", kStraight, "MET_FLOAT", as_bytes<float>({nan, -1024.0F, 300.5F})));
  VolumeFileOptions options;
  options.rules = {{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), 7}};
  EXPECT_EQ(voxel::load_volume(path, options).labels, (std::vector<std::uint8_t>{0, 7, 7}));
  EXPECT_SAYS(refusal_of(path), "say which range");
  const voxel::VolumeStatistics statistics = voxel::read_volume_statistics(path);
  EXPECT_EQ(std::pair(statistics.minimum, statistics.maximum), std::pair(-1024.0, 300.5));
  EXPECT_EQ(statistics.not_numbers, 1U);
  EXPECT_TRUE(statistics.label_counts.empty());
}

TEST_F(VolumeFile, ResamplingTakesTheNearestVoxelAndCoversTheExtent) {
  for (const bool left_handed : {false, true}) {
    std::string data;
    for (int n = 0; n < 7 * 6 * 5; ++n) data.push_back(static_cast<char>(n));
    const fs::path path = write(
        "v.mha", meta("7 6 5", "1 1.5 2", left_handed ? "-1 0 0 0 1 0 0 0 1" : kStraight, "MET_UCHAR", data));
    const LabelVolume source = voxel::load_volume(path, {});
    for (const glm::dvec3 spacing :
         {glm::dvec3(1e-3), glm::dvec3(0.4e-3, 0.5e-3, 0.7e-3), glm::dvec3(3e-3, 2e-3, 9e-3)}) {
      VolumeFileOptions options;
      options.spacing_m = spacing;
      const LabelVolume result = voxel::load_volume(path, options);
      const glm::dvec3 middle_before =
          0.5 * (place_of(source, 0, 0, 0) +
                 place_of(source, source.dims[0] - 1, source.dims[1] - 1, source.dims[2] - 1));
      const glm::dvec3 middle_after =
          0.5 * (place_of(result, 0, 0, 0) +
                 place_of(result, result.dims[0] - 1, result.dims[1] - 1, result.dims[2] - 1));
      EXPECT_LT(glm::distance(middle_before, middle_after), 1e-12);
      for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const double before = source.dims[a] * source.spacing_m[axis];
        const double after = result.dims[a] * spacing[axis];
        EXPECT_GE(after, before * (1.0 - 1e-9));
        EXPECT_LT(after - spacing[axis], before);
      }
      for (int k = 0; k < result.dims[2]; ++k) {
        for (int j = 0; j < result.dims[1]; ++j) {
          for (int i = 0; i < result.dims[0]; ++i) {
            const glm::dvec3 p =
                glm::conjugate(source.rotation) * (place_of(result, i, j, k) - source.origin_m);
            std::array<int, 3> nearest{};
            bool tie = false;
            for (int axis = 0; axis < 3; ++axis) {
              const double at = p[axis] / source.spacing_m[axis];
              tie = tie || std::abs(at - std::floor(at) - 0.5) < 1e-6;
              nearest[static_cast<std::size_t>(axis)] = static_cast<int>(std::lround(at));
            }
            if (tie) continue;
            ASSERT_EQ(result.labels[result.index(i, j, k)],
                      source.labels[source.index(nearest[0], nearest[1], nearest[2])]);
          }
        }
      }
    }
  }
}

// ---- Refusals

TEST_F(VolumeFile, RefusesWrongHeadersInWords) {
  const std::string data(24, '\1');
  const auto say = [&](const std::string& text) { return refusal_of(write("v.mha", text)); };
  EXPECT_EQ(say(meta("2 3 4", "1 1 1", kStraight, "MET_UCHAR", data)), "");
  EXPECT_SAYS(say(meta("2 3 4", "1 0 1", kStraight, "MET_UCHAR", data)), "spacing");
  EXPECT_SAYS(say(meta("2 3 4", "1 -2 1", kStraight, "MET_UCHAR", data)), "spacing");
  EXPECT_SAYS(say(meta("2 3 4", "1 nan 1", kStraight, "MET_UCHAR", data)), "");
  EXPECT_SAYS(say(meta("2 3 0", "1 1 1", kStraight, "MET_UCHAR", data)), "v.mha");
  EXPECT_SAYS(say(meta("2 3 -4", "1 1 1", kStraight, "MET_UCHAR", data)), "v.mha");
  EXPECT_SAYS(say(meta("2 3 4", "1 1 1", "1 0 0 0.5 1 0 0 0 1", "MET_UCHAR", data)), "right angles");
  EXPECT_SAYS(say(meta("2 3 4", "1 1 1", "0 0 0 0 1 0 0 0 1", "MET_UCHAR", data)), "right angles");
  EXPECT_SAYS(say(meta("2 2 2", "1 1 1", kStraight, "MET_UCHAR", data, "ElementNumberOfChannels = 3\n")),
              "one channel");
  EXPECT_SAYS(say(meta("200 300 400", "1 1 1", kStraight, "MET_UCHAR", data)), "has only");
  EXPECT_SAYS(say(meta("2 3 4", "1 1 1", kStraight, "MET_UCHAR", data.substr(1))), "v.mha");
  EXPECT_SAYS(say("ObjectType = Image\nNDims = 1000000\nElementDataFile = LOCAL\n"), "axes");
  EXPECT_SAYS(say(std::string(100'000, 'x')), "1,000 characters");
  EXPECT_SAYS(say(std::string(100, '\0')), "not text");
  EXPECT_SAYS(say(""), "empty");
  std::string elsewhere = meta("2 3 4", "1 1 1", kStraight, "MET_UCHAR", "");
  const auto with_data_file = [&](const std::string& name) {
    std::string text = elsewhere;
    return text.replace(text.find("LOCAL"), 5, name);
  };
  EXPECT_SAYS(say(with_data_file("gone.raw")), "gone.raw");
  EXPECT_SAYS(say(with_data_file("/dev/zero")), "/dev/zero");
  EXPECT_SAYS(say(with_data_file("%s%n%s%n.raw 1 4 1")), "several files");
  EXPECT_SAYS(say(with_data_file("LIST")), "several files");
}

TEST_F(VolumeFile, RefusesWhatIsNoVolume) {
  EXPECT_SAYS(refusal_of(in_folder("gone.nii.gz")), "no such file");
  EXPECT_SAYS(refusal_of(write("picture.png", "x")), ".nii.gz");
  EXPECT_SAYS(refusal_of(write("slice.dcm", "x")), "folder");
  EXPECT_SAYS(refusal_of(write("v.nii", "this is not a volume")), "v.nii");
  EXPECT_SAYS(refusal_of(write("v.nii.gz", "this is not a volume")), "v.nii.gz");
  EXPECT_SAYS(refusal_of(write("v.nrrd", "this is not a volume")), "v.nrrd");
  fs::create_directories(in_folder("empty"));
  EXPECT_SAYS(refusal_of(in_folder("empty")), "no DICOM series");
  EXPECT_SAYS(refusal_of("/dev/null"), "/dev/null");
}

TEST_F(VolumeFile, RefusesBadOptionsAndTooMuchMemory) {
  const fs::path path = in_folder("v.nii.gz");
  voxel::save_volume(path, random_volume({50, 40, 30}, 0));
  VolumeFileOptions options;
  options.max_bytes = 50'000;  // too few for 60,000 voxels
  EXPECT_SAYS(refusal_of(path, options), "50 x 40 x 30");
  EXPECT_SAYS(refusal([&] { voxel::read_volume_statistics(path, 1000); }), "MB");
  options = {};
  options.spacing_m = glm::dvec3(1e-9);
  EXPECT_SAYS(refusal_of(path, options), "limit");
  options.spacing_m = glm::dvec3(1e-5);
  EXPECT_SAYS(refusal_of(path, options), "need");
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    options = {};
    options.spacing_m = glm::dvec3(1e-3, bad, 1e-3);
    EXPECT_SAYS(refusal_of(path, options), "spacing");
    options = {};
    options.unit_m = bad;
    EXPECT_SAYS(refusal_of(path, options), "unit");
    options = {};
    options.rules = {{bad, -2.0, 1}};
    EXPECT_SAYS(refusal_of(path, options), "range");
  }
  options.rules = {{0.0, 1.0, 0}};
  EXPECT_SAYS(refusal_of(path, options), "label 0");
}

// A NIfTI header with these dimensions, little-endian, and `bytes` of zeros after it.
std::string nifti(const std::vector<std::int16_t>& dims, std::int16_t type, std::int16_t bits,
                  std::size_t bytes) {
  std::string text(352 + bytes, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(&text[at], &value, sizeof(value)); };
  put(0, std::int32_t{348});
  put(40, static_cast<std::int16_t>(dims.size()));
  for (std::size_t n = 0; n < dims.size(); ++n) put(42 + 2 * n, dims[n]);
  put(70, type);
  put(72, bits);
  for (std::size_t n = 0; n < 8; ++n) put(76 + 4 * n, 1.0F);
  put(108, 352.0F);
  put(112, 1.0F);
  std::memcpy(&text[344], "n+1", 4);
  return text;
}

TEST_F(VolumeFile, NiftiHeadersThatAreNotOneVolume) {
  const auto say = [&](const std::string& text) { return refusal_of(write("v.nii", text)); };
  EXPECT_EQ(say(nifti({2, 3, 4}, 2, 8, 24)), "");
  EXPECT_EQ(say(nifti({2, 3, 4, 1}, 2, 8, 24)), "");
  EXPECT_SAYS(say(nifti({2, 3, 4, 5}, 2, 8, 120)), "4 axes");
  EXPECT_SAYS(say(nifti({2, 3, 4, 1, 3}, 2, 8, 72)), "5 axes");    // a vector image
  EXPECT_SAYS(say(nifti({2, 3, 4}, 128, 24, 72)), "one channel");  // RGB
  EXPECT_SAYS(say(nifti({30000, 30000, 30000}, 2, 8, 24)), "has only");
  EXPECT_SAYS(say(nifti({2, 3, 4}, 2, 8, 23)), "v.nii");
  EXPECT_SAYS(say(nifti({2, 3, 4}, 2, 8, 24).substr(0, 200)), "v.nii");
  EXPECT_SAYS(say(nifti({2, 0, 4}, 2, 8, 24)), "v.nii");
  std::string scaled = nifti({3, 1, 1}, 4, 16, 6);
  const std::array<std::int16_t, 3> values{0, 1, 2};
  std::memcpy(&scaled[352], values.data(), 6);
  const float slope = 2.5F;
  const float intercept = -1.0F;
  std::memcpy(&scaled[112], &slope, 4);
  std::memcpy(&scaled[116], &intercept, 4);
  const voxel::VolumeStatistics statistics = voxel::read_volume_statistics(write("v.nii", scaled));
  EXPECT_EQ(statistics.minimum, -1.0);
  EXPECT_EQ(statistics.maximum, 4.0);
}

// ---- Mutations: all bytes must end in a volume within the limit or in a VolumeError

TEST_F(VolumeFile, MutatedFilesEndInAVolumeOrARefusal) {
  std::mt19937 random(20);
  const LabelVolume volume = random_volume({6, 5, 4}, 2);
  VolumeFileOptions options;
  options.max_bytes = 16U << 20U;
  options.rules = {{1, 255, 1}};
  const auto start = std::chrono::steady_clock::now();
  std::size_t loaded = 0;
  std::size_t refused = 0;
  // On a slow machine the test does fewer mutations instead of taking longer.
  const auto late = [&] { return std::chrono::steady_clock::now() - start > std::chrono::seconds(15); };
  ::testing::internal::CaptureStdout();  // the libraries print messages when they fail
  ::testing::internal::CaptureStderr();
  for (const char* name : kNames) {
    const fs::path path = in_folder(name);
    voxel::save_volume(path, volume);
    const std::string original = contents(path);
    for (int n = 0; n < 800 && !late(); ++n) {
      std::string bytes = original;
      // Mutates the header more often than the voxels, because most defects are possible there.
      const std::size_t reach = n % 4 == 0 ? bytes.size() : std::min<std::size_t>(bytes.size(), 360);
      const auto changes = 1 + random() % 3;
      for (unsigned change = 0; change < changes; ++change) {
        const std::size_t at = random() % reach;
        switch (random() % 5) {
          case 0:
            bytes[at] = static_cast<char>(random());
            break;
          case 1:
            bytes[at] = static_cast<char>(bytes[at] ^ (1U << random() % 8));
            break;
          case 2:
            bytes[at] = "0123456789-. "[random() % 13];
            break;
          case 3:
            bytes.insert(at, 1 + random() % 4, "09-x \n"[random() % 6]);
            break;
          default:
            bytes.resize(std::max<std::size_t>(at, 1));
            break;
        }
        if (bytes.size() < reach) break;
      }
      fs::remove(path);  // unlike a rewritten file, a new file is not flushed to the disk
      std::ofstream(path, std::ios::binary) << bytes;
      try {
        const LabelVolume result = voxel::load_volume(path, options);
        ++loaded;
        ASSERT_LE(result.labels.size(), options.max_bytes);
        ASSERT_EQ(result.labels.size(), static_cast<std::size_t>(result.dims[0]) *
                                            static_cast<std::size_t>(result.dims[1]) *
                                            static_cast<std::size_t>(result.dims[2]));
        ASSERT_NEAR(glm::length(result.rotation), 1.0, 1e-6);
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_TRUE(std::isfinite(result.spacing_m[axis]) && result.spacing_m[axis] > 0.0);
          ASSERT_TRUE(std::isfinite(result.origin_m[axis]));
        }
      } catch (const VolumeError& error) {
        ++refused;
        ASSERT_NE(std::string(error.what()).find(path.filename().string()), std::string::npos)
            << error.what();
      }
    }
  }
  ::testing::internal::GetCapturedStdout();
  ::testing::internal::GetCapturedStderr();
  std::cout << loaded << " loaded, " << refused << " refused\n";
  EXPECT_GT(refused, 100U);
}

}  // namespace
