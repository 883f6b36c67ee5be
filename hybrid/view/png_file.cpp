// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/png_file.h"

#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <system_error>

namespace hybrid {

void save_png(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> rgb) {
  if (width < 1 || height < 1 ||
      rgb.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3) {
    throw std::invalid_argument("save_png: the pixels do not match the size");
  }
  struct Close {
    void operator()(std::FILE* open) const { std::fclose(open); }
  };
  std::unique_ptr<std::FILE, Close> out(std::fopen(file.c_str(), "wb"));
  if (!out) {
    throw std::runtime_error(file.string() + ": cannot write the picture (" + std::strerror(errno) +
                             "); name a file in a folder that exists and that you may write to");
  }
  // The simplified interface reports errors by value: no longjmp across C++ frames.
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  const bool good = png_image_write_to_stdio(&image, out.get(), 0, rgb.data(), 0, nullptr) != 0 &&
                    std::fflush(out.get()) == 0;
  const std::string why = image.message[0] != '\0' ? image.message : std::strerror(errno);
  png_image_free(&image);
  if (good) return;
  out.reset();
  std::error_code ignored;
  if (std::filesystem::is_regular_file(file, ignored)) std::filesystem::remove(file, ignored);
  throw std::runtime_error(file.string() + ": the picture could not be finished (" + why +
                           "); see that the disk has room");
}

}  // namespace hybrid
