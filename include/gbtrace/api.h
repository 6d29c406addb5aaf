/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/api.h -- macros around the declarations of every public header: C linkage in C++, and default
   visibility in the shared library. */
#ifndef GBTRACE_API_H
#define GBTRACE_API_H

/* The library is built with hidden visibility: only what stands between these two macros is exported from
   libgbtrace.so. */
/* clang-format would join the unbalanced braces of these macros. */
/* clang-format off */
#ifdef __cplusplus
#define GBT_API_BEGIN _Pragma("GCC visibility push(default)") extern "C" {
#define GBT_API_END } _Pragma("GCC visibility pop")
#else
#define GBT_API_BEGIN _Pragma("GCC visibility push(default)")
#define GBT_API_END _Pragma("GCC visibility pop")
#endif
/* clang-format on */

#endif
