/* SPDX-License-Identifier: Apache-2.0 */
/* gbtrace/api.h -- what stands around the declarations of every public header: C names also in C++, and
   visible in the shared library. */
#ifndef GBTRACE_API_H
#define GBTRACE_API_H

/* Everything else in libgbtrace.so is hidden. */
/* The formatter would join braces without their other half. */
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
