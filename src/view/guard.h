/* SPDX-License-Identifier: Apache-2.0 */
/* view/guard.h -- access control: the address to listen at, the host names that are accepted, and the token
   that clients of other machines must show. */
#ifndef GBT_VIEW_GUARD_H
#define GBT_VIEW_GUARD_H

#include <netinet/in.h>
#include <stdbool.h>

#include "gbtrace/status.h"

enum { GUARD_TOKEN_DIGITS = 32, GUARD_URL_SIZE = 128 };

typedef struct guard {
    struct in_addr address;
    char host[INET_ADDRSTRLEN];
    char token[GUARD_TOKEN_DIGITS + 1]; /* hexadecimal; empty: none is needed, because only this machine can
                                           connect */
} guard;

/**
 * @param host [in] IPv4 address of this machine, 0.0.0.0 for all of its addresses; NULL and "localhost":
 *                  127.0.0.1. For addresses outside 127.0.0.0/8 a token of 128 random bits is made
 * @return GBT_OK, GBT_ERR_ARGUMENT ("host: ..."), GBT_ERR_IO (no random bytes)
 */
gbt_status guard_open(const char *host, guard *out, gbt_error *err);

/**
 * Whether a Host header means this server, which protects against DNS rebinding: a foreign host name could be
 * made to resolve to our address.
 *
 * Accepted are localhost, 127.0.0.1 and the address that the server listens at; with a token, any IPv4
 * address, since a router may forward requests. Any port, or none, is accepted, since a tunnel may end at
 * another port.
 */
bool guard_knows_host(const guard *g, const char *host);

/** Compare with the token, in constant time. NULL is wrong; when no token is needed everything is right. */
bool guard_knows_token(const guard *g, const char *given);

/** The URL to open in a browser, with the token. For 0.0.0.0 it has the address by which other machines reach
    this one. */
void guard_url(const guard *g, int port, char out[GUARD_URL_SIZE]);

#endif
