// SPDX-License-Identifier: GPL-3.0-or-later
// PNG files out. With height_image.cpp, which reads them, the only part of the project that knows libpng.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

namespace hybrid {

// Rows from the top, three bytes (RGB) a pixel, 3·width·height of them. Throws std::runtime_error: not
// writable, disk full. A file that could not be finished is removed.
void save_png(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> rgb);

}  // namespace hybrid
