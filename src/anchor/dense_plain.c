/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/dense_plain.c -- the decoder's arithmetic in plain C, which defines the results, and the choice of
   an implementation. */
#include "anchor/dense_elementwise.inc.h"
#include "base/cpu.h"

static void dense_multiply(const dense_product *job)
{
    for (size_t i = 0; i < job->m; i++) {
        for (size_t j = 0; j < job->n; j++) {
            float *c = &job->c[i * job->c_row + j];
            float sum = job->bias != NULL ? job->bias[j] : *c;
            for (size_t t = 0; t < job->k; t++)
                sum = fmaf(job->a[i * job->a_row + t * job->a_step], job->b[t * job->b_row + j], sum);
            const bool shut = job->gate != NULL && !(job->gate[i * job->c_row + j] > 0.0f);
            *c = shut || (job->relu && !(sum > 0.0f)) ? 0.0f : sum;
        }
    }
}

const dense_kernels dense_kernels_plain = {dense_multiply, dense_exp, dense_tanh, dense_sigmoid,
                                           dense_normalize};

const dense_kernels *dense_best(void) { return CPU_VARIANT(dense_kernels, cpu_best_isa()); }
