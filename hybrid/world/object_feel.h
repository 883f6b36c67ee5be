// SPDX-License-Identifier: GPL-3.0-or-later
// One object's part of the force on the hand.
#pragma once

namespace hybrid {

struct ObjectFeel {
  bool contact = false;
  double force_N = 0.0;
};

}  // namespace hybrid
