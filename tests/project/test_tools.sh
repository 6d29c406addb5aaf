#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/project/test_tools.sh -- plants offences that tools/check_layers.sh, check_text.sh and tools/count_tests.awk must see; what ./run and
# .ci/run say of wrong arguments and missing tools. Usage: test_tools.sh SOURCE
set -u
source=$1
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
passed=0
failed=0

check() { # name, wanted, got
    if [ "$2" = "$3" ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        printf '%s\n  wanted: %s\n  got:    %s\n' "$1" "$2" "$3"
    fi
}

# layers NAME FILE LINE WANTED: a clean tree plus one file with one line.
layers() {
    rm -rf "$work/tree"
    mkdir -p "$work/tree/tools" "$work/tree/src/base" "$work/tree/src/bvh" "$work/tree/src/cli" "$work/tree/src/shim" \
        "$work/tree/scenes" "$work/tree/include/gbtrace" "$work/tree/src/odd" "$work/tree/lab/odd"
    printf '# rooms\nbase:\nshim: base\nbvh: base\nscenes: base\nlab:\ncli: lab\n' >"$work/tree/tools/layers.txt"
    printf '#include <embree3/rtcore.h>\n' >"$work/tree/src/bvh/embree_api.h"
    printf '%s\n' "$3" >"$work/tree/$2"
    got=$(sh "$source/tools/check_layers.sh" "$work/tree")
    check "layers: $1" "$4" "$? $got"
}
layers "a clean tree" src/base/a.c '#include "base/a.h"' "0 "
layers "a row above" src/bvh/a.c '#include "base/a.h"' "0 "
layers "a row below" src/base/a.c '#include "bvh/a.h"' "1 src/base/a.c:1: base may not include bvh/a.h"
layers "spaces in the directive" src/base/a.c ' #  include "bvh/a.h"' "1 src/base/a.c:1: base may not include bvh/a.h"
layers "system and public headers" src/base/a.c '#include "gbtrace/a.h"' "0 "
layers "no room in the name" src/base/a.c '#include "a.h"' '1 src/base/a.c:1: "a.h" is not written as "room/file.h"'
layers "shim" src/bvh/a.c '#include "shim/a.h"' "1 src/bvh/a.c:1: nobody includes shim/"
layers "Embree by another file of bvh" src/bvh/a.c '#include <embree4/rtcore.h>' "1 src/bvh/a.c:1: only src/bvh/embree_api.h may include Embree"
layers "Embree's header by another room" scenes/a.c '#include "bvh/embree_api.h"' \
    "1 scenes/a.c:1: only bvh may include bvh/embree_api.h
scenes/a.c:1: scenes may not include bvh/embree_api.h"
layers "C++ outside shim" src/base/a.cpp 'int x;' "1 src/base/a.cpp: C++ outside src/shim"
layers "C++ in shim" src/shim/a.cpp '#include "base/a.h"' "0 "
layers "cli sees base" src/cli/a.c '#include "base/a.h"' "1 src/cli/a.c:1: cli may not include base/a.h"
layers "scenes" scenes/a.c '#include "cli/a.h"' "1 scenes/a.c:1: scenes may not include cli/a.h"
layers "a room that sees the laboratory" src/base/a.c '#include "lab/a.h"' "1 src/base/a.c:1: base may not include lab/a.h"
layers "a room of the laboratory" lab/odd/a.c 'int x;' "1 lab/odd/a.c: room odd is not in tools/layers.txt"
layers "a room without a row" src/odd/a.c 'int x;' "1 src/odd/a.c: room odd is not in tools/layers.txt"
layers "a public header that shows a room" include/gbtrace/a.h '#include "base/a.h"' "1 include/gbtrace/a.h:1: include may not include base/a.h"
layers "a row that names a row below" tools/layers.txt 'base: cli' "1 tools/layers.txt: base: cli does not stand above it
src/bvh/embree_api.h: room bvh is not in tools/layers.txt"

# text RULE LINE WANTED: a tree with that line.
text() {
    rm -rf "$work/tree"
    mkdir -p "$work/tree/src/odd" "$work/tree/lab" "$work/tree/include" "$work/tree/examples" "$work/tree/scenes"
    printf '%s\n' "$2" >"$work/tree/src/odd/a.c"
    got=$(sh "$source/tests/project/check_text.sh" "$1" "$work/tree")
    check "text: $1: $2" "$3" "$? $got"
}
wide=$(printf '%0111d' 0)
text lines "$wide" "1 src/odd/a.c:1:$wide"
text lines "${wide#0}" "0 "
text messages 'fail("use --steps");' '1 src/odd/a.c:1:fail("use --steps");'
text messages 'fail("steps -- or none");' "0 "
text functions 'x = tanf(y);' "1 src/odd/a.c:1:x = tanf(y);"
text functions 'x = own_tanf(y);' "0 "
rmdir "$work/tree/scenes"
sh "$source/tests/project/check_text.sh" functions "$work/tree" 2>"$work/said"
check "text: without a folder that it looks at" "1 1" "$? $(wc -l <"$work/said")"

# count NAME CTEST_CODE STATUS WANTED: the output of one program comes on stdin; STATUS is what ctest says of it.
count() {
    got=$({
        printf '<testsuite>\n\t<testcase name="a" status="%s">\n' "${3%% *}"
        case $3 in *skip) printf '\t\t<skipped message="SKIP_RETURN_CODE=77"/>\n' ;; *lost) printf '\t\t<skipped message="Unable to find executable"/>\n' ;; esac
        printf '\t\t<system-out>'
        cat
        printf '</system-out>\n\t</testcase>\n</testsuite>\n'
    } | awk -v ctest_code="$2" -f "$source/tools/count_tests.awk")
    check "count: $1" "$4" "$? $got"
}
count "cases of one program" 0 run "0 3 passed, 0 failed, 1 skipped" <<'END'
[==========] Running 4 test(s).
[       OK ] x
[       OK ] y
[       OK ] z
[  SKIPPED ] w
[==========] 4 test(s) run.
[  PASSED  ] 3 test(s).
[  SKIPPED ] 1 test(s), listed below:
[  SKIPPED ] w

 1 SKIPPED TEST(S)
END
count "the words of newer versions" 8 fail "1 1 passed, 2 failed, 11 skipped" <<'END'
[==========] tests: Running 14 test(s).
[       OK ] x
[  FAILED  ] y
[==========] tests: 14 test(s) run.
[  PASSED  ] 1 test(s).
[  SKIPPED ] tests: 11 test(s), listed below:
[  FAILED  ] tests: 2 test(s), listed below:
[  FAILED  ] y

 2 FAILED TEST(S)
END
count "a failed set-up is a failed case" 8 fail "1 1 passed, 2 failed, 0 skipped" <<'END'
[  PASSED  ] 1 test(s).
[  FAILED  ] 1 test(s), listed below:
[  FAILED  ] y

 2 FAILED TEST(S)
END
count "two groups, then a crash in the second" 8 fail "1 4 passed, 1 failed, 0 skipped" <<'END'
[       OK ] x
[       OK ] y
[  PASSED  ] 2 test(s).
[       OK ] z
[       OK ] w
END
count "a leak after all cases passed" 8 fail "1 1 passed, 1 failed, 0 skipped" <<'END'
[       OK ] x
[  PASSED  ] 1 test(s).
ERROR: LeakSanitizer
END
count "summary on the first line" 0 run "0 7 passed, 0 failed, 0 skipped" <<'END'
[  PASSED  ] 7 test(s).
END
count "what scripts report" 8 fail "1 1 passed, 1 failed, 2 skipped" <<END
$(. "$source/tests/cli/report.sh" && report 0 x && report 1 y "" && skip z why && skip w why && finish)
END
count "a script that skips all" 0 run "0 0 passed, 0 failed, 1 skipped" <<END
$(. "$source/tests/cli/report.sh" && skip x why && finish)
END
count "a program without cases" 0 run "0 1 passed, 0 failed, 0 skipped" </dev/null
count "a program that skips itself" 0 "notrun skip" "0 0 passed, 0 failed, 1 skipped" </dev/null
count "a program that was not built" 8 "notrun lost" "1 0 passed, 1 failed, 0 skipped" </dev/null
count "ctest failed and nobody says why" 8 run "1 1 passed, 1 failed, 0 skipped" </dev/null

# ./run where there is nothing else that it could do anything with. said: exit code and first line.
mkdir -p "$work/alone/tools" "$work/alone/tests/fuzz/seeds/ply" "$work/alone/.ci" "$work/bin"
cp "$source/run" "$work/alone/" && cp "$source/tools/release.sh" "$work/alone/tools/"
for tool in bash cat dirname env grep id ls xargs; do ln -s "$(command -v $tool)" "$work/bin/"; done
said() { # arguments of ./run
    PATH=$work/bin "$work/alone/run" "$@" >"$work/said" 2>&1 </dev/null
    echo "$? $(head -n 1 "$work/said")"
}
for verb in build test package install packages format lint fuzz sanitize coverage site release faults; do
    check "run $verb --none" "2 error: --none: unknown argument, see ./run --help" "$(said $verb --none)"
    check "run $verb --help" "0 usage: ./run build" "$(said $verb --help | head -c 20)"
done
check "run release --full" "2 error: --full: not with release (wanted nothing)" "$(said release --full)"
check "run fuzz none" "2 error: none: no such target (wanted one of: ply)" "$(said fuzz none)"
check "run fuzz ply 1m" "2 error: 1m: bad seconds (wanted a whole number, 1 or more)" "$(said fuzz ply 1m)"
check "faults of no command" "error: none: no such command" "$(bash "$source/tests/faults/faults.sh" /bin/sh /bin/sh 1 none 2>&1 | head -c 28)"
check "run format without clang-format" 77 "$(said format --check | cut -d ' ' -f 1)"
if command -v git >/dev/null; then
    ln -s "$(command -v git)" "$work/bin/"
    printf '#!%s/bash\necho "$@"\n' "$work/bin" >"$work/bin/clang-format-14"
    chmod +x "$work/bin/clang-format-14"
    : >"$work/alone/a.c"
    git init -q "$work" && git -C "$work" add alone/a.c
    check "run format in another repository" "1 error: no files to look at (wanted a git repository: $work/alone)" "$(said format)"
    git init -q "$work/alone" && git -C "$work/alone" add a.c
    check "run format in a repository" "0 -i a.c" "$(said format)"
fi

# .ci/run with a ./run that says what it was asked for, after a line that is in the log before.
cp "$source/.ci/run" "$work/alone/.ci/"
printf '#!/bin/sh\n[ $1 = format ] && exit "${LAYOUT:-0}"\nprintf "%%s\\n2 passed, 0 failed, 0 skipped\\n" "$1"\n' >"$work/alone/run"
{ echo before; bash "$work/alone/.ci/run"; } >"$work/log" 2>&1
check "ci" "0 before test 2 passed, 0 failed, 0 skipped 5 passed, 0 failed, 0 skipped " "$? $(tr '\n' ' ' <"$work/log")"
check "ci without clang-format" "4 passed, 0 failed, 1 skipped" "$(LAYOUT=77 bash "$work/alone/.ci/run" 2>/dev/null)"
check "ci with a file that is laid out otherwise" "0 passed, 1 failed, 0 skipped" "$(LAYOUT=1 bash "$work/alone/.ci/run" 2>/dev/null)"

printf '[  PASSED  ] %d test(s).\n' "$passed"
[ "$failed" -eq 0 ] && exit 0
printf '[  FAILED  ] %d test(s), listed above\n\n %d FAILED TEST(S)\n' "$failed" "$failed"
exit 1
