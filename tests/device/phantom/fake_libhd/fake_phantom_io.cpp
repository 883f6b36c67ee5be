// SPDX-License-Identifier: GPL-3.0-or-later
// A test double of the library that the real libHD needs. The double of libHD is linked against this double,
// so that a test can hide it.
extern "C" int fake_phantom_io();
extern "C" int fake_phantom_io() {
  return 0;
}
