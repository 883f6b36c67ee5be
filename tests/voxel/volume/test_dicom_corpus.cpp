// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM series made by hand, each with one defect.
#include <gtest/gtest.h>
#include <zlib.h>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <random>
#include <vector>
#include "tests/voxel/volume/dicom_slices.h"
#include "tests/voxel/volume/volume_folder.h"

namespace {

namespace fs = std::filesystem;
using tests::DicomSlice;
using tests::refusal_of;
using voxel::LabelVolume;

class DicomCorpus : public tests::VolumeFolder {
 protected:
  // A folder with these slices, each named by its number.
  fs::path folder(const std::string& name, const std::vector<DicomSlice>& slices) const {
    fs::create_directories(in_folder(name));
    for (std::size_t n = 0; n < slices.size(); ++n)
      (void)write(name + "/" + std::to_string(n), tests::dicom(slices[n]));
    return in_folder(name);
  }
  static std::vector<DicomSlice> stack(std::size_t count) {
    std::vector<DicomSlice> slices(count);
    for (std::size_t n = 0; n < count; ++n) {
      slices[n].position[2] = 2.0 * static_cast<double>(n);
      slices[n].value = static_cast<std::int16_t>(n + 1);
    }
    return slices;
  }
};

TEST_F(DicomCorpus, AStackIsReadInTheOrderOfItsPlaces) {
  std::vector<DicomSlice> slices = stack(5);
  std::swap(slices[0], slices[3]);  // names do not give the order
  const LabelVolume v = voxel::load_volume(folder("a", slices), {});
  EXPECT_EQ(v.dims, (std::array{4, 3, 5}));
  EXPECT_NEAR(v.spacing_m.z, 2e-3, 1e-12);
  for (int k = 0; k < 5; ++k) EXPECT_EQ(v.labels[v.index(1, 1, k)], k + 1);
}

TEST_F(DicomCorpus, RunLengthsAreUnpacked) {
  std::vector<DicomSlice> slices = stack(4);
  for (DicomSlice& slice : slices) slice.syntax = tests::kRunLengths;
  slices[2].columns = slices[1].columns = slices[0].columns = slices[3].columns =
      37;                   // long enough for several runs
  slices[2].value = 0x123;  // uses both bytes
  voxel::VolumeFileOptions options;
  options.rules = {{0x123, 0x123, 9}, {1, 4, 1}};
  const LabelVolume v = voxel::load_volume(folder("a", slices), options);
  ASSERT_EQ(v.dims, (std::array{37, 3, 4}));
  for (std::size_t n = 0; n < v.labels.size(); ++n) EXPECT_EQ(v.labels[n], n / (37 * 3) == 2 ? 9 : 1);
}

TEST_F(DicomCorpus, WhatIsNotOneWholeSeriesIsRefusedInWords) {
  const auto said = [&](const std::string& name,
                        const std::function<void(std::vector<DicomSlice>&)>& change) {
    std::vector<DicomSlice> slices = stack(6);
    change(slices);
    return refusal_of(folder(name, slices));
  };
  using Slices = std::vector<DicomSlice>;
  EXPECT_EQ(said("whole", [](Slices&) {}), "");
  EXPECT_SAYS(said("missing", [](Slices& s) { s.erase(s.begin() + 2); }), "missing (about 1)");
  EXPECT_SAYS(said("twice", [](Slices& s) { s.push_back(s[2]); }), "same place");
  EXPECT_SAYS(said("uneven", [](Slices& s) { s[5].position[2] += 0.7; }), "uneven");
  EXPECT_SAYS(said("tilted",
                   [](Slices& s) {
                     for (std::size_t n = 0; n < 6; ++n) s[n].position[1] = 0.5 * static_cast<double>(n);
                   }),
              "sideways");
  EXPECT_SAYS(said("mixed_series", [](Slices& s) { s[1].series = "1.2.4"; }), "2 DICOM series");
  EXPECT_SAYS(said("mixed_turn", [](Slices& s) { s[4].orientation = {0, 1, 0, 0, 0, 1}; }), "orientation");
  EXPECT_SAYS(said("mirrored", [](Slices& s) { s[4].orientation = {-1, 0, 0, 0, 1, 0}; }), "orientation");
  EXPECT_SAYS(said("mixed_size", [](Slices& s) { s[3].rows = 5; }), "size");
  EXPECT_SAYS(said("mixed_spacing", [](Slices& s) { s[3].spacing[0] = 1.5; }), "spacing");
  EXPECT_SAYS(said("zero_spacing",
                   [](Slices& s) {
                     for (DicomSlice& slice : s) slice.spacing = {0.0, 0.0};
                   }),
              "spacing");
  EXPECT_SAYS(said("colour",
                   [](Slices& s) {
                     for (DicomSlice& slice : s) slice.samples = 3;
                   }),
              "single intensities");
  EXPECT_SAYS(said("deflated", [](Slices& s) { s[0].syntax = "1.2.840.10008.1.2.1.99"; }), "deflated");
  EXPECT_SAYS(said("unknown_syntax",
                   [](Slices& s) {
                     for (DicomSlice& slice : s) slice.syntax = "1.2.3.4";
                   }),
              "unknown_syntax");
}

TEST_F(DicomCorpus, AMissingPixelSpacingIsSaid) {
  std::vector<DicomSlice> slices = stack(3);
  EXPECT_TRUE(voxel::read_volume_header(folder("said", slices)).notes.empty());
  for (DicomSlice& slice : slices) slice.spacing = {-1.0, -1.0};
  const auto notes = voxel::read_volume_header(folder("unsaid", slices)).notes;
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_SAYS(notes[0], "pixels");
}

}  // namespace
