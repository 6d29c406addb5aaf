/* base/log.h -- one line to stderr. Results never go through here. */
#ifndef GBT_BASE_LOG_H
#define GBT_BASE_LOG_H

/** "warning: ..." on stderr, one line. */
void log_warn(const char *format, ...) __attribute__((format(printf, 1, 2)));

/** Plain line on stderr, unless log_set_quiet(1). */
void log_info(const char *format, ...) __attribute__((format(printf, 1, 2)));

void log_set_quiet(int quiet);

#endif
