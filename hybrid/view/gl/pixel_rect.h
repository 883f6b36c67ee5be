// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace hybrid {

// Rectangle of the frame (pixels, y down from the top).
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

}  // namespace hybrid
