/* SPDX-License-Identifier: Apache-2.0 */
/* anchor/dense_elementwise.inc.h -- loops over activations.h, compiled once per instruction set and
   vectorised by the compiler. */
#include <math.h>

#include "anchor/activations.h"
#include "anchor/dense.h"

static void dense_exp(float *restrict x, size_t count)
{
    for (size_t i = 0; i < count; i++)
        x[i] = activation_exp(x[i]);
}

static void dense_tanh(float *restrict x, size_t count)
{
    for (size_t i = 0; i < count; i++)
        x[i] = activation_tanh(x[i]);
}

static void dense_sigmoid(float *restrict x, size_t count)
{
    for (size_t i = 0; i < count; i++)
        x[i] = activation_sigmoid(x[i]);
}

static void dense_normalize(float *restrict w, float *restrict x, float *restrict y, float *restrict z,
                            float *restrict inverse_length, size_t count)
{
    const float limit = 1e18f; /* the sum of four squares of it is still finite */
    for (size_t i = 0; i < count; i++) {
        const float a = activation_clamp(w[i], -limit, limit), b = activation_clamp(x[i], -limit, limit);
        const float c = activation_clamp(y[i], -limit, limit), d = activation_clamp(z[i], -limit, limit);
        const float square = __builtin_fmaf(d, d, __builtin_fmaf(c, c, __builtin_fmaf(b, b, a * a)));
        const int usable = square >= 1e-24f;
        const float inverse = 1.0f / sqrtf(usable ? square : 1.0f);
        w[i] = usable ? a * inverse : 1.0f;
        x[i] = usable ? b * inverse : 0.0f;
        y[i] = usable ? c * inverse : 0.0f;
        z[i] = usable ? d * inverse : 0.0f;
        inverse_length[i] = usable ? inverse : 0.0f;
    }
}
