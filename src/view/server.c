/* SPDX-License-Identifier: Apache-2.0 */
/* view/server.c -- the HTTP server: libmicrohttpd in its own thread, and the queue of jobs for the worker.

     libmicrohttpd's thread: on_request() --> http_page(), /status, /log: answered at once
                                          --> put_in(): a job; its connection is suspended
     worker (the caller):    server_next() --> server_answer(): resumes the connection
     watching thread:        closes slow connections, and tells the worker when its client has left

   One lock guards everything that the threads share. */
#include "view/server.h"

#include <arpa/inet.h>
#include <errno.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "base/fail.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/plain_numbers.h"
#include "base/stop_signal.h"
#include "data/number.h"
#include "view/connections.h"
#include "view/http.h"

enum { LOG_BYTES_MAX = 1 << 20, BODY_BYTES_MAX = 1 << 16 };

struct server_job {
    struct MHD_Connection *connection;
    request request;
    answer answer;
    bool is_answered; /* guarded by the lock until the connection is resumed */
    size_t body_bytes;
};

struct server {
    struct MHD_Daemon *daemon;
    guard guard;
    const char *log_path;
    sem_t wake; /* posted once per job, and by server_wake() */
    pthread_mutex_t lock;
    server_job *waiting[SERVER_JOBS]; /* oldest first */
    int waiting_count;
    char *status;
    bool is_closing;
    connections clients;
    connection_entry client_entries[SERVER_CONNECTIONS];
    const struct MHD_Connection *working_for; /* the connection of the job that server_next() returned last;
                                                 NULL: none */
    atomic_bool nobody_waits;
    pthread_t watch;
    bool is_watched;
};

/* ---- the queue ---- */

static const char text_plain[] = "text/plain; charset=utf-8";

static void take_out(server *s, int i)
{
    s->waiting_count--;
    memmove(s->waiting + i, s->waiting + i + 1, (size_t)(s->waiting_count - i) * sizeof *s->waiting);
}

/* Call with the lock held and the connection suspended. */
static void resume_with_text(server_job *job, int code, const char *text)
{
    answer_text(&job->answer, code, text_plain, text);
    job->is_answered = true;
    MHD_resume_connection(job->connection);
}

/* Append to the queue; call with the lock held. A new picture replaces one that still waits, because the page
   no longer needs that one. */
static bool put_in(server *s, server_job *job)
{
    for (int i = 0; i < s->waiting_count && job->request.kind == REQUEST_RENDER; i++)
        if (s->waiting[i]->request.kind == REQUEST_RENDER) {
            resume_with_text(s->waiting[i], 503, "error: a newer picture was asked for\n");
            take_out(s, i);
        }
    if (s->is_closing || s->waiting_count == SERVER_JOBS)
        return false;
    s->waiting[s->waiting_count++] = job;
    return true;
}

server_job *server_next(server *s, double seconds)
{
    struct timespec until;
    clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_sec += (time_t)seconds;
    until.tv_nsec += (long)((seconds - (double)(time_t)seconds) * 1e9);
    if (until.tv_nsec >= 1000000000) {
        until.tv_sec++;
        until.tv_nsec -= 1000000000;
    }
    while (sem_clockwait(&s->wake, CLOCK_MONOTONIC, &until) != 0)
        if (errno != EINTR)
            return NULL;
    pthread_mutex_lock(&s->lock);
    server_job *job = s->waiting_count > 0 ? s->waiting[0] : NULL;
    if (job != NULL)
        take_out(s, 0);
    s->working_for = job != NULL ? job->connection : NULL;
    atomic_store(&s->nobody_waits, false);
    pthread_mutex_unlock(&s->lock);
    return job;
}

const atomic_bool *server_nobody_waits(const server *s) { return &s->nobody_waits; }

void server_set_patience(server *s, double seconds)
{
    pthread_mutex_lock(&s->lock);
    s->clients.request_seconds = s->clients.answer_seconds = seconds;
    pthread_mutex_unlock(&s->lock);
}

const request *server_request(const server_job *job) { return &job->request; }

void server_answer(server *s, server_job *job, const answer *with)
{
    pthread_mutex_lock(&s->lock);
    if (s->working_for == job->connection)
        s->working_for = NULL;
    job->answer = *with;
    job->is_answered = true;
    MHD_resume_connection(job->connection);
    pthread_mutex_unlock(&s->lock);
}

void server_wake(server *s) { sem_post(&s->wake); }

void server_set_status(server *s, char *json)
{
    if (json == NULL)
        return;
    pthread_mutex_lock(&s->lock);
    mem_free(s->status);
    s->status = json;
    pthread_mutex_unlock(&s->lock);
}

/* ---- the thread that watches the clients ---- */

static void *watch_clients(void *context)
{
    static const struct timespec pause = {.tv_nsec = 100000000};
    server *s = context;
    for (bool go_on = true; go_on;) {
        pthread_mutex_lock(&s->lock);
        go_on = !s->is_closing;
        connections_shut_slow(&s->clients);
        if (stop_signal_seen() ||
            (s->working_for != NULL && connections_has_left(&s->clients, s->working_for)))
            atomic_store(&s->nobody_waits, true);
        pthread_mutex_unlock(&s->lock);
        if (go_on)
            nanosleep(&pause, NULL);
    }
    return NULL;
}

static void on_connection(void *context, struct MHD_Connection *connection, void **state,
                          enum MHD_ConnectionNotificationCode what)
{
    server *s = context;
    (void)state;
    pthread_mutex_lock(&s->lock);
    if (what == MHD_CONNECTION_NOTIFY_STARTED)
        connections_expect_request(&s->clients, connection);
    else
        connections_forget(&s->clients, connection);
    pthread_mutex_unlock(&s->lock);
}

/* ---- requests, in libmicrohttpd's thread ---- */

static const char *query_word(void *query, const char *name)
{
    return MHD_lookup_connection_value(query, MHD_GET_ARGUMENT_KIND, name);
}

static void give_status(server *s, answer *out)
{
    pthread_mutex_lock(&s->lock);
    answer_text(out, 200, "application/json", s->status != NULL ? s->status : "{}");
    pthread_mutex_unlock(&s->lock);
}

/* The log from a byte on; the whole log if it is now shorter than that. */
static void give_log(const server *s, struct MHD_Connection *connection, answer *out)
{
    const char *from = query_word(connection, "from");
    uint64_t begin = 0;
    unsigned char *bytes = NULL;
    size_t count = 0;
    if (from != NULL && number_parse_u64(from, strlen(from), &begin) != NUMBER_OK) {
        answer_text(out, 400, text_plain, "error: from: wanted a number of bytes\n");
        return;
    }
    if (s->log_path[0] == '\0' || file_read(s->log_path, &bytes, &count, NULL) != GBT_OK) {
        answer_text(out, 404, text_plain, "error: no log\n");
        return;
    }
    if (begin > count)
        begin = 0;
    count -= begin;
    if (count > LOG_BYTES_MAX)
        count = LOG_BYTES_MAX;
    memmove(bytes, bytes + begin, count);
    *out = (answer){.code = 200, .type = "text/csv; charset=utf-8", .bytes = bytes, .count = count};
    snprintf(out->about, sizeof out->about, "{\"from\":%llu}", (unsigned long long)begin);
}

static enum MHD_Result refuse(const server *s, struct MHD_Connection *connection, int code, const char *why)
{
    answer text = {0};
    answer_text(&text, code, text_plain, why);
    return http_send(connection, &s->guard, &text, false);
}

/* Answer at once, or append a job to the queue and suspend the connection. */
static enum MHD_Result begin(server *s, server_job *job, const char *path)
{
    answer now = {0};
    gbt_error err = {0};
    if (http_page(path, &now))
        return http_send(job->connection, &s->guard, &now, true);
    if (strcmp(path, "/status") == 0)
        give_status(s, &now);
    else if (strcmp(path, "/log") == 0)
        give_log(s, job->connection, &now);
    if (now.code != 0)
        return http_send(job->connection, &s->guard, &now, false);
    const gbt_status status = request_parse(path, query_word, job->connection, &job->request, &err);
    if (status != GBT_OK) {
        answer_failure(&now, status, &err);
        now.code = status == GBT_ERR_IO ? 404 : now.code;
        return http_send(job->connection, &s->guard, &now, false);
    }
    pthread_mutex_lock(&s->lock);
    const bool waits = put_in(s, job);
    if (waits) {
        connections_hold(&s->clients, job->connection);
        MHD_suspend_connection(job->connection);
    }
    pthread_mutex_unlock(&s->lock);
    if (!waits)
        return refuse(s, job->connection, 503, "error: too many requests are waiting\n");
    sem_post(&s->wake);
    return MHD_YES;
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *connection, const char *path,
                                  const char *method, const char *version, const char *body,
                                  size_t *body_bytes, void **state)
{
    PLAIN_NUMBERS; /* each thread starts with the program's locale */
    server *s = context;
    server_job *job = *state;
    const char *why;
    (void)version;
    (void)body;
    if (job == NULL) { /* first call: only the headers have arrived, and no answer may be sent yet */
        job = mem_calloc(1, sizeof *job, "request", NULL);
        *state = job;
        return job != NULL ? MHD_YES : MHD_NO;
    }
    job->connection = connection;
    if (*body_bytes == 0) {
        pthread_mutex_lock(&s->lock);
        connections_expect_taking(&s->clients, connection);
        pthread_mutex_unlock(&s->lock);
    }
    if (*body_bytes > 0) { /* a request body is ignored, up to a limit */
        job->body_bytes += *body_bytes;
        *body_bytes = 0;
        return job->body_bytes <= BODY_BYTES_MAX ? MHD_YES : MHD_NO;
    }
    if (job->is_answered) {
        const answer with = job->answer;
        job->answer = (answer){0};
        return http_send(connection, &s->guard, &with, false);
    }
    const int refusal = http_refusal(connection, &s->guard, path, method, &why);
    return refusal != 0 ? refuse(s, connection, refusal, why) : begin(s, job, path);
}

static void on_done(void *context, struct MHD_Connection *connection, void **state,
                    enum MHD_RequestTerminationCode how)
{
    server *s = context;
    server_job *job = *state;
    (void)how;
    pthread_mutex_lock(&s->lock);
    connections_expect_request(&s->clients, connection);
    pthread_mutex_unlock(&s->lock);
    if (job != NULL)
        mem_free(job->answer.bytes);
    mem_free(job);
    *state = NULL;
}

static void on_message(void *context, const char *format, va_list words)
{
    /* about broken connections, which do not concern the user */
    (void)context;
    (void)format;
    (void)words;
}

/* ---- start and stop ---- */

gbt_status server_start(const guard *g, int port, const char *log_path, server **out, gbt_error *err)
{
    struct sockaddr_in address = {
        .sin_family = AF_INET, .sin_port = htons((uint16_t)port), .sin_addr = g->address};
    server *s = mem_calloc(1, sizeof *s, "server", err);
    *out = s;
    if (s == NULL)
        return GBT_ERR_NO_MEMORY;
    s->guard = *g;
    s->log_path = log_path;
    sem_init(&s->wake, 0, 0);
    pthread_mutex_init(&s->lock, NULL);
    s->clients = (connections){.entries = s->client_entries,
                               .capacity = SERVER_CONNECTIONS,
                               .expecting_max = SERVER_EXPECTING_CONNECTIONS,
                               .request_seconds = SERVER_REQUEST_SECONDS,
                               .answer_seconds = SERVER_ANSWER_SECONDS};
    errno = 0;
    s->daemon = MHD_start_daemon(
        MHD_USE_INTERNAL_POLLING_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG, (uint16_t)port, NULL,
        NULL, on_request, s, MHD_OPTION_EXTERNAL_LOGGER, on_message, NULL, MHD_OPTION_SOCK_ADDR,
        (struct sockaddr *)&address, MHD_OPTION_NOTIFY_COMPLETED, on_done, s, MHD_OPTION_NOTIFY_CONNECTION,
        on_connection, s, MHD_OPTION_CONNECTION_LIMIT, (unsigned)SERVER_CONNECTIONS,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)SERVER_HEAD_BYTES, MHD_OPTION_PER_IP_CONNECTION_LIMIT,
        (unsigned)SERVER_ADDRESS_CONNECTIONS, MHD_OPTION_END);
    int why = errno;
    if (s->daemon != NULL) {
        why = pthread_create(&s->watch, NULL, watch_clients, s);
        s->is_watched = why == 0;
    }
    if (s->is_watched)
        return GBT_OK;
    server_stop(s);
    *out = NULL;
    return base_fail(err, GBT_ERR_IO, "%s:%d: cannot listen: %s%s", g->host, port,
                     why != 0 ? strerror(why) : "libmicrohttpd did not start",
                     why == EADDRINUSE ? " (wanted another port, or 0 for any free one)" : "");
}

int server_port(const server *s) { return MHD_get_daemon_info(s->daemon, MHD_DAEMON_INFO_BIND_PORT)->port; }

void server_stop(server *s)
{
    pthread_mutex_lock(&s->lock);
    s->is_closing = true;
    while (s->waiting_count > 0)
        resume_with_text(s->waiting[--s->waiting_count], 503, "error: the server ends\n");
    pthread_mutex_unlock(&s->lock);
    if (s->is_watched)
        pthread_join(s->watch, NULL);
    if (s->daemon != NULL)
        MHD_stop_daemon(s->daemon);
    pthread_mutex_destroy(&s->lock);
    sem_destroy(&s->wake);
    mem_free(s->status);
    mem_free(s);
}
