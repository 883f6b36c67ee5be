// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Compiles a function for several vector widths; the loader picks one when the program starts. All give the
// same bits, because the operations are element-wise and contraction is off. The start-up of sanitizers does
// not support ifunc resolvers, so there the build names the one width that its machine has
// (cmake/HybridTarget.cmake).
#if defined(__clang__) || !defined(__x86_64__)
#define HYBRID_MULTIVERSIONED
#define HYBRID_MULTIVERSIONED_512
#elif defined(HYBRID_SANITIZED_512)
#define HYBRID_MULTIVERSIONED __attribute__((target("avx2")))
#define HYBRID_MULTIVERSIONED_512 __attribute__((target("arch=x86-64-v4")))
#elif defined(HYBRID_SANITIZED_AVX2)
#define HYBRID_MULTIVERSIONED __attribute__((target("avx2")))
#define HYBRID_MULTIVERSIONED_512 __attribute__((target("avx2")))
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HYBRID_MULTIVERSIONED
#define HYBRID_MULTIVERSIONED_512
#else
#define HYBRID_MULTIVERSIONED __attribute__((target_clones("default", "avx2")))
// For functions that need many registers: AVX-512 has 32 and saves spills to the stack.
#define HYBRID_MULTIVERSIONED_512 __attribute__((target_clones("default", "avx2", "arch=x86-64-v4")))
#endif
