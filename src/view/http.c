/* view/http.c -- who may ask, and the headers of what is sent. */
#include "view/http.h"

#include <string.h>

#include "base/memory.h"
#include "view/page_files.h"

bool http_host_is_local(const char *host)
{
    static const char *const names[] = {"127.0.0.1", "localhost"};
    if (host == NULL)
        return false;
    const size_t length = strcspn(host, ":");
    if (host[length] == ':' && strspn(host + length + 1, "0123456789") != strlen(host + length + 1))
        return false;
    for (int i = 0; i < 2; i++)
        if (strlen(names[i]) == length && strncasecmp(host, names[i], length) == 0)
            return true;
    return false;
}

int http_refusal(struct MHD_Connection *connection, const char *path, const char *method, const char **why)
{
    const char *host = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_HOST);
    const char *site = MHD_lookup_connection_value(connection, MHD_HEADER_KIND, "Sec-Fetch-Site");
    if (!http_host_is_local(host))
        return *why = "error: Host: only 127.0.0.1 and localhost are answered\n", 403;
    if (strcmp(method, MHD_HTTP_METHOD_GET) != 0)
        return *why = "error: only GET is answered\n", 405;
    if (site != NULL && strcmp(site, "same-origin") != 0 && strcmp(site, "none") != 0 && strcmp(path, "/") != 0)
        return *why = "error: another site's page may not ask\n", 403;
    return 0;
}

enum MHD_Result http_send(struct MHD_Connection *connection, const answer *with, bool keeps)
{
    static const struct { const char *name, *value; } always[] = {
        {"Cache-Control", "no-store"},
        {"X-Content-Type-Options", "nosniff"},
        {"Cross-Origin-Resource-Policy", "same-origin"},
        {"Referrer-Policy", "no-referrer"},
        {"Content-Security-Policy", "default-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'; base-uri 'none'; form-action "
                                    "'none'"},
    };
    struct MHD_Response *response = keeps ? MHD_create_response_from_buffer(with->count, with->bytes, MHD_RESPMEM_PERSISTENT)
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
    if (with->code == 405)
        MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, MHD_HTTP_METHOD_GET);
    const enum MHD_Result sent = MHD_queue_response(connection, (unsigned)with->code, response);
    MHD_destroy_response(response);
    return sent;
}

bool http_page(const char *path, answer *out)
{
    static const struct { const char *ending, *type; } types[] = {
        {".html", "text/html; charset=utf-8"}, {".css", "text/css; charset=utf-8"}, {".js", "text/javascript; charset=utf-8"},
        {".svg", "image/svg+xml"}};
    const page_file *file = page_file_find(strcmp(path, "/") == 0 ? "index.html" : path + 1);
    if (path[0] != '/' || file == NULL)
        return false;
    *out = (answer){.code = 200, .type = "application/octet-stream", .bytes = (unsigned char *)file->bytes, .count = file->count};
    const char *dot = strrchr(file->name, '.');
    for (size_t i = 0; dot != NULL && i < sizeof types / sizeof *types; i++)
        if (strcmp(dot, types[i].ending) == 0)
            out->type = types[i].type;
    return true;
}
