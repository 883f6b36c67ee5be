// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// The same source for several widths of vector, chosen when the program starts. All give the same bits: the
// operations are element by element, and contraction is off. Not under sanitizers, whose start-up does not
// stand ifunc resolvers.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || defined(__clang__) || \
    !defined(__x86_64__)
#define HYBRID_WIDE
#define HYBRID_WIDE_AND_MANY
#else
#define HYBRID_WIDE __attribute__((target_clones("default", "avx2")))
// Where twice as many registers (AVX-512 has 32) save what would go to the stack and back.
#define HYBRID_WIDE_AND_MANY __attribute__((target_clones("default", "avx2", "arch=x86-64-v4")))
#endif
