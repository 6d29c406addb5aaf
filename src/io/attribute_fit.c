/* SPDX-License-Identifier: Apache-2.0 */
/* io/attribute_fit.c -- fits the rules that predict attributes: ridge regression of every column on the
   values that are known before it. */
#include <math.h>

#include "base/memory.h"
#include "base/symmetric.h"
#include "io/attribute_code.h"

enum { UNKNOWNS_MAX = ATTRIBUTE_INPUTS_MAX + 1, ROWS_MAX = 20000 /* a sample of this size is enough */ };

typedef struct fit {
    double normal[UNKNOWNS_MAX * UNKNOWNS_MAX], right[UNKNOWNS_MAX], input[UNKNOWNS_MAX];
} fit;

static int32_t rounded(double x)
{
    const double most = 1 << 22;
    return (int32_t)lrint(fmin(fmax(x, -most), most));
}

/* The inputs are 1 (for the bias), the column in the neighbour rows, and the earlier columns of the row. */
static void fit_column(attribute_table *t, size_t column, fit *f)
{
    const size_t columns = (size_t)t->columns, n = 1 + ATTRIBUTE_NEAR + column,
                 stride = 1 + t->rows / ROWS_MAX;
    for (size_t i = 0; i < n; i++) {
        f->right[i] = 0;
        for (size_t j = 0; j <= i; j++)
            f->normal[i * n + j] = i != j ? 0 : i == 0 ? 1e-6 : 1 + 1e-3 * (double)(t->rows / stride);
    }
    for (size_t row = 1; row < t->rows; row += stride) {
        const int32_t *own = t->value + row * columns;
        f->input[0] = 1;
        for (size_t k = 0; k < ATTRIBUTE_NEAR; k++)
            f->input[1 + k] = t->value[t->near[row][k] * columns + column];
        for (size_t j = 0; j < column; j++)
            f->input[1 + ATTRIBUTE_NEAR + j] = own[j];
        for (size_t i = 0; i < n; i++) {
            f->right[i] += f->input[i] * own[column];
            for (size_t j = 0; j <= i; j++)
                f->normal[i * n + j] += f->input[i] * f->input[j];
        }
    }
    symmetric_cholesky(f->normal, f->normal, (int)n, 1e-9);
    symmetric_solve(f->normal, f->right, (int)n);
    attribute_rule *rule = &t->rule[column];
    rule->bias = rounded(f->right[0] * ATTRIBUTE_ONE);
    for (size_t i = 1; i < n; i++)
        rule->weight[i - 1] = rounded(f->right[i] * ATTRIBUTE_ONE);
}

gbt_status attribute_fit(attribute_table *t, gbt_error *err)
{
    fit *f = mem_alloc(1, sizeof *f, "normal equations", err);
    if (f == NULL)
        return GBT_ERR_NO_MEMORY;
    for (int column = 0; column < t->columns; column++)
        fit_column(t, (size_t)column, f);
    mem_free(f);
    return GBT_OK;
}
