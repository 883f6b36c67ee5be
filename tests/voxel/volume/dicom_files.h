// SPDX-License-Identifier: GPL-3.0-or-later
// DICOM files of the base volume (base_volume.h), made by hand. They exist in both byte orders, with
// explicit or implicit types, as one file per slice or as one file of all frames. Labels are stored times
// 100.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/voxel/volume/base_volume.h"

namespace tests {

// The encoding of numbers and elements.
struct DicomText {
  bool big_endian = false, implicit = false;

  [[nodiscard]] std::string number(std::uint64_t n, int bytes) const {
    std::string out;
    for (int b = 0; b < bytes; ++b)
      out.push_back(static_cast<char>(n >> (8 * (big_endian ? bytes - 1 - b : b))));
    return out;
  }
  [[nodiscard]] std::string head(unsigned group, unsigned element, const std::string& type,
                                 std::uint64_t length) const {
    const std::string tag = number(group, 2) + number(element, 2);
    if (implicit || group == 0xfffe) return tag + number(length, 4);
    const bool is_long = type == "OW" || type == "OB" || type == "SQ" || type == "UN";
    return tag + type + (is_long ? std::string(2, '\0') + number(length, 4) : number(length, 2));
  }
  [[nodiscard]] std::string element(unsigned group, unsigned element, const std::string& type,
                                    std::string value) const {
    if (value.size() % 2 != 0) value.push_back(type == "UI" || type == "OB" ? '\0' : ' ');
    return head(group, element, type, value.size()) + value;
  }
  [[nodiscard]] std::string words(unsigned group, unsigned at, const std::vector<double>& values) const {
    std::ostringstream out;
    for (std::size_t n = 0; n < values.size(); ++n) out << (n == 0 ? "" : "\\") << values[n];
    return element(group, at, "DS", out.str());
  }
  [[nodiscard]] std::string us(unsigned group, unsigned at, unsigned value) const {
    return element(group, at, "US", number(value, 2));
  }
  // A sequence that ends by its length, or by a delimiter if `undefined`.
  [[nodiscard]] std::string sequence(unsigned group, unsigned at, const std::vector<std::string>& items,
                                     bool undefined = false) const {
    constexpr std::uint64_t kUndefined = 0xffffffffU;
    std::string out;
    for (const std::string& item : items) {
      out += head(0xfffe, 0xe000, "", undefined ? kUndefined : item.size()) + item;
      if (undefined) out += head(0xfffe, 0xe00d, "", 0);
    }
    if (undefined) out += head(0xfffe, 0xe0dd, "", 0);
    return head(group, at, "SQ", undefined ? kUndefined : out.size()) + out;
  }
};

struct DicomPixels {
  int bits = 16;
  std::string type = "OW";
};

// The stored numbers of slice k: labels times `scale`. In big-endian files of `type` OW, whole 16-bit words
// are swapped, so 8-bit pixels are swapped in pairs.
inline std::string dicom_pixels(const DicomText& text, const DicomPixels& pixels, int k,
                                double scale = 100.0) {
  std::string out;
  for (int j = 0; j < kBaseDims[1]; ++j) {
    for (int i = 0; i < kBaseDims[0]; ++i)
      out += text.number(static_cast<std::uint64_t>(base_label(i, j, k) * scale), pixels.bits / 8);
  }
  if (text.big_endian && pixels.bits == 8 && pixels.type == "OW") {
    for (std::size_t n = 0; n + 1 < out.size(); n += 2) std::swap(out[n], out[n + 1]);
  }
  return out;
}

// The elements that all files have. `more` is inserted before the pixels.
inline std::string dicom_image(const DicomText& text, const std::string& place, const DicomPixels& pixels,
                               int frames, const std::string& more, const std::string& numbers) {
  const auto bits = static_cast<unsigned>(pixels.bits);
  return text.element(8, 0x16, "UI",
                      frames > 0 ? "1.2.840.10008.5.1.4.1.1.2.1" : "1.2.840.10008.5.1.4.1.1.2") +
         text.element(8, 0x18, "UI", "1.2.3.9") + text.element(8, 0x60, "CS", "CT") +
         (frames > 0 ? "" : place) + text.us(0x28, 2, 1) + text.element(0x28, 4, "CS", "MONOCHROME2") +
         (frames > 0 ? text.element(0x28, 8, "IS", std::to_string(frames)) : "") + text.us(0x28, 0x10, 10) +
         text.us(0x28, 0x11, 12) + (frames > 0 ? "" : text.words(0x28, 0x30, {2, 2})) +
         text.us(0x28, 0x100, bits) + text.us(0x28, 0x101, bits) + text.us(0x28, 0x102, bits - 1) +
         text.us(0x28, 0x103, 0) + more + text.element(0x7fe0, 0x10, pixels.type, numbers);
}

// Slice k of a classic series. `with_place`: the slice states its position and orientation.
inline std::string dicom_slice(const DicomText& text, int k, const DicomPixels& pixels = {},
                               const std::string& more = "", bool with_place = true,
                               const std::string& thickness = "") {
  const std::string place =
      thickness + text.element(0x20, 0xd, "UI", "1.2.3.1") + text.element(0x20, 0xe, "UI", "1.2.3") +
      (with_place
           ? text.words(0x20, 0x32, {-10, -20, 30.0 + 2.0 * k}) + text.words(0x20, 0x37, {1, 0, 0, 0, 1, 0})
           : "");
  return dicom_image(text, place, pixels, 0, more, dicom_pixels(text, pixels, k));
}

// One frame of an enhanced file.
struct EnhancedFrame {
  int k = 0;  // the slice whose labels the frame shows
  double z = 30.0;
  std::optional<double> slope;  // the frame's own slope; empty: the shared one
  std::vector<double> orientation{};
};

// An enhanced file. Frames share the values that they do not state. `shared_slope` 0: no shared slope is
// stated.
inline std::string dicom_enhanced(const std::vector<EnhancedFrame>& frames, double shared_slope = 0.0,
                                  const std::string& series = "1.2.3") {
  const DicomText text;
  const DicomPixels pixels;
  const auto rescale = [&](double slope) {
    return text.sequence(0x28, 0x9145, {text.words(0x28, 0x1052, {0}) + text.words(0x28, 0x1053, {slope})});
  };
  std::vector<std::string> each;
  std::string numbers;
  for (const EnhancedFrame& frame : frames) {
    std::string item = text.sequence(0x20, 0x9113, {text.words(0x20, 0x32, {-10, -20, frame.z})});
    if (!frame.orientation.empty())
      item += text.sequence(0x20, 0x9116, {text.words(0x20, 0x37, frame.orientation)});
    if (frame.slope) item += rescale(*frame.slope);
    each.push_back(item);
    numbers += dicom_pixels(text, pixels, frame.k,
                            100.0 / frame.slope.value_or(shared_slope == 0.0 ? 1.0 : shared_slope));
  }
  const std::string shared =
      text.sequence(0x20, 0x9116, {text.words(0x20, 0x37, {1, 0, 0, 0, 1, 0})}) +
      text.sequence(0x28, 0x9110, {text.words(0x18, 0x50, {2}) + text.words(0x28, 0x30, {2, 2})}) +
      (shared_slope == 0.0 ? "" : rescale(shared_slope));
  const std::string groups = text.sequence(0x5200, 0x9229, {shared}) + text.sequence(0x5200, 0x9230, each);
  std::string image = dicom_image(text, "", pixels, static_cast<int>(frames.size()), groups, numbers);
  const std::string ids = text.element(0x20, 0xd, "UI", "1.2.3.1") + text.element(0x20, 0xe, "UI", series);
  const auto before = image.find(text.us(0x28, 2, 1));
  return image.insert(before, ids);
}

// The elements of group 2, which state the encoding of the others.
inline std::string dicom_meta(const DicomText& text) {
  const DicomText plain;
  const std::string rest = plain.element(2, 2, "UI", "1.2.840.10008.5.1.4.1.1.2") +
                           plain.element(2, 3, "UI", "1.2.3.9") +
                           plain.element(2, 0x10, "UI",
                                         text.big_endian ? "1.2.840.10008.1.2.2"
                                         : text.implicit ? "1.2.840.10008.1.2"
                                                         : "1.2.840.10008.1.2.1");
  return plain.element(2, 0, "UL", plain.number(rest.size(), 4)) + rest;
}

inline std::string with_preamble(const std::string& elements, const DicomText& text = {}) {
  return std::string(128, '\0') + "DICM" + dicom_meta(text) + elements;
}

}  // namespace tests
