# SPDX-License-Identifier: Apache-2.0
# tests/package/checks.sh -- one line per check, for the scripts beside it and in tests/readers. check wants $work.
passed=0
failed=0

check() { # name, command...
    check_name=$1
    shift
    if "$@" >"$work/check.log" 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        printf '[  FAILED  ] %s\n' "$check_name"
        tail -n 30 "$work/check.log"
    fi
}

# Counts as tools/count_tests.awk reads them, and the files that are given when something failed.
report() {
    printf '[  PASSED  ] %d test(s).\n' "$passed"
    [ "$failed" -eq 0 ] && exit 0
    [ "$#" -eq 0 ] || cat "$@"
    printf '[  FAILED  ] %d test(s), listed above\n\n %d FAILED TEST(S)\n' "$failed" "$failed"
    exit 1
}

# Not possible here: says why, and is counted as skipped.
give_up() {
    printf 'skipped: %s\n' "$*"
    exit 77
}
