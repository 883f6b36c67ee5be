// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM files in all encodings: frames, byte orders, icons, missing preambles and missing places.
#include <gtest/gtest.h>

#include <cstdio>
#include <functional>
#include <glm/geometric.hpp>
#include <vector>

#include "tests/voxel/volume/dicom_files.h"
#include "tests/voxel/volume/volume_folder.h"

namespace {

namespace fs = std::filesystem;
using tests::dicom_enhanced;
using tests::dicom_slice;
using tests::DicomText;
using tests::EnhancedFrame;
using tests::refusal_of;
using tests::with_preamble;
using voxel::LabelVolume;

class DicomFrames : public tests::VolumeFolder {
 protected:
  // A folder with these files, each named by its number.
  fs::path folder(const std::vector<std::string>& files) {
    const std::string name = "series" + std::to_string(folders_++);
    fs::create_directories(in_folder(name));
    for (std::size_t n = 0; n < files.size(); ++n) (void)write(name + "/" + std::to_string(n), files[n]);
    return in_folder(name);
  }
  // One file for each slice of the base volume.
  fs::path slices(const std::function<std::string(int)>& slice) {
    std::vector<std::string> files;
    for (int k = 0; k < tests::kBaseDims[2]; ++k) files.push_back(slice(k));
    return folder(files);
  }
  static std::string notes_of(const fs::path& path) {
    std::string all;
    for (const std::string& note : voxel::read_volume_header(path).notes) all += note + "\n";
    return all;
  }
  // Expects that the folder holds the base volume, with labels times 100 and 2 mm voxels. The first voxel
  // must be at (-10, -20, 30) mm.
  static void expect_base(const fs::path& path, const std::string& what) {
    voxel::VolumeFileOptions options;
    options.rules = {{100, 100, 1}, {200, 200, 2}, {300, 300, 3}};
    const LabelVolume volume = voxel::load_volume(path, options);
    EXPECT_EQ(tests::counts_of(volume), tests::kBaseCounts) << what;
    EXPECT_LT(glm::distance(volume.spacing_m, glm::dvec3(2e-3)), 1e-12) << what;
    EXPECT_LT(glm::distance(tests::centre_of(volume, 2), glm::dvec3(7e-3, -11e-3, 37e-3)), 1e-12) << what;
    const voxel::VolumeStatistics s = voxel::read_volume_statistics(path);
    EXPECT_EQ(s.minimum, 0.0) << what;
    EXPECT_EQ(s.maximum, 300.0) << what;
  }

 private:
  int folders_ = 0;
};

std::vector<EnhancedFrame> all_frames() {
  std::vector<EnhancedFrame> frames;
  for (int k = 0; k < tests::kBaseDims[2]; ++k) frames.push_back({k, 30.0 + 2.0 * k, {}, {}});
  return frames;
}

// ---- Frames

TEST_F(DicomFrames, EachFrameHasItsOwnRescaling) {
  std::vector<EnhancedFrame> frames = all_frames();
  expect_base(folder({with_preamble(dicom_enhanced(frames))}), "none");
  expect_base(folder({with_preamble(dicom_enhanced(frames, 0.5))}), "shared");
  const std::array<double, 8> slopes{1.0, 0.5, 0.25, 2.0, 4.0, 0.1, 0.4, 0.5};
  for (std::size_t n = 0; n < frames.size(); ++n) frames[n].slope = slopes[n];
  expect_base(folder({with_preamble(dicom_enhanced(frames))}), "by frame");
  for (std::size_t n = 0; n < frames.size(); n += 2) frames[n].slope.reset();
  expect_base(folder({with_preamble(dicom_enhanced(frames, 0.2))}), "by frame, else shared");
  EXPECT_EQ(voxel::read_volume_header(folder({with_preamble(dicom_enhanced(all_frames(), 2.0))})).component,
            "uint32");
  std::string zero = dicom_enhanced(all_frames(), 2.0);
  const std::string two = DicomText{}.words(0x28, 0x1053, {2}), none = DicomText{}.words(0x28, 0x1053, {0});
  zero.replace(zero.find(two), two.size(), none);
  EXPECT_SAYS(refusal_of(folder({with_preamble(zero)})), "rescale slope is 0");
}

// One slope for each slice, as PET scanners write it.
TEST_F(DicomFrames, EachSliceHasItsOwnRescaling) {
  const DicomText text;
  const std::array<double, 8> slopes{1.0, 0.5, 0.25, 2.0, 4.0, 0.1, 0.4, 0.5};
  const auto rescaled = [&](const std::function<std::string(int)>& slope) {
    return slices([&](int k) {
      std::string bytes = dicom_slice(
          text, k, {}, text.element(0x28, 0x1052, "DS", "0") + text.element(0x28, 0x1053, "DS", slope(k)));
      const std::string numbers =
          tests::dicom_pixels(text, {}, k, 100.0 / slopes[static_cast<std::size_t>(k)]);
      return with_preamble(bytes.replace(bytes.size() - numbers.size(), numbers.size(), numbers));
    });
  };
  const auto written = [&](int k, const char* format) {
    std::array<char, 32> number{};
    std::snprintf(number.data(), number.size(), format, slopes[static_cast<std::size_t>(k)]);
    return std::string(number.data());
  };
  expect_base(rescaled([&](int k) { return written(k, "%g"); }), "decimals");
  expect_base(rescaled([&](int k) { return written(k, " %.6E "); }), "powers of ten");
  EXPECT_SAYS(refusal_of(rescaled([](int) { return "0,5"; })), "element (0028,1053) holds '0,5'");
  EXPECT_SAYS(refusal_of(rescaled([](int) { return "0"; })), "rescale slope is 0");
}

TEST_F(DicomFrames, NumbersThatAreNoneAreRefused) {
  const DicomText text;
  const auto with = [&](const std::string& right, const std::string& wrong) {
    return refusal_of(slices([&](int k) {
      std::string bytes = dicom_slice(text, k);
      bytes.replace(bytes.find(right), right.size(), wrong);
      return with_preamble(bytes);
    }));
  };
  const std::string spacing = text.words(0x28, 0x30, {2, 2});
  EXPECT_SAYS(with(spacing, text.element(0x28, 0x30, "DS", "2,0\\2,0")),
              "element (0028,0030) holds '2,0\\2,0'");
  EXPECT_SAYS(with(spacing, text.element(0x28, 0x30, "DS", "2mm\\2mm")), "where numbers are needed");
  EXPECT_SAYS(with(spacing, text.element(0x28, 0x30, "DS", "2")), "one pixel spacing");
  EXPECT_SAYS(
      with(text.words(0x20, 0x37, {1, 0, 0, 0, 1, 0}), text.element(0x20, 0x37, "DS", "1\\0\\0\\0\\1,0\\0")),
      "element (0020,0037)");
}

// Siemens writes the slices of a moment side by side into one picture.
TEST_F(DicomFrames, AMosaicIsNoSlice) {
  const DicomText text;
  const std::string type = text.element(8, 8, "CS", "ORIGINAL\\PRIMARY\\M\\ND\\MOSAIC"),
                    plain = text.element(8, 8, "CS", "ORIGINAL\\PRIMARY\\M\\ND");
  EXPECT_SAYS(refusal_of(folder({with_preamble(type + dicom_slice(text, 3))})), "mosaic");
  EXPECT_SAYS(refusal_of(slices([&](int k) { return with_preamble(type + dicom_slice(text, k)); })),
              "mosaic");
  expect_base(slices([&](int k) { return with_preamble(plain + dicom_slice(text, k)); }), "no mosaic");
}

TEST_F(DicomFrames, FramesAreSortedByTheirPlaces) {
  std::vector<EnhancedFrame> frames = all_frames();
  std::reverse(frames.begin(), frames.end());
  expect_base(folder({with_preamble(dicom_enhanced(frames))}), "head to feet");
  std::swap(frames[1], frames[6]);
  std::swap(frames[0], frames[3]);
  expect_base(folder({with_preamble(dicom_enhanced(frames))}), "in no order");
  // A series may consist of several files, with several frames or one.
  const std::vector<EnhancedFrame> one{frames[0]}, some(frames.begin() + 1, frames.begin() + 4),
      others(frames.begin() + 4, frames.end());
  expect_base(folder({with_preamble(dicom_enhanced(one)), with_preamble(dicom_enhanced(others)),
                      with_preamble(dicom_enhanced(some))}),
              "three files");
}

TEST_F(DicomFrames, FramesThatAreNotOneVolumeAreRefused) {
  std::vector<EnhancedFrame> frames = all_frames();
  const auto said = [&](const std::function<void(std::vector<EnhancedFrame>&)>& change) {
    frames = all_frames();
    change(frames);
    return refusal_of(folder({with_preamble(dicom_enhanced(frames))}));
  };
  using Frames = std::vector<EnhancedFrame>;
  const std::string two_times = said([](Frames& f) { f.insert(f.end(), f.begin(), f.begin() + 8); });
  EXPECT_SAYS(two_times, "same place");
  EXPECT_SAYS(two_times, "frame 9");
  EXPECT_SAYS(said([](Frames& f) { f.push_back(f[2]); }), "same place");
  EXPECT_SAYS(said([](Frames& f) { f.erase(f.begin() + 3); }), "missing (about 1)");
  EXPECT_SAYS(said([](Frames& f) { f[7].z += 0.5; }), "uneven");
  EXPECT_SAYS(said([](Frames& f) { f[4].orientation = {0, 1, 0, 0, 0, 1}; }), "orientation");
  EXPECT_SAYS(said([](Frames& f) { f[4].orientation = {1, 0, 0, 1, 0, 0}; }), "right angles");
  EXPECT_SAYS(refusal_of(folder({with_preamble(dicom_enhanced(all_frames())),
                                 with_preamble(dicom_enhanced(all_frames(), 0.0, "1.2.4"))})),
              "2 DICOM series");
  // The stated count differs from the number of frames.
  std::string bytes = with_preamble(dicom_enhanced(all_frames()));
  const std::string eight = DicomText{}.element(0x28, 8, "IS", "8");
  bytes.replace(bytes.find(eight), eight.size(), DicomText{}.element(0x28, 8, "IS", "7"));
  EXPECT_NE(refusal_of(folder({bytes})), "");
}

// Frames without functional groups. A dose states offsets, other classes state a step between frames, and a
// film over time states neither.
TEST_F(DicomFrames, FramesOfOnePlaceLieByTheirStep) {
  const DicomText text;
  const auto file = [&](const std::string& more, const std::string& of_class) {
    std::string numbers;
    for (int k = 0; k < 8; ++k) numbers += tests::dicom_pixels(text, {}, k);
    const std::string image =
        text.element(8, 0x16, "UI", of_class) + text.element(8, 0x18, "UI", "1.2.3.9") +
        text.element(8, 0x60, "CS", "OT") + more + text.element(0x20, 0xe, "UI", "1.2.3") +
        text.words(0x20, 0x32, {-10, -20, 30}) + text.words(0x20, 0x37, {1, 0, 0, 0, 1, 0}) +
        text.us(0x28, 2, 1) + text.element(0x28, 4, "CS", "MONOCHROME2") + text.element(0x28, 8, "IS", "8") +
        text.us(0x28, 0x10, 10) + text.us(0x28, 0x11, 12) + text.words(0x28, 0x30, {2, 2}) +
        text.us(0x28, 0x100, 16) + text.us(0x28, 0x101, 16) + text.us(0x28, 0x102, 15) +
        text.us(0x28, 0x103, 0) +
        (of_class.back() == '2'
             ? text.words(0x3004, 0xc, {0, 2, 4, 6, 8, 10, 12, 14}) + text.words(0x3004, 0xe, {1})
             : "") +
        text.element(0x7fe0, 0x10, "OW", numbers);
    return with_preamble(image);
  };
  const std::string dose = "1.2.840.10008.5.1.4.1.1.481.2", film = "1.2.840.10008.5.1.4.1.1.7.3";
  expect_base(folder({file("", dose)}), "dose");
  expect_base(folder({file(text.words(0x18, 0x88, {2}), film)}), "step");
  EXPECT_SAYS(refusal_of(folder({file("", film)})), "how far apart");
}

// ---- Byte orders

TEST_F(DicomFrames, NumbersOfEveryByteOrderAreRead) {
  for (const bool implicit : {false, true}) {
    const DicomText text{.big_endian = false, .implicit = implicit};
    for (const int bits : {16, 32}) {
      expect_base(slices([&](int k) {
                    return with_preamble(dicom_slice(text, k, {bits, "OW"}), text);
                  }),
                  "little " + std::to_string(bits));
    }
  }
  const DicomText big{.big_endian = true, .implicit = false};
  for (const int bits : {16, 32}) {
    for (const char* type : {"OW", "OB"}) {
      expect_base(slices([&](int k) {
                    return with_preamble(dicom_slice(big, k, {bits, type}), big);
                  }),
                  "big " + std::to_string(bits) + type);
    }
  }
  // With pixels of 8 bits, only whole words are swapped.
  for (const DicomText& text : {DicomText{}, big}) {
    for (const char* type : {"OW", "OB"}) {
      const fs::path path = slices([&](int k) {
        std::string bytes = dicom_slice(text, k, {8, type});
        const std::string hundredfold = tests::dicom_pixels(text, {8, type}, k);
        bytes.replace(bytes.size() - hundredfold.size(), hundredfold.size(),
                      tests::dicom_pixels(text, {8, type}, k, 1.0));
        return with_preamble(bytes, text);
      });
      const LabelVolume volume = voxel::load_volume(path, {});
      EXPECT_EQ(tests::counts_of(volume), tests::kBaseCounts) << type;
      EXPECT_LT(glm::distance(tests::centre_of(volume, 2), glm::dvec3(7e-3, -11e-3, 37e-3)), 1e-12) << type;
    }
  }
}

// ---- One slice

TEST_F(DicomFrames, ASingleSliceIsAsThickAsItSays) {
  const DicomText text;
  const auto one = [&](const std::string& thickness) {
    return folder({with_preamble(dicom_slice(text, 3, {}, "", true, thickness))});
  };
  const auto thick_m = [&](const std::string& thickness) {
    return voxel::read_volume_header(one(thickness)).spacing_m.z;
  };
  const std::string thickness = text.words(0x18, 0x50, {5}), step = text.words(0x18, 0x88, {5});
  EXPECT_NEAR(thick_m(thickness), 5e-3, 1e-12);
  EXPECT_NEAR(thick_m(step), 5e-3, 1e-12);
  EXPECT_NEAR(thick_m(thickness + text.words(0x18, 0x88, {3})), 5e-3, 1e-12);
  EXPECT_NEAR(thick_m(text.words(0x18, 0x50, {0}) + step), 5e-3, 1e-12);
  EXPECT_SAYS(notes_of(one(thickness)), "5 mm, is taken from its header");
  EXPECT_NEAR(thick_m(""), 1e-3, 1e-12);
  EXPECT_SAYS(notes_of(one("")), "does not say how thick");
  const fs::path enhanced = folder({with_preamble(dicom_enhanced({{3, 36.0, {}, {}}}))});
  EXPECT_NEAR(voxel::read_volume_header(enhanced).spacing_m.z, 2e-3, 1e-12);
}

// ---- Icons, preambles, places

TEST_F(DicomFrames, IconsInSequencesAreNoPixelsOfTheSlice) {
  const DicomText text;
  const std::string jpeg{"\xff\xd8\xff\xe0\x00\x10JF", 8};
  const std::string fragments =
      text.head(0x7fe0, 0x10, "OB", 0xffffffffU) + text.head(0xfffe, 0xe000, "", 0) +
      text.head(0xfffe, 0xe000, "", jpeg.size()) + jpeg + text.head(0xfffe, 0xe0dd, "", 0);
  const std::string plain = text.element(0x7fe0, 0x10, "OB", std::string(16, '\7'));
  const auto icon = [&](const std::string& pixels, bool undefined) {
    return text.sequence(
        0x88, 0x200,
        {text.us(0x28, 2, 1) + text.element(0x28, 4, "CS", "MONOCHROME2") + text.us(0x28, 0x10, 4) +
         text.us(0x28, 0x11, 4) + text.us(0x28, 0x100, 8) + text.us(0x28, 0x101, 8) +
         text.us(0x28, 0x102, 7) + text.us(0x28, 0x103, 0) + pixels},
        undefined);
  };
  for (const bool undefined : {false, true}) {
    for (const std::string& pixels : {fragments, plain}) {
      expect_base(
          slices([&](int k) { return with_preamble(dicom_slice(text, k, {}, icon(pixels, undefined))); }),
          undefined ? "ended by delimiters" : "ended by lengths");
    }
  }
  // A file that has no pixels except an icon's is not a slice, and is left out.
  const fs::path mixed = slices([&](int k) { return with_preamble(dicom_slice(text, k)); });
  std::string report = dicom_slice(text, 0, {}, icon(plain, false));
  report.resize(report.size() - 240 - 12);
  std::ofstream(mixed / "report", std::ios::binary) << with_preamble(report);
  expect_base(mixed, "a report among the slices");
  EXPECT_SAYS(notes_of(mixed), "1 files");
  // An icon in an icon, both of undefined length. The file may be read or refused, but must not crash the
  // reader.
  refusal_of(folder({with_preamble(dicom_slice(text, 0, {}, icon(icon(fragments, true), true)))}));
}

TEST_F(DicomFrames, SlicesWithoutAPreambleAreRead) {
  const DicomText typed, untyped{.big_endian = false, .implicit = true};
  expect_base(slices([&](int k) { return tests::dicom_meta(typed) + dicom_slice(typed, k); }),
              "group 2 first");
  expect_base(slices([&](int k) { return dicom_slice(typed, k); }), "no group 2, with types");
  expect_base(slices([&](int k) { return dicom_slice(untyped, k); }), "no group 2, without types");
  EXPECT_SAYS(refusal_of(slices([&](int k) { return dicom_slice(typed, k).substr(0, 400); })), "damaged");
  EXPECT_SAYS(refusal_of(folder({"no slice at all", std::string(400, '\0')})), "no DICOM series");
}

TEST_F(DicomFrames, SlicesThatDoNotSayWhereTheyLieAreRefused) {
  const DicomText text;
  EXPECT_SAYS(refusal_of(slices([&](int k) { return with_preamble(dicom_slice(text, k, {}, "", false)); })),
              "Image Position (Patient)");
  EXPECT_SAYS(refusal_of(slices([&](int k) { return with_preamble(dicom_slice(text, k, {}, "", k != 5)); })),
              "slice 5 does not say where it lies");
  const fs::path one = folder({with_preamble(dicom_slice(text, 3, {}, "", false))});
  EXPECT_SAYS(notes_of(one), "anatomical directions are unknown");
  EXPECT_FALSE(voxel::read_volume_header(one).directions_known);
}

TEST_F(DicomFrames, PixelsThatAreNoWholeNumbersAreRefused) {
  const DicomText text;
  std::string floats = with_preamble(dicom_slice(text, 0));
  const std::string pixels = text.head(0x7fe0, 0x10, "OW", 240);
  floats.replace(
      floats.find(pixels), pixels.size(),
      text.number(0x7fe0, 2) + text.number(8, 2) + "OF" + std::string(2, '\0') + text.number(240, 4));
  EXPECT_SAYS(refusal_of(folder({floats})), "real numbers");
  std::string bits = with_preamble(dicom_slice(text, 0));
  for (const auto& [at, from, to] : {std::array<unsigned, 3>{0x100, 16, 1}, {0x101, 16, 1}, {0x102, 15, 0}}) {
    const std::string before = text.us(0x28, at, from);
    bits.replace(bits.find(before), before.size(), text.us(0x28, at, to));
  }
  EXPECT_SAYS(refusal_of(folder({bits})), "one bit");
}

}  // namespace
