/* The tree's one compiler extension: compile a function for several instruction sets and pick one
 * when the program starts.
 *
 * Write MULTIVERSION before a function whose loops the compiler vectorises. It does something only
 * where the build defines SOT_MULTIVERSION (an optimised build for the host) and the compiler is
 * GCC for x86-64 on Linux; elsewhere it is empty. All versions compute the same: integers only. */
#ifndef VISION_MULTIVERSION_H
#define VISION_MULTIVERSION_H

#if defined(SOT_MULTIVERSION) && defined(__GNUC__) && !defined(__clang__) &&                       \
    defined(__x86_64__) && defined(__linux__)
#define MULTIVERSION __attribute__((target_clones("default", "avx2")))
#else
#define MULTIVERSION
#endif

#endif
