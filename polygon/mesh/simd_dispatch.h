// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Compiles a function for two vector widths; the loader picks one when the program starts. Both give the same
// bits, because the operations are element-wise and contraction is off. Sanitizers do not support ifunc
// resolvers at start-up. So a sanitizer build selects the single width of its machine
// (cmake/HybridTarget.cmake).
#if defined(__clang__) || !defined(__x86_64__)
#define HYBRID_MULTIVERSIONED
#elif defined(HYBRID_SANITIZED_AVX2)
#define HYBRID_MULTIVERSIONED __attribute__((target("avx2")))
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HYBRID_MULTIVERSIONED
#else
#define HYBRID_MULTIVERSIONED __attribute__((target_clones("default", "avx2")))
#endif
