#!/bin/sh
# tests/project/test_readers.sh -- exported files in the hands of readers that are not ours. Usage: test_readers.sh PROGRAM SOURCE
# Needs what bench/viewers installs (build/viewers-env, or GBT_VIEWERS_ENV); ends with 77, skipped, where that is not there.
set -u
program=$1
source=$2
env=${GBT_VIEWERS_ENV:-$source/build/viewers-env}
if ! command -v node >/dev/null || [ ! -f "$env/complete" ]; then
    echo "skipped: $env is not there (bench/viewers makes it, with packages from npm)"
    exit 77
fi
cp "$source/bench/viewers_pages/count.mjs" "$source/tests/project/readers.mjs" "$env/" && exec node "$env/readers.mjs" "$program"
