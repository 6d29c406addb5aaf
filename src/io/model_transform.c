/* SPDX-License-Identifier: Apache-2.0 */
/* io/model_transform.c -- transforms the features of a model to the basis that codes best, and its networks
   accordingly. */
#include <string.h>

#include "base/memory.h"
#include "base/symmetric.h"
#include "io/model_steps.h"

enum { DIM = ANCHOR_FEATURE_DIM };

typedef double square[DIM][DIM];

/* Eigenvectors of a symmetric matrix m as the columns of u, with descending eigenvalues, which are left on
   the diagonal of m. */
static void eigenvectors(square m, square u)
{
    symmetric_eigen(&m[0][0], &u[0][0], DIM, 1e-14);
    for (size_t i = 0; i < DIM; i++) {
        size_t best = i;
        for (size_t j = i + 1; j < DIM; j++)
            best = m[j][j] > m[best][best] ? j : best;
        const double value = m[i][i];
        m[i][i] = m[best][best];
        m[best][best] = value;
        for (size_t k = 0; k < DIM; k++) {
            const double x = u[k][i];
            u[k][i] = u[k][best];
            u[k][best] = x;
        }
    }
}

static void find_covariance(const anchors *a, double mean[DIM], square covariance)
{
    const double n = a->count > 0 ? (double)a->count : 1;
    memset(covariance, 0, sizeof(square));
    memset(mean, 0, DIM * sizeof *mean);
    for (size_t i = 0; i < a->count * DIM; i++)
        mean[i % DIM] += (double)a->feature[i] / n;
    for (size_t i = 0; i < a->count; i++)
        for (size_t c = 0; c < DIM; c++)
            for (size_t d = 0; d < DIM; d++)
                covariance[c][d] += ((double)a->feature[i * DIM + c] - mean[c]) *
                                    ((double)a->feature[i * DIM + d] - mean[d]) / n;
}

/* T and its inverse: transform = U^T L^T, inverse = L^-T U, where L L^T = S / mean of S's diagonal, and U
   holds the eigenvectors of L^T C L. */
static void find_basis(const square sensitivity, const square covariance, square transform, square inverse)
{
    square scaled, l, product, u;
    double mean = 0;
    for (size_t c = 0; c < DIM; c++)
        mean += sensitivity[c][c] / DIM;
    for (size_t c = 0; c < DIM; c++)
        for (size_t d = 0; d < DIM; d++)
            scaled[c][d] = sensitivity[c][d] / mean;
    symmetric_cholesky(&scaled[0][0], &l[0][0], DIM, 1e-12); /* positive definite, thanks to
                                                                model_sensitivity_end() */
    for (size_t i = 0; i < DIM; i++)
        for (size_t j = 0; j < DIM; j++) {
            scaled[i][j] = 0;
            for (size_t k = 0; k < DIM; k++)
                scaled[i][j] += covariance[i][k] * l[k][j];
        }
    for (size_t i = 0; i < DIM; i++)
        for (size_t j = 0; j < DIM; j++) {
            product[i][j] = 0;
            for (size_t k = 0; k < DIM; k++)
                product[i][j] += l[k][i] * scaled[k][j];
        }
    eigenvectors(product, u);
    for (size_t i = 0; i < DIM; i++)
        for (size_t j = 0; j < DIM; j++) {
            transform[i][j] = 0;
            for (size_t k = 0; k < DIM; k++)
                transform[i][j] += u[k][i] * l[j][k];
        }
    for (size_t j = 0; j < DIM; j++) /* solve L^T x = u_j by back substitution */
        for (size_t i = DIM; i-- > 0;) {
            double sum = u[i][j];
            for (size_t k = i + 1; k < DIM; k++)
                sum -= l[k][i] * inverse[k][j];
            inverse[i][j] = sum / l[i][i];
        }
}

/* Replace W1 by W1 T^-1, and add W1 (mean f) to the bias b1, because the mean is subtracted from the
   features. */
static void transform_networks(decoder *d, const double mean[DIM], const square inverse)
{
    decoder_network networks[DECODER_NETWORKS];
    decoder_networks(d, networks);
    const size_t inputs = DIM + 3 + (d->has_distance ? 1 : 0);
    for (int i = 0; i < DECODER_NETWORKS; i++)
        for (size_t h = 0; h < ANCHOR_HIDDEN_DIM; h++) {
            float *w = d->params + networks[i].begin + h * inputs,
                  *bias = d->params + networks[i].begin + ANCHOR_HIDDEN_DIM * inputs + h;
            double transformed[DIM] = {0}, sum = (double)*bias;
            for (size_t c = 0; c < DIM; c++) {
                sum += (double)w[c] * mean[c];
                for (size_t e = 0; e < DIM; e++)
                    transformed[e] += (double)w[c] * inverse[c][e];
            }
            for (size_t e = 0; e < DIM; e++)
                w[e] = (float)transformed[e];
            *bias = (float)sum;
        }
}

gbt_status model_transform_features(model *m, model_sensitivity *s, gbt_error *err)
{
    struct {
        square covariance, transform, inverse;
        double mean[DIM];
    } *t = mem_alloc(1, sizeof *t, "basis of features", err);
    if (t == NULL)
        return GBT_ERR_NO_MEMORY;
    find_covariance(&m->anchors, t->mean, t->covariance);
    find_basis(s->feature, t->covariance, t->transform, t->inverse);
    double all = 0;
    for (size_t c = 0; c < DIM; c++)
        all += s->feature[c][c] / DIM;
    for (size_t c = 0; c < DIM; c++)
        for (size_t d = 0; d < DIM; d++)
            s->feature[c][d] = c == d ? all : 0;
    for (size_t i = 0; i < m->anchors.count; i++) {
        float *f = m->anchors.feature + i * DIM;
        double transformed[DIM] = {0};
        for (size_t c = 0; c < DIM; c++)
            for (size_t d = 0; d < DIM; d++)
                transformed[c] += t->transform[c][d] * ((double)f[d] - t->mean[d]);
        for (size_t c = 0; c < DIM; c++)
            f[c] = (float)transformed[c];
    }
    transform_networks(&m->decoder, t->mean, t->inverse);
    mem_free(t);
    return GBT_OK;
}
