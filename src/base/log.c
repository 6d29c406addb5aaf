/* base/log.c -- one line to stderr. */
#include "base/log.h"

#include <stdarg.h>
#include <stdio.h>

static int is_quiet = 0;

static void print_line(const char *prefix, const char *format, va_list args)
{
    /* One write per line, so that lines of two threads never mix. */
    char line[1024];
    int used = snprintf(line, sizeof line, "%s", prefix);
    const int more = vsnprintf(line + used, sizeof line - (size_t)used - 1, format, args);
    used = more < 0 ? used : used + more;
    if (used > (int)sizeof line - 2)
        used = (int)sizeof line - 2;
    line[used] = '\n', line[used + 1] = '\0';
    fputs(line, stderr);
}

void log_warn(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    print_line("warning: ", format, args);
    va_end(args);
}

void log_info(const char *format, ...)
{
    if (is_quiet)
        return;
    va_list args;
    va_start(args, format);
    print_line("", format, args);
    va_end(args);
}

void log_set_quiet(int quiet)
{
    is_quiet = quiet;
}
