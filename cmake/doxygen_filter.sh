#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# cmake/doxygen_filter.sh -- a public header in the form that Doxygen reads: comments behind members and values as /**<, the first one as the file's.
exec sed -E -e "1s,.*,," -e '2s,^/\* ([^ ]+) -- ,/** @file \1\n ,' -e 's,^([[:space:]]+[^/*[:space:]][^/]*[;\,]|[[:space:]]+GBT_[A-Z_]+)([[:space:]]*)/\* ,\1\2/**< ,' "$1"
