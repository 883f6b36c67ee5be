// SPDX-License-Identifier: GPL-3.0-or-later
// A test double of the library that the real libHD needs. The double of libHD is linked against it, so that a
// test can make it impossible to find.
extern "C" int fake_phantom_io();
extern "C" int fake_phantom_io() {
  return 0;
}
