#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# tests/faults/faults.sh -- system calls that fail, and kills at them. Usage: faults.sh PROGRAM SHIM STEP [COMMAND [CALLS]]
#
# Each command is run over a tiny scene with its 1st, 1 + STEP-th, ... call of every kind made to fail, and killed there. Wanted: one line and an exit
# code, or success where a failure does not matter; no temporary file left by a failure; the run that was there before still whole; and after a kill
# of a training, --resume to the same bits as without.
set -u
here=$(cd "$(dirname "$0")" && pwd)
names="$(sed -n 's/^try \([a-z-]*\) .*/\1/p' "$here/faults.sh" | tr '\n' ' ')outside"
[ -z "${4:-}" ] || [[ " $names " = *" $4 "* ]] || { echo "error: $4: no such command (wanted one of: $names)" >&2; exit 2; }
program=$(realpath "$1") shim=$(realpath "$2") step=$3 only=${4:-} calls=${5:-open write fsync close rename mkdir find look read thread memory library}
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failed=0 runs=0

bad() {
    failed=$((failed + 1))
    printf 'FAILED  %s: %s\n%s\n' "$1" "$2" "$(head -c 1000 said)"
}

faulty() { # CALL:N:WHAT, command
    local what=$1
    shift
    with=(env GBT_FAULT="$what" GBT_FAULT_COUNT="$work/count" LD_PRELOAD="$shim")
    # the shell's own line about a killed program goes away
    { if [ "$1" = viewed ]; then viewed >said 2>&1; else "${with[@]}" "$@" >said 2>&1 </dev/null; fi; code=$?; } 2>/dev/null
    runs=$((runs + 1))
}

# What a browser does, then SIGINT. A server that is still there after the fault must answer once more.
viewed() {
    local url='' server end='' target
    "${with[@]}" "$program" view case/run --data case/data --port 0 --threads 1 >address &
    server=$!
    while [ -z "$url" ] && kill -0 $server 2>/dev/null; do
        sleep 0.02
        url=$(head -n 1 address 2>/dev/null)
    done
    ask() { # target
        (
            exec 3<>"/dev/tcp/127.0.0.1/$(echo "$url" | sed 's/.*:\([0-9]*\).*/\1/')" &&
                printf 'GET %s HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n' "$1" >&3 && cat <&3 >answer
        ) 2>/dev/null || : >answer
        end=$(head -c 12 answer 2>/dev/null)
    }
    for target in / '/render?view=0&format=png' '/render?view=0&format=jpeg' '/photo?view=0' '/render?view=1&format=png'; do
        [ -n "$url" ] && kill -0 $server 2>/dev/null || break
        ask "$target"
    done
    [ "$end" != "HTTP/1.1 500" ] || ask "$target" # the fault was in the last one
    kill -INT $server 2>/dev/null
    wait $server
    code=$?
    [ $code != 0 ] || [ -z "$url" ] || [ "$end" = "HTTP/1.1 200" ] || { echo "no picture after the fault: $end"; return 99; }
    return $code
}

prepare() { # a fresh copy of what a command works on
    rm -rf case
    mkdir case
    cp -R base/. case/
}

look() { # name, kind of end
    local name=$1 end=$2 errors
    errors=$(grep -c '^error: ' said)
    case $end in
    fail)
        case $code in
        0) [ "$errors" = 0 ] || bad "$name" "a success with an error" ;;
        4 | 5) [ "$errors" = 1 ] || bad "$name" "$errors lines with an error" ;;
        *) bad "$name" "exit code $code" ;;
        esac
        [ -z "$(find case -name '.*.tmp')" ] || bad "$name" "a temporary file is left: $(find case -name '.*.tmp')"
        ;;
    kill) [ "$code" = 137 ] || [ "$code" = 0 ] || bad "$name" "exit code $code after a kill" ;;
    esac
    # What was there is whole, old or new.
    [ ! -e base/run/checkpoints/last.gbt ] || [ -e case/run/checkpoints/last.gbt ] || bad "$name" "no last.gbt"
    if [ -e case/run/model.gbt ]; then
        "$program" info case/run >info 2>&1 || { cp info said; bad "$name" "the run is damaged"; }
    fi
}

go_on() { # name: go on with what was killed, by the same command or by --resume, and compare
    local run=case/run
    if [ -e $run/checkpoints/last.gbt ] || [ -e $run/checkpoints/last.gbt.prev ]; then
        "$program" train case/data -o $run --resume --iterations 6 --threads 1 --quiet >said 2>&1
    else
        "$program" train case/data -o $run --overwrite --iterations 6 --threads 1 --quiet >said 2>&1
    fi
    code=$?
    [ $code = 0 ] || { bad "$1" "exit code $code when it goes on"; return; }
    cmp -s $run/model.gbt "$whole/model.gbt" || bad "$1" "other bits after going on"
    [ -z "$(find case -name '.*.tmp')" ] || bad "$1" "a temporary file is left after going on"
}

try() { # name, goes on (yes or no), command...
    local name=$1 on=$2 call total n each
    shift 2
    [ -z "$only" ] || [ "$only" = "$name" ] || return 0
    for call in $calls; do
        prepare
        faulty "$call:0:count" "$@"
        [ $code = 0 ] || { bad "$name" "exit code $code without a fault"; return; }
        total=$(cat count)
        [ "$total" -gt 0 ] || [[ " mkdir thread " = *" $call "* ]] || [ "$name" = view ] || bad "$name" "no $call was counted: the shim does not work"
        each=$step
        case $call in
        thread) each=1 ;;
        memory | library) each=$((total / (step < 60 ? 200 / step : 3) + 1)) ;; # there are thousands
        esac
        for ((n = 1; n <= total; n += each)); do
            prepare
            faulty "$call:$n:fail" "$@"
            look "$name, $call $n of $total fails" fail
            [ "$on" = no ] || [ "$code" != 0 ] || cmp -s case/run/model.gbt "$whole/model.gbt" || bad "$name, $call $n of $total fails" "other bits"
            # Every file that these write is wanted: no failure may go unnoticed.
            [[ " export render compress report make-scene " != *" $name "* || " open write fsync close rename " != *" $call "* ]] ||
                [ "$code" != 0 ] || bad "$name, $call $n of $total fails" "a success"
            [[ " thread memory library find look read " == *" $call "* ]] && continue
            prepare
            faulty "$call:$n:kill" "$@"
            look "$name, killed at $call $n of $total" kill
            [ "$on" = no ] || go_on "$name, killed at $call $n of $total"
        done
    done
}

mkdir base
cp_run() { # iterations of each part: a run in base/run, made in parts
    rm -rf base/run case
    local part
    mv base case # a run tells the name of its data
    for part in "$@"; do
        "$program" train case/data -o case/run $([ -d case/run ] && echo --resume) --iterations "$part" --threads 1 --quiet >said 2>&1 ||
            { bad "a run" "not made"; exit 1; }
    done
    mv case base
}
"$program" make-scene tabletop -o base/data --width 32 --height 24 --views 4 --points 200 --samples 1 --quiet >said 2>&1 || { bad "a scene" "not made"; exit 1; }
cp_run 3 6 && cp -R base/run resumed
cp_run 6 && cp -R base/run straight

rm -rf base/run
whole=straight
try make-scene no "$program" make-scene tabletop -o case/made --width 16 --height 16 --views 3 --points 20 --samples 1 --quiet
try train yes "$program" train case/data -o case/run --iterations 6 --threads 1 --quiet
cp_run 3
whole=resumed
try resume yes "$program" train case/data -o case/run --resume --iterations 6 --threads 1 --quiet
try render no "$program" render case/run -o case/pictures --data case/data --quiet
try export no "$program" export case/run -o case/model.ply
try compress no "$program" compress case/run -o case/small.gbt --quality 40 # without it, a small model is copied
try report no "$program" report case/run
try view no viewed
mkdir tools && cp "$here/../pose/false_colmap.py" tools/colmap && chmod +x tools/colmap
"$program" make-scene tabletop -o five --width 80 --height 64 --views 5 --points 50 --samples 1 --quiet >said 2>&1 && cp -R five three ||
    { bad "a scene" "not made"; exit 1; }
PATH=$work/tools:$PATH
try pose no "$program" pose five/images -o case/posed

# ---- what comes from outside
same_bits() { # name
    [ "$code" = 0 ] || bad "$1" "exit code $code"
    cmp -s case/run/model.gbt "$whole/model.gbt" || bad "$1" "other bits"
}

long_run() { # options: in the background, until it has saved; $pid
    "$program" train case/data -o case/run --iterations 1000000 --threads 1 --quiet "$@" >long 2>&1 &
    pid=$!
    while [ ! -s case/run/log.csv ] && kill -0 $pid 2>/dev/null; do sleep 0.05; done
    runs=$((runs + 1))
}

outside() {
    local name
    for name in short:0:all clock:0:back; do
        whole=straight
        rm -rf base/run
        prepare
        faulty $name "$program" train case/data -o case/run --iterations 3 --threads 1 --quiet --tensorboard
        faulty $name "$program" train case/data -o case/run --resume --iterations 6 --threads 1 --quiet --tensorboard
        whole=resumed
        same_bits "train and resume, $name"
    done

    prepare
    long_run
    "$program" train case/data -o case/run --overwrite --iterations 6 --threads 1 --quiet >said 2>&1
    code=$?
    [ $code = 4 ] && [ "$(grep -c '^error: case/run: another process' said)" = 1 ] || bad "two trainers in one folder" "exit code $code"
    kill -INT $pid
    wait $pid
    code=$?
    cp long said
    [ $code = 130 ] || bad "SIGINT" "exit code $code"
    "$program" train case/data -o case/run --resume --stop-at-step 1 --threads 1 --quiet >said 2>&1 # the lock is gone
    grep -q 'another process' said && bad "a lock after the end" "it is still there"

    # What follows the last step belongs to the training, too: it waits for whoever reads the scores.
    prepare
    mkdir case/late && mkfifo case/late/metrics.json
    "$program" train case/data -o case/late --iterations 3 --threads 1 --quiet >long 2>&1 &
    pid=$!
    runs=$((runs + 1))
    while [ ! -s case/late/train.json ] && kill -0 $pid 2>/dev/null; do sleep 0.05; done
    sleep 1
    "$program" train case/data -o case/late --overwrite --iterations 6 --threads 1 --quiet >said 2>&1
    code=$?
    [ $code = 4 ] && [ "$(grep -c '^error: case/late: another process' said)" = 1 ] || bad "a second trainer while the first scores" "exit code $code"
    [ -p case/late/metrics.json ] && timeout 60 cat case/late/metrics.json >scores && [ -s scores ] || kill -KILL $pid
    wait $pid
    code=$?
    cp long said
    [ $code = 0 ] && [ -s case/late/report.html ] || bad "the first trainer's end" "exit code $code"

    prepare
    long_run
    kill -STOP $pid
    kill -INT $pid
    kill -TERM $pid # another signal: two of one kind, while it is stopped, would be one
    kill -CONT $pid
    wait $pid
    code=$?
    cp long said
    [ $code = 130 ] || bad "SIGINT and SIGTERM at once" "exit code $code"
    [ -e case/run/checkpoints/last.gbt ] || bad "SIGINT and SIGTERM at once" "it did not save"

    prepare
    long_run
    rm case/data/images/0001.png
    kill -INT $pid
    wait $pid
    code=$?
    cp long said
    [ $code = 130 ] || bad "a photo deleted in mid-run" "exit code $code"
    "$program" train case/data -o case/run --resume --iterations 6 --threads 1 --quiet >said 2>&1
    code=$?
    [ $code = 3 ] && grep -q '^error: .*made from other data.*; photos that are missing: .*0001.png' said || bad "a run goes on without one of its photos" "exit code $code"
}
[ -n "$only" ] && [ "$only" != outside ] || outside

# A full disk as the shell's limit on the size of a file sees it: in blocks of 1024 bytes.
whole=straight
for limit in 0 1 8 64 1024; do
    [ -z "$only" ] || break
    prepare
    (ulimit -f $limit; "$program" train case/data -o case/run --overwrite --iterations 6 --threads 1 --quiet >"$work/all" 2>&1)
    code=$?
    cp all said 2>/dev/null
    runs=$((runs + 1))
    case $limit:$code in
    *:4) ;;
    [1-9]*:0) cmp -s case/run/model.gbt "$whole/model.gbt" || bad "files of $limit kB" "other bits" ;;
    *) bad "files of $limit kB" "exit code $code" ;;
    esac
    [ -z "$(find case -name '.*.tmp')" ] || bad "files of $limit kB" "a temporary file is left"
done
printf '%d runs, %d failed\n' "$runs" "$failed"
[ "$failed" = 0 ]
