/* eval/report_style.h -- the style sheet and the script of the page. */
#ifndef GBT_EVAL_REPORT_STYLE_H
#define GBT_EVAL_REPORT_STYLE_H

extern const char report_css[];
extern const char report_script[]; /* moves the sliders and sorts the views; the page is whole without it */

#endif
