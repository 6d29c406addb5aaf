/* SPDX-License-Identifier: Apache-2.0 */
/* view/connections.h -- the sockets of the server's clients: who has been slow for too long, and who has
 * left. */
#ifndef GBT_VIEW_CONNECTIONS_H
#define GBT_VIEW_CONNECTIONS_H

#include <microhttpd.h>
#include <stdbool.h>

typedef struct connection_entry {
    struct MHD_Connection *connection; /* NULL: free */
    int socket;
    double until; /* clock_wall() when its patience ends; infinite while we work for it */
} connection_entry;

/** Of a server; used with its lock held. */
typedef struct connections {
    connection_entry *entries;
    int capacity;
    double request_seconds, answer_seconds; /* for a whole request, and to take a whole answer */
} connections;

/** A connection begins, or waits for its next request. */
void connections_expect_request(connections *c, struct MHD_Connection *connection);
/** Its request is whole: the time is ours. */
void connections_hold(connections *c, struct MHD_Connection *connection);
void connections_expect_taking(connections *c, struct MHD_Connection *connection);
void connections_forget(connections *c, struct MHD_Connection *connection);

/** Shut the sockets of those whose time is over: libmicrohttpd then closes them. */
void connections_shut_slow(connections *c);

/** Whether the other side has closed. */
bool connections_has_left(const connections *c, const struct MHD_Connection *connection);

#endif
