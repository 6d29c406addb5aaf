/* SPDX-License-Identifier: Apache-2.0 */
/* view/server.h -- the HTTP server: sends the page and short texts at once, and queues everything else as
   jobs for one worker. Of several waiting pictures only the newest is kept. */
#ifndef GBT_VIEW_SERVER_H
#define GBT_VIEW_SERVER_H

#include <stdatomic.h>

#include "view/answer.h"
#include "view/guard.h"
#include "view/request.h"

/** Fixed limits: connections in total, per client address, and without a whole request; waiting jobs; bytes
    of a request's headers; seconds for a whole request, counted from the start of the connection or the end
    of the last answer; seconds to receive a whole answer. */
enum {
    SERVER_CONNECTIONS = 32,
    SERVER_ADDRESS_CONNECTIONS = 24,
    SERVER_EXPECTING_CONNECTIONS = 16,
    SERVER_JOBS = 16,
    SERVER_HEAD_BYTES = 32 * 1024,
    SERVER_REQUEST_SECONDS = 10,
    SERVER_ANSWER_SECONDS = 120
};

typedef struct server server;

/** A request that waits for its answer. */
typedef struct server_job server_job;

/**
 * Listen at the guard's address.
 *
 * Requests are refused unless they are GET, have a Host header that the guard accepts (which excludes foreign
 * names made to resolve to this server), and show the token if there is one. Requests that the browser marks
 * as coming from another site get nothing but the page itself.
 *
 * @param g        [in] copied
 * @param port     [in] 0: any free one
 * @param log_path [in] file whose rest /log?from=BYTE returns; empty: none. Borrowed
 * @return GBT_OK, GBT_ERR_IO (the port is in use, the address is not this machine's), GBT_ERR_NO_MEMORY
 */
gbt_status server_start(const guard *g, int port, const char *log_path, server **out, gbt_error *err);
int server_port(const server *s);

/** Refuse the waiting jobs (503), close, free. Every job that server_next() returned must have been answered.
 */
void server_stop(server *s);

/** Set the answer to /status: JSON, allocated by mem_alloc(); the server takes ownership. NULL: no change. */
void server_set_status(server *s, char *json);

/** Wait for the oldest job, at most `seconds`. NULL after a timeout or server_wake(). Its request stays valid
    until it is answered. */
server_job *server_next(server *s, double seconds);
const request *server_request(const server_job *job);

/** A flag that becomes true when the client of the last job from server_next() has disconnected, or the
    program is to stop: work on that job can be abandoned. */
const atomic_bool *server_nobody_waits(const server *s);

/** Replace SERVER_REQUEST_SECONDS and SERVER_ANSWER_SECONDS for all deadlines that start from now on. For
    tests. */
void server_set_patience(server *s, double seconds);

/** Send an answer; its bytes become the server's. */
void server_answer(server *s, server_job *job, const answer *with);

/** Make server_next() return. May be called from a signal handler. */
void server_wake(server *s);

#endif
