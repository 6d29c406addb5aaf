/* SPDX-License-Identifier: Apache-2.0 */
/* report/facts.h -- the tables of a run's page: counts, speed, machine, settings, and the commands that
   repeat the run. */
#ifndef GBT_REPORT_FACTS_H
#define GBT_REPORT_FACTS_H

#include <jansson.h>

#include "eval/scores.h"
#include "report/text.h"

/** Add the section "Facts". `settings`: lines "key = value"; NULL: unknown. */
void report_facts(text *out, const evaluation *e, const json_t *metrics, const char *settings);

/** Add the section "Make it again". */
void report_again(text *out, const char *run, const json_t *metrics);

#endif
