// SPDX-License-Identifier: GPL-3.0-or-later
// What one object adds to the force that is felt.
#pragma once

namespace hybrid {

struct ObjectFeel {
  bool contact = false;
  double force_N = 0.0;
};

}  // namespace hybrid
