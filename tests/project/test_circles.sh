#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/project/test_circles.sh -- no two files call each other, directly or by way of others; and the test finds it where they do.
# Usage: test_circles.sh SOURCE BUILD COMPILER
#
# Calls are read from the object files of the build: a file calls another when it refers to a function that the other defines. Data (a
# table of commands) is no call. Includes would not do: public headers, and headers of several files, hide who calls whom.
set -u
source=$1
build=$2
compiler=$3
. "$source/tests/cli/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT

# circles: object files on stdin; what is left when files that call nobody left, and files that nobody left calls, are taken away.
circles() {
    tr '\n' '\0' | xargs -0 nm -A | awk '
{
    split($0, at, /\.o:/)
    file = at[1]
    sub(/.*CMakeFiles\//, "", file)
    kind = $(NF - 1)
    if (kind == "T" || kind == "W")
        defines[$NF] = kind == "T" || !($NF in defines) ? file : defines[$NF]
    else if (kind == "U")
        calls[++call_count] = file SUBSEP $NF
    files[file] = 1
}
END {
    for (i = 1; i <= call_count; i++) {
        split(calls[i], call, SUBSEP)
        other = defines[call[2]]
        if (other != "" && other != call[1])
            edge[call[1] SUBSEP other] = call[2]
    }
    do {
        split("", out)
        split("", in_)
        for (e in edge) {
            split(e, ends, SUBSEP)
            out[ends[1]] = in_[ends[2]] = 1
        }
        removed = 0
        for (e in edge) {
            split(e, ends, SUBSEP)
            if (!(ends[2] in out) || !(ends[1] in in_)) {
                delete edge[e]
                removed = 1
            }
        }
    } while (removed)
    for (e in edge) {
        split(e, ends, SUBSEP)
        print ends[1] " calls " ends[2] ": " edge[e]
    }
}' | LC_ALL=C sort
}

# Each file once: those of the rooms, the laboratory and the program; the shared library has the same again. An object of a file that is
# no longer there is left from an earlier build.
(cd "$build" && find src lab scenes -name '*.o') | grep -E '/(gbt_[a-z_]+|gbtrace)\.dir/' | while read -r object; do
    file=$(printf '%s\n' "${object%.o}" | sed 's|CMakeFiles/[^/]*/||; s|__/|../|g')
    [ -f "$source/$file" ] || [ -f "$build/$file" ] && printf '%s\n' "$build/$object"
done >"$work/objects"
circles <"$work/objects" >"$work/found"
[ ! -s "$work/found" ]
report $? "no files call each other" "$(cat "$work/found")"
[ "$(wc -l <"$work/objects")" -ge 200 ]
report $? "there are object files" "  only $(wc -l <"$work/objects") in $build"

# plant NAME WANTED FILE...: a file is "name:called,called"; how many calls lie on a circle.
plant() {
    name=$1
    wanted=$2
    shift 2
    rm -rf "$work/tree"
    mkdir -p "$work/tree"
    for file in "$@"; do
        called=$(echo "${file#*:}" | tr ',' ' ')
        {
            for other in $called; do echo "void $other(void);"; done
            echo "void ${file%%:*}(void) {"
            for other in $called; do echo "$other();"; done
            echo "}"
        } >"$work/tree/${file%%:*}.c"
        "$compiler" -O1 -c "$work/tree/${file%%:*}.c" -o "$work/tree/${file%%:*}.o" || return
    done
    got=$(find "$work/tree" -name '*.o' | circles | wc -l)
    [ "$got" -eq "$wanted" ]
    report $? "planted: $name" "  wanted $wanted, got $got"
}
plant "a chain and a diamond" 0 a:b,c b:d c:d d:
plant "two files" 2 a:b b:a
plant "three files, and one that calls into them" 3 a:b b:c c:a d:a
plant "one file that calls itself" 0 a:a
finish
