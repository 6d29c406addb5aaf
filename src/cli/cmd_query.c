/* SPDX-License-Identifier: Apache-2.0 */
/* cli/cmd_query.c -- gbtrace query. */
#include <stdio.h>
#include <string.h>

#include "cli/options.h"
#include "gbtrace/query.h"

/* In the order of gbt_query_kind. */
static const command_word *kinds(void)
{
    static const command_word words[] = {
        {"nearest", "the K nearest centres of a point"}, {"within", "centres within a radius of a point"},
        {"containing", "balls that contain a point"},    {"overlapping", "balls that overlap a ball"},
        {"crossed", "balls that a ray crosses"},         {NULL, NULL}};
    return words;
}

static gbt_query_def def;

static const option *options(int *count)
{
    def = gbt_query_def_default();
    static const option rows[] = {
        {.name = "at",
         .kind = OPTION_STRING,
         .value = &def.at,
         .value_name = "X,Y,Z",
         .help = "one query point; for crossed a ray: X,Y,Z,DX,DY,DZ[,TMIN,TMAX] (origin, direction, part of "
                 "the ray)"},
        {.name = "from",
         .kind = OPTION_STRING,
         .value = &def.from,
         .value_name = "FILE",
         .help = "a query per line of a text file, or per vertex of a .ply; a fourth number is a radius"},
        {.name = "count",
         .of = "nearest",
         .short_name = 'k',
         .field = "k",
         .kind = OPTION_INT,
         .value = &def.k,
         .min = 1,
         .max = 1000000,
         .value_name = "K",
         .help = "number of nearest balls to find"},
        {.name = "radius",
         .of = "within overlapping",
         .kind = OPTION_DOUBLE,
         .value = &def.radius,
         .min = 0,
         .max = 1e100,
         .value_name = "R",
         .help = "radius around each query point"},
        MEMORY_OPTION,
    };
    *count = sizeof rows / sizeof *rows;
    return rows;
}

static int run(const operands *given)
{
    gbt_error err = {0};
    int kind = 0;
    while (strcmp(kinds()[kind].name, given->value[0]) != 0)
        kind++;
    def.kind = (gbt_query_kind)kind;
    const gbt_status status = gbt_query(given->value[1], &def, stdout, &err);
    return ferror(stdout) ? 0 : command_failed(status, &err); /* main() reports failures of stdout */
}

const command command_query = {.name = "query",
                               .summary = "find balls and anchors by place: nearest, in a ball, along a ray",
                               .usage = "KIND RUN|FILE|DATA --at X,Y,Z|--from FILE",
                               .options = options,
                               .min_operands = 2,
                               .max_operands = 2,
                               .run = run,
                               .words = kinds};
