/* SPDX-License-Identifier: Apache-2.0 */
/* view/view.c -- gbtrace view: run the page's server from start to Ctrl-C. */
#include "gbtrace/view.h"

#include "base/clock.h"
#include "base/def.h"
#include "base/fail.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "base/stop_signal.h"
#include "view/server.h"
#include "view/viewer.h"

static const double look_every_seconds = 1; /* how often to look for a newer model */

gbt_view_def gbt_view_def_default(void) { return (gbt_view_def){.port = 8470, .cookie_ = DEF_COOKIE}; }

static void wake(void *http) { server_wake(http); }

static void serve(viewer_state *s, server *http)
{
    double looked = clock_wall();
    s->stop = server_nobody_waits(http);
    while (!stop_signal_seen()) {
        server_job *job = server_next(http, look_every_seconds);
        if (job != NULL) {
            answer made = {0};
            viewer_answer(s, server_request(job), &made);
            server_answer(http, job, &made);
        }
        if (clock_wall() - looked >= look_every_seconds) {
            viewer_follow(s);
            server_set_status(http, viewer_status(s));
            looked = clock_wall();
        }
    }
}

static void serve_until_signal(viewer_state *s, server *http, const char *url, const gbt_view_def *def)
{
    stop_signal_wake(wake, http);
    stop_signal_catch();
    if (def->ready != NULL)
        def->ready(url, def->context);
    serve(s, http);
    stop_signal_release();
    stop_signal_wake(NULL, NULL);
}

gbt_status gbt_view(const char *input, const gbt_view_def *def, gbt_error *err)
{
    PLAIN_NUMBERS;
    server *http = NULL;
    guard who;
    char url[GUARD_URL_SIZE];
    GBT_TRY(def_check(def->cookie_, "gbt_view_def_default", err));
    if (def->port < 0 || def->port > 65535)
        return base_fail(err, GBT_ERR_ARGUMENT, "port: %d (wanted 0 to 65535)", def->port);
    GBT_TRY(guard_open(def->host, &who, err));
    viewer_state *s = mem_calloc(1, sizeof *s, "scene", err);
    if (s == NULL)
        return GBT_ERR_NO_MEMORY;
    gbt_status status = viewer_open(input, def->data, s, err);
    if (status == GBT_OK)
        status = server_start(&who, def->port, s->log_path, &http, err);
    if (status == GBT_OK) {
        server_set_status(http, viewer_status(s));
        guard_url(&who, server_port(http), url);
        serve_until_signal(s, http, url, def);
        server_stop(http);
    }
    viewer_close(s);
    mem_free(s);
    return status;
}
