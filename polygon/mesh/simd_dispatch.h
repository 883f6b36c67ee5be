// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Compiles a function for two vector widths; the loader picks one when the program starts. Both give the same
// bits, because the operations are element-wise and contraction is off. Disabled under sanitizers, whose
// start-up does not support ifunc resolvers.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__) || \
    !defined(__x86_64__)
#define HYBRID_WIDE
#else
#define HYBRID_WIDE __attribute__((target_clones("default", "avx2")))
#endif
