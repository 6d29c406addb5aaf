#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/package/test_reference.sh -- the reference of the library has no warnings, and no public function is missing. Usage: test_reference.sh SOURCE BUILD
set -u
source=$1
build=$2
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
. "$source/tests/package/checks.sh"
command -v doxygen >/dev/null 2>&1 || give_up "doxygen is not there"
grep -q '^DOXYGEN_EXECUTABLE:.*/doxygen' "$build/CMakeCache.txt" || give_up "doxygen was not there when the build was configured"
check "doxygen without warnings" cmake --build "$build" --target docs
for page in index.html model_8h.html structgbt__camera.html; do
    check "$page" test -s "$build/reference/html/$page"
done
check "comments behind members are in it" grep -q 'held_out' "$build/reference/html/structgbt__model__view.html"
report
