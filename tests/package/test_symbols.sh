#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/package/test_symbols.sh -- libgbtrace gives its public functions and nothing else, and nothing of the laboratory.
# Usage: test_symbols.sh SOURCE BUILD
set -u
source=$1
build=$2
. "$source/tests/cli/report.sh"
names=$(mktemp) || exit 1
trap 'rm -f "$names"' EXIT
nm -D --defined-only "$build/libgbtrace.so" | awk '{print $NF}' | sed 's/@.*//' >"$names"
[ "$(grep -c '^gbt_' "$names")" -ge 20 ] && [ "$(grep -vc '^gbt_' "$names")" = 0 ]
report $? "the shared library's names begin with gbt_" "$(grep -v '^gbt_' "$names" | head)"
missing=$(while read -r name; do grep -qrw "$name" "$source/include/gbtrace" || echo "$name"; done <"$names")
[ -z "$missing" ]
report $? "each stands in a public header" "$missing"
nm --defined-only "$build/libgbtrace.a" 2>/dev/null | grep -E ' T (lab|bench|study|stability|speed|rounding_bench|time_variants)_' | head >"$names"
[ ! -s "$names" ]
report $? "the archive has nothing of the laboratory" "$(cat "$names")"
finish
