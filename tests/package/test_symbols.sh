#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/package/test_symbols.sh -- libgbtrace gives its public functions and nothing else, and nothing of the laboratory.
# Usage: test_symbols.sh SOURCE BUILD
set -u
source=$1
build=$2
. "$source/tests/cli/report.sh"
names=$(mktemp) lab=$(mktemp) || exit 1
trap 'rm -f "$names" "$lab"' EXIT
nm -D --defined-only "$build/libgbtrace.so" | awk '{print $NF}' | sed 's/@.*//' >"$names"
[ "$(grep -c '^gbt_' "$names")" -ge 20 ] && [ "$(grep -vc '^gbt_' "$names")" = 0 ]
report $? "the shared library's names begin with gbt_" "$(grep -v '^gbt_' "$names" | head)"
missing=$(while read -r name; do grep -qrw "$name" "$source/include/gbtrace" || echo "$name"; done <"$names")
[ -z "$missing" ]
report $? "each stands in a public header" "$missing"
# What the laboratory defines, by its own archives, against all names of both libraries, hidden ones too.
nm --defined-only "$build"/lab/*/libgbt_lab_*.a 2>/dev/null | awk '$2 ~ /^[TDBRC]$/ {print $NF}' | LC_ALL=C sort -u >"$lab"
[ "$(wc -l <"$lab")" -ge 100 ]
report $? "the laboratory has names of its own" "  only $(wc -l <"$lab")"
for library in libgbtrace.a libgbtrace.so; do
    nm --defined-only "$build/$library" 2>/dev/null | awk 'NF == 3 {print $NF}' | LC_ALL=C sort -u >"$names"
    [ "$(wc -l <"$names")" -ge 300 ]
    report $? "$library has a table of symbols" "  only $(wc -l <"$names") names"
    found=$(LC_ALL=C comm -12 "$names" "$lab")
    [ -z "$found" ]
    report $? "$library has nothing of the laboratory" "$found"
done
finish
