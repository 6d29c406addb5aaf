/* SPDX-License-Identifier: Apache-2.0 */
/* view/http.c -- the checks of every request, and the headers of every response. */
#include "view/http.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "base/memory.h"
#include "view/page_files.h"

enum { COOKIE_NAME_SIZE = 24 };

/* The port is part of the name because a browser sends a host's cookies to all ports of that host. */
static void cookie_name(struct MHD_Connection *connection, char out[COOKIE_NAME_SIZE])
{
    struct MHD_Daemon *daemon = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_DAEMON)->daemon;
    snprintf(out, COOKIE_NAME_SIZE, "gbtrace_%d",
             MHD_get_daemon_info(daemon, MHD_DAEMON_INFO_BIND_PORT)->port);
}

static const char *token_in_query(struct MHD_Connection *connection)
{
    return MHD_lookup_connection_value(connection, MHD_GET_ARGUMENT_KIND, "token");
}

static bool has_token(struct MHD_Connection *connection, const guard *g)
{
    char name[COOKIE_NAME_SIZE];
    cookie_name(connection, name);
    return guard_knows_token(g, token_in_query(connection)) ||
           guard_knows_token(g, MHD_lookup_connection_value(connection, MHD_COOKIE_KIND, name));
}

/* Whether the browser says that another site's page makes this request. Browsers send Sec-Fetch-Site only to
   trustworthy addresses, which a plain http address is only on the same machine, and Origin only with some
   requests. Where both are missing the cookie protects: pages of other sites cannot make the browser send it.
   */
static bool is_cross_site(struct MHD_Connection *connection, const char *path, const char *host)
{
    const char *site = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Sec-Fetch-Site");
    const char *origin = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_ORIGIN);
    const bool foreign = site != NULL && strcmp(site, "same-origin") != 0 && strcmp(site, "none") != 0;
    return (foreign && strcmp(path, "/") != 0) ||
           (origin != NULL && (strncmp(origin, "http://", 7) != 0 || strcasecmp(origin + 7, host) != 0));
}

int http_refusal(struct MHD_Connection *connection, const guard *g, const char *path, const char *method,
                 const char **why)
{
    const char *host = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_HOST);
    if (!guard_knows_host(g, host)) {
        *why = "error: Host: only the address that gbtrace view printed is answered\n";
        return 403;
    }
    if (strcmp(method, MHD_HTTP_METHOD_GET) != 0) {
        *why = "error: only GET is answered\n";
        return 405;
    }
    if (!has_token(connection, g)) {
        *why = "error: no token, or not this server's: open the address that gbtrace view printed\n";
        return 403;
    }
    if (is_cross_site(connection, path, host)) {
        *why = "error: another site's page may not ask\n";
        return 403;
    }
    return 0;
}

enum MHD_Result http_send(struct MHD_Connection *connection, const guard *g, const answer *with, bool keeps)
{
    static const struct {
        const char *name, *value;
    } always[] = {
        {"Cache-Control", "no-store"},
        {"X-Content-Type-Options", "nosniff"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
        {"Referrer-Policy", "no-referrer"},
        {"Content-Security-Policy", "default-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'; "
                                    "base-uri 'none'; form-action 'none'"},
    };
    struct MHD_Response *response =
        keeps ? MHD_create_response_from_buffer(with->count, with->bytes, MHD_RESPMEM_PERSISTENT)
              : MHD_create_response_from_buffer_with_free_callback(with->count, with->bytes, mem_free);
    if (response == NULL) {
        if (!keeps)
            mem_free(with->bytes);
        return MHD_NO;
    }
    for (size_t i = 0; i < sizeof always / sizeof *always; i++)
        MHD_add_response_header(response, always[i].name, always[i].value);
    MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, with->type);
    if (with->about[0] != '\0')
        MHD_add_response_header(response, "X-Picture", with->about);
    if (with->code == 200 && g->token[0] != '\0' && guard_knows_token(g, token_in_query(connection))) {
        char name[COOKIE_NAME_SIZE], cookie[128];
        cookie_name(connection, name);
        snprintf(cookie, sizeof cookie, "%s=%s; Path=/; HttpOnly; SameSite=Strict", name, g->token);
        MHD_add_response_header(response, MHD_HTTP_HEADER_SET_COOKIE, cookie);
    }
    if (with->code == 405)
        MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, MHD_HTTP_METHOD_GET);
    const enum MHD_Result sent = MHD_queue_response(connection, (unsigned)with->code, response);
    MHD_destroy_response(response);
    return sent;
}

bool http_page(const char *path, answer *out)
{
    static const struct {
        const char *ending, *type;
    } types[] = {{".html", "text/html; charset=utf-8"},
                 {".css", "text/css; charset=utf-8"},
                 {".js", "text/javascript; charset=utf-8"},
                 {".svg", "image/svg+xml"}};
    const page_file *file = page_file_find(strcmp(path, "/") == 0 ? "index.html" : path + 1);
    if (path[0] != '/' || file == NULL)
        return false;
    *out = (answer){.code = 200,
                    .type = "application/octet-stream",
                    .bytes = (unsigned char *)file->bytes,
                    .count = file->count};
    const char *dot = strrchr(file->name, '.');
    for (size_t i = 0; dot != NULL && i < sizeof types / sizeof *types; i++)
        if (strcmp(dot, types[i].ending) == 0)
            out->type = types[i].type;
    return true;
}
