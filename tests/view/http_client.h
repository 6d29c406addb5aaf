/* SPDX-License-Identifier: Apache-2.0 */
/* tests/view/http_client.h -- bytes to a port of this machine, and all that comes back. */
#ifndef GBT_TESTS_HTTP_CLIENT_H
#define GBT_TESTS_HTTP_CLIENT_H

#include "test_support.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#define GOOD_HEAD "Host: 127.0.0.1\r\nConnection: close\r\n\r\n"

typedef struct reply {
    int code;   /* 0: closed without a word */
    char *text; /* head and body, NUL behind; free() */
    size_t count;
    char *body; /* in `text` */
    size_t body_count;
} reply;

static inline int http_connect(int port)
{
    const struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons((uint16_t)port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || connect(fd, (const struct sockaddr *)&address, sizeof address) != 0)
        fail_msg("cannot connect to port %d", port);
    return fd;
}

/* The other side may have closed before it has read all. */
static inline void http_write(int fd, const char *data, size_t count)
{
    for (ssize_t sent; count > 0 && (sent = send(fd, data, count, MSG_NOSIGNAL)) > 0;
         data += sent, count -= (size_t)sent)
        ;
}

static inline reply http_read(int fd)
{
    reply r = {0};
    size_t capacity = 1 << 16;
    ssize_t got;
    r.text = malloc(capacity + 1);
    while ((got = recv(fd, r.text + r.count, capacity - r.count, 0)) > 0) {
        r.count += (size_t)got;
        if (r.count == capacity)
            r.text = realloc(r.text, (capacity *= 2) + 1);
    }
    close(fd);
    r.text[r.count] = '\0';
    r.body = strstr(r.text, "\r\n\r\n");
    r.body = r.body != NULL ? r.body + 4 : r.text + r.count;
    r.body_count = r.count - (size_t)(r.body - r.text);
    if (r.count > 12 && strncmp(r.text, "HTTP/1.", 7) == 0)
        r.code = atoi(r.text + 9);
    return r;
}

/* All the bytes at once, then nothing more. */
static inline reply http_raw(int port, const char *data, size_t count)
{
    const int fd = http_connect(port);
    http_write(fd, data, count);
    shutdown(fd, SHUT_WR);
    return http_read(fd);
}

static inline int http_ask(int port, const char *path)
{
    char head[8192];
    const int length = snprintf(head, sizeof head, "GET %s HTTP/1.1\r\n" GOOD_HEAD, path),
              fd = http_connect(port);
    assert_true(length < (int)sizeof head);
    http_write(fd, head, (size_t)length);
    return fd;
}

static inline reply http_get(int port, const char *path) { return http_read(http_ask(port, path)); }

#endif
