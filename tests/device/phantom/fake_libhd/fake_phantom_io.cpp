// SPDX-License-Identifier: GPL-3.0-or-later
// Stands for the driver's own library: linked against, and not to be found when it is looked for.
extern "C" int fake_phantom_io();
extern "C" int fake_phantom_io() {
  return 0;
}
