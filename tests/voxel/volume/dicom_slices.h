// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM slices made by hand: explicit little-endian, uncompressed or run-length encoded. They have only the
// elements that a reader of volumes uses.
#pragma once

#include <array>
#include <cstdint>
#include <sstream>
#include <string>

namespace tests {

inline const std::string kRunLengths = "1.2.840.10008.1.2.5";

struct DicomSlice {
  int columns = 4, rows = 3;
  std::array<double, 2> spacing{1.0, 1.0};  // (mm) below 0: not stated
  std::array<double, 3> position{0.0, 0.0, 0.0};
  std::array<double, 6> orientation{1.0, 0.0, 0.0, 0.0, 1.0, 0.0};
  std::string series = "1.2.3";
  std::string syntax = "1.2.840.10008.1.2.1";
  int samples = 1;         // 3: RGB
  std::int16_t value = 7;  // value of all voxels
};

inline std::string dicom_number(std::uint64_t n, int bytes) {
  std::string out;
  for (int b = 0; b < bytes; ++b) out.push_back(static_cast<char>(n >> (8 * b)));
  return out;
}

// 16-bit pixels of one value in RLE Lossless (DICOM PS3.5, annex G). High bytes come first, then low bytes,
// each as runs. They are in one fragment after an empty table of offsets.
inline std::string dicom_runs(int count, std::int16_t value) {
  std::string high, low;
  for (int left = count; left > 0; left -= 100) {
    const int run = left < 100 ? left : 100;
    const std::string length =
        run == 1 ? std::string(1, '\0') : dicom_number(static_cast<std::uint64_t>(257 - run), 1);
    high += length + static_cast<char>(value >> 8);
    low += length + static_cast<char>(value);
  }
  if (high.size() % 2 != 0) high.push_back('\0');
  if (low.size() % 2 != 0) low.push_back('\0');
  std::string frame = dicom_number(2, 4) + dicom_number(64, 4) + dicom_number(64 + high.size(), 4);
  frame.resize(64, '\0');
  frame += high + low;
  const std::string item = dicom_number(0xfffe, 2) + dicom_number(0xe000, 2);
  return item + dicom_number(0, 4) + item + dicom_number(frame.size(), 4) + frame + dicom_number(0xfffe, 2) +
         dicom_number(0xe0dd, 2) + dicom_number(0, 4);
}

inline std::string dicom_element(std::uint16_t group, std::uint16_t element, const std::string& type,
                                 std::string value) {
  if (value.size() % 2 != 0) value.push_back(type == "UI" ? '\0' : ' ');
  const bool is_long = type == "OW" || type == "OB";
  return dicom_number(group, 2) + dicom_number(element, 2) + type +
         (is_long ? std::string(2, '\0') + dicom_number(value.size(), 4) : dicom_number(value.size(), 2)) +
         value;
}

inline std::string dicom(const DicomSlice& s) {
  const auto words = [](const auto& values) {
    std::ostringstream out;
    for (std::size_t n = 0; n < values.size(); ++n) out << (n == 0 ? "" : "\\") << values[n];
    return out.str();
  };
  const auto us = [](int n) { return std::string{static_cast<char>(n), static_cast<char>(n >> 8)}; };
  const std::string ct = "1.2.840.10008.5.1.4.1.1.2", image = s.series + ".9";
  const std::string meta = dicom_element(2, 2, "UI", ct) + dicom_element(2, 3, "UI", image) +
                           dicom_element(2, 0x10, "UI", s.syntax);
  std::string pixels;
  const int bytes = s.samples == 1 ? 2 : 1;
  for (int n = 0; n < s.columns * s.rows * s.samples; ++n)
    pixels += us(s.value).substr(0, static_cast<std::size_t>(bytes));
  std::string size(4, '\0');
  for (std::size_t b = 0; b < 4; ++b) size[b] = static_cast<char>(meta.size() >> (8 * b));
  return std::string(128, '\0') + "DICM" + dicom_element(2, 0, "UL", size) + meta +
         dicom_element(8, 0x16, "UI", ct) + dicom_element(8, 0x18, "UI", image) +
         dicom_element(8, 0x60, "CS", "CT") + dicom_element(0x20, 0xd, "UI", s.series + ".1") +
         dicom_element(0x20, 0xe, "UI", s.series) + dicom_element(0x20, 0x32, "DS", words(s.position)) +
         dicom_element(0x20, 0x37, "DS", words(s.orientation)) + dicom_element(0x28, 2, "US", us(s.samples)) +
         dicom_element(0x28, 4, "CS", s.samples == 1 ? "MONOCHROME2" : "RGB") +
         (s.samples == 1 ? "" : dicom_element(0x28, 6, "US", us(0))) +
         dicom_element(0x28, 0x10, "US", us(s.rows)) + dicom_element(0x28, 0x11, "US", us(s.columns)) +
         (s.spacing[0] < 0.0 ? "" : dicom_element(0x28, 0x30, "DS", words(s.spacing))) +
         dicom_element(0x28, 0x100, "US", us(8 * bytes)) + dicom_element(0x28, 0x101, "US", us(8 * bytes)) +
         dicom_element(0x28, 0x102, "US", us(8 * bytes - 1)) +
         dicom_element(0x28, 0x103, "US", us(s.samples == 1 ? 1 : 0)) +
         (s.syntax == kRunLengths
              ? dicom_number(0x7fe0, 2) + dicom_number(0x10, 2) + "OB" + std::string(2, '\0') +
                    dicom_number(0xffffffffU, 4) + dicom_runs(s.columns * s.rows, s.value)
              : dicom_element(0x7fe0, 0x10, s.samples == 1 ? "OW" : "OB", pixels));
}

}  // namespace tests
