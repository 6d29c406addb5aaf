/* SPDX-License-Identifier: Apache-2.0 */
/* view/connections.h -- the sockets of the server's clients: which of them are too slow, and which have
   disconnected. */
#ifndef GBT_VIEW_CONNECTIONS_H
#define GBT_VIEW_CONNECTIONS_H

#include <microhttpd.h>
#include <stdbool.h>

typedef struct connection_entry {
    struct MHD_Connection *connection; /* NULL: unused entry */
    int socket;
    double until;         /* deadline by clock_wall(); infinite while the server works on its request */
    bool expects_request; /* no whole request has arrived yet */
} connection_entry;

/** All connections of a server; used with the server's lock held. */
typedef struct connections {
    connection_entry *entries;
    int capacity, expecting_max; /* expecting_max: most connections without a whole request */
    double request_seconds,
        answer_seconds; /* time limits for sending a whole request, and for receiving a whole answer */
} connections;

/** A connection was opened, or waits for its next request: the client must send one in time. If more than
    `expecting_max` do, the one that has waited longest is shut down. */
void connections_expect_request(connections *c, struct MHD_Connection *connection);
/** Its request is complete: no deadline while the server works on it. */
void connections_hold(connections *c, struct MHD_Connection *connection);
void connections_expect_taking(connections *c, struct MHD_Connection *connection);
void connections_forget(connections *c, struct MHD_Connection *connection);

/** Shut down the sockets whose deadline has passed. */
void connections_shut_slow(connections *c);

/** Whether the client has closed its side. */
bool connections_has_left(const connections *c, const struct MHD_Connection *connection);

#endif
