// SPDX-License-Identifier: GPL-3.0-or-later
// Stands for the driver's own library. The double is linked against it, so that a test can make it impossible
// to find.
extern "C" int fake_phantom_io();
extern "C" int fake_phantom_io() {
  return 0;
}
