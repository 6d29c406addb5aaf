/* SPDX-License-Identifier: Apache-2.0 */
/* run/run_sensitivity.h -- what the training views of a run lose by a change of each parameter. */
#ifndef GBT_RUN_RUN_SENSITIVITY_H
#define GBT_RUN_RUN_SENSITIVITY_H

#include "io/model_steps.h"
#include "run/loaded_run.h"

#define MAKING_SMALL_STOPPED                                                                                 \
    "stopped while the model was made small (compress, or resume of a training, does it again)"

/**
 * Sensitivities of the run's model (io/model_steps.h), from its training cameras alone: photos are not read.
 *
 * Renders at most 64 of the views, spread over all, at half the run's resolution, of large photos every n-th
 * pixel of that, with one adjoint pass each.
 * Without training views: the guess. Between stop_signal_catch() and stop_signal_release() a signal ends it
 * with GBT_ERR_INTERRUPTED.
 *
 * @param out [out] free with model_sensitivity_free(), after failure too
 * Threads: same bits for every thread count.
 */
gbt_status run_sensitivity(loaded_run *r, model_sensitivity *out, gbt_error *err);

#endif
