// SPDX-License-Identifier: GPL-3.0-or-later
// Compiles a function for several vector widths. The loader picks one when the program starts.
//
// All versions give the same bits: the operations are element-wise, and contraction is off. Sanitizers do not
// support ifunc resolvers at start-up, so a sanitizer build names the one width of its machine
// (cmake/HybridTarget.cmake).
#pragma once

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
// For functions that need many registers: the 32 of AVX-512 avoid spills to the stack.
#define HYBRID_MULTIVERSIONED_512 __attribute__((target_clones("default", "avx2", "arch=x86-64-v4")))
#endif
