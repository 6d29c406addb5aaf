/* SPDX-License-Identifier: Apache-2.0 */
/* view/connections.c -- a deadline for each connection. libmicrohttpd has only a timeout that starts anew
   with every byte, so a client that sends a byte now and then would hold its connection forever. */
#include "view/connections.h"

#include <math.h>
#include <poll.h>
#include <sys/socket.h>

#include "base/clock.h"

static connection_entry *find(const connections *c, const struct MHD_Connection *connection)
{
    for (int i = 0; i < c->capacity; i++)
        if (c->entries[i].connection == connection)
            return &c->entries[i];
    return NULL;
}

/* The request of a connection has arrived: set the next deadline. */
static void set_until(connections *c, const struct MHD_Connection *connection, double until)
{
    connection_entry *entry = find(c, connection);
    if (entry == NULL)
        return;
    entry->until = until;
    entry->expects_request = false;
}

/* libmicrohttpd then closes the connection. */
static void shut(connection_entry *entry)
{
    shutdown(entry->socket, SHUT_RDWR);
    entry->until = (double)INFINITY;
    entry->expects_request = false;
}

void connections_expect_request(connections *c, struct MHD_Connection *connection)
{
    connection_entry *entry = find(c, connection);
    if (entry == NULL && (entry = find(c, NULL)) != NULL)
        *entry = (connection_entry){
            .connection = connection,
            .socket = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd};
    if (entry == NULL)
        return;
    entry->until = clock_wall() + c->request_seconds;
    entry->expects_request = true;
    connection_entry *oldest = entry;
    int expecting = 0;
    for (int i = 0; i < c->capacity; i++)
        if (c->entries[i].connection != NULL && c->entries[i].expects_request) {
            expecting++;
            if (c->entries[i].until < oldest->until)
                oldest = &c->entries[i];
        }
    if (expecting > c->expecting_max)
        shut(oldest);
}

void connections_hold(connections *c, struct MHD_Connection *connection)
{
    set_until(c, connection, (double)INFINITY);
}

void connections_expect_taking(connections *c, struct MHD_Connection *connection)
{
    set_until(c, connection, clock_wall() + c->answer_seconds);
}

void connections_forget(connections *c, struct MHD_Connection *connection)
{
    connection_entry *entry = find(c, connection);
    if (entry != NULL)
        entry->connection = NULL;
}

void connections_shut_slow(connections *c)
{
    const double now = clock_wall();
    for (int i = 0; i < c->capacity; i++)
        if (c->entries[i].connection != NULL && now > c->entries[i].until)
            shut(&c->entries[i]);
}

bool connections_has_left(const connections *c, const struct MHD_Connection *connection)
{
    const connection_entry *entry = find(c, connection);
    if (entry == NULL)
        return true;
    struct pollfd state = {.fd = entry->socket, .events = POLLRDHUP};
    return poll(&state, 1, 0) > 0 && (state.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
}
