# SPDX-License-Identifier: Apache-2.0
# tests/cli/report.sh -- count what passed, as tools/count_tests.awk reads it. Sourced.
passed=0
failed=0
skipped=0

report() { # ok?, name, details
    if [ "$1" = 0 ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        printf 'FAILED: %s\n%s\n' "$2" "$3"
    fi
}

skip() { # name, why
    skipped=$((skipped + 1))
    printf 'skipped: %s: %s\n' "$1" "$2"
}

finish() {
    printf '[  PASSED  ] %d test(s).\n' "$passed"
    [ "$skipped" -eq 0 ] || printf '[  SKIPPED ] %d test(s), listed above\n' "$skipped"
    [ "$failed" -eq 0 ] && exit 0
    printf '[  FAILED  ] %d test(s), listed above\n\n %d FAILED TEST(S)\n' "$failed" "$failed"
    exit 1
}
