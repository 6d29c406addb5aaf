/* SPDX-License-Identifier: Apache-2.0 */
/* report/scene.c -- the place that a run is of, as a section of the page. */
#include "report/scene.h"

void report_scene(text *out, loaded_run *r, const evaluation *e)
{
    text_add(out, "<section id=\"scene\"><h2>The scene</h2>\n");
    report_maps(out, r, e);
    text_add(out, "</section>\n");
}
