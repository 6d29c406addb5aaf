/* SPDX-License-Identifier: Apache-2.0 */
/* tests/quiet.h -- the library's messages and progress unheard; its warnings on stderr. */
#ifndef GBT_TEST_QUIET_H
#define GBT_TEST_QUIET_H

#include <stdio.h>

#include "gbtrace/progress.h"

static inline void only_warnings(const gbt_event *event, void *context)
{
    (void)context;
    if (event->kind == GBT_EVENT_WARNING)
        fprintf(stderr, "warning: %s\n", event->text);
}

static inline void be_quiet(void) { gbt_listen(only_warnings, NULL); }

#endif
