/* SPDX-License-Identifier: Apache-2.0 */
/* view/server.h -- HTTP: the page and small texts at once, all else as jobs for one worker, the newest
   picture first to last. */
#ifndef GBT_VIEW_SERVER_H
#define GBT_VIEW_SERVER_H

#include <stdatomic.h>

#include "view/answer.h"
#include "view/guard.h"
#include "view/request.h"

/** Fixed limits: connections at once, of one address, waiting jobs, bytes of a request's head, seconds for a
   whole request since the connection began or the last answer ended, and to take a whole answer. */
enum {
    SERVER_CONNECTIONS = 32,
    SERVER_ADDRESS_CONNECTIONS = 24,
    SERVER_JOBS = 16,
    SERVER_HEAD_BYTES = 32 * 1024,
    SERVER_REQUEST_SECONDS = 10,
    SERVER_ANSWER_SECONDS = 120
};

typedef struct server server;

/** A request that waits for its answer. */
typedef struct server_job server_job;

/**
 * Listen where the guard says.
 *
 * Only GET is answered, only with a Host that the guard knows (so that no foreign name can be made to mean
 * this server), only with the token where there is one, and nothing but the page itself to requests that a
 * browser marks as another site's.
 *
 * @param g        [in] copied
 * @param port     [in] 0: any free one
 * @param log_path [in] file that /log?from=BYTE gives the rest of; empty: none. Borrowed
 * @return GBT_OK, GBT_ERR_IO (the port is in use, the address is not this machine's), GBT_ERR_NO_MEMORY
 */
gbt_status server_start(const guard *g, int port, const char *log_path, server **out, gbt_error *err);
int server_port(const server *s);

/** Give up what waits (503), close, free. Every job that server_next() gave must have been answered. */
void server_stop(server *s);

/** What /status says from now on: JSON, taken over, mem_free(). NULL: stays as it is. */
void server_set_status(server *s, char *json);

/** The oldest waiting job, for at most so many seconds; NULL: none, or server_wake(). Its request stays valid
    until it is answered. */
server_job *server_next(server *s, double seconds);
const request *server_request(const server_job *job);

/** True, in place, as soon as whoever asked for the job of the last server_next() has left, or the program is
   to stop: what is made for it may stop. */
const atomic_bool *server_nobody_waits(const server *s);

/** In place of SERVER_REQUEST_SECONDS and SERVER_ANSWER_SECONDS, for what begins from now on. For tests. */
void server_set_patience(server *s, double seconds);

/** Send; the answer's bytes are taken over. */
void server_answer(server *s, server_job *job, const answer *with);

/** Let server_next() return. May be called in a signal handler. */
void server_wake(server *s);

#endif
