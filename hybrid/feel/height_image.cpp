// SPDX-License-Identifier: GPL-3.0-or-later
// Reads PNG files as heights.
#include <png.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "hybrid/feel/height_texture.h"

namespace hybrid {
namespace {

constexpr std::uintmax_t kMostFileBytes = std::uintmax_t{160} << 20U;  // 4096² pixels of four 16-bit channels
// first bytes of every PNG file
constexpr std::array<unsigned char, 8> kSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what) {
  throw std::runtime_error(file.string() + ": " + what);
}

std::vector<unsigned char> read_bytes(const std::filesystem::path& file) {
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(file, failed);
  if (failed)
    refuse(file, "the image cannot be read (" + failed.message() + "); name a PNG file that is there");
  if (size > kMostFileBytes)
    refuse(file,
           "the image file is larger than 160 MiB; make it smaller: a texture repeats, one period is enough");
  std::vector<unsigned char> bytes(static_cast<std::size_t>(size));
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!in) refuse(file, std::string("the image cannot be read (") + std::strerror(errno) + ")");
  if (bytes.size() < kSignature.size() || !std::equal(kSignature.begin(), kSignature.end(), bytes.begin()))
    refuse(file, "this is not a PNG image; convert it to PNG, grey, 8 or 16 bits");
  return bytes;
}

// Removes the chunks on brightness (gamma, profile), because libpng would use them to change the heights.
std::vector<unsigned char> without_colour_space(const std::vector<unsigned char>& png) {
  static constexpr std::array<const char*, 4> kDropped{"gAMA", "cHRM", "sRGB", "iCCP"};
  std::vector<unsigned char> out(png.begin(), png.begin() + kSignature.size());
  out.reserve(png.size());
  std::size_t at = kSignature.size();
  while (png.size() - at >= 12) {  // length, type, data, checksum
    const std::size_t length = std::size_t{png[at]} << 24U | std::size_t{png[at + 1]} << 16U |
                               std::size_t{png[at + 2]} << 8U | std::size_t{png[at + 3]};
    const std::size_t whole = length + 12;
    if (whole > png.size() - at) break;  // cut short; the rest is kept, and libpng reports the error
    const auto* type = png.data() + at + 4;
    const bool dropped = std::any_of(kDropped.begin(), kDropped.end(),
                                     [type](const char* name) { return std::memcmp(name, type, 4) == 0; });
    if (!dropped) out.insert(out.end(), png.data() + at, png.data() + at + whole);
    at += whole;
  }
  out.insert(out.end(), png.data() + at, png.data() + png.size());
  return out;
}

// The simplified interface returns errors as values, so no longjmp crosses C++ frames.
struct Image : png_image {
  Image() : png_image{} { version = PNG_IMAGE_VERSION; }
  Image(const Image&) = delete;
  Image& operator=(const Image&) = delete;
  Image(Image&&) = delete;
  Image& operator=(Image&&) = delete;
  ~Image() { png_image_free(this); }
  [[nodiscard]] std::string why() const { return message[0] != '\0' ? message : "no reason given"; }
};

template <typename Value>
std::vector<float> read_grey(Image& image, const std::filesystem::path& file, unsigned format, float full) {
  image.format = format;
  std::vector<Value> values(static_cast<std::size_t>(image.width) * image.height);
  const png_color black{0, 0, 0};  // colour of transparent pixels
  const bool linear = (format & PNG_FORMAT_FLAG_LINEAR) != 0;
  const bool good = png_image_finish_read(&image, linear ? nullptr : &black, values.data(), 0, nullptr) != 0;
  // A warning (a wrong checksum, data cut short) means that pixels are missing, so no height can be trusted.
  if (!good || (image.warning_or_error & PNG_IMAGE_WARNING) != 0)
    refuse(file, "the image is damaged (" + image.why() + "); save it again");
  std::vector<float> grey(values.size());
  std::transform(values.begin(), values.end(), grey.begin(),
                 [full](Value value) { return static_cast<float>(value) / full; });
  return grey;
}

}  // namespace

GreyImage load_grey_png(const std::filesystem::path& file) {
  const std::vector<unsigned char> bytes = without_colour_space(read_bytes(file));
  Image image;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0)
    refuse(file, "the image is damaged (" + image.why() + "); save it again");
  if (image.width > kMostTexturePixels || image.height > kMostTexturePixels) {
    refuse(file, "the image has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                     " pixels, and at most " + std::to_string(kMostTexturePixels) +
                     " a side are read; make it smaller: a texture repeats, one period is enough");
  }
  GreyImage out;
  out.width = static_cast<int>(image.width);
  out.height = static_cast<int>(image.height);
  out.grey = (image.format & PNG_FORMAT_FLAG_LINEAR) != 0
                 ? read_grey<std::uint16_t>(image, file, PNG_FORMAT_LINEAR_Y, 65535.0F)
                 : read_grey<std::uint8_t>(image, file, PNG_FORMAT_GRAY, 255.0F);
  return out;
}

}  // namespace hybrid
