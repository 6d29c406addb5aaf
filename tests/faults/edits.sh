#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tests/faults/edits.sh -- random edits of a run and of its data. Usage: edits.sh PROGRAM COUNT SEED
#
# Each edit changes one file of a copy: a byte, some bytes, its length, another file in its place, or no file. Then the run is shown, drawn,
# reported and gone on with. Wanted of each: it does so, or ends with one line and exit code 3 to 5; never a signal, never another code.
set -u
program=$(realpath "$1") count=$2 RANDOM=$3
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failed=0 done=0 refused=0

"$program" make-scene tabletop -o data --width 32 --height 24 --views 4 --points 200 --samples 1 --quiet >said 2>&1 &&
    "$program" train data -o run --iterations 3 --threads 1 --quiet >said 2>&1 && "$program" render run -o run/drawn --quiet >>said 2>&1 ||
    { cat said; exit 1; }
mapfile -t files < <(find run data -type f | LC_ALL=C sort)

number() { # sets n, below $1. Not in a subshell, which would have random numbers of its own
    n=$(((RANDOM << 15 | RANDOM) % $1))
}

edit() { # file: sets `did`
    local size at
    size=$(stat -c %s "$1")
    number $((size + 1))
    at=$n
    number 6
    case $n in
    0) did="a byte at $at"; number 256; printf "\\x$(printf %x "$n")" | dd of="$1" bs=1 seek="$at" conv=notrunc status=none ;;
    1) did="64 bytes at $at"; n=$RANDOM; head -c $((64 * (1 + at))) <(yes "$n") | tail -c 64 | dd of="$1" bs=1 seek="$at" conv=notrunc status=none ;;
    2) did="cut at $at"; truncate -s "$at" "$1" ;;
    3) did="1000 bytes more"; head -c 1000 /dev/zero >>"$1" ;;
    4) number ${#files[@]}; did="${files[n]} in its place"; cp "${files[n]}" "$1" ;;
    5) did="gone"; rm "$1" ;;
    esac
}

check() { # edit, command...
    local what=$1 code errors
    shift
    GBTRACE_THREADS=1 "$program" "$@" >said 2>&1 </dev/null
    code=$?
    errors=$(grep -c '^error: ' said)
    case $code in
    0) [ "$errors" = 0 ] && done=$((done + 1)) && return ;;
    3 | 4 | 5) [ "$errors" = 1 ] && refused=$((refused + 1)) && return ;;
    esac
    failed=$((failed + 1))
    printf 'FAILED  %s: %s: exit code %s\n%s\n' "$what" "$*" "$code" "$(head -c 1000 said)"
}

mkdir kept && mv run data kept
for ((i = 0; i < count; i++)); do
    rm -rf run data drawn
    cp -R kept/. .
    number ${#files[@]}
    file=${files[n]}
    edit "$file"
    what="$file: $did"
    check "$what" info run
    check "$what" render run -o drawn --quiet
    check "$what" report run
    check "$what" train data -o run --resume --iterations 6 --quiet
done
printf '%d edits: %d commands did their work, %d were refused in one line, %d failed\n' "$count" "$done" "$refused" "$failed"
[ "$failed" = 0 ]
