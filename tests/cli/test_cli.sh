#!/bin/sh
# tests/cli/test_cli.sh -- exact exit codes and messages of the program. Usage: test_cli.sh PROGRAM [SHARED]
set -u
program=$1
shared=${2:-}
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
passed=0
failed=0

report() { # ok?, name, details
    if [ "$1" = 0 ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        printf 'FAILED: %s\n%s\n' "$2" "$3"
    fi
}

# misuse CODE MESSAGE ARGUMENTS...: exactly one line on stderr, nothing on stdout.
misuse() {
    code=$1
    message=$2
    shift 2
    "$program" "$@" >out 2>err </dev/null
    got=$?
    [ "$got" = "$code" ] && [ ! -s out ] && [ "$(cat err)" = "error: $message" ]
    report $? "$*" "  wanted $code: error: $message
  got    $got: $(head -c 2000 err) $(head -c 300 out)"
}

# prints NAME PATTERN ARGUMENTS...: exit 0, stdout matches, stderr is empty.
prints() {
    name=$1
    pattern=$2
    shift 2
    "$program" "$@" >out 2>err </dev/null
    got=$?
    [ "$got" = 0 ] && [ ! -s err ] && grep -q -e "$pattern" out
    report $? "$name" "  wanted 0 with $pattern
  got    $got: $(head -c 2000 err) $(head -c 2000 out)"
}

# ---- help and version
prints "help" '^  info  *what is in' --help
prints "help, short" '^usage: gbtrace COMMAND' -h
prints "help, as a verb" '^usage: gbtrace COMMAND' help
prints "help about a verb" '^usage: gbtrace init DATA -o FILE.ply \[options\]$' help init
prints "help of a verb" '^      --max-depth D  *most splits of the cloud (default 18)$' init --help
prints "help wins over what is wrong" '^usage: gbtrace init' init --nonsense -h
prints "needed options say so" '^  -o, --output FILE.ply  *.* (needed)$' init --help
prints "choices with their default" '--init gb|voxel .*(default gb)' init --help
prints "version" '^gbtrace [0-9][0-9]*\.[0-9][0-9]*\.[0-9][0-9]*$' --version

# ---- verbs
misuse 2 "command missing (see gbtrace --help)"
misuse 2 "inof: unknown command (did you mean info?)" inof
misuse 2 "make_scene: unknown command (did you mean make-scene?)" make_scene
misuse 2 "zzzzzzzzzz: unknown command (see gbtrace --help)" zzzzzzzzzz
misuse 2 "intt: unknown command (did you mean init?)" help intt
misuse 2 "--verbose: unknown command (see gbtrace --help)" --verbose
misuse 2 ": unknown command (see gbtrace --help)" ""
misuse 2 "a?b: unknown command (see gbtrace --help)" "a
b"

# ---- options
init_usage="usage: gbtrace init DATA -o FILE.ply"
depth="a whole number from 0 to 64"
misuse 2 "--max-dept: unknown option (did you mean --max-depth?)" init d -o p --max-dept 3
misuse 2 "--max-dept=3: unknown option (did you mean --max-depth?)" init d -o p --max-dept=3
misuse 2 "--qqqqqqqq: unknown option (see --help)" init d -o p --qqqqqqqq
misuse 2 "-x: unknown option (see --help)" init d -o p -x
misuse 2 "-5: unknown option (see --help)" init d -o p -5
misuse 2 "--max-depth: value missing (wanted $depth)" init d -o p --max-depth
misuse 2 "--max-depth: value missing (wanted $depth)" init d -o p --max-depth --mesh
misuse 2 "--max-depth: value missing (wanted $depth)" init d -o p --max-depth=
misuse 2 "-o: value missing (wanted a text that is not empty)" init d -o
misuse 2 "--output: value missing (wanted a text that is not empty)" init d --output ""
# Every edge of every type is in test_options.c; starting the program costs a quarter of a second of dynamic linking.
for bad in -1 1e99 abc 0x10; do
    misuse 2 "--max-depth: bad value (wanted $depth, got $bad)" init d -o p --max-depth "$bad"
done
for bad in -1 nan 1,5; do
    misuse 2 "--voxel-size: bad value (wanted a number from 0 to 1e+30, got $bad)" init d -o p --voxel-size "$bad"
done
for bad in gbx 'gb|voxel'; do
    misuse 2 "--init: bad value (wanted one of gb|voxel, got $bad)" init d -o p --init "$bad"
done
misuse 2 "--seed: bad value (wanted a whole number from 0 to 18446744073709551615, got -1)" make-scene tabletop -o d --seed -1
misuse 2 "--seed: bad value (wanted a whole number from 0 to 18446744073709551615, got 18446744073709551616)" make-scene tabletop -o d --seed 18446744073709551616
misuse 2 "--width: bad value (wanted a whole number from 8 to 8192, got 0)" make-scene tabletop -o d --width 0
misuse 2 "--max-depth: given twice" init d -o p --max-depth 3 --max-depth=3
misuse 2 "--output: given twice" init d -o p --output q
misuse 2 "--mesh: takes no value (got 1)" init d -o p --mesh=1
misuse 2 "--json: given twice" info d --json --json
misuse 2 "--output is missing ($init_usage)" init d
misuse 2 "argument missing ($init_usage)" init -o p
misuse 2 "argument missing ($init_usage)" init -o p --
misuse 2 "e: one argument too many ($init_usage)" init d e -o p
misuse 2 "--mesh: one argument too many ($init_usage)" init -o p -- d --mesh
misuse 2 "argument 1 is empty ($init_usage)" init "" -o p
long=$(awk 'BEGIN { for (i = 0; i < 5000; i++) printf "x" }')
"$program" info "$long" >out 2>err
got=$?
[ "$got" = 4 ] && [ "$(wc -l <err)" = 1 ] && [ "$(wc -c <err)" -lt 600 ]
report $? "a path of 5000 characters" "  wanted one line of less than 600 bytes and 4, got $got: $(cat err)"

# ---- configuration files
printf '# a comment\r\n\n  max-depth =  5 \nmesh = true\nvoxel-size = 2' >good.conf
prints "help with a good configuration" '^usage' init --config good.conf --help
misuse 4 "nothing: no such file or folder" init nothing -o p --config good.conf
misuse 4 "nothing: no such file or folder" init nothing -o p --config good.conf --max-depth 6
misuse 2 "--max-depth: bad value (wanted $depth, got 65)" init d -o p --config good.conf --max-depth 65
misuse 4 "none.conf: cannot open: No such file or directory" init d -o p --config none.conf
misuse 4 ".: not a regular file" init d -o p --config .
misuse 2 "--config: value missing (wanted a file)" init d -o p --config
misuse 2 "--config: given twice" init d -o p --config good.conf --config=good.conf
config() { # text, message
    printf "$1" >bad.conf
    misuse 3 "bad.conf:$2" init d -o p --config bad.conf
}
config 'max-dept = 3\n' '1: max-dept: unknown option'
config '\n\nmax-depth 3\n' '3: max-depth 3: not a name = value line'
config 'max-depth = 3\nmax-depth = 3\n' '2: max-depth: given twice'
config 'max-depth = 3 4\n' "1: max-depth: bad value (wanted $depth, got 3 4)"
config 'max-depth =\n' "1: max-depth: bad value (wanted $depth, got nothing)"
config 'mesh = yes\n' '1: mesh: bad value (wanted true or false, got yes)'
config 'config = other\n' '1: config: unknown option'
config 'a\0b\n' ' not a configuration file (wanted name = value lines, at most 1 MiB)'

# ---- files
misuse 4 "nothing: no such file or folder" info nothing
misuse 4 "no.gbt: cannot open: No such file or directory" info no.gbt
misuse 4 "nothing/model.gbt: cannot open: No such file or directory" render nothing/model.gbt -o o --camera c.json
misuse 2 "--downscale: not with --camera (the camera file says the size)" render nothing -o o --camera c.json --downscale 2
mkdir empty
misuse 3 "empty: not a data set (wanted sparse/0/cameras.bin or transforms.json in it)" info empty
printf 'GBTMODEL' >short.gbt
misuse 3 "short.gbt: too short for a gbtrace file (wanted at least 64 bytes, got 8)" info short.gbt
awk 'BEGIN { for (i = 0; i < 100; i++) printf "text " }' >text.gbt
misuse 3 "text.gbt@0: not a gbtrace file (wanted \"GBTMODEL\")" info text.gbt
printf 'text' >text.txt
misuse 3 "text.txt: not a data set (wanted a folder, a .ply or a transforms.json)" info text.txt

# ---- a tiny cloud, from beginning to end
{
    printf 'ply\nformat ascii 1.0\nelement vertex 64\nproperty float x\nproperty float y\nproperty float z\nend_header\n'
    awk 'BEGIN { for (i = 0; i < 64; i++) print i % 4, int(i / 4) % 4, int(i / 16) }'
} >cloud.ply
prints "info of a cloud" '^  points    64, without colour, 90 % within' info cloud.ply
prints "info of a cloud as JSON" '^  "points": 64,$' info cloud.ply --json
prints "JSON has a schema" '^  "schema": 1,$' info cloud.ply --json
prints "a name behind --" '^cloud.ply: data set (ply)$' info -- cloud.ply
prints "init" '^anchors  *[1-9][0-9]* (granular balls)' init cloud.ply -o balls.ply --json balls.json
prints "init keeps voxels beside it" '^voxel baseline  *64 anchors' init cloud.ply -o balls.ply
prints "init with voxels" '^anchors  *64 (voxels), 1 points each$' init cloud.ply -o voxels.ply --init voxel
prints "init, depth 0 is one ball" '^anchors  *1 (granular balls), 64 points each$' init cloud.ply -o one.ply --max-depth 0
printf 'max-depth = 0\noutput = from_config.ply\n' >one.conf
prints "a configuration file is used" '^anchors  *1 (granular balls)' init cloud.ply --config one.conf
[ -s from_config.ply ]
report $? "needed options may stand in the configuration file" "  from_config.ply was not written"
prints "the command line wins over it" '^anchors  *[2-9][0-9]* (granular balls)' init cloud.ply --config one.conf --max-depth 18
prints "init as a mesh" '^anchors' init cloud.ply -o mesh.ply --mesh --max-depth 1
[ "$(head -c 400 mesh.ply | grep -a -c -e '^element vertex 84$' -e '^element face 160$')" = 2 ]
report $? "a mesh has 42 vertices and 80 faces a ball" "$(head -c 400 mesh.ply | grep -a element)"
prints "what init wrote can be read" "points    $(sed -n 's/^  "anchors": \([0-9]*\),$/\1/p' balls.json)," info balls.ply
misuse 2 "cloud.ply: would be overwritten (the output must be another file)" init cloud.ply -o cloud.ply
misuse 2 "./cloud.ply: would be overwritten (the output must be another file)" init cloud.ply -o x.ply --json ./cloud.ply
misuse 4 "nowhere/x.ply: cannot create: No such file or directory" init cloud.ply -o nowhere/x.ply
if [ -w /dev/full ]; then
    "$program" --help >/dev/full 2>err
    got=$?
    [ "$got" = 4 ] && [ "$(cat err)" = "error: standard output: write failed: No space left on device" ]
    report $? "full disk behind stdout" "  got $got: $(cat err)"
fi

# ---- procedural scenes
prints "make-scene" '^wrote made$' make-scene tabletop -o made --width 32 --height 24 --views 4 --samples 1 --points 50
[ -s made/sparse/0/cameras.bin ] && [ -s made/sparse/0/images.bin ] && [ -s made/sparse/0/points3D.bin ]
report $? "make-scene writes a COLMAP model" "$(find made)"
prints "info of a made scene" '^  photos    4 found, 0 unreadable, 32 x 24 pixels' info made

# ---- real data, where it is
if [ -n "$shared" ] && [ -d "$shared/data/fox" ]; then
    prints "info of real photos" '^  photos    50 found, 0 unreadable, 360 x 640 pixels$' info "$shared/data/fox"
    prints "info of real photos: split" '^  views     50: 43 to train, 7 held out$' info "$shared/data/fox"
fi

printf '[  PASSED  ] %d test(s).\n' "$passed"
[ "$failed" -eq 0 ] && exit 0
printf '[  FAILED  ] %d test(s), listed above\n\n %d FAILED TEST(S)\n' "$failed" "$failed"
exit 1
