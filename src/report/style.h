/* SPDX-License-Identifier: Apache-2.0 */
/* report/style.h -- the style sheet and the script of the page: page.css and page.js, embedded by
   tools/embed.cmake. */
#ifndef GBT_REPORT_STYLE_H
#define GBT_REPORT_STYLE_H

extern const char report_css[];
extern const char report_script[]; /* moves the sliders and sorts tables; the page works without it */

#endif
