/* SPDX-License-Identifier: Apache-2.0 */
/* run/run_sensitivity.h -- how much the training views of a run change with each parameter of its model. */
#ifndef GBT_RUN_RUN_SENSITIVITY_H
#define GBT_RUN_RUN_SENSITIVITY_H

#include "io/model_steps.h"
#include "run/loaded_run.h"

#define MAKING_SMALL_STOPPED                                                                                 \
    "stopped while the model was made small (compress, or resume of a training, does it again)"

/**
 * Sensitivities of the run's model (io/model_steps.h), from its training cameras alone: photos are not read.
 *
 * At most 64 evenly chosen views are rendered, at half the run's resolution (for large photos only every n-th
 * pixel of that), with one adjoint pass each. Without training views the result is model_sensitivity_guess().
 * Between stop_signal_catch() and stop_signal_release() a signal ends it with GBT_ERR_INTERRUPTED.
 *
 * @param out [out] free with model_sensitivity_free(), also after a failure
 * Threads: same bits for every thread count.
 */
gbt_status run_sensitivity(loaded_run *r, model_sensitivity *out, gbt_error *err);

#endif
