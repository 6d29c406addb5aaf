/* SPDX-License-Identifier: Apache-2.0 */
/* view/guard.h -- who may ask: where the server listens, under which names it is asked, and the token that
   others must show. */
#ifndef GBT_VIEW_GUARD_H
#define GBT_VIEW_GUARD_H

#include <netinet/in.h>
#include <stdbool.h>

#include "gbtrace/status.h"

enum { GUARD_TOKEN_DIGITS = 32, GUARD_URL_SIZE = 128 };

typedef struct guard {
    struct in_addr address;
    char host[INET_ADDRSTRLEN];
    char token[GUARD_TOKEN_DIGITS + 1]; /* hexadecimal; empty: none is needed, as only this machine can ask */
} guard;

/**
 * @param host [in] IPv4 address of this machine, 0.0.0.0 for all that it has; NULL and "localhost":
 *                  127.0.0.1. Outside 127.0.0.0/8 a token of 128 random bits is made
 * @return GBT_OK, GBT_ERR_ARGUMENT ("host: ..."), GBT_ERR_IO (no random bytes)
 */
gbt_status guard_open(const char *host, guard *out, gbt_error *err);

/**
 * Whether a Host header means this server: localhost, 127.0.0.1 or the address it listens at, and with a
 * token any IPv4 address (a router may pass requests on); with any port or none (a tunnel may end at
 * another). Never another name, which could be made to point here.
 */
bool guard_knows_host(const guard *g, const char *host);

/** Whether this is the token, in a time that does not depend on where it differs; NULL: it is not. Always
    when none is needed. */
bool guard_knows_token(const guard *g, const char *given);

/** What to open in a browser, with the token. For 0.0.0.0 with the address that this machine has towards
    others. */
void guard_url(const guard *g, int port, char out[GUARD_URL_SIZE]);

#endif
