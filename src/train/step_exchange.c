/* SPDX-License-Identifier: Apache-2.0 */
/* train/step_exchange.c -- send outcomes to all processes, rows to the process that sums them, and the sums
   to all. */
#include "train/step_exchange.h"

#include "base/fail.h"
#include "cluster/cluster.h"

_Static_assert(sizeof(view_outcome) % sizeof(uint32_t) == 0, "messages are words");

void step_exchange_outcomes(trainer *t)
{
    view_outcome mine[STEP_VIEWS_MAX];
    size_t counts[STEP_VIEWS_MAX];
    const size_t size = (size_t)gbt_cluster_size();
    for (size_t i = 0; i < t->view_count; i++)
        mine[i] = t->views[i].outcome;
    for (size_t r = 0; r < size; r++)
        counts[r] = t->view_count * sizeof *mine / sizeof(uint32_t);
    cluster_gather(mine, counts, t->outcomes);
}

/* Every process sends one number to every other. */
static void exchange_counts(const size_t *mine, size_t *theirs)
{
    uint32_t out[STEP_VIEWS_MAX], in[STEP_VIEWS_MAX];
    size_t ones[STEP_VIEWS_MAX];
    const size_t size = (size_t)gbt_cluster_size();
    for (size_t r = 0; r < size; r++) {
        out[r] = (uint32_t)mine[r];
        ones[r] = 1;
    }
    cluster_exchange(out, ones, in, ones);
    for (size_t r = 0; r < size; r++)
        theirs[r] = in[r];
}

gbt_status step_exchange_rows(trainer *t, const row_list *mine, size_t numbers, gbt_error *err)
{
    const size_t size = (size_t)gbt_cluster_size(), width = mine->width, words = 1 + width;
    size_t send[STEP_VIEWS_MAX], receive[STEP_VIEWS_MAX], rows = 0, begin = 0;

    /* Send each row to its owner, the process that sums rows of that number. */
    for (size_t r = 0; r < size; r++) {
        const size_t end = row_list_find(mine, (uint32_t)(numbers * (r + 1) / size));
        send[r] = (end - begin) * words;
        begin = end;
    }
    exchange_counts(send, receive);
    for (size_t r = 0; r < size; r++)
        rows += receive[r] / words;
    GBT_TRY(row_list_resize(&t->received, rows, width, err));
    cluster_exchange(mine->words, send, t->received.words, receive);

    /* Sum the rows received. */
    row_list parts[STEP_VIEWS_MAX];
    const row_list *lists[STEP_VIEWS_MAX];
    row_word *at = t->received.words;
    for (size_t r = 0; r < size; r++) {
        parts[r] = (row_list){.count = receive[r] / words, .width = width, .words = at};
        lists[r] = &parts[r];
        at += receive[r];
    }
    GBT_TRY(row_list_sum(lists, size, &t->owned, err));

    /* Send the sums to all processes. */
    rows = 0;
    for (size_t r = 0; r < size; r++)
        send[r] = t->owned.count * words;
    exchange_counts(send, receive);
    for (size_t r = 0; r < size; r++)
        rows += receive[r] / words;
    GBT_TRY(row_list_resize(&t->rows, rows, width, err));
    cluster_gather(t->owned.words, receive, t->rows.words);
    return GBT_OK;
}
