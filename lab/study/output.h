/* SPDX-License-Identifier: Apache-2.0 */
/* study/output.h -- what a study writes: a row that says how, and the files. */
#ifndef GBT_STUDY_OUTPUT_H
#define GBT_STUDY_OUTPUT_H

#include <jansson.h>
#include <stdio.h>

#include "report/text.h"

/** A study by its name, and what is written of it. Functions get the study's own struct. */
typedef struct study_output {
    const char *name;
    void (*tables)(const void *study, text *out); /* NAME.md */
    void (*charts)(const void *study, text *out); /* NAME.svg; NULL: none */
    json_t *(*data)(const void *study);           /* NAME.json: an object; `schema` and `study` are added */
} study_output;

/** All files of a study into `folder`. `out`: optional (NULL), gets the tables too. */
gbt_status study_output_save(const study_output *o, const void *study, const char *folder, FILE *out,
                             gbt_error *err);

#endif
