/* SPDX-License-Identifier: Apache-2.0 */
/* tests/view/test_server.c -- the server alone, with this program as its worker: bad requests, the queue,
   limits, the end. */
#include "view/http_client.h"

#include <signal.h>

#include "folder.h"
#include "base/stop_signal.h"
#include "view/server.h"

static server *s;
static guard here;
static int port;

static int start(void **state)
{
    gbt_error err = {0};
    if (folder_make(state) != 0)
        return -1;
    const char *log = in_folder("log.csv");
    write_text(log, "a,b\n1,2\n");
    if (guard_open(NULL, &here, &err) != GBT_OK || server_start(&here, 0, log, &s, &err) != GBT_OK)
        return -1;
    port = server_port(s);
    return 0;
}

static int stop(void **state)
{
    server_stop(s);
    return folder_remove(state);
}

/* ---- requests that are wrong ---- */

#define GET(path) "GET " path " HTTP/1.1\r\n"
#define BAD_OR_CLOSED (-1)

typedef struct bad_case {
    const char *name, *bytes;
    int code;     /* wanted; BAD_OR_CLOSED: 400 to 599, or the connection just closes */
    size_t count; /* 0: strlen */
} bad_case;

static bad_case bad[] = {
    {"no Host", GET("/") "\r\n", BAD_OR_CLOSED, 0},
    {"no Host in HTTP/1.0", "GET / HTTP/1.0\r\n\r\n", 403, 0},
    {"a foreign Host", GET("/") "Host: evil.example\r\nConnection: close\r\n\r\n", 403, 0},
    {"a foreign Host for data", GET("/status") "Host: evil.example\r\nConnection: close\r\n\r\n", 403, 0},
    {"a name that begins like ours", GET("/") "Host: 127.0.0.1.evil.example\r\nConnection: close\r\n\r\n",
     403, 0},
    {"another site's script", GET("/status") "Sec-Fetch-Site: cross-site\r\n" GOOD_HEAD, 403, 0},
    {"another port's script", GET("/render?view=0") "Sec-Fetch-Site: same-site\r\n" GOOD_HEAD, 403, 0},
    {"another site's script, with its name", GET("/status") "Origin: https://evil.example\r\n" GOOD_HEAD, 403,
     0},
    {"POST", "POST /render HTTP/1.1\r\nContent-Length: 4\r\n" GOOD_HEAD "view", 405, 0},
    {"PUT", "PUT /index.html HTTP/1.1\r\nContent-Length: 0\r\n" GOOD_HEAD, 405, 0},
    {"HEAD", "HEAD / HTTP/1.1\r\n" GOOD_HEAD, 405, 0},
    {"a method of its own", "FROB / HTTP/1.1\r\n" GOOD_HEAD, BAD_OR_CLOSED, 0},
    {"a body that never comes", "POST / HTTP/1.1\r\nContent-Length: 1000000\r\n" GOOD_HEAD "x", BAD_OR_CLOSED,
     0},
    {"a length that is none", "POST / HTTP/1.1\r\nContent-Length: -5\r\n" GOOD_HEAD, BAD_OR_CLOSED, 0},
    {"a length beyond 64 bits", "POST / HTTP/1.1\r\nContent-Length: 99999999999999999999999\r\n" GOOD_HEAD,
     BAD_OR_CLOSED, 0},
    {"chunks that are none", "POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n" GOOD_HEAD "zz\r\n",
     BAD_OR_CLOSED, 0},
    {"no path", "GET\r\n\r\n", BAD_OR_CLOSED, 0},
    {"nothing", "", BAD_OR_CLOSED, 0},
    {"one byte", "G", BAD_OR_CLOSED, 0},
    {"half a head", "GET / HTTP/1.1\r\nHost: 127.0", BAD_OR_CLOSED, 0},
    {"no protocol", "GET /status\r\n\r\n", BAD_OR_CLOSED, 0},
    {"a protocol to come", "GET / HTTP/9.9\r\n" GOOD_HEAD, BAD_OR_CLOSED, 0},
    {"zeros", "\0\0\0\0\r\n\r\n\0\0", BAD_OR_CLOSED, 10},
    {"a zero in a header", GET("/nowhere") "X: a\0b\r\n" GOOD_HEAD, BAD_OR_CLOSED,
     sizeof(GET("/nowhere") "X: a\0b\r\n" GOOD_HEAD) - 1},
    {"TLS", "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", BAD_OR_CLOSED, 15},
    {"a header without a name", GET("/nowhere") ": x\r\n" GOOD_HEAD, BAD_OR_CLOSED, 0},
    {"no such path", GET("/nowhere") GOOD_HEAD, 404, 0},
    {"up and away", GET("/../../etc/passwd") GOOD_HEAD, 404, 0},
    {"up and away, written otherwise", GET("/%2e%2e/%2e%2e/etc/passwd") GOOD_HEAD, 404, 0},
    {"a zero ends the path", GET("/nowhere%00/index.html") GOOD_HEAD, 404, 0},
    {"percent and no number", GET("/%zz%") GOOD_HEAD, 404, 0},
    {"a star", "GET * HTTP/1.1\r\n" GOOD_HEAD, 404, 0},
    {"an address in place of a path", "GET http://evil.example/ HTTP/1.1\r\n" GOOD_HEAD, BAD_OR_CLOSED, 0},
    {"a word without a value", GET("/render?camera") GOOD_HEAD, 400, 0},
    {"words twice", GET("/render?view=&view=&&&=&") GOOD_HEAD, 400, 0},
    {"a camera cut short", GET("/render?camera=%7B%22origin%22:%5B1,") GOOD_HEAD, 400, 0},
    {"a log from nowhere", GET("/log?from=-1") GOOD_HEAD, 400, 0},
    {"a log from beyond 64 bits", GET("/log?from=99999999999999999999") GOOD_HEAD, 400, 0},
};

static void assert_lives(void)
{
    reply r = http_get(port, "/status");
    assert_int_equal(r.code, 200);
    free(r.text);
}

static void refused(void **state)
{
    const bad_case *c = *state;
    reply r = http_raw(port, c->bytes, c->count > 0 ? c->count : strlen(c->bytes));
    const bool fine =
        c->code == BAD_OR_CLOSED ? r.code == 0 || (r.code >= 400 && r.code < 600) : r.code == c->code;
    if (!fine)
        fail_msg("wanted %d, got %.200s", c->code, r.text);
    free(r.text);
    assert_lives();
}

/* A head, or a query, of `count` bytes. */
static void too_long(bool in_query, size_t count)
{
    char *bytes = malloc(count + 256);
    size_t length = (size_t)sprintf(bytes, in_query ? "GET /render?camera=" : "GET / HTTP/1.1\r\nX: ");
    memset(bytes + length, '[', count);
    length += count;
    length += (size_t)sprintf(bytes + length, in_query ? " HTTP/1.1\r\n" GOOD_HEAD : "\r\n" GOOD_HEAD);
    reply r = http_raw(port, bytes, length);
    if (r.code != 0 && (r.code < 400 || r.code > 499))
        fail_msg("%zu bytes: %.200s", count, r.text);
    free(r.text);
    free(bytes);
    assert_lives();
}

static void long_heads_are_refused(void **state)
{
    (void)state;
    too_long(false, 40000);
    too_long(true, 20000); /* fits, and is a list in a list in a list ... */
    too_long(true, 40000);
    too_long(true, 3000000);
}

/* As much as a client has to say is not read: it is shut before its 256 MB, of which the kernel may hold some
   before anybody reads. */
static void a_body_without_end_is_cut(void **state)
{
    (void)state;
    static const char head[] = "POST /status HTTP/1.1\r\nContent-Length: 1000000000\r\n" GOOD_HEAD,
                      body[1 << 16];
    const int fd = http_connect(port);
    int sent = 0;
    http_write(fd, head, sizeof head - 1);
    while (sent < 4000 && send(fd, body, sizeof body, MSG_NOSIGNAL) > 0)
        sent++;
    assert_in_range(sent, 0, 3999);
    close(fd);
    assert_lives();
}

/* ---- what is there ---- */

static void assert_has(const reply *r, const char *text)
{
    if (strstr(r->text, text) == NULL)
        fail_msg("no \"%s\" in %.1000s", text, r->text);
}

static void the_page_is_there(void **state)
{
    (void)state;
    static const struct {
        const char *path, *type, *text;
    } files[] = {{"/", "text/html", "<title>gbtrace</title>"},
                 {"/index.html", "text/html", "</html>"},
                 {"/view.js", "text/javascript", "import"},
                 {"/view.css", "text/css", "prefers-color-scheme"},
                 {"/icon.svg", "image/svg+xml", "</svg>"}};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        reply r = http_get(port, files[i].path);
        assert_int_equal(r.code, 200);
        assert_has(&r, files[i].type);
        assert_has(&r, files[i].text);
        assert_has(&r, "Content-Security-Policy: default-src 'self'");
        assert_has(&r, "X-Content-Type-Options: nosniff");
        free(r.text);
    }
}

static void the_log_is_read_on(void **state)
{
    (void)state;
    static const struct {
        const char *path, *body, *about;
    } parts[] = {{"/log", "a,b\n1,2\n", "{\"from\":0}"},
                 {"/log?from=4", "1,2\n", "{\"from\":4}"},
                 {"/log?from=8", "", "{\"from\":8}"},
                 {"/log?from=9", "a,b\n1,2\n", "{\"from\":0}"}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        reply r = http_get(port, parts[i].path);
        assert_int_equal(r.code, 200);
        assert_string_equal(r.body, parts[i].body);
        assert_has(&r, parts[i].about);
        free(r.text);
    }
}

static void status_is_what_was_set(void **state)
{
    (void)state;
    char *json = mem_alloc(16, 1, "test", NULL);
    strcpy(json, "{\"version\":7}");
    server_set_status(s, json);
    server_set_status(s, NULL); /* no memory for a new one: the old one stays */
    reply r = http_get(port, "/status");
    assert_string_equal(r.body, "{\"version\":7}");
    free(r.text);
}

/* ---- the queue ---- */

static void expect(int fd, int code, const char *body)
{
    reply r = http_read(fd);
    assert_int_equal(r.code, code);
    assert_string_equal(r.body, body);
    free(r.text);
}

static server_job *wait_for_job(server *from)
{
    server_job *job = NULL;
    while (job == NULL)
        job = server_next(from, 5);
    return job;
}

/* What was sent before has been read after this: the server looks at all connections in each round of its one
   thread. */
static void settle(int at)
{
    for (int i = 0; i < 2; i++) {
        reply r = http_get(at, "/status");
        assert_int_equal(r.code, 200);
        free(r.text);
    }
}

static void answer_with(server *by, server_job *job, const char *text)
{
    answer a = {0};
    answer_text(&a, 200, "text/plain", text);
    strcpy(a.about, "{\"width\":1}");
    server_answer(by, job, &a);
}

static void the_newest_picture_wins(void **state)
{
    (void)state;
    const int first = http_ask(port, "/render?view=1"), photo = http_ask(port, "/photo?view=9");
    server_job *job = wait_for_job(s);
    server_job *other = wait_for_job(s);
    if (server_request(job)->kind != REQUEST_RENDER) { /* they came on two connections, in any order */
        server_job *swap = job;
        job = other;
        other = swap;
    }
    assert_true(server_request(job)->kind == REQUEST_RENDER && server_request(job)->view == 1 &&
                server_request(other)->kind == REQUEST_PHOTO);
    /* While the first is drawn three more are asked for: the last one is what the page wants to see. */
    const int second = http_ask(port, "/render?view=2"), scene = http_ask(port, "/scene");
    settle(port);
    const int third = http_ask(port, "/render?view=3");
    expect(second, 503, "error: a newer picture was asked for\n");
    settle(port);
    const int fourth = http_ask(port, "/render?view=4");
    expect(third, 503, "error: a newer picture was asked for\n");
    answer_with(s, job, "first");
    answer_with(s, other, "photo");
    expect(first, 200, "first");
    expect(photo, 200, "photo");
    for (int i = 0; i < 2; i++) {
        job = wait_for_job(s);
        if (server_request(job)->kind == REQUEST_RENDER)
            assert_int_equal(server_request(job)->view, 4);
        answer_with(s, job, "next");
    }
    expect(scene, 200, "next");
    reply r = http_read(fourth);
    assert_int_equal(r.code, 200);
    assert_has(&r, "X-Picture: {\"width\":1}");
    free(r.text);
}

static void the_queue_has_an_end(void **state)
{
    (void)state;
    int fd[SERVER_JOBS + 1], refused_count = 0;
    for (int i = 0; i <= SERVER_JOBS; i++)
        fd[i] = http_ask(port, "/scene");
    settle(port); /* all have been read: one found no room */
    for (int i = 0; i < SERVER_JOBS; i++)
        answer_with(s, wait_for_job(s), "here");
    server_job *more = server_next(s, 0.01);
    if (more != NULL) /* or the reads below would wait for ever */
        answer_with(s, more, "here");
    for (int i = 0; i <= SERVER_JOBS; i++) {
        reply r = http_read(fd[i]);
        assert_true(r.code == 200 || r.code == 503);
        refused_count += r.code == 503;
        free(r.text);
    }
    assert_int_equal(refused_count, 1);
}

static void nobody_waits_for_an_answer_that_nobody_wants(void **state)
{
    (void)state;
    const int fd = http_ask(port, "/render?view=0");
    server_job *job = wait_for_job(s);
    close(fd);
    answer_with(s, job, "late");
    assert_lives();
}

/* A byte now and then, until it is closed. */
static void send_slowly(int fd)
{
    char byte;
    while (recv(fd, &byte, 1, MSG_DONTWAIT) < 0) {
        http_write(fd, "x", 1);
        usleep(20000);
    }
    close(fd);
}

/* As many as one address may have, each with half a request: they are shut, and the server answers again. */
static void slow_clients_are_shut(void **state)
{
    (void)state;
    server *other;
    int slow[SERVER_ADDRESS_CONNECTIONS];
    assert_ok(server_start(&here, 0, "", &other, NULL));
    server_set_patience(other, 0.2);
    for (int i = 0; i < SERVER_ADDRESS_CONNECTIONS; i++) {
        slow[i] = http_connect(server_port(other));
        http_write(slow[i], "GET /status HTTP/1.1\r\nX: ", 26);
    }
    for (int i = 0; i < SERVER_ADDRESS_CONNECTIONS; i++)
        send_slowly(slow[i]);
    server_set_patience(other, SERVER_REQUEST_SECONDS);
    reply r = http_get(server_port(other), "/status");
    assert_int_equal(r.code, 200);
    free(r.text);
    server_stop(other);
}

/* More than the kernel holds, of which one byte is taken. Whoever came later and is shut, too, was shut after
   it. */
static void who_does_not_take_an_answer_is_shut(void **state)
{
    (void)state;
    enum { BYTES = 1 << 26 };
    server *other;
    char byte;
    assert_ok(server_start(&here, 0, "", &other, NULL));
    const int fd = http_ask(server_port(other), "/scene");
    server_job *job = wait_for_job(other);
    server_set_patience(other, 0.2);
    const answer large = {
        .code = 200, .type = "text/plain", .bytes = mem_calloc(BYTES, 1, "test", NULL), .count = BYTES};
    server_answer(other, job, &large);
    assert_int_equal(recv(fd, &byte, 1, 0), 1);
    const int later = http_connect(server_port(other));
    http_write(later, "GET /status HTTP/1.1\r\nX: ", 26);
    send_slowly(later);
    reply rest = http_read(fd);
    assert_true(rest.count < BYTES);
    free(rest.text);
    server_stop(other);
}

/* With as many jobs as may wait, one address has room for some connections without a request. */
static void one_address_leaves_room_for_others(void **state)
{
    (void)state;
    server *other;
    enum { ROOM = SERVER_ADDRESS_CONNECTIONS - SERVER_JOBS };
    int asking[SERVER_JOBS], fd[ROOM + 1];
    assert_ok(server_start(&here, 0, "", &other, NULL));
    for (int i = 0; i < SERVER_JOBS; i++)
        asking[i] = http_ask(server_port(other), "/scene");
    settle(server_port(other));
    for (int i = 0; i <= ROOM; i++)
        fd[i] = http_connect(server_port(other));
    /* The last one is closed unasked, the first stay open. */
    char byte;
    assert_int_equal(recv(fd[ROOM], &byte, 1, 0), 0);
    assert_true(recv(fd[0], &byte, 1, MSG_DONTWAIT) < 0);
    for (int i = 0; i <= ROOM; i++)
        close(fd[i]);
    for (int i = 0; i < SERVER_JOBS; i++)
        answer_with(other, wait_for_job(other), "here");
    for (int i = 0; i < SERVER_JOBS; i++)
        expect(asking[i], 200, "here");
    server_stop(other);
}

/* Who asks is answered, although hundreds connect and send nothing; so is who had asked before. */
static void clients_that_send_nothing_make_room(void **state)
{
    (void)state;
    enum { SILENT = 300 };
    server *other;
    int fd[SILENT];
    assert_ok(server_start(&here, 0, "", &other, NULL));
    const int before = http_ask(server_port(other), "/scene");
    server_job *job = wait_for_job(other);
    for (int i = 0; i < SILENT; i++)
        fd[i] = http_connect(server_port(other));
    settle(server_port(other));
    answer_with(other, job, "here");
    expect(before, 200, "here");
    for (int i = 0; i < SILENT; i++)
        close(fd[i]);
    server_stop(other);
}

static void it_is_known_that_nobody_waits(void **state)
{
    (void)state;
    const int fd = http_ask(port, "/render?view=0");
    server_job *job = wait_for_job(s);
    assert_false(atomic_load(server_nobody_waits(s)));
    close(fd);
    while (!atomic_load(server_nobody_waits(s)))
        usleep(10000);
    answer_with(s, job, "late");
    const int next = http_ask(port, "/render?view=0");
    job = wait_for_job(s);
    assert_false(atomic_load(server_nobody_waits(s)));
    answer_with(s, job, "here");
    expect(next, 200, "here");
}

static void a_signal_ends_what_is_made(void **state)
{
    (void)state;
    stop_signal_catch();
    const int fd = http_ask(port, "/render?view=0");
    server_job *job = wait_for_job(s);
    assert_false(atomic_load(server_nobody_waits(s)));
    raise(SIGINT);
    while (!atomic_load(server_nobody_waits(s)))
        usleep(10000);
    stop_signal_release(); /* forgets it */
    answer_with(s, job, "given up");
    expect(fd, 200, "given up");
}

static void the_end_answers_all(void **state)
{
    (void)state;
    server *other;
    assert_ok(server_start(&here, 0, "", &other, NULL));
    reply none = http_get(server_port(other), "/log");
    assert_int_equal(none.code, 404);
    free(none.text);
    const int fd = http_ask(server_port(other), "/scene");
    answer_with(other, wait_for_job(other), "last");
    expect(fd, 200, "last");
    server_wake(other);
    assert_null(server_next(other, 5));
    const int waits = http_ask(server_port(other), "/render?view=0");
    settle(server_port(other));
    server_stop(other);
    reply r = http_read(waits); /* told so, or cut off while it was told */
    assert_true(r.code == 503 || r.code == 0);
    free(r.text);
}

/* ---- with a token ---- */

static reply get_with(int at, const char *path, const char *headers)
{
    char head[1024];
    const int length =
        snprintf(head, sizeof head, "GET %s HTTP/1.1\r\n%sConnection: close\r\n\r\n", path, headers);
    return http_raw(at, head, (size_t)length);
}

static void assert_code(int at, const char *path, const char *headers, int code)
{
    reply r = get_with(at, path, headers);
    if (r.code != code)
        fail_msg("%s %s: wanted %d, got %.300s", path, headers, code, r.text);
    if (code == 403 && (r.body_count == 0 || strchr(r.body, '\n') != r.body + r.body_count - 1 ||
                        strncmp(r.body, "error: ", 7) != 0))
        fail_msg("%s %s: wanted one line, got \"%s\"", path, headers, r.body);
    if (code == 403 && strstr(r.text, "Set-Cookie") != NULL)
        fail_msg("%s %s: a cookie for a stranger", path, headers);
    free(r.text);
}

static void others_need_the_token(void **state)
{
    (void)state;
    static const char *const paths[] = {"/",    "/index.html", "/view.js",       "/status",
                                        "/log", "/scene",      "/render?view=0", "/nowhere"};
    static const char host[] = "Host: 192.168.1.5:8470\r\n";
    server *other;
    guard g;
    char path[256], headers[256], wanted[256];
    assert_ok(guard_open("0.0.0.0", &g, NULL));
    assert_ok(server_start(&g, 0, "", &other, NULL));
    const int at = server_port(other);
    for (size_t i = 0; i < sizeof paths / sizeof *paths; i++) {
        assert_code(at, paths[i], host, 403);
        assert_code(at, paths[i], "Host: 127.0.0.1\r\n", 403); /* from this machine too: its address is not
                                                                  whose request it is */
    }
    assert_code(at, "/status?token=", host, 403);
    assert_code(at, "/status?token=00000000000000000000000000000000", host, 403);
    snprintf(path, sizeof path, "/?token=%s", g.token);
    reply r = get_with(at, path, host);
    assert_int_equal(r.code, 200);
    snprintf(wanted, sizeof wanted, "Set-Cookie: gbtrace_%d=%s; Path=/; HttpOnly; SameSite=Strict\r\n", at,
             g.token);
    assert_has(&r, wanted);
    assert_has(&r, "Referrer-Policy: no-referrer");
    free(r.text);
    snprintf(headers, sizeof headers, "%sCookie: a=b; gbtrace_%d=%s\r\n", host, at, g.token);
    assert_code(at, "/", headers, 200);
    assert_code(at, "/view.js", headers, 200);
    assert_code(at, "/status", headers, 200);
    /* with the token, but for a foreign name or another site */
    snprintf(headers, sizeof headers, "Host: evil.example:8470\r\nCookie: gbtrace_%d=%s\r\n", at, g.token);
    assert_code(at, "/status", headers, 403);
    snprintf(headers, sizeof headers, "%sOrigin: http://192.168.1.5:80\r\nCookie: gbtrace_%d=%s\r\n", host,
             at, g.token);
    assert_code(at, "/status", headers, 403);
    snprintf(headers, sizeof headers, "%sOrigin: null\r\nCookie: gbtrace_%d=%s\r\n", host, at, g.token);
    assert_code(at, "/status", headers, 403);
    snprintf(headers, sizeof headers, "%sSec-Fetch-Site: same-site\r\nCookie: gbtrace_%d=%s\r\n", host, at,
             g.token);
    assert_code(at, "/status", headers, 403);
    snprintf(headers, sizeof headers, "%sOrigin: http://192.168.1.5:8470\r\nCookie: gbtrace_%d=%s\r\n", host,
             at, g.token);
    assert_code(at, "/status", headers, 200);
    server_stop(other);
}

static void an_address_of_another_machine(void **state)
{
    (void)state;
    server *other;
    guard g;
    gbt_error err = {0};
    assert_ok(guard_open("203.0.113.77", &g, NULL)); /* for documentation: nobody's */
    assert_int_equal(server_start(&g, 0, "", &other, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "203.0.113.77:0: cannot listen"));
}

static void a_port_belongs_to_one(void **state)
{
    (void)state;
    server *other;
    gbt_error err = {0};
    assert_int_equal(server_start(&here, port, "", &other, &err), GBT_ERR_IO);
    assert_non_null(strstr(err.text, "cannot listen"));
    assert_null(other);
}

int main(void)
{
    enum { BAD = sizeof bad / sizeof *bad };
    const struct CMUnitTest rest[] = {
        cmocka_unit_test(long_heads_are_refused),
        cmocka_unit_test(the_page_is_there),
        cmocka_unit_test(the_log_is_read_on),
        cmocka_unit_test(status_is_what_was_set),
        cmocka_unit_test(the_newest_picture_wins),
        cmocka_unit_test(the_queue_has_an_end),
        cmocka_unit_test(a_body_without_end_is_cut),
        cmocka_unit_test(nobody_waits_for_an_answer_that_nobody_wants),
        cmocka_unit_test(slow_clients_are_shut),
        cmocka_unit_test(who_does_not_take_an_answer_is_shut),
        cmocka_unit_test(one_address_leaves_room_for_others),
        cmocka_unit_test(clients_that_send_nothing_make_room),
        cmocka_unit_test(it_is_known_that_nobody_waits),
        cmocka_unit_test(a_signal_ends_what_is_made),
        cmocka_unit_test(the_end_answers_all),
        cmocka_unit_test(others_need_the_token),
        cmocka_unit_test(an_address_of_another_machine),
        cmocka_unit_test(a_port_belongs_to_one),
    };
    enum { REST = sizeof rest / sizeof *rest };
    struct CMUnitTest tests[BAD + REST];
    for (size_t i = 0; i < BAD; i++)
        tests[i] = (struct CMUnitTest){.name = bad[i].name, .test_func = refused, .initial_state = &bad[i]};
    memcpy(tests + BAD, rest, sizeof rest);
    return cmocka_run_group_tests(tests, start, stop);
}
