#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/cli/test_cli.sh -- exact exit codes and messages of the program. Usage: test_cli.sh PROGRAM [SHARED]
set -u
program=$1
shared=${2:-}
. "$(dirname "$0")/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
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
prints "help" '^  info  *show what' --help
prints "help, short" '^usage: gbtrace COMMAND' -h
prints "help, as a verb" '^usage: gbtrace COMMAND' help
prints "help about a verb" '^usage: gbtrace init DATA -o FILE.ply \[options\]$' help init
prints "help of a verb" '^      --max-depth D  *maximum depth of the ball tree (default 18)$' init --help-all
prints "help wins over what is wrong" '^usage: gbtrace init' init --nonsense -h
prints "needed options say so" '^  -o, --output FILE.ply  *.* (needed)$' init --help
for command in $("$program" --help | sed -n 's/^  \([a-z-]*\) .*/\1/p'); do
    "$program" "$command" --help >out 2>err && awk 'length($0) > 100 || NR > 40 { print FILENAME ": line " NR; bad = 1 } END { exit bad }' out >>err
    report $? "help of $command fits a screen: 40 lines of 100 columns" "$(cat err)"
done
for command in $("$program" --help | sed -n 's/^  \([a-z-]*\) .*/\1/p'); do
    for option in $("$program" "$command" --help-all | awk '/^  -., --/ || /^      --/ { match($0, /--[a-z-]+/); name = substr($0, RSTART, RLENGTH); text = "" }
        { text = text " " $0 } name != "" && text ~ / 0: / { print name; name = "" }'); do
        "$program" "$command" "$option" 0 '' >out 2>err
        [ $? = 2 ] && grep -q '^error: argument 1 is empty' err
        report $? "$command $option: what the help says of 0 is taken" "$(cat err)"
    done
done
prints "rare options are in the whole help" '^      --final-prune-factor F .*' train --help-all
"$program" train --help | grep -q -e '--final-prune-factor' -e '--pace' -e '--distance'
[ $? = 1 ]
report $? "and not in the short one" "$("$program" train --help)"
prints "choices" '--init gb|adaptive|voxel|random  *initial' init --help
prints "choices with their default" '--scale-prior gb|nn  *initial scale' init --help-all
prints "help of a verb with words: each with its line" '^  courtyard   a town square: ' make-scene --help
prints "help of a study" '^  rate        file size against picture quality' study --help
prints "version, short" '^gbtrace [0-9]*\.[0-9]*\.[0-9]*$' -V
prints "version, short too" '^gbtrace [0-9]*\.[0-9]*\.[0-9]*$' -v
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
for bad in -1 nan 1,5 1e10; do
    misuse 2 "--voxel-size: bad value (wanted a number from 0 to 1e+09, got $bad)" init d -o p --voxel-size "$bad"
done
for bad in gbx=gb 'gb|voxel=voxel' adaptiv=adaptive; do
    misuse 2 "--init: bad value (wanted one of gb|adaptive|voxel|random, got ${bad%=*}; did you mean ${bad#*=}?)" init d -o p --init "${bad%=*}"
done
misuse 2 "--init: bad value (wanted one of gb|adaptive|voxel|random, got zzzz)" init d -o p --init zzzz
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
misuse 2 "--config: value missing (wanted a text that is not empty)" init d -o p --config
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

# ---- the environment, between the configuration file and the command line
prints "help with a variable" '--max-depth D  *maximum depth of the ball tree (default 18)$' init --help-all
export GBTRACE_MAX_DEPTH=65
misuse 2 "GBTRACE_MAX_DEPTH: bad value (wanted $depth, got 65)" init d -o p
export GBTRACE_MAX_DEPTH=5 GBTRACE_INIT_VOXEL_SIZE=nan
misuse 2 "GBTRACE_INIT_VOXEL_SIZE: bad value (wanted a number from 0 to 1e+09, got nan)" init d -o p
unset GBTRACE_MAX_DEPTH GBTRACE_INIT_VOXEL_SIZE

# ---- what people type who come from other programs
misuse 4 "nothing: no such file or folder" train -s nothing -m run -r 2 --eval --iterations 7000 --quiet
misuse 4 "nothing: no such file or folder" train --source_path nothing --model_path run --resolution 2 --n_offsets 10 --voxel_size 0.01
misuse 2 "--output: given twice" train -s nothing -m run --output run
misuse 4 "nothing: no such file or folder" train nothing -o run --budget 10min
[ ! -e run ]
report $? "no folder of a run whose data are missing"
misuse 2 "-r: bad value (wanted a number from 0 to 64, got 800)" train -s nothing -m run -r 800
misuse 2 "--budget: cannot be combined with --iterations" train nothing -o run --iterations 20 --budget 3s
misuse 2 "--white_background: not supported; use --alpha white (the default of Blender's scenes)" train -s d -m r --white_background
misuse 2 "-i: not supported; photos are found from the cameras; for smaller ones use --downscale F" train -s d -m r -i images_4
misuse 2 "--test_iterations: not supported; use --eval-at 1m,2m for scores on the way" train -s d -m r --test_iterations 7000 30000
misuse 2 "--test_iterations: not supported; use --eval-at 1m,2m for scores on the way" train -s d -m r --test_iterations -1
misuse 2 "--position_lr_init: not supported; use --learning-rate F, which multiplies all rates" train -s d -m r --position_lr_init 0.0001
for name in random_background position_lr_delay_mult exposure_lr_init offset_lr_max_steps mlp_opacity_lr_init appearance_lr_final optimizer_type \
    convert_SHs_python debug disable_viewer depth_l1_weight_init update_init_factor min_opacity success_threshold use_feat_bank add_opacity_dist lod; do
    "$program" train -s d -m r --$name 1 >out 2>err
    got=$?
    [ "$got" = 2 ] && grep -q "^error: --$name: not supported; " err
    report $? "--$name of other programs" "  got $got: $(cat err out)"
done
misuse 4 "nothing: not a run folder (wanted what gbtrace train wrote)" metrics -m nothing
# Where results go is looked at before anything else.
misuse 4 "nowhere/x.ply: cannot create: No such file or directory" export nothing x.ply nowhere/x.ply
misuse 4 "good.conf/x/: cannot create: Not a directory" export nothing good.conf/x/
misuse 4 "nowhere/x.json: cannot create: No such file or directory" export nothing x.ply --json nowhere/x.json
misuse 4 "nowhere/x.gbt: cannot create: No such file or directory" compress nothing -o nowhere/x.gbt
misuse 4 "nowhere/x.json: cannot create: No such file or directory" compress nothing -o x.gbt --json nowhere/x.json
misuse 4 "nowhere/x.mp4: cannot create: No such file or directory" render nothing -o nowhere/x.mp4 --path orbit
misuse 2 "--output is missing (usage: gbtrace render RUN|GAUSSIANS [-o DIR])" render -m nothing
misuse 2 "--iteration: not supported; a run keeps only its last model" render -m nothing --iteration 7000

# ---- files
misuse 4 "nothing: no such file or folder" info nothing
misuse 4 "no.gbt: cannot open: No such file or directory" info no.gbt
misuse 4 "nothing/model.gbt: cannot open: No such file or directory" render nothing/model.gbt -o o --camera c.json
misuse 2 "--downscale: cannot be combined with a camera file (which gives the size)" render nothing -o o --camera c.json --downscale 2
misuse 2 "--insert: only the renderer trace supports this" render nothing -o o --insert i.json --renderer reference
mkdir empty
misuse 4 "empty/model.gbt: does not exist (wanted a run, a model file or plain Gaussians)" render empty && [ -z "$(ls empty)" ]
report $? "and nothing is made in it" "$(ls empty)"
misuse 3 "empty: not a data set (wanted sparse/0/cameras.bin, transforms.json or transforms_train.json in it)" info empty
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
prints "init with adaptive balls" '^anchors  *4 (adaptive balls), 16 points each$' init cloud.ply -o adaptive.ply --init adaptive
prints "init with so many of them" '^anchors  *32 (adaptive balls), 2 points each$' init cloud.ply -o adaptive.ply --init adaptive --init-count 0.5
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

( while [ ! -e closed ]; do sleep 0.05; done; "$program" --help 2>err; echo $? >code ) | { exec <&-; : >closed; }
[ "$(cat code)" = 141 ] && [ ! -s err ]
report $? "closed pipe behind stdout" "  got $(cat code): $(cat err)"

# ---- procedural scenes
prints "make-scene" '^wrote made$' make-scene tabletop -o made --width 32 --height 24 --views 4 --samples 1 --points 50
[ -s made/sparse/0/cameras.bin ] && [ -s made/sparse/0/images.bin ] && [ -s made/sparse/0/points3D.bin ]
report $? "make-scene writes a COLMAP model" "$(find made)"
prints "info of a made scene" '^  photos    4 found, 0 unreadable, 32 x 24 pixels' info made

# ---- meshes among the Gaussians of a tiny run
"$program" train made -o tiny --iterations 2 --eval-split none >out 2>err
report $? "a tiny run" "$(cat err)"
rm -f closed
( while [ ! -e closed ]; do sleep 0.05; done; "$program" train made -o unread --iterations 2 --eval-split none 2>&1 >/dev/null; echo $? >code ) | { exec <&-; : >closed; }
[ "$(cat code)" = 0 ] && [ -s unread/model.gbt ]
report $? "a training whose progress nobody reads" "  got $(cat code)"
rm -f closed
( while [ ! -e closed ]; do sleep 0.05; done; "$program" query nearest tiny --at 0,0,0 --count 100 2>err; echo $? >code ) | { exec <&-; : >closed; }
[ "$(cat code)" = 141 ] && [ ! -s err ]
report $? "a query whose answers nobody reads" "  got $(cat code): $(cat err)"
[ "$(tail -n 2 out)" = "Report: tiny/report.html
Viewer: gbtrace view tiny" ]
report $? "its last lines say what to look at" "$(cat out)"
printf '{"origin": [0, -2, -3], "target": [0, 0, 0], "up": [0, -1, 0], "fov_x_deg": 50, "width": 24, "height": 16}' >c.json
printf 'v -50 -50 -1\nv 50 -50 -1\nv 0 50 -1\nf 1 2 3\n' >wall.obj
insert() { # objects and light
    printf '%s' "$1" >i.json
}
drawn() { # name, same or different, arguments...: renders the camera, and compares the picture with the one without a mesh
    name=$1
    wanted=$2
    shift 2
    "$program" render tiny -o "$wanted" --camera c.json "$@" >out 2>err
    got=$?
    cmp -s plain/c.png "$wanted/c.png" && is=same || is=different
    [ "$got" = 0 ] && [ "$is" = "$wanted" ]
    report $? "$name" "  wanted 0 and $wanted, got $got and $is: $(cat err)"
}
"$program" render tiny -o plain --camera c.json >out 2>err
insert '{"light": {"towards": [0, -1, -1]}, "objects": [{"mesh": "wall.obj", "color": [0, 1, 0]}]}'
drawn "a mesh in front of the camera" different --insert i.json
insert '{"objects": [{"mesh": "wall.obj", "position": [0, 0, -20]}]}'
drawn "a mesh behind the camera" same --insert i.json
insert '{"objects": [{"mesh": "wall.obj", "material": "glass"}]}'
misuse 3 "i.json: objects[0].material: wanted one of matt, mirror" render tiny -o o --camera c.json --insert i.json
insert '{"objects": [{"mesh": "none.obj"}]}'
misuse 4 "none.obj: cannot open: No such file or directory" render tiny -o o --camera c.json --insert i.json
insert '{"objects": [{"mesh": "wall.obj"}]}'
printf 'v 0 0 0\nf 1 2 3\n' >wall.obj
misuse 3 "wall.obj:2: no such vertex: 2 (there are 1 so far)" render tiny -o o --camera c.json --insert i.json
misuse 4 "i2.json: cannot open: No such file or directory" render tiny -o o --camera c.json --insert i2.json

# ---- films of the same run
film() { # name, number of frames, folder, arguments...
    name=$1
    wanted=$2
    folder=$3
    shift 3
    "$program" render tiny -o "$folder" "$@" >out 2>err
    got=$?
    [ "$got" = 0 ] && [ "$(ls "$folder" | wc -l)" = "$wanted" ] && [ -s "$folder/frame_0000$wanted.png" ] && grep -q "^$wanted frames rendered into $folder, " err &&
        [ "$(cat out)" = "$folder" ]
    report $? "$name" "  wanted 0 and $wanted frames, got $got: $(cat err out) $(ls "$folder")"
}
film "a film around the scene" 3 around --path orbit --frames 3 --threads 1
film "a film on three threads" 3 around-3 --path orbit --frames 3 --threads 3
for frame in 1 2 3; do
    cmp -s around/frame_0000$frame.png around-3/frame_0000$frame.png
    report $? "frame $frame does not depend on the threads" ""
done
film "a film through the cameras" 4 through --path interpolate --frames 4 --size 20x10
printf '{"frames": 5, "fps": 12, "up": [0, -1, 0], "fov_x_deg": 50, "width": 24, "height": 16, "cameras": [
    {"origin": [0, -2, -3], "target": [0, 0, 0]}, {"origin": [1, -2, -3], "target": [0, 0, 0]}]}' >path.json
film "a film along a file" 5 along --path path.json
cmp -s along/frame_00001.png plain/c.png
report $? "its first frame is what that camera takes" "$(ls -l along plain)"
"$program" render tiny -o around-3 --path orbit --frames 3 >out 2>err && ! grep -q "an earlier film" err
report $? "frames that are all replaced are not told" "$(cat err)"
"$program" render tiny -o around-3 --path orbit --frames 2 >out 2>err && grep -q '^warning: around-3: frames from 3 on are left over from an earlier film$' err
report $? "frames that a longer film left are" "$(cat err)"
film "a low, near orbit around a place" 3 low --path orbit --frames 3 --look-at 0,0.5,-1e-1 --radius 2 --height -0.5
cmp -s low/frame_00001.png around/frame_00001.png
[ $? = 1 ]
report $? "it is another film" ""
misuse 2 "--look-at, --radius, --height: only with the path orbit" render tiny -o o --path interpolate --height 1
misuse 2 "--look-at, --radius, --height: only with the path orbit" render tiny -o o --radius 1
for bad in 1,2 1,2,3,4 1,2,x 1,2,nan 1,,2 ,; do
    misuse 2 "--look-at: \"$bad\" (wanted X,Y,Z, as in 0.5,-1,2)" render tiny -o o --path orbit --look-at "$bad"
done
misuse 2 "--radius: bad value (wanted a number from 0 to 1e+09, got -1)" render tiny -o o --path orbit --radius -1
misuse 2 "--frames, --fps, --size: only with a path" render tiny -o o --frames 3
misuse 2 "film.mp4: a film needs a path" render tiny -o film.mp4
printf '{"model": "equirectangular", "width": 16384, "height": 16384, "origin": [0, 0, -4], "target": [0, 0, 0], "up": [0, -1, 0]}' >large.json
misuse 2 "large: a picture of 16384 x 16384 pixels (wanted at most 178956970 pixels)" render tiny -o o --camera large.json
misuse 2 "film.MOV: this type of film cannot be written (wanted .mp4, .webm, .gif or a folder)" render tiny -o film.MOV --path orbit
misuse 2 "picture.PNG: wanted a folder (the picture is named after its camera or view)" render tiny -o picture.PNG --camera c.json
misuse 2 "--path: cannot be combined with a camera file" render tiny -o o --path orbit --camera c.json
misuse 2 "--downscale: cannot be combined with a path file (wanted the size of the film)" render tiny -o o --path path.json --downscale 2
for other in "--data tiny" "--downscale 2" "--format exr" "--insert x.json" "--path orbit" "--preset fast" "--renderer raster"; do
    misuse 2 "--output is missing (with --data, --downscale, --format, --insert, --path, --preset or --renderer, pictures do not go into tiny/renders)" render tiny $other
done
misuse 2 "--outputs: cannot be written as a film (wanted a folder)" render tiny -o film.mp4 --path orbit --outputs depth
misuse 2 "--format: does not apply to a film (wanted a folder)" render tiny -o film.mp4 --path orbit --format exr
misuse 2 "film.mp4: 21 x 10 pixels (wanted even numbers: films keep colours for 2 x 2 pixels)" render tiny -o film.mp4 --path orbit --size 21x10
for bad in 20x10x5 -3x4; do
    misuse 2 "--size: bad value (wanted WxH like 1280x720, got $bad)" render tiny -o o --path orbit --size="$bad"
done
misuse 4 "none.json: cannot open: No such file or directory" render tiny -o o --path none.json
printf '{}' >path.json
misuse 3 "path.json: not a camera path (wanted \"cameras\", or nerfstudio's \"camera_path\")" render tiny -o o --path path.json
PATH=/nowhere "$program" render tiny -o film.mp4 --path orbit --frames 2 >out 2>err
got=$?
[ "$got" = 4 ] && [ "$(cat err)" = "error: film.mp4: a film needs the program ffmpeg, which is not installed (install it: apt install ffmpeg, or give a folder for pictures)" ] && [ ! -e film.mp4 ]
report $? "a film without ffmpeg" "  got $got: $(cat err)"
mkdir failing && printf '#!/bin/sh\ncat >/dev/null\nexit 1\n' >failing/ffmpeg && chmod +x failing/ffmpeg
PATH=$PWD/failing:$PATH env --ignore-signal=CHLD "$program" render tiny -o film.mp4 --path orbit --frames 2 >out 2>err
got=$?
[ "$got" = 4 ] && grep -q '^error: film.mp4: ffmpeg failed (code 1): no output$' err && [ ! -e film.mp4 ] && [ ! -e .film.mp4.tmp ]
report $? "an ffmpeg that fails, where how children end is ignored" "  got $got: $(cat err)"
if command -v ffmpeg >/dev/null; then
    "$program" render tiny -o film.gif --path orbit --frames 2 >out 2>err && [ "$(head -c 4 film.gif)" = GIF8 ] && [ ! -e .film.gif.tmp ] &&
        [ "$(cat out)" = film.gif ]
    report $? "a film with ffmpeg" "$(cat err out)"
    mkdir 12:30 && "$program" render tiny -o 12:30/film.gif --path orbit --frames 2 >out 2>err && [ "$(head -c 4 12:30/film.gif)" = GIF8 ]
    report $? "a film in a folder with a colon" "$(cat err out)"
fi
# ---- the page of a run, made again with the chart of a study
cp tiny/report.html before.html
for part in 'From above' 'From the side' 'alt="Points"' 'alt="Granular balls"' 'alt="Anchors"' 'alt="The photo"'; do
    [ "$(grep -c -e "$part" tiny/report.html)" -ge 1 ]
    report $? "the page has: $part" "$(wc -c tiny/report.html)"
done
mkdir charts
printf '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><circle r="3"/></svg>' >charts/speed.svg
"$program" report tiny >out 2>err && cmp -s before.html tiny/report.html
report $? "report makes the same page again" "$(cat err)"
"$program" report tiny charts >out 2>err && [ "$(grep -c 'Speed against accuracy.*data:image/svg+xml;base64,PHN2' tiny/report.html)" = 1 ] &&
    grep -q '^tiny/report.html: 0 held-out views$' err
report $? "report takes the charts of studies" "$(cat err)"
misuse 4 "no-charts: no such file or folder (wanted what gbtrace study wrote)" report tiny no-charts
misuse 2 "tiny/config: no chart (wanted .svg, or a folder of them)" report tiny tiny/config
misuse 4 "nothing/metrics.json: cannot open: No such file or directory" report nothing

# ---- Gaussians: time, speed against accuracy
{
    printf 'ply\nformat ascii 1.0\nelement vertex 60\n'
    for name in x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3; do
        echo "property float $name"
    done
    echo end_header
    awk 'BEGIN { for (i = 0; i < 60; i++) print i % 5 - 2, int(i / 5) % 4 - 1.5, int(i / 20), i % 3 - 1, 0.5, -0.5, i % 7 - 3, -1, -1.5, -2, 1, 0, i % 2, 0.5 }'
} >gaussians.ply
printf '{"origin": [0, 0, -8], "target": [0, 0, 0], "up": [0, 1, 0], "fov_x_deg": 40, "width": 40, "height": 32}' >camera.json
bench="bench trace --model gaussians.ply --camera camera.json --repeats 1"
prints "bench" '^forward, core-us/ray  *[0-9.]*$' $bench --json one.json
prints "bench of several kernels gives ratios" '^adjoint, core-us/ray  *[0-9.]*  *[0-9.]*  *[0-9.]*x' $bench --kernel tree,embree --check --json two.json
for name in forward_core_us_per_ray adjoint_core_us_per_ray nodes_per_ray candidates_per_packet tests_per_ray hits_per_ray blended_per_ray rows_per_packet \
    row_pairs_per_packet tape_bytes tree_bytes list_bytes record_bytes forward_seconds build_ms; do
    [ "$(grep -c "\"$name\": [0-9]" one.json)" = 2 ] && [ "$(grep -c "\"$name\": [0-9]" two.json)" = 3 ] # at the top, and once per kernel
    report $? "bench writes $name" "$(cat two.json)"
done
grep -q '"schema": 3' two.json && [ "$(grep -c '"kernel": "embree"' two.json)" = 1 ] && [ "$(grep -c '"kernel": "tree"' two.json)" = 2 ] && [ "$(grep -c '"psnr_to_reference": [0-9][0-9]' two.json)" = 3 ]
report $? "bench names kernels and their errors" "$(cat two.json)"
printf '{"origin": [0, 0, 0.5], "target": [0, 0, 2], "up": [0, 1, 0], "fov_x_deg": 40, "width": 40, "height": 32}' >inside.json
"$program" bench trace --model gaussians.ply --camera inside.json --repeats 1 --json inside-bench.json >out 2>err && grep -q '"gaussians": 60,' inside-bench.json
report $? "bench takes plain Gaussians behind the camera too" "$(cat err out)"
prints "bench with a preset" '^alpha_min 0.02, alpha_max 0.99, T_min 0.001; medians of 1$' $bench --preset fast
prints "options of 0 leave it to the preset" '^alpha_min 0.02, alpha_max 0.99, T_min 0.001; medians of 1$' $bench --preset fast --alpha-min 0 --alpha-max 0 --t-min 0
prints "options win over the preset" '^alpha_min 0.05, alpha_max 0.9, T_min 0.001; medians of 1$' $bench --preset fast --alpha-min 0.05 --alpha-max 0.9
misuse 2 '--kernel: "tree,tree" (wanted list, packet, tree, single, embree or splats, or some of them with commas between)' $bench --kernel tree,tree
misuse 2 "--preset: bad value (wanted one of exact|default|fast, got slow)" $bench --preset slow
misuse 2 "bench: bad alpha_max (wanted alpha_min, 0.5, or more, got 0.4)" $bench --alpha-min 0.5 --alpha-max 0.4
misuse 2 "bench: bad alpha_min (wanted a number in [1e-30, 1), got 1e-31)" $bench --alpha-min 1e-31
misuse 2 "gaussians.ply: plain Gaussians have no cameras (wanted --camera FILE.json)" bench trace --model gaussians.ply
mkdir alone && cp gaussians.ply alone && "$program" export gaussians.ply alone/gaussians.splat >out 2>err
for study in speed crosscheck; do
    for file in alone/gaussians.ply alone/gaussians.splat; do
        misuse 2 "$file: plain Gaussians have no cameras (wanted --camera FILE.json, or camera.json beside it)" study $study $file -o study
    done
done
misuse 2 "gaussians.ply: plain Gaussians, no anchors (wanted a run or its model.gbt)" study rate gaussians.ply -o study
misuse 2 "gaussians.ply: plain Gaussians, no anchors (wanted a run or its model.gbt)" check-grad gaussians.ply
rm -rf study
"$program" export gaussians.ply alone/gaussians.glb >out 2>err &&
    "$program" bench trace --model alone/gaussians.glb --camera camera.json --repeats 1 --json glb.json >>out 2>>err &&
    [ "$(grep -m 1 '"blended_per_ray"' glb.json)" = "$(grep -m 1 '"blended_per_ray"' one.json)" ]
report $? "bench of the same Gaussians in another format" "$(cat err out glb.json)"
misuse 2 'study: "pace" (wanted speed, crosscheck, rate, stability, paper, time or anchors; did you mean rate?)' study pace gaussians.ply -o study
misuse 2 'study: "zzzzzz" (wanted speed, crosscheck, rate, stability, paper, time or anchors)' study zzzzzz gaussians.ply -o study
misuse 2 'bench: "tarce" (wanted trace; did you mean trace?)' bench tarce --model gaussians.ply
misuse 2 "bench trace: --model is missing (wanted --model FILE|RUN)" bench trace
misuse 2 "./gaussians.ply: would be overwritten (--json must be another file)" $bench --json ./gaussians.ply
misuse 2 "camera.json: would be overwritten (--json must be another file)" $bench --json camera.json
misuse 2 "made/sparse: exists, and a COLMAP model cannot describe a rolling shutter (wanted another folder)" make-scene tabletop -o made --lens rolling
misuse 2 "--seeds: does not apply to study speed (only to paper time anchors)" study speed gaussians.ply -o study --seeds 3
misuse 2 "--count: does not apply to query within (only to nearest)" query within balls.txt --at 0,0,0 --radius 1 --count 3
misuse 2 "--skip-test: cannot be combined with --skip-train" render tiny -o o --skip-train --skip-test
printf '0 0 0 1\n3 4 0 2\n' >balls.txt
prints "query, a header" '^query,rank,ball,distance,x,y,z,radius$' query nearest balls.txt --at 0,0,1
prints "query, nearest" '^0,1,1,5,3,4,0,2$' query nearest balls.txt --at 0,0,0 -k 2
prints "query along a ray" '^0,0,1,4,3,4,0,2$' query crossed balls.txt --at 3,0,0,0,1,0
prints "query of plain Gaussians" '^0,0,[0-9]*,' query nearest gaussians.ply --at=-1,0,0
misuse 2 "--at, --from: neither is given (wanted exactly one of them)" query nearest balls.txt
misuse 2 "--radius: 0 (wanted more, or a fourth number for each query point)" query within balls.txt --at 0,0,0
misuse 3 "at:1: 2 numbers (wanted 3)" query nearest balls.txt --at 0,0
misuse 4 "nowhere.txt: cannot open: No such file or directory" query nearest nowhere.txt --at 0,0,0
misuse 2 'query: "near" (wanted nearest, within, containing, overlapping or crossed)' query near balls.txt --at 0,0,0
misuse 2 "argument missing (usage: gbtrace study STUDY [MODEL|DATA...] -o DIR)" study -o study
misuse 2 "study crosscheck: wanted a model, or data to train on" study crosscheck -o study
misuse 2 'study stability: "gaussians.ply" is one too many' study stability gaussians.ply -o study
misuse 2 'study stability: "A99" is not a list of different cases (wanted some of A1 to A13, as A1,A9)' study stability --only A99 -o study
misuse 2 '--tables: "1,5" (wanted some of 1,2,3,4)' study paper made -o study --tables 1,5
for study in speed crosscheck rate; do
    misuse 2 "study: a/r/E and b/r/E/ would have one name (wanted paths whose last two parts differ)" study $study a/r/E a/q/E b/r/E/ -o study
done
misuse 2 "study: two data sets are called made; their runs would share a folder" study time made made -o study
"$program" study speed gaussians.ply -o study --repeats 1 >out 2>err
got=$?
[ "$got" = 0 ] && [ "$(grep -c '^| preset | [a-z]* | [0-9.]* | [0-9.]* | [0-9.]* | [0-9.]* | [0-9]* | [0-9.]* | [0-9.e-]* | n/a |$' out)" = 3 ] && cmp -s out study/speed.md
report $? "study prints its table" "  got $got: $(cat err out)"
"$program" study crosscheck alone/gaussians.splat --camera camera.json -o study-splat >out 2>err && [ "$(grep -c '"pass": true' study-splat/crosscheck.json)" -ge 6 ]
report $? "study of other plain Gaussians" "$(cat err out)"
[ "$(grep -c '"knob": ' study/speed.json)" -ge 21 ] && [ "$(grep -c '<svg xmlns' study/speed.svg)" = 1 ] &&
    [ "$(grep -o '>exact</text>' study/speed.svg | wc -l)" = 1 ] && [ "$(ls study | wc -l)" = 3 ]
report $? "study writes data and charts" "$(ls -l study)"
"$program" study crosscheck gaussians.ply -o cross >out 2>err
got=$?
[ "$got" = 0 ] && [ "$(grep -c '^| [a-z-]* | [0-9.]* | [0-9.e-]* | [0-9.]* | [0-9.e-]* |$' out)" = 5 ] && [ "$(grep -c '"pass": true' cross/crosscheck.json)" = 7 ] &&
    grep -q 'dilation' cross/crosscheck.md && grep -q '<svg xmlns' cross/crosscheck.svg &&
    [ -s cross/crosscheck_gaussians.ply_camera.png ] && grep -q '^| .* | >= [0-9]* | .* | yes |$' out && ! grep -q '&' out cross/crosscheck.md
report $? "study crosscheck: every row within its limit" "  got $got: $(cat err out)"

# ---- what is rendered beside the picture
if "$program" train made -o run --iterations 3 --lossless >out 2>err; then
    outputs=transmittance,depth,median-depth,normal,hits,anchor
    "$program" render run -o pictures --outputs $outputs --preset exact >out 2>err
    got=$?
    ls pictures >listed
    [ "$got" = 0 ] && [ "$(wc -l <listed)" = 7 ] && [ "$(grep -c -e '\.png$' listed)" = 1 ]
    report $? "render writes its outputs" "  got $got: $(cat err listed)"
    for name in transmittance depth median-depth normal hits anchor; do
        channels=Y
        [ $name = normal ] && channels='B.*G.*R'
        head -c 500 pictures/*.$name.exr 2>err | tr -c 'A-Za-z' ' ' | grep -q "channels chlist *[A-Za-z ]*$channels .*compression"
        report $? "channels of $name" "$(head -c 300 pictures/*.$name.exr | tr -c 'A-Za-z0-9' ' ')"
    done
    find run -type f -exec cksum {} + | sort >before
    for other in '--preset fast' '--renderer raster' '--downscale 2' "--data moved"; do
        rm -rf moved && cp -r made moved
        "$program" eval run $other >out 2>err && grep -q -F 'run/metrics.json and report.html are unchanged; name a JSON file to keep these scores' err &&
            "$program" eval run $other --json other.json >out 2>err && grep -q 'scores are only in other.json; ' err &&
            find run -type f -exec cksum {} + | sort | cmp -s - before
        report $? "eval $other changes nothing in the run" "$(cat err; find run -newer before)"
        "$program" eval run $other --json ./run/metrics.json >out 2>err
        [ $? = 2 ] && grep -q '^error: ./run/metrics.json: would be overwritten (--json must be another file)$' err &&
            find run -type f -exec cksum {} + | sort | cmp -s - before
        report $? "eval $other does not take the place of the run's scores" "$(cat err; find run -newer before)"
        if [ "$other" = '--preset fast' ]; then
            [ "$(grep -c '^  "preset": "fast"' other.json)" = 1 ]
            report $? "eval says with which preset it scored" "$(cat other.json)"
        fi
    done
    sed -i 's/"psnr": [0-9.]*/"psnr": 1/' run/metrics.json
    for same in '--preset default' '--renderer trace' '--downscale 1' '--data ./made'; do
        cp run/metrics.json scores
        "$program" eval run $same >out 2>err && ! cmp -s scores run/metrics.json && ! grep -q stay err
        report $? "eval $same is the run's own setting" "$(cat err)"
    done
    mv made gone && "$program" eval run --data moved >out 2>err && [ "$(grep -c '^  "data": "moved"' run/metrics.json)" = 1 ]
    report $? "a data set that moved stands for the run's own" "$(cat err)"
    mv gone made
    "$program" compress run -o small.gbt --json small.json >out 2>err && "$program" compress small.gbt -o same.gbt --lossless >>out 2>>err &&
        [ "$(wc -c <small.gbt)" -lt "$(wc -c <run/model.gbt)" ] && grep -q '"steps_from": "training views"' small.json &&
        [ "$("$program" info small.gbt | grep anchors)" = "$("$program" info run/model.gbt | grep anchors)" ] &&
        "$program" render small.gbt -o pictures-small >>out 2>>err && "$program" render same.gbt -o pictures-same >>out 2>>err &&
        cmp -s pictures-small/*.png pictures-same/*.png
    report $? "a small model is read as a large one, and keeps every bit without loss" "$(cat err out)"
    "$program" train made -o run-small --iterations 3 >out 2>err && cmp -s small.gbt run-small/model.gbt
    report $? "train leaves the small model, unless it shall be lossless" "$(cat err out)"
    rm -rf made.hidden && mv made made.hidden # a copy needs no data set
    "$program" compress run-small -o copy.gbt --json copy.json >out 2>err && [ ! -s err ] && cmp -s copy.gbt small.gbt && grep -q '"steps_from": "already small"' copy.json &&
        [ "$(head -n 1 out | sed 's/[0-9][0-9.]*/N/g')" = "run-small/model.gbt: already small: N anchors, N bytes, N bytes per anchor; copy.gbt is a copy" ] &&
        [ "$(grep -A 99 parts copy.json | grep -B 99 -m 1 probe | sed '$d')" = "$(grep -A 99 parts small.json | grep -B 99 -m 1 probe | sed '$d')" ]
    report $? "compress copies what is small already" "$(cat err out copy.json)"
    mv made.hidden made
    "$program" compress run-small -o run-small/model.gbt >out 2>err && grep -q '; nothing to do$' out && cmp -s small.gbt run-small/model.gbt
    report $? "compress of a small model onto itself does nothing" "$(cat err out)"
    "$program" compress run-small -o smaller.gbt --quality 40 >out 2>err && grep -q ' times smaller, .* (quantization steps from training views)$' out && ! cmp -s smaller.gbt small.gbt
    report $? "compress codes a small model again at a lower quality" "$(cat err out)"
    "$program" compress run -o whole.gbt --lossless >out 2>err && "$program" compress whole.gbt -o copy.gbt --lossless >out 2>err && cmp -s whole.gbt copy.gbt &&
        grep -q 'already small' out && "$program" compress whole.gbt -o quantised.gbt >out 2>err && [ "$(wc -c <quantised.gbt)" -lt "$(wc -c <whole.gbt)" ]
    report $? "a lossless model is copied without loss only" "$(cat err out)"
    "$program" train made -o run-small --iterations 4 >out 2>err
    got=$?
    [ "$got" = 2 ] && [ "$(grep -c '^error: run-small: .*with --resume, .*with --overwrite, ' err)" = 1 ] && cmp -s small.gbt run-small/model.gbt
    report $? "train leaves a run alone" "  got $got: $(cat err out)"
    "$program" train made -o run-small --iterations 4 --overwrite >out 2>err && "$program" info run-small | grep -q 'trained   4 iterations'
    report $? "train --overwrite trains anew" "$(cat err out; "$program" info run-small)"
    "$program" train -o run-small --resume --iterations 9 --threshold-factor 2 >out 2>err && grep -q '^run-small: 4 steps done; training continues to step 9' err &&
        grep -q "^warning: a run is resumed with its own settings: threshold-factor = 1, not 2" err && [ "$(grep -c '^warning' err)" = 1 ] &&
        "$program" train -o run-small --resume >out 2>>err && grep -q '^run-small: all 9 steps are done' err && ! grep -q 0x0 err &&
        "$program" info run-small | grep -q 'trained   9 iterations'
    report $? "train --resume goes on without naming the data" "$(cat err out)"
    misuse 2 "run-small: 8 iterations were asked for (wanted more than the 9 that it has done)" train -o run-small --resume --iterations 8
    misuse 2 "argument missing (usage: gbtrace train DATA -o RUN)" train -o run-small
    mkdir elsewhere && (cd elsewhere && "$program" eval ../run-small) >out 2>err
    report $? "eval from another folder" "$(cat err out)"
    mkdir pair && cp -r made run-small pair && sed '2s#/made$#/gone#' run-small/data_places >pair/run-small/data_places &&
        (cd elsewhere && "$program" eval ../pair/run-small) >out 2>err &&
        grep -q '^\.\./pair/run-small: its data set is read from \.\./pair/run-small/\.\./made, ' err
    report $? "eval of a run that was moved with its data" "$(cat err out)"
    rm pair/run-small/data_places && "$program" eval pair/run-small >out 2>err
    report $? "eval of an older run, in the folder where it was trained" "$(cat err out)"
    (cd elsewhere && "$program" eval ../pair/run-small) >out 2>err
    got=$?
    [ "$got" = 4 ] && [ "$(grep error err)" = "error: ../pair/run-small: its data set is not found (tried made); --data must name its new place" ]
    report $? "eval names the place of a missing data set" "  got $got: $(cat err out)"
    printf 'made\n/gone/made\n../gone\n' >pair/run-small/data_places
    (cd elsewhere && "$program" eval ../pair/run-small) >out 2>err
    got=$?
    [ "$got" = 4 ] && grep -q '(tried /gone/made, \.\./pair/run-small/\.\./gone, made)' err
    report $? "eval names all places of a missing data set" "  got $got: $(cat err out)"
    mv made moved && "$program" compress run -o alone.gbt >out 2>err && grep -q '(quantization steps from the model alone)$' out && grep -q '^made is not there: ' err &&
        "$program" info alone.gbt >>out 2>>err
    report $? "a model without its data set becomes small too" "$(cat err out)"
    mv moved made
    "$program" study rate run -o rate >out 2>err && cmp -s out rate/rate.md && [ "$(grep -c '"row": ' rate/rate.json)" = 2 ] && grep -q '<svg xmlns.* height="[0-9]' rate/rate.svg && grep -q '^run: lossless: ' err &&
        [ "$(ls rate | wc -l)" = 3 ]
    report $? "study rate writes its tables and its chart" "$(cat err out)"
    "$program" export run plain.ply plain.spz plain.splat plain.glb --refine 5 --json plain.json >out 2>err && [ "$(grep -c 'dB to the model' out)" = 4 ] &&
        [ "$(grep -c '"psnr_to_model": ' plain.json)" = 4 ] && [ "$(head -c 4 plain.glb)" = glTF ] && "$program" export plain.spz back.ply >>out 2>>err &&
        [ "$(grep -a '^element vertex' back.ply)" = "$(grep -a '^element vertex' plain.ply)" ]
    report $? "export bakes a run into every format, and converts" "$(cat err out)"
    "$program" export plain.spz -o named.ply >out 2>err && cmp -s named.ply back.ply
    report $? "export takes -o too" "$(cat err out)"
    "$program" export plain.ply all.compressed.ply all.v4.spz all.sog all.usda all.usdz >out 2>err && for ending in compressed.ply v4.spz sog usda usdz; do
        "$program" info all.$ending && "$program" export all.$ending again.ply || break
    done >>out 2>>err && [ "$(grep -c "gaussians $(sed -n 's/^  "gaussians": \([0-9]*\),$/\1/p' plain.json)," out)" = 5 ]
    report $? "every small format is written, looked into and converted" "$(cat err out)"
    "$program" export run $("$program" export --help | sed -n 's,^  \(\.[a-z0-9.]*\) .*,each\1,p') each/ --refine 0 >out 2>err && [ "$(grep -c 'dB to the model' out)" = 10 ]
    report $? "one export has room for all formats and the result folder" "$(cat err out)"
    misuse 2 "plain.ply: 17 files to write (wanted 1 to 16)" export plain.ply $(seq -f %g.ply 16) -o 17.ply
    "$program" export run thin.sog --gaussians 1010 --refine 2 --json thin.json >out 2>err && grep -q '^  "gaussians": 1010,$' thin.json && grep -q '^  "thinned": [1-9]' thin.json &&
        grep -q ' that are blended least' out
    report $? "export keeps the Gaussians that are blended most" "$(cat err out)"
    misuse 2 "--gaussians: does not apply to plain Gaussians, as in plain.ply (wanted a trained model)" export plain.ply o.ply --gaussians 10
    misuse 2 "--refine: does not apply to plain Gaussians, as in plain.ply (wanted a trained model)" export plain.ply o.ply --refine 3
    misuse 2 "--no-backdrop: does not apply to plain Gaussians, as in plain.ply (wanted a trained model)" export plain.ply o.ply --no-backdrop
    misuse 2 "--data: does not apply to plain Gaussians, as in plain.ply (wanted a trained model)" export plain.ply o.ply --data made
    misuse 2 "o.ply: would be written twice (each output must be another file)" export plain.ply o.ply o.ply
    misuse 2 "./o.ply: would be written twice (each output must be another file)" export plain.ply ./o.ply o.ply
    mkdir -p found/point_cloud/iteration_7 && cp plain.ply found/point_cloud/iteration_7/point_cloud.ply
    misuse 2 "found/point_cloud/iteration_7/point_cloud.ply: would be overwritten (the output must be another file)" \
        export found found/point_cloud/iteration_7/point_cloud.ply
    misuse 2 "o.ply: would be written twice (each output must be another file)" export plain.ply o.ply --json o.ply
    misuse 2 "plain.ply: would be overwritten (--json must be another file)" export plain.ply o.ply --json plain.ply
    misuse 2 "./plain.ply: would be overwritten (the output must be another file)" export plain.ply o.ply ./plain.ply
    misuse 2 "--data: cannot be combined with a camera file or a path file (which give the cameras)" render plain.ply -o drawn --data made --camera x.json
    misuse 2 "--data: cannot be combined with a camera file or a path file (which give the cameras)" render plain.ply -o drawn --data made --path x.json
    misuse 2 "--gaussians: 1000 (wanted more than the 1000 of the background, or no background)" export run o.ply --gaussians 1000
    for file in plain.ply plain.splat plain.spz plain.glb; do
        prints "info of $file" "^$file: plain Gaussians$" info $file
    done
    "$program" info run >out 2>err && grep -q '^  config    footprint = 0.1$' out && ! grep -q '[0-9]\{15\}' out
    report $? "info writes numbers as people do" "$(cat out err)"
    misuse 2 "argument missing (usage: $("$program" export --help | sed -n 's/^usage: \(.*\) \[options\]$/\1/p'))" export run
    rm -f out # of the row before: an old one would be read as the address
    "$program" view run --port 0 >out 2>err &
    viewer=$!
    while kill -0 "$viewer" 2>/dev/null && [ ! -s out ]; do sleep 0.1; done
    kill -INT "$viewer"
    wait "$viewer" && grep -q '^http://127\.0\.0\.1:[1-9][0-9]*$' out && ! grep -q error err
    report $? "view says where, and Ctrl-C ends it with 0" "$(cat err out)"
    rm out
    "$program" view run --port 0 --host 0.0.0.0 >out 2>err &
    viewer=$!
    while kill -0 "$viewer" 2>/dev/null && [ ! -s out ]; do sleep 0.1; done
    kill -INT "$viewer"
    wait "$viewer" && grep -q '^http://[1-9][0-9.]*:[1-9][0-9]*/?token=[0-9a-f]\{32\}$' out && ! grep -q error err
    report $? "view --host prints an address with a token" "$(cat err out)"
    misuse 2 '--host: "example.org" (wanted an IPv4 address of this machine, or 0.0.0.0 for all that it has)' view run --host example.org
    misuse 4 "nowhere: does not exist (wanted a run, a model file or plain Gaussians)" view nowhere
    misuse 4 "made/model.gbt: does not exist (wanted a run, a model file or plain Gaussians)" view made
    misuse 2 "--port: bad value (wanted a whole number from 0 to 65535, got 65536)" view run --port 65536
    "$program" export run result/ --refine 2 >out 2>err && grep -q '^result/: .* dB to the model' out && ls result/point_cloud/iteration_*/point_cloud.ply >>out 2>>err &&
        grep -q "^Namespace(sh_degree=3, source_path='.* depths='', .* train_test_exp=False, " result/cfg_args && [ "$(grep -c '"img_name": ' result/cameras.json)" = 4 ] &&
        [ -f result/input.ply ] && [ -f result/test/ours_*/gt/00000.png ] && grep -q '"PSNR": ' result/results.json && grep -q '"00000.png": ' result/per_view.json &&
        "$program" info result >>out 2>>err && grep -q 'gaussians .*, colours of degree 3' out && "$program" render result -o result_test >>out 2>>err &&
        [ "$(ls result_test | wc -l)" = 1 ] && sed -i "s/source_path='[^']*'/source_path=''/" result/cfg_args && "$program" render result -o result_all >>out 2>>err &&
        [ "$(ls result_all | wc -l)" = 4 ] && "$program" export result back.spz >>out 2>>err
    report $? "a result folder of 3DGS, out and in" "$(cat err out)"
    misuse 2 "result: wanted a run as input, and one result folder at most" export result other/
    misuse 4 "nothing: cannot open: No such file or directory" import nothing -o imported
    misuse 4 "empty: no model of Scaffold-GS (wanted point_cloud/iteration_N/point_cloud.ply or point_cloud.ply in it)" import empty -o imported
    misuse 2 "run: holds a trained run (wanted another folder)" import empty -o run
    misuse 4 "nowhere: the data set does not exist" import empty -o imported --data nowhere
    misuse 2 "scene.obj: unknown file ending (wanted .ply, .compressed.ply, .splat, .spz, .v4.spz, .sog, .glb, .usda or .usdz)" export run scene.obj
    misuse 2 "--sh-degree: bad value (wanted a whole number from 0 to 3, got 4)" export run scene.ply --sh-degree 4
    misuse 4 "nothing: cannot open: No such file or directory" eval run --lpips nothing
    misuse 4 "nothing: cannot open: No such file or directory" compare pictures-same/*.png pictures-same/*.png --lpips nothing
    misuse 2 "--quality: bad value (wanted a number from 20 to 90, got 10)" compress run -o small.gbt --quality 10
    misuse 2 "small.gbt: would be overwritten (--json must be another file)" compress run -o small.gbt --json small.gbt
    misuse 2 "run/model.gbt: would be overwritten (--json must be another file)" compress run -o small.gbt --json run/model.gbt
    misuse 2 '--outputs: "dept" (wanted transmittance, depth, median-depth, normal, hits or anchor, with commas between)' render run -o unmade --outputs hits,dept && [ ! -e unmade ]
    report $? "and nothing is made"
else
    report 1 "a run to render" "$(cat err)"
fi

# ---- real data, where it is
if [ -n "$shared" ] && [ -d "$shared/data/fox" ]; then
    prints "info of real photos" '^  photos    50 found, 0 unreadable, 360 x 640 pixels$' info "$shared/data/fox"
    prints "info of real photos: split" '^  views     50: 43 to train, 7 held out (every 8th)$' info "$shared/data/fox"
fi

finish
