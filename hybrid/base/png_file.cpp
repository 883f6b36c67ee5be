// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/base/png_file.h"

#include <png.h>

#include <stdexcept>
#include <string>

#include "hybrid/base/whole_file.h"

namespace hybrid {

void save_png(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> rgb) {
  if (width < 1 || height < 1 ||
      rgb.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3) {
    throw std::invalid_argument("save_png: the pixels do not match the size");
  }
  WholeFile out(file);
  // The simplified interface returns errors as values, so no longjmp crosses C++ frames.
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  const bool good = png_image_write_to_stdio(&image, out.stream(), 0, rgb.data(), 0, nullptr) != 0;
  const std::string why = image.message;
  png_image_free(&image);
  if (!good) {
    throw std::runtime_error(file.string() + ": the picture could not be finished (" + why +
                             "); see that the disk has room");
  }
  out.keep();
}

}  // namespace hybrid
