/* SPDX-License-Identifier: Apache-2.0 */
/* study/output.h -- the files of a study, described by a struct of functions that write them. */
#ifndef GBT_STUDY_OUTPUT_H
#define GBT_STUDY_OUTPUT_H

#include <jansson.h>
#include <stdio.h>

#include "report/text.h"

/** A study's name, and the functions that write its results; they get the study's own struct. */
typedef struct study_output {
    const char *name;
    void (*tables)(const void *study, text *out); /* NAME.md */
    void (*charts)(const void *study, text *out); /* NAME.svg; NULL: none */
    json_t *(*data)(const void *study); /* NAME.json: returns an object, to which `schema` and `study` are
                                           added */
} study_output;

/** Write all files of a study into `folder`, and the tables to `out` too unless it is NULL. */
gbt_status study_output_save(const study_output *o, const void *study, const char *folder, FILE *out,
                             gbt_error *err);

#endif
