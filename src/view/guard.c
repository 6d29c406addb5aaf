/* SPDX-License-Identifier: Apache-2.0 */
/* view/guard.c -- access control: listening address, Host header and token. */
#include "view/guard.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/fail.h"

static gbt_status make_token(char token[GUARD_TOKEN_DIGITS + 1], gbt_error *err)
{
    unsigned char bytes[GUARD_TOKEN_DIGITS / 2];
    if (getentropy(bytes, sizeof bytes) != 0)
        return base_fail(err, GBT_ERR_IO, "host: no random bytes for a token");
    for (size_t i = 0; i < sizeof bytes; i++)
        snprintf(token + 2 * i, 3, "%02x", bytes[i]);
    return GBT_OK;
}

gbt_status guard_open(const char *host, guard *out, gbt_error *err)
{
    *out = (guard){0};
    if (host == NULL || strcmp(host, "localhost") == 0)
        host = "127.0.0.1";
    if (inet_pton(AF_INET, host, &out->address) != 1)
        return base_fail(
            err, GBT_ERR_ARGUMENT,
            "host: \"%.60s\" (wanted an IPv4 address of this machine, or 0.0.0.0 for all that it has)", host);
    inet_ntop(AF_INET, &out->address, out->host, sizeof out->host);
    return ntohl(out->address.s_addr) >> 24 == IN_LOOPBACKNET ? GBT_OK : make_token(out->token, err);
}

bool guard_knows_host(const guard *g, const char *host)
{
    char name[INET_ADDRSTRLEN];
    struct in_addr any;
    if (host == NULL)
        return false;
    const size_t length = strcspn(host, ":");
    if (length >= sizeof name ||
        (host[length] == ':' && strspn(host + length + 1, "0123456789") != strlen(host + length + 1)))
        return false;
    memcpy(name, host, length);
    name[length] = '\0';
    return strcmp(name, "127.0.0.1") == 0 || strcasecmp(name, "localhost") == 0 ||
           strcmp(name, g->host) == 0 || (g->token[0] != '\0' && inet_pton(AF_INET, name, &any) == 1);
}

bool guard_knows_token(const guard *g, const char *given)
{
    if (g->token[0] == '\0')
        return true;
    if (given == NULL || strlen(given) != GUARD_TOKEN_DIGITS)
        return false;
    volatile unsigned char differs = 0;
    for (int i = 0; i < GUARD_TOKEN_DIGITS; i++)
        differs |= (unsigned char)(g->token[i] ^ given[i]);
    return differs == 0;
}

/* The address from which this machine reaches other networks, found by connecting a UDP socket, which sends
   no packet. False if there is no such network. */
static bool find_own_address(char out[INET_ADDRSTRLEN])
{
    struct sockaddr_in there = {.sin_family = AF_INET, .sin_port = htons(9)}, here;
    socklen_t size = sizeof here;
    inet_pton(AF_INET, "192.0.2.1", &there.sin_addr); /* reserved for documentation, so it is nobody's */
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const bool found = fd >= 0 && connect(fd, (struct sockaddr *)&there, sizeof there) == 0 &&
                       getsockname(fd, (struct sockaddr *)&here, &size) == 0;
    if (fd >= 0)
        close(fd);
    return found && inet_ntop(AF_INET, &here.sin_addr, out, INET_ADDRSTRLEN) != NULL;
}

void guard_url(const guard *g, int port, char out[GUARD_URL_SIZE])
{
    char host[INET_ADDRSTRLEN];
    memcpy(host, g->host, sizeof host);
    if (g->address.s_addr == htonl(INADDR_ANY) && !find_own_address(host))
        strcpy(host, "127.0.0.1");
    snprintf(out, GUARD_URL_SIZE, "http://%s:%d%s%s", host, port, g->token[0] != '\0' ? "/?token=" : "",
             g->token);
}
