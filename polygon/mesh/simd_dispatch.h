// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The same source for two widths of vector, chosen when the program starts. Both give the same bits: the
// operations are element by element, and contraction is off. Not under sanitizers, whose start-up does not
// stand ifunc resolvers.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__) || \
    !defined(__x86_64__)
#define HYBRID_WIDE
#else
#define HYBRID_WIDE __attribute__((target_clones("default", "avx2")))
#endif
