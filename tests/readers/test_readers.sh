#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/readers/test_readers.sh -- exported files in the hands of readers that are not ours. Usage: test_readers.sh PROGRAM SOURCE BUILD
# Packages from npm and PyPI go into BUILD/readers-env, once, and nothing anywhere else; ends with 77, skipped, where they cannot be had.
set -u
program=$1
source=$2
env=$3/readers-env
here=$source/tests/readers

. "$source/tests/package/checks.sh" # give_up
command -v npm >/dev/null && command -v node >/dev/null || give_up "npm is not there (Debian: npm, nodejs)"
if ! cat "$here/package.json" "$here/requirements.txt" | cmp -s - "$env/complete"; then
    rm -rf "$env"
    mkdir -p "$env" && cp "$here/package.json" "$env/" || exit 1
    (cd "$env" && npm install --no-audit --no-fund --fetch-retries 1 --fetch-timeout 60000 >npm.log 2>&1) || give_up "npm could not install: $(tail -n 1 "$env/npm.log")"
    python3 -m venv "$env/python" >"$env/pip.log" 2>&1 || give_up "python3 -m venv does not work here (Debian: python3-venv)"
    "$env/python/bin/python" -m pip -q install --disable-pip-version-check --retries 1 --timeout 15 -r "$here/requirements.txt" >"$env/pip.log" 2>&1 ||
        give_up "not all packages from PyPI: $(tail -n 1 "$env/pip.log")"
    cat "$here/package.json" "$here/requirements.txt" >"$env/complete" || exit 1
fi
cp "$source/bench/viewers_pages/count.mjs" "$here/readers.mjs" "$env/" && exec node "$env/readers.mjs" "$program" "$env/python/bin/python" "$here/read_columns.py"
