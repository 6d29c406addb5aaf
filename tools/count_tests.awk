# tools/count_tests.awk -- ctest's JUnit file to one line "N passed, N failed, N skipped"; exit 1 unless nothing failed.
#
# Counts the cases that test programs report in cmocka's words. A program that reports no cases is one case. A program that ctest
# calls failed has at least one failed case: that is how crashes, time-outs and sanitizer reports at exit are counted.
# Set ctest_code to ctest's exit code.

function number_before(text) { # "[  SKIPPED ] group: 12 test(s), listed below:" -> 12
    sub(/ test\(s\).*/, "", text)
    sub(/ FAILED TEST\(S\).*/, "", text)
    sub(/.* /, "", text)
    return text + 0
}
function close_program() {
    passed += ok_lines # of a group that crashed before its summary, only what was reported one by one is known
    if (verdict == "failed" && failed == 0)
        failed = 1
    if (passed + failed + skipped == 0) {
        if (verdict == "skipped")
            skipped = 1
        else
            passed = 1
    }
    all_passed += passed
    all_failed += failed
    all_skipped += skipped
    inside = 0
}

/^[ \t]*<testcase / {
    inside = 1
    verdict = /status="run"/ ? "passed" : "failed" # "notrun" with a reason below may still be a skip
    passed = failed = skipped = ok_lines = 0
    next
}
!inside { next }
/^[ \t]*<\/testcase>/ { close_program(); next }
/^[ \t]*<skipped message="SKIP_/ { verdict = "skipped"; next }
{ sub(/^[ \t]*<system-out>/, "") }
/^\[       OK \] / { ok_lines++; next }
/^\[  PASSED  \] .*test\(s\)/ { passed += number_before($0); ok_lines = 0; next }
/^\[  SKIPPED \] .*test\(s\), listed/ { skipped += number_before($0); next }
/^ [0-9]+ FAILED TEST\(S\)/ { failed += number_before($0); next } # failed cases and failed set-ups

END {
    if (inside)
        close_program()
    if (ctest_code != 0 && all_failed == 0)
        all_failed = 1
    printf "%d passed, %d failed, %d skipped\n", all_passed, all_failed, all_skipped
    exit all_failed > 0
}
