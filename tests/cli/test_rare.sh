#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/cli/test_rare.sh -- options and inputs that are used seldom, and what must come out. Usage: test_rare.sh PROGRAM LIMIT,
# LIMIT being more memory than the program takes before it reads Gaussians.
set -u
program=$1
limit=$2
. "$(dirname "$0")/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1

# holds NAME CODE PATTERN ARGUMENTS...: exit code; a line of what it prints matches.
holds() {
    name=$1
    code=$2
    pattern=$3
    shift 3
    "$program" "$@" >out 2>err </dev/null
    got=$?
    [ "$got" = "$code" ] && cat out err | grep -q -e "$pattern"
    report $? "$name" "  wanted $code with $pattern
  got    $got: $(head -c 2000 err) $(head -c 1000 out)"
}

"$program" make-scene tabletop -o made --width 32 --height 24 --views 9 --samples 1 --points 60 >out 2>&1
report $? "a scene" "$(cat out)"

# ---- training
holds "times of scores on the way" 0 '^3 held-out views: ' train made -o run --iterations 40 --eval-split every=3 --eval-at 1h,2h
holds "a time before the first step" 0 '^warning: eval_at: .*times skipped: 1$' train made -o early --iterations 3 --eval-at 0.0001s,1h
"$program" train made -o blind --budget 0.6s --eval-split none --eval-at 0.3s >out 2>err && ! grep -q -w nan err
report $? "no score on the way without held-out photos" "$(cat err)"
holds "times that fall" 2 '^error: --eval-at: "1s" (wanted up to [0-9]* increasing times' train made -o none --eval-at 2s,1s
holds "a time that is none" 2 '^error: --eval-at: "soon"' train made -o none --eval-at soon
holds "a list that is too long" 2 '^error: --eval-at: the list is too long' train made -o none --eval-at "$(printf '%0600d' 1)"
holds "more anchors at the start than are wanted" 0 '^warning: max_anchors: the sparse points alone make [0-9]* anchors, so none is added in training (the limit is 5)$' train made -o many --iterations 3 --max-anchors 5
holds "a setting that the initial anchors do not use" 0 '^warning: init_count: ignored with init gb$' train made -o unheeded --iterations 3 --init-count 0.5
holds "a setting that the renderer does not use" 0 '^warning: splats_until: ignored with renderer raster$' train made -o unheeded --overwrite --iterations 3 --renderer raster --splats-until 0.5
holds "settings that compat does not use" 0 '^warning: splats_until, threshold_factor: ignored with compat$' train made -o reference --iterations 3 --compat --splats-until 0.7 --threshold-factor 3
holds "nothing is said of those that it uses" 0 '^[^w]' train made -o reference --iterations 3 --compat --overwrite && ! grep -q ignored err
report $? "no warning without reason" "$(cat err)"
"$program" train made -o paused --iterations 60 --stop-at-step 40 --quiet >out 2>err
echo 30,1.25,0.5,32,24,0.2,0.1,0.5,15,20.5,273,460 >>paused/log.csv # as --eval-at leaves it
"$program" train -o paused --resume --quiet >>out 2>>err && tr -d ' \n' <paused/train.json | grep -q '"held_out":.{"seconds":1.25,"step":30,"psnr":20.5}'
report $? "a resumed run keeps its scores on the way" "$(cat err out)"
"$program" train made -o halved --iterations 40 --stop-at-step 20 --quiet >out 2>&1
[ $? -eq 130 ] && echo 'iterations = 60' >longer.conf &&
    GBTRACE_TRAIN_BUDGET=1s "$program" train -o halved --resume --config longer.conf >out 2>&1 && "$program" info halved | grep -q 'trained   40 iterations' &&
    GBTRACE_TRAIN_BUDGET=0.001s "$program" train -o halved --resume >out 2>&1 && grep -q '^halved: all 40 steps are done' out
report $? "lengths in a file or a variable change no run that is resumed" "$(cat out; "$program" info halved)"
printf 'iterations = 20\npace = %s\n' "$(seq -s , 20 | sed 's/[0-9][0-9]*/1/g')" >length.conf
GBTRACE_TRAIN_ITERATIONS=20 "$program" train made -o timed --config length.conf --budget 0.6s --quiet >out 2>&1 &&
    [ "$(grep -c -x -e 'iterations = 0' -e 'budget-seconds = 0.6' -e 'pace = ' timed/config)" = 3 ] &&
    "$program" train made -o counted --config length.conf --iterations 4 --quiet >>out 2>&1 && "$program" info counted | grep -q 'trained   4 iterations'
report $? "a length that is typed wins over those in a file or a variable" "$(cat out timed/config; "$program" info counted)"
mkdir wide && cp -r made/* wide && holds "a sky that is learned" 0 '^2 held-out views: ' train wide -o wide/run --iterations 5 --background sky
"$program" make-scene tabletop -o rolled --lens rolling --width 32 --height 24 --views 3 --samples 1 --points 60 --quiet >out 2>&1 && cp -r rolled/images rolled/masks &&
    "$program" info rolled >out 2>err && grep -q '^warning: rolled/masks: not used: no frame of rolled/transforms.json names a mask in it (mask_path)$' err
report $? "masks that no frame names" "$(cat err out)"
holds "and what it was trained with" 0 '^  config    background = sky$' info wide/run
cp -r rolled own && sed '1s|{|{"train_filenames": ["images/0000.png", "images/0001.png"],|' rolled/transforms.json >own/transforms.json &&
    "$program" train own -o own-run --eval --iterations 3 >out 2>err && grep -q ': 2 photos to train on, 1 held out; ' err &&
    tr -d ' \n' <own-run/metrics.json | grep -q '"views":.{"name":"images/0002.png"'
report $? "--eval holds out what the data set says" "$(cat err out; head -c 300 own/transforms.json)"
printf '0001.png\n0005.png\n' >names.txt && "$program" train made -o listed --iterations 3 --eval-split list=names.txt --quiet >out 2>err && rm names.txt &&
    mkdir apart && (cd apart && "$program" eval ../listed) >out 2>>err && grep -q '^2 held-out views: ' err && "$program" train --config listed/config -o again --quiet >>out 2>>err &&
    cmp again/held-out.txt listed/held-out.txt >>err && cat listed/report.html | grep -q ' --eval-split list=names.txt'
report $? "a list of held-out photos stays with the run" "$(cat err out; cat listed/config)"
"$program" make-scene courtyard -o foreign --width 32 --height 24 --views 9 --samples 1 --points 60 --quiet >out 2>&1 && cp listed/metrics.json before.json && mkdir -p apart &&
    (cd apart && "$program" eval ../listed --data ../foreign) >out 2>err && cmp listed/metrics.json before.json >>err
report $? "scores of other data leave the run's alone, from any folder" "$(cat err out)"
holds "scores at more than the photos' size" 2 '^error: --downscale: 0.5 (wanted 1 to 64)$' eval run --downscale 0.5

"$program" train made -o exposed --exposure --iterations 3 --quiet >out 2>err && cp -r exposed/renders/test scored &&
    holds "the scored pictures of a run with exposures are not drawn over" 2 '^error: exposed/renders/test: holds the scored pictures, through the photos. colour matrices (wanted another folder)$' render exposed &&
    diff -r scored exposed/renders/test >out && "$program" render exposed -o exposed-drawn >>out 2>err && "$program" render exposed --split train >>out 2>>err
report $? "they stay, and all else is drawn" "$(cat err out)"
"$program" export exposed exposed.ply exposed-result/ --refine 0 --json exposed.json >out 2>err && grep -q '"psnr_to_model"' exposed.json && ! grep -q to_photos exposed.json &&
    grep -q '^warning: exposed-result/: ' err && "$program" export run usual.ply usual-result/ --refine 0 --json usual.json >>out 2>err && ! grep -q matrices err && grep -q '"model_psnr_to_photos"' usual.json
report $? "an export tells scores to photos where these have no exposures" "$(cat err out exposed.json usual.json)"

mkdir -p mine/scene && holds "the demo leaves data that are no scene of its own alone" 2 '^error: mine/scene: exists, but is not a scene made by gbtrace ' demo -o mine && [ -z "$(ls mine/scene)" ]
report $? "nor anything in their folder"
mkdir -p shop/scene/sparse/0/images.bin && touch shop/scene/SCENE.md && "$program" make-scene tabletop -o shop/scene --width 32 --height 24 --views 9 --samples 1 --points 60 >out 2>&1
[ $? = 4 ] && [ ! -e shop/scene/sparse/0/points3D.bin ] && rm -r shop/scene/sparse # bench/ looks for what is written last
report $? "a scene that was not finished" "$(cat out; ls -R shop/scene)"
mkdir -p rolled-part/points.ply && "$program" make-scene tabletop -o rolled-part --lens rolling --width 32 --height 24 --views 9 --samples 1 --points 60 >out 2>&1
[ $? = 4 ] && [ ! -e rolled-part/transforms.json ]
report $? "nor one of moving cameras" "$(cat out; ls rolled-part)"
cp -r listed shop/run && holds "the demo takes it for its own, and leaves a run of other data alone" 2 '^error: shop/run: already holds a run ' demo -o shop --minutes 0.05 && cmp listed/model.gbt shop/run/model.gbt >out
report $? "and its model" "$(cat out)"
sed -i '3s|.*|../scene|' shop/run/data_places && holds "the demo trains its own run anew" 0 '^Report: shop/run/report.html$' demo -o shop --minutes 0.05 && ! cmp -s listed/model.gbt shop/run/model.gbt
report $? "and writes its model" "$(cat err)"

# ---- pictures
"$program" render run -o shown --format exr >out 2>err && "$program" render run -o exact --renderer reference --format exr >>out 2>>err &&
    "$program" compare shown/0000.exr exact/0000.exr --json >scores 2>>err &&
    grep -q '^{"schema": 1, "width": 32, "height": 24, "psnr": [0-9.]*, "ssim": [0-9.]*, "ssim_interior": [0-9.]*, "flip": [0-9.e-]*}$' scores &&
    [ "$(sed 's/.*"psnr": \([0-9]*\).*/\1/' scores)" -ge 90 ]
report $? "render in double, and compare as JSON" "$(cat err out; ls shown; cat scores)"
cp -r made gaps && rm gaps/images/0001.png && mkdir gaps/masks && printf '0001.png\n0003.png\n' >gaps/list && "$program" train gaps -o gaps-run --eval-split list=gaps/list --iterations 3 --quiet >out 2>err &&
    [ "$(grep '^warning: ' err | sed 's/: [0-9].*//')" = "warning: gaps/list: names of missing photos, ignored
warning: gaps: views left out because their photo is missing
warning: gaps: photos without a mask, used completely" ]
report $? "training warns about its data once" "$(cat err out)"
"$program" eval gaps-run >out 2>err && [ "$(grep -c '^warning: ' err)" = 3 ]
report $? "scoring alone warns, too" "$(cat err out)"
mkdir floats && cp -r made/* floats && cp shown/0000.exr floats/images/0001.png &&
    holds "EXR photos are told" 0 '^warning: floats: EXR photos, used without tone mapping, values above 1 clipped: 1$' train floats -o floats/run --iterations 3
"$program" train made -o splats --renderer raster --iterations 3 --quiet >out 2>err && ! "$program" render splats -o none --outputs depth >>out 2>>err &&
    "$program" render splats -o splats-exact --renderer reference --outputs depth >>out 2>>err && [ -s splats-exact/0000.depth.exr ]
report $? "the reference, and depth beside it, of a model of splats" "$(cat err out; ls splats-exact)"
printf '{"cameras": [{"origin": [0, 0, -4], "target": [0, 0, 0]}, {"origin": [1, 0, -4], "target": [0, 0, 0]}], "rays": "none.exr"}' >rays.json
holds "rays beside the cameras of a path" 3 '^error: rays.json: cameras.0..rays: not supported in a path (wanted a camera)$' render run --path rays.json -o none
holds "a limit that one picture passes: it is drawn" 5 '^error: memory: the limit of 20 MiB was exceeded: this took [0-9]* MiB (the output is complete' render run -o drawn --memory 20M && [ -s drawn/0000.png ]
report $? "and is there" "$(ls drawn)"
"$program" render run -o path --path orbit --frames 2 --size 20x10 >out 2>err && [ "$(ls path | wc -l)" = 2 ]
report $? "an orbit of another size" "$(cat err)"
"$program" render run -o followed --path orbit --frames 2 --size 20x10 --progress json >out 2>err && grep -q '"event": "progress", .*"stage": "render", "done": 2, "total": 2' err
report $? "a driver is told how far a film is" "$(cat err)"
cat >path.json <<'END'
{"width": 40, "height": 30, "fov_x_deg": 60, "fps": 5, "up": [0, -1, 0], "cameras": [{"origin": [0, 0, -4], "target": [0, 0, 0]}, {"origin": [1, 0, -4], "target": [0, 0, 0]}]}
END
"$program" render run -o resized --path path.json --frames 3 --size 20x10 --fps 7 >out 2>err && grep -q '^3 frames .* at 7 frames per second' err &&
    [ "$(ls resized | wc -l)" = 3 ] && "$program" compare resized/*1.png path/*1.png >>out 2>>err
report $? "a path file of another size" "$(cat err out)"
"$program" export run result/ --sh-degree 1 >out 2>err && "$program" render result -o whole --format exr >>out 2>>err &&
    "$program" render result -o cells --format exr --memory "$limit" >>out 2>>err && "$program" compare whole/*0.exr cells/*0.exr >>out 2>>err
report $? "a result folder within a memory limit" "$(cat err out)"
sed -i 's/resolution=1/resolution=2/' result/cfg_args && "$program" render result -o half --format exr >out 2>err && "$program" render result -o asked --format exr -d 1 >>out 2>>err &&
    "$program" compare whole/*0.exr asked/*0.exr >>out 2>>err && ! "$program" compare whole/*0.exr half/*0.exr >>out 2>>err && grep -q '16 x 12' err
report $? "a result folder of photos at half size" "$(cat err out)"
sed -i "s/images='images'/images='images_2'/; s/resolution=2/resolution=-1/" result/cfg_args && "$program" render result -o reduced --format exr >out 2>err && "$program" render result -o divided --format exr -d 2 >>out 2>>err &&
    grep -q "images='images_2'.*resolution=-1" result/cfg_args && "$program" compare divided/*0.exr reduced/*0.exr >>out 2>>err
report $? "a result folder of photos that were divided before" "$(cat err out result/cfg_args)"
"$program" train made -o three-quarters --iterations 3 --downscale 1.33333 --quiet >out 2>err && "$program" export three-quarters narrow/ --refine 0 >>out 2>>err &&
    grep -q 'resolution=24, ' narrow/cfg_args && grep -q '"width": 24,' narrow/cameras.json && "$program" render narrow -o narrow-drawn >>out 2>>err &&
    "$program" compare narrow-drawn/0000.png narrow/test/*/renders/00000.png --json | grep -q '"width": 24, "height": 18, "psnr": 100,'
report $? "a result folder of photos at another width" "$(cat err out; cat narrow/cfg_args; "$program" compare narrow-drawn/0000.png narrow/test/*/renders/00000.png)"
echo 0002.png >held-third
"$program" train made -o third --iterations 3 --eval-split list=held-third --quiet >out 2>err && "$program" export third of-third/ --refine 0 >>out 2>>err &&
    grep -m 1 '"img_name"' of-third/cameras.json | grep -q '"0002"' && "$program" info made | grep -e '^  points ' -e '^  origin ' >points && [ "$(wc -l <points)" = 2 ] &&
    "$program" info of-third/input.ply | grep -e '^  points ' -e '^  origin ' | cmp - points >>err
report $? "a result folder holds the points, and the held-out photo first" "$(cat err out points of-third/cameras.json)"
"$program" compare of-third/test/ours_3/gt/00000.png made/images/0002.png --json | grep -q '"psnr": 100,' &&
    "$program" compare of-third/test/ours_3/renders/00000.png of-third/test/ours_3/gt/00000.png --json | sed 's/.*"psnr": \([0-9.]*\), "ssim": \([0-9.]*\),.*/\2\n\1/' >scores &&
    sed -n 's/.*"00000.png": \([0-9.]*\).*/\1/p' of-third/per_view.json | paste - scores |
    awk '{ near += $1 > 0 && $1 - $2 < 1e-6 && $2 - $1 < 1e-6 } END { exit !(NR == 2 && near == 2) }'
report $? "the scores in a result folder are those of its pictures" "$(cat scores of-third/per_view.json)"
"$program" export run plain.ply >out 2>err && "$program" make-scene tabletop -o wide --width 1920 --height 12 --views 3 --points 20 --samples 1 --quiet >>out 2>>err && "$program" render plain.ply -o usual --data wide >>out 2>>err &&
    "$program" render plain.ply -o as-is --data wide -d 1 >>out 2>>err && ! "$program" compare usual/0000.png as-is/0000.png >>out 2>>err &&
    grep -q '1600 x 10' err && grep -q '1920 x 12' err
report $? "wide photos of plain Gaussians" "$(cat err out)"
"$program" make-scene tabletop -o wider --width 3600 --height 24 --views 3 --points 20 --samples 1 --quiet >out 2>err && "$program" render result -o at-most --data wider >>out 2>>err &&
    sed -i 's/resolution=-1/resolution=1/' result/cfg_args && "$program" render result -o at-half --data wider >>out 2>>err && ! "$program" compare at-most/0000.png at-half/0000.png >>out 2>>err &&
    grep -q '1600 x 11' err && grep -q '1800 x 12' err
report $? "wide photos of a result folder that were divided before" "$(cat err out result/cfg_args)"
sed -i "s/source_path='[^']*'/source_path=''/" result/cfg_args && "$program" render result -o listed --format exr >out 2>err && "$program" compare whole/*0.exr listed/*0.exr >>out 2>>err
report $? "the cameras in a result folder have sizes of their own" "$(cat err out)"
mkdir -p close/images && cp made/images/0000.png made/images/0001.png close/images && frame() { printf '{"file_path": "images/%s.png", "transform_matrix": [[0,0,1,%s],[1,0,0,0],[0,1,0,%s],[0,0,0,1]]}' "$1" "$2" "$3"; }
printf '{"fl_x": 30, "fl_y": 30, "cx": 16, "cy": 12, "w": 32, "h": 24, "frames": [%s, %s]}' "$(frame 0000 1 0)" "$(frame 0001 -0.2 0.3)" >close/transforms.json
"$program" train made -o facing --near 0.9 --iterations 40 --eval-split every=3 --quiet >out 2>&1
"$program" export facing n.ply n.glb n.sog n.usda n.spz n.splat near/ --data close --refine 0 >out 2>err && "$program" render facing -o near-model --data close >>err 2>&1
for file in n.ply n.glb n.sog n.usda n.spz n.splat near; do
    "$program" render "$file" -o near-drawn --data close >>err 2>&1
    drawn=$("$program" compare near-drawn/*.png near-model/*.png --json | sed 's/.*"psnr": \([0-9.]*\).*/\1/')
    said=$(sed -n "s|^$file/*: .* 1 held-out views: \([0-9.]*\) dB to the model.*|\1|p" out)
    awk "BEGIN { exit !($drawn - $said < 0.02 && $said - $drawn < 0.02) }" || { echo "$file: $drawn dB, $said said"; break; }
done >wrong 2>&1 && [ ! -s wrong ] && [ "$(grep -c '^warning: .*does not keep the near distance' err)" = 2 ] && grep -q '^warning: n.spz: the format does not keep the near distance (0\.95[0-9]*): PSNR to the model is ' err
report $? "the printed scores are those of the files, with their near distance or without" "$(cat wrong err out)"
echo 0000.png >held # it is nearer to things than all that are trained on
"$program" train made -o nearest --near 1 --iterations 40 --eval-split list=held --quiet >out 2>&1 && "$program" render nearest -o nearest-drawn >>out 2>&1 &&
    cmp nearest-drawn/0000.png nearest/renders/test/0000.png >>out 2>&1
report $? "render draws a held-out photo with its near distance, as it was scored" "$(cat out)"
"$program" export run fresh/n.ply fresh/ --refine 0 >out 2>err && [ -s fresh/n.ply ] && [ -s fresh/cfg_args ] && ! "$program" export run other/sub/n.ply other/ --refine 0 >>out 2>>err && [ ! -e other ]
report $? "a file in a result folder that is named first" "$(cat err out)"
mkdir -p res2/point_cloud/iteration_30000 &&
    holds "a result folder of a later iteration" 2 '^error: res2/: holds iteration 30000, which readers take instead of 40 (wanted an empty folder)$' export run res2/ --refine 0 && [ "$(ls res2)" = point_cloud ]
report $? "and nothing is written into it" "$(ls res2)"
"$program" train made -o whole-set --iterations 3 --eval-split none --quiet >out 2>err && "$program" export whole-set set/ --refine 0 >>out 2>>err && grep -q 'eval=False' set/cfg_args && grep -q 'eval=True' result/cfg_args
report $? "a result folder says whether photos were held out" "$(cat err out)"
mkdir -p twice/point_cloud/iteration_1 && cp plain.ply twice/point_cloud/iteration_1/point_cloud.ply && camera='"width": 16, "height": 12, "fx": 15, "fy": 15, "rotation": [[1,0,0],[0,1,0],[0,0,1]], "img_name": "r_0"' &&
    printf "[{%s, \"position\": [0,0,-4]}, {%s, \"position\": [0,1,-4]}]" "$camera" "$camera" >twice/cameras.json && "$program" render twice -o twice-drawn --split all >out 2>err && [ "$(ls twice-drawn | tr '\n' ' ')" = "r_0-00001.png r_0.png " ]
report $? "two cameras of one name" "$(cat err out; ls twice-drawn)"
holds "info of plain Gaussians, as JSON" 0 '^  "kind": "gaussians",$' info plain.ply --json

prim='def ParticleField3DGaussianSplat "one" { point3f[] positions = [(1, 2, 3)] quatf[] orientations = [(1, 0, 0, 0)] float[] opacities = [0.5] float3[] scales = [(1, 1, 1)]'
moved='double3 xformOp:translate = (9, 0, 0) uniform token[] xformOpOrder = ["xformOp:translate"]'
usd() { # NAME WARNINGS TEXT
    printf '#usda 1.0\n%s\n' "$3" >one.usda
    "$program" export one.usda one.ply >out 2>err && [ "$(grep -c '^warning: one.usda: only the translation of the Gaussians. prim is used;' err)" = "$2" ]
    report $? "USD: $1" "$(cat err out)"
}
usd "a prim alone, with a translation" 0 "$prim $moved }"
turned='float xformOp:rotateY = 90 uniform token[] xformOpOrder = ["xformOp:rotateY"]'
usd "a prim that is turned" 1 "$prim $turned }"
usd "a prim in one that is moved" 1 "def Xform \"all\" { $moved def Scope \"some\" { $prim } } }"
usd "a prim in one that says so behind it" 1 "def Xform \"all\" { def Scope \"some\" { $prim } } $moved }"
usd "a prim in one that is not moved, beside some that are" 0 "def Xform \"all\" { def Xform \"a\" { $moved } $prim } def Xform \"b\" { $moved } } def Xform \"c\" { $moved }"

# ---- counts and places
GBT_ISA=sse "$program" info made >out 2>err && grep -q '^warning: GBT_ISA=sse: no instruction set (wanted plain, neon, avx2 or avx512)$' err
report $? "an instruction set that is none" "$(cat err)"
GBTRACE_LIBRARY=/nothing "$program" doctor >out 2>&1
! grep -q 'no command has the option' out
report $? "the doctor knows the variable of the Python package" "$(cat out)"
"$program" init made -o anchors.ply --json counts.json >out 2>err && [ "$(grep -c '"color_rms": 0\.1' counts.json)" -ge 3 ]
report $? "init tells how well anchors stand for points" "$(cat err out; cat counts.json)"
cp -r run small && "$program" compress run -o small.gbt >out 2>err && "$program" compress small -o limited.gbt --memory 400M >>out 2>>err && cmp small.gbt limited.gbt >>out
report $? "compress within a memory limit" "$(cat err out)"
"$program" query nearest run --at 0,0,0 >free 2>err && "$program" query nearest run --at 0,0,0 --memory 400M >out 2>>err && cmp free out >>err
report $? "query within a memory limit" "$(cat err out)"
holds "a limit that is passed" 5 '^error: memory: ' query nearest run --at 0,0,0 --memory 1M
if command -v perl >/dev/null; then
    perl -e '$n = 5e8; $much = "x" x $n; exec @ARGV' "$program" info made --memory 400M >out 2>err
    report $? "a limit does not count what was there before the program" "$(cat err)"
fi
"$program" make-scene tabletop -o low --width 16 --height 8 --views 3 --samples 1 --points 60 --quiet >out 2>&1
holds "pictures smaller than a window of SSIM" 0 '(windows inside: n/a), FLIP 0.000000$' compare low/images/0000.png low/images/0000.png
holds "query of a data set" 0 '[0-9]' query nearest made --at 0,0,0 --count 3
printf '<svg xmlns="http://www.w3.org/2000/svg"/>' >chart.svg && "$program" report run ./chart.svg >out 2>err && grep -q 'class="study card"' run/report.html
report $? "a chart that is named from here" "$(cat err out)"
holds "JSON in the place of the model" 2 '^error: run/model.gbt: would be overwritten (--json must be another file)$' eval run --json run/model.gbt
holds "JSON in the place of the model that is exported" 2 '^error: run/model.gbt: would be overwritten (--json must be another file)$' export run made.ply --json run/model.gbt
"$program" report run >out 2>err && grep -c 'class="view' run/report.html >>out
report $? "a report from a run's own scores" "$(cat err)"

finish
