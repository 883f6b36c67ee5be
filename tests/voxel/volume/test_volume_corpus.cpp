// SPDX-License-Identifier: GPL-3.0-or-later
// Volumes made by hand, each with one defect or peculiarity. Each is read correctly, or refused with a
// message that names the defect. The same files with random bytes changed or cut off must end in a volume or
// a refusal.
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

#include "tests/voxel/volume/dicom_files.h"
#include "tests/voxel/volume/dicom_slices.h"
#include "tests/voxel/volume/volume_folder.h"

// Read by the leak check of the address sanitizer. ITK's readers of NRRD and MetaImage do not free their own
// header and message (3 kB) where they refuse a file.
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:libITKNrrdIO\nleak:libITKMetaIO\n";
}

namespace {

namespace fs = std::filesystem;
using tests::DicomSlice;
using voxel::LabelVolume;

class VolumeCorpus : public tests::VolumeFolder {};

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// A NIfTI file of 4 x 3 x 2 voxels with the values 0, 1, 2, … The cases change its public members.
struct Nifti {
  std::vector<std::int16_t> dims{4, 3, 2};
  std::int16_t type = 2, bits = 8;
  std::array<float, 3> spacing{1.0F, 1.0F, 1.0F};
  std::array<float, 12> sform{};
  bool has_sform = false, has_qform = false, big_endian = false;
  float offset = 352.0F, slope = 0.0F;
  std::string magic = "n+1";
  std::int32_t header_bytes = 348;

  [[nodiscard]] std::string text() const {
    std::string out(352, '\0');
    const auto put = [&](std::size_t at, auto value) {
      std::array<char, sizeof(value)> bytes{};
      std::memcpy(bytes.data(), &value, sizeof(value));
      if (big_endian) std::reverse(bytes.begin(), bytes.end());
      out.replace(at, sizeof(value), bytes.data(), sizeof(value));
    };
    put(0, header_bytes);
    put(40, static_cast<std::int16_t>(dims.size()));
    for (std::size_t n = 0; n < 7; ++n) put(42 + 2 * n, n < dims.size() ? dims[n] : std::int16_t{1});
    put(70, type);
    put(72, bits);
    for (std::size_t n = 0; n < 8; ++n) put(76 + 4 * n, n >= 1 && n <= 3 ? spacing[n - 1] : 1.0F);
    put(108, offset);
    put(112, slope);
    put(252, static_cast<std::int16_t>(has_qform));
    put(254, static_cast<std::int16_t>(has_sform));
    for (std::size_t n = 0; n < 12; ++n) put(280 + 4 * n, sform[n]);
    out.replace(344, magic.size(), magic);
    std::size_t voxels = 1;
    for (const std::int16_t n : dims) voxels *= static_cast<std::size_t>(std::max<std::int16_t>(n, 1));
    const std::size_t at = out.size();
    out.resize(at + voxels * static_cast<std::size_t>(bits / 8));
    for (std::size_t n = 0; n < voxels; ++n) {
      if (type == 2) out[at + n] = static_cast<char>(n);
      if (type == 4) put(at + 2 * n, static_cast<std::int16_t>(n));
      if (type == 8) put(at + 4 * n, static_cast<std::int32_t>(n));
      if (type == 16) put(at + 4 * n, static_cast<float>(n));
      if (type == 64) put(at + 8 * n, static_cast<double>(n));
    }
    return out;
  }
};

std::string gzip(const std::string& text) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY);
  std::string out(text.size() + 200, '\0'), in = text;
  stream.next_in = reinterpret_cast<unsigned char*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<unsigned char*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

std::string counting() {
  std::string out;
  for (int n = 0; n < 24; ++n) out.push_back(static_cast<char>(n));
  return out;
}

std::string meta(const std::map<std::string, std::string>& changed, const std::string& data = counting()) {
  std::string out;
  const std::vector<std::array<std::string, 2>> lines{{"ObjectType", "Image"},
                                                      {"NDims", "3"},
                                                      {"BinaryData", "True"},
                                                      {"BinaryDataByteOrderMSB", "False"},
                                                      {"TransformMatrix", "1 0 0 0 1 0 0 0 1"},
                                                      {"Offset", "0 0 0"},
                                                      {"ElementSpacing", "1 1 1"},
                                                      {"DimSize", "4 3 2"},
                                                      {"ElementNumberOfChannels", "1"},
                                                      {"ElementType", "MET_UCHAR"},
                                                      {"ElementDataFile", "LOCAL"}};
  for (const auto& [key, value] : lines) {
    const auto other = changed.find(key);
    const std::string& is = other == changed.end() ? value : other->second;
    if (!is.empty()) out.append(key).append(" = ").append(is).append("\n");
  }
  return out + data;
}

std::string nrrd(const std::map<std::string, std::string>& changed, const std::string& data = counting()) {
  std::map<std::string, std::string> lines{{"type", "uint8"},
                                           {"dimension", "3"},
                                           {"space", "left-posterior-superior"},
                                           {"sizes", "4 3 2"},
                                           {"space directions", "(1,0,0) (0,1,0) (0,0,1)"},
                                           {"space origin", "(0,0,0)"},
                                           {"endian", "little"},
                                           {"encoding", "raw"}};
  for (const auto& [key, value] : changed) lines[key] = value;
  std::string out = "NRRD0004\n";
  // The format requires this order: the number of axes comes before their properties.
  for (const char* key : {"type", "dimension", "space", "sizes", "spacings", "space directions", "kinds",
                          "endian", "encoding", "space origin", "byte skip", "line skip"}) {
    const auto line = lines.find(key);
    if (line != lines.end() && !line->second.empty())
      out.append(key).append(": ").append(line->second).append("\n");
  }
  return out + "\n" + data;
}

template <typename T>
std::string swapped_bytes() {
  std::string out;
  for (int n = 0; n < 24; ++n) {
    const T value = static_cast<T>(n);
    std::array<char, sizeof(T)> bytes{};
    std::memcpy(bytes.data(), &value, sizeof(T));
    std::reverse(bytes.begin(), bytes.end());
    out.append(bytes.data(), bytes.size());
  }
  return out;
}

struct Case {
  std::string name, bytes;
  std::string refusal;  // part of the expected message; empty: the file is read, with the values 0, 1, 2, …
  std::string note{};   // part of the note that is expected for the file
};

Nifti with(const std::function<void(Nifti&)>& change) {
  Nifti n;
  change(n);
  return n;
}

std::vector<Case> corpus() {
  std::vector<Case> all;
  const auto nifti = [&](const char* refusal, const std::function<void(Nifti&)>& change,
                         const char* note = "") {
    all.push_back({"v.nii", with(change).text(), refusal, note});
  };
  // Sizes.
  nifti("", [](Nifti&) {});
  nifti("0 voxels", [](Nifti& n) { n.dims = {4, 0, 2}; });
  nifti("-3 voxels", [](Nifti& n) { n.dims = {4, -3, 2}; });
  nifti("4 axes", [](Nifti& n) { n.dims = {4, 3, 2, 5}; });
  nifti("", [](Nifti& n) { n.dims = {4, 3, 2, 1}; });
  nifti("9 axes", [](Nifti& n) { n.dims = {4, 3, 2, 1, 1, 1, 1, 1, 1}; });
  all.push_back({"v.nii", Nifti{}.text() + "more", "", "4 bytes behind"});
  all.push_back({"v.nii", Nifti{}.text().substr(0, 370), "has only"});
  all.push_back({"v.mha", meta({{"DimSize", "4 3 2000000000"}}), "1,000,000 along each"});
  all.push_back({"v.mha", meta({{"DimSize", "9999 9999 9999"}}), "has only"});
  all.push_back({"v.mha", meta({{"DimSize", "4 3"}}), "header cannot be read"});
  all.push_back({"v.nrrd", nrrd({{"sizes", "4 3"}}), "header cannot be read"});
  // Spacing.
  nifti("spacing of 0", [](Nifti& n) { n.spacing[1] = 0.0F; });
  nifti("spacing of -1", [](Nifti& n) { n.spacing[1] = -1.0F; });
  nifti("nan", [](Nifti& n) { n.spacing[1] = kNan; });
  nifti("inf", [](Nifti& n) { n.spacing[1] = std::numeric_limits<float>::infinity(); });
  nifti("1 nm", [](Nifti& n) { n.spacing[1] = 1e-20F; });
  for (const char* bad : {"0 1 1", "-1 1 1", "nan 1 1", "inf 1 1"})
    all.push_back({"v.mha", meta({{"ElementSpacing", bad}}), "v.mha"});
  all.push_back({"v.mha", meta({{"ElementSpacing", ""}}), "", "no voxel spacing"});
  const std::string none;
  all.push_back({"v.nrrd", nrrd({{"space", none}, {"space directions", none}, {"space origin", none}}), "",
                 "no voxel spacing"});
  all.push_back(
      {"v.nrrd",
       nrrd({{"space", none}, {"space directions", none}, {"space origin", none}, {"spacings", "1 nan 1"}}),
       "nan"});
  all.push_back({"v.nrrd", nrrd({{"space directions", "(0,0,0) (0,1,0) (0,0,1)"}}), "spacing of 0"});
  all.push_back({"v.nrrd", nrrd({{"space directions", "none (0,1,0) (0,0,1)"}}), "no direction"});
  // Axes.
  all.push_back({"v.mha", meta({{"TransformMatrix", "1 0 0 0.5 1 0 0 0 1"}}), "right angles"});
  all.push_back({"v.mha", meta({{"TransformMatrix", "2 0 0 0 2 0 0 0 2"}}), "right angles"});
  all.push_back({"v.nrrd", nrrd({{"space directions", "(1,0,0) (0.5,1,0) (0,0,1)"}}), "right angles"});
  nifti("right angles", [](Nifti& n) {
    n.has_sform = true;
    n.sform = {1, 0.5F, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  });
  nifti("as long as", [](Nifti& n) {
    n.has_sform = true;
    n.sform = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0};
  });
  nifti(
      "",
      [](Nifti& n) {
        n.has_sform = n.has_qform = true;
        n.sform = {1, 0, 0, 30, 0, 1, 0, 0, 0, 0, 1, 0};
      },
      "different places");
  // Types of voxels.
  nifti("one channel", [](Nifti& n) { n.type = 128, n.bits = 24; });
  nifti("", [](Nifti& n) { n.type = 16, n.bits = 32; });
  nifti("", [](Nifti& n) { n.type = 64, n.bits = 64; });
  nifti("not a label", [](Nifti& n) { n.type = 4, n.bits = 16, n.slope = 0.5F; });
  nifti("", [](Nifti& n) { n.type = 4, n.bits = 16, n.slope = 1.0F; });
  all.push_back({"v.mha", meta({{"ElementNumberOfChannels", "3"}, {"DimSize", "4 2 1"}}), "one channel"});
  all.push_back({"v.nrrd",
                 nrrd({{"dimension", "4"},
                       {"sizes", "3 4 2 1"},
                       {"space directions", "none (1,0,0) (0,1,0) (0,0,1)"},
                       {"kinds", "vector domain domain domain"}}),
                 "one channel"});
  all.push_back({"v.nrrd", nrrd({{"type", "quaternion"}}), "header cannot be read"});
  // The other byte order.
  for (const std::int16_t type : {std::int16_t{2}, std::int16_t{4}, std::int16_t{8}, std::int16_t{16}}) {
    nifti("", [&](Nifti& n) {
      n.big_endian = true;
      n.type = type;
      n.bits = static_cast<std::int16_t>(type == 2 ? 8 : type == 4 ? 16 : 32);
    });
  }
  all.push_back({"v.mha",
                 meta({{"BinaryDataByteOrderMSB", "True"}, {"ElementType", "MET_SHORT"}},
                      swapped_bytes<std::int16_t>()),
                 ""});
  all.push_back(
      {"v.mha",
       meta({{"BinaryDataByteOrderMSB", "True"}, {"ElementType", "MET_DOUBLE"}}, swapped_bytes<double>()),
       ""});
  all.push_back({"v.nrrd", nrrd({{"endian", "big"}, {"type", "int32"}}, swapped_bytes<std::int32_t>()), ""});
  all.push_back({"v.nrrd", nrrd({{"endian", none}, {"type", "int16"}}, swapped_bytes<std::int16_t>()),
                 "header cannot be read"});
  // The offset and the packing of the voxels.
  nifti("byte", [](Nifti& n) { n.offset = -5.0F; });
  nifti("byte", [](Nifti& n) { n.offset = kNan; });
  nifti("byte", [](Nifti& n) { n.offset = 1e9F; });
  all.push_back({"v.nrrd", nrrd({{"byte skip", "3"}}, "abc" + counting()), ""});
  all.push_back({"v.nrrd", nrrd({{"byte skip", "-1"}}, "abcd" + counting()), ""});
  all.push_back({"v.nrrd", nrrd({{"line skip", "1"}}, "hello\n" + counting()), ""});
  all.push_back({"v.nrrd", nrrd({{"encoding", "gzip"}}, gzip(counting())), ""});
  all.push_back({"v.nrrd", nrrd({{"encoding", "gzip"}}, gzip(counting()).substr(0, 30)), "v.nrrd"});
  all.push_back({"v.nrrd", nrrd({{"encoding", "zstd"}}), "encoding"});
  all.push_back(
      {"v.nrrd",
       nrrd({{"encoding", "ascii"}}, "0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23"), ""});
  all.push_back(
      {"v.mha",
       meta({{"BinaryData", "False"}}, "0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 "),
       ""});
  const std::string packed = gzip(Nifti{}.text());
  all.push_back({"v.nii.gz", packed, ""});
  all.push_back({"v.nii.gz", packed + "tail", ""});
  all.push_back({"v.nii.gz", gzip(Nifti{}.text().substr(0, 100)) + gzip(Nifti{}.text().substr(100)), ""});
  for (const std::size_t cut : {std::size_t{1}, std::size_t{10}, std::size_t{20}, packed.size() / 2,
                                packed.size() - 9, packed.size() - 8, packed.size() - 4, packed.size() - 1})
    all.push_back({"v.nii.gz", packed.substr(0, cut), "v.nii.gz"});
  std::string sum = packed;
  sum[sum.size() - 6] = static_cast<char>(sum[sum.size() - 6] ^ 1);
  all.push_back({"v.nii.gz", sum, "v.nii.gz"});
  // Other kinds of files.
  all.push_back({"v.nii", packed, ".nii.gz"});
  all.push_back({"v.nii.gz", Nifti{}.text(), "end in .nii"});
  nifti("NIfTI-2", [](Nifti& n) { n.header_bytes = 540; });
  nifti(".img", [](Nifti& n) { n.magic = "ni1"; });
  nifti("not a NIfTI-1 file", [](Nifti& n) { n.magic = "xyz"; });
  return all;
}

TEST_F(VolumeCorpus, EachIsReadRightOrRefusedInWords) {
  ::testing::internal::CaptureStderr();  // the libraries print messages when they fail
  std::size_t number = 0;
  for (const Case& c : corpus()) {
    fs::remove(in_folder(c.name));
    const fs::path path = write(c.name, c.bytes);
    const std::string where = "case " + std::to_string(number++) + ", " + c.name;
    try {
      std::vector<std::string> notes;
      const LabelVolume v = voxel::load_volume(path, {}, &notes);
      EXPECT_EQ(c.refusal, "") << where << " was read";
      ASSERT_EQ(v.labels.size(), 24U) << where;
      // NIfTI frames are rotated but never mirrored, so the order of the voxels stays.
      for (std::size_t n = 0; n < 24; ++n) EXPECT_EQ(v.labels[n], n) << where;
      std::string said;
      for (const std::string& note : notes) said += note + "\n";
      EXPECT_NE(said.find(c.note), std::string::npos) << where << ": " << said;
    } catch (const voxel::VolumeError& error) {
      EXPECT_NE(c.refusal, "") << where << ": " << error.what();
      EXPECT_NE(std::string(error.what()).find(c.refusal), std::string::npos)
          << where << ": " << error.what();
    }
  }
  ::testing::internal::GetCapturedStderr();
  EXPECT_GT(number, 60U);
}

// ---- random damage

// Other kinds of DICOM files: with frames, in the other byte order, without a preamble, with an icon.
std::vector<std::string> other_dicom() {
  const tests::DicomText text, big{.big_endian = true, .implicit = false},
      untyped{.big_endian = false, .implicit = true};
  const std::string icon = text.sequence(
      0x88, 0x200, {text.us(0x28, 0x10, 4) + text.element(0x7fe0, 0x10, "OB", std::string(16, '\7'))}, true);
  return {tests::with_preamble(tests::dicom_enhanced({{0, 30.0, 0.5, {}}, {1, 32.0, {}, {}}}, 2.0)),
          tests::with_preamble(tests::dicom_slice(big, 0, {32, "OB"}), big), tests::dicom_slice(untyped, 0),
          tests::with_preamble(tests::dicom_slice(text, 0, {}, icon))};
}

std::vector<std::string> other_nrrd_headers() {
  return {
      "space: LAST\nspace directions: (2,0,0,0) (0,2,0,0) (0,0,2,0)\nspace units: \"um\" \"mm\" \"in\" "
      "\"s\"\n"
      "space origin: (1,2,3,0)\n",
      "spacings: 2 2 2\naxis mins: -1 -2 -3\ncenters: cell node ???\nunits: \"cm\" \"cm\" \"\"\n"};
}

// Runs for 1.5 s, or for HYBRID_FUZZ_SECONDS if this is set. HYBRID_FUZZ_SEED sets the seed.
TEST_F(VolumeCorpus, DamagedFilesEndInAVolumeOrARefusal) {
  const char* given = std::getenv("HYBRID_FUZZ_SECONDS");
  const char* seed = std::getenv("HYBRID_FUZZ_SEED");
  const double seconds = given == nullptr ? 1.5 : std::atof(given);
  std::mt19937 random(seed == nullptr ? 11U : static_cast<unsigned>(std::atoi(seed)));
  std::vector<Case> originals = corpus();
  DicomSlice packed;
  packed.syntax = tests::kRunLengths;
  for (int n = 0; n < 4; ++n) {
    originals.push_back({"slices/0", tests::dicom(DicomSlice{}), ""});
    originals.push_back({"slices/0", tests::dicom(packed), ""});
    for (const std::string& dicom : other_dicom()) originals.push_back({"slices/0", dicom, ""});
    for (const std::string& header : other_nrrd_headers())
      originals.push_back({"v.nrrd", tests::nrrd_file(header), ""});
  }
  fs::create_directories(in_folder("slices"));
  voxel::VolumeFileOptions options;
  options.max_bytes = 16U << 20U;
  options.rules = {{1, 255, 1}};
  std::size_t inputs = 0, loaded = 0;
  const auto start = std::chrono::steady_clock::now();
  const auto late = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds;
  };
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  while (!late()) {
    const Case& from = originals[random() % originals.size()];
    std::string bytes = from.bytes;
    for (unsigned change = 1 + random() % 4; change > 0 && !bytes.empty(); --change) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 7) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:
          bytes[at] = static_cast<char>(bytes[at] ^ (1U << random() % 8));
          break;
        case 2:
          bytes[at] = "0123456789-. e"[random() % 14];
          break;
        case 3:
          bytes.insert(at, 1 + random() % 4, "09-x \n"[random() % 6]);
          break;
        case 4:
          bytes.erase(at, 1 + random() % 8);
          break;
        case 5:
          bytes.replace(at, std::min<std::size_t>(4, bytes.size() - at), 4,
                        static_cast<char>(random() % 2 * 255));
          break;
        default:
          bytes.resize(at);
      }
    }
    const fs::path path = in_folder(from.name);
    fs::remove(path);
    std::ofstream(path, std::ios::binary) << bytes;
    const fs::path what = from.name == "slices/0" ? in_folder("slices") : path;
    ++inputs;
    try {
      const LabelVolume v = voxel::load_volume(what, options);
      ASSERT_EQ(v.labels.size(), static_cast<std::size_t>(v.dims[0]) * static_cast<std::size_t>(v.dims[1]) *
                                     static_cast<std::size_t>(v.dims[2]));
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_TRUE(std::isfinite(v.spacing_m[axis]) && v.spacing_m[axis] > 0.0);
        ASSERT_TRUE(std::isfinite(v.origin_m[axis]));
      }
      ++loaded;
    } catch (const voxel::VolumeError& error) {
      ASSERT_NE(std::string(error.what()), "");
    }
  }
  ::testing::internal::GetCapturedStdout();
  ::testing::internal::GetCapturedStderr();
  std::cout << inputs << " inputs, " << loaded << " loaded\n";
}

}  // namespace
