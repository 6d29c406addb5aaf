#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/golden/golden.sh -- the bits of models, pictures and exports, on every instruction set and number of threads.
#
# Usage: golden.sh PROGRAM RECORD THREADS [ISA]
#
# Makes small scenes, trains each kind of run on them, draws, exports, and hashes every file. RECORD holds the hashes as they were recorded,
# under the name of the C library and image library whose arithmetic and files they have; elsewhere the comparison is skipped.
# `golden.sh PROGRAM - THREADS ISA > RECORD` records. A change that should alter no result leaves RECORD as it is.
set -u
program=$1
record=$2
threads=$3
isa=${4:-}
[ "$record" = - ] || record=$(cd "$(dirname "$record")" && pwd)/$(basename "$record")
. "$(dirname "$0")/../cli/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
GBTRACE_THREADS=$threads
export GBTRACE_THREADS

# ---- scenes. 400 Gaussians, their centres as sparse points, nine cameras around them, and the tracer's pictures as photos. Nothing of Embree's
# own arithmetic is in them, as it would be in those of `gbtrace make-scene`: it differs between instruction sets and between processors.
awk 'function random() { state = (state * 16807) % 2147483647; return state / 2147483647 }
    function start(file, names) {
        printf "ply\nformat ascii 1.0\nelement vertex 400\n" >file
        n = split(names, name, " ")
        for (k = 1; k <= n; k++) printf "property %s %s\n", name[k] ~ /red|green|blue/ ? "uchar" : "float", name[k] >file
        print "end_header" >file
    }
    BEGIN {
        state = 1
        start("gaussians.ply", "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3")
        start("points.ply", "x y z red green blue")
        for (i = 0; i < 400; i++) {
            for (k = 0; k < 3; k++) center[k] = 3 * random() - 1.5
            for (k = 0; k < 3; k++) color[k] = 3 * random() - 1.5
            where = sprintf("%.6f %.6f %.6f", center[0], center[1], center[2])
            printf "%s %.6f %.6f %.6f %.6f", where, color[0], color[1], color[2], 6 * random() - 2 >"gaussians.ply"
            for (k = 0; k < 3; k++) printf " %.6f", -3 + 2 * random() >"gaussians.ply"
            printf " %.6f %.6f %.6f %.6f\n", 0.1 + random(), random() - 0.5, random() - 0.5, random() - 0.5 >"gaussians.ply"
            printf "%s %d %d %d\n", where, 128 + 70 * color[0], 128 + 70 * color[1], 128 + 70 * color[2] >"points.ply"
        }
    }'
make() { # NAME FIELDS: those of transforms.json beside the pinhole camera's
    mkdir "$1" "$1/images" && cp points.ply "$1" || exit 1
    for i in 0 1 2 3 4 5 6 7 8; do
        if [ "$1" = plain ]; then : >"$1/images/000$i.png"; else cp plain/images/000$i.png "$1/images" || exit 1; fi
        # OpenGL axes: right (-s, c, 0), up (0, 0, 1), back (c, s, 0), at 4 times back
        awk -v i=$i -v fields="$2" 'BEGIN {
            c = cos(0.7 * i); s = sin(0.7 * i)
            if (i == 0) printf "{\"fl_x\": 90, \"fl_y\": 90, \"cx\": 48, \"cy\": 36, \"w\": 96, \"h\": 72, %s\"frames\": [\n", fields
            printf "{\"file_path\": \"images/%04d.png\", \"transform_matrix\": [[%.9g,0,%.9g,%.9g],[%.9g,0,%.9g,%.9g],[0,1,0,0.5],[0,0,0,1]]}%s\n",
                i, -s, c, 4 * c, c, s, 4 * s, i < 8 ? "," : "]}"
        }'
    done >"$1/transforms.json"
}
points='"ply_file_path": "points.ply", '
make plain "$points"
"$program" render gaussians.ply -o photos --data plain --split all --quiet >out 2>&1 || { cat out; exit 1; }
for photo in photos/*.png; do mv "$photo" "plain/images/${photo##*images_}" || exit 1; done
rm -r photos
make bent "$points\"k1\": -0.12, \"k2\": 0.03, \"p1\": 0.002, \"p2\": -0.001, "
make fisheye "$points\"camera_model\": \"OPENCV_FISHEYE\", "
make masked "$points" && mkdir masked/masks || exit 1
for photo in plain/images/*.png; do cp plain/images/0003.png "masked/masks/${photo##*/}"; done
sed -i 's|"file_path": "images/\(.*\.png\)"|&, "mask_path": "masks/\1"|' masked/transforms.json
make pointless ''
make rolling "$points\"rolling_shutter\": [0, 0, 1, 0], " # the camera climbs while it is read out
sed -i 's/"transform_matrix": \(.*\)\[0,1,0,0.5\]\(,\[0,0,0,1\]\]\)/"transform_matrix_start": \1[0,1,0,0.45]\2, "transform_matrix_end": \1[0,1,0,0.6]\2/' rolling/transforms.json

# ---- what is made of them
[ -z "$isa" ] || export GBT_ISA="$isa"
run() { # NAME DATA OPTIONS...
    name=$1
    data=$2
    shift 2
    "$program" train "$data" -o "$name" --iterations ${steps:-40} --lossless --quiet "$@" >out 2>&1 || printf 'failed: %s: %s\n' "$name" "$(cat out)"
    rm -rf "$name"/checkpoints "$name"/*.json "$name"/*.csv "$name"/report.html "$name"/data_places "$name"/config
}
draw() { "$program" render "$@" --quiet >out 2>&1 || printf 'failed: %s: %s\n' "$*" "$(cat out)"; }
for init in gb adaptive voxel random; do run init-$init plain --init $init; done
run nearest plain --scale-prior nn --offsets 4 --distance on
run compat plain --compat
run raster plain --renderer raster
run per-ray plain --renderer per-ray
run rays plain --footprint 0
run splats-first plain --splats-until 0.7
run exposure plain --exposure
run masked-run masked
run fisheye-run fisheye
run bent-run bent
run rolling-run rolling
run pointless-run pointless
run picked plain --step-pixels 768 # every third across and down
run sky plain --background sky --views 2
run poses plain --refine-poses --exposure --views 2
steps=560 # so many looks at each photo that steps leave anchors out
run long plain --eval-split every=2
steps=
"$program" train plain -o goes-on --iterations 20 --quiet >/dev/null 2>&1
"$program" train -o goes-on --resume --iterations 40 --lossless --quiet >out 2>&1 || cat out
rm -rf goes-on/checkpoints goes-on/*.json goes-on/*.csv goes-on/report.html goes-on/data_places goes-on/config

for renderer in trace raster per-ray reference; do draw init-gb -o drawn-$renderer --renderer $renderer --format exr; done
for preset in fast exact; do draw init-gb -o drawn-$preset --preset $preset --format exr; done
draw init-gb -o outputs --outputs transmittance,depth,median-depth,normal,hits,anchor --format exr
draw init-gb -o orbit --path orbit --frames 3
draw init-gb -o tour --path interpolate --frames 3
camera='"origin": [0.3, -0.4, -2], "target": [0, 0, 0.5], "up": [0, -1, 0], "width": 64, "height": 48'
printf '{"model": "equirectangular", %s}' "$camera" >panorama.json
printf '{"fov_x_deg": 60, "aperture": 0.1, "focus": 2, "samples": 8, %s}' "$camera" >aperture.json
printf '{"fov_x_deg": 60, "end": {"origin": [0.5, -0.4, -2]}, %s}' "$camera" >shutter.json
printf 'v -0.3 -0.3 0\nv 0.3 -0.3 0\nv 0.3 0.3 0\nv -0.3 0.3 0\nf 1 2 3 4\n' >square.obj
printf '{"light": {"position": [1, -2, -1], "radius": 0.2}, "objects": [{"mesh": "square.obj", "material": "mirror", "position": [0, -0.3, 0]}]}' >square.json
for camera in panorama aperture shutter; do draw init-gb -o cameras --camera $camera.json --format exr; done
draw init-gb -o cameras-insert --camera shutter.json --insert square.json --format exr
draw sky -o sky-camera --camera panorama.json --format exr
draw sky -o sky-insert --camera aperture.json --insert square.json --format exr
mkdir exports
"$program" export init-gb exports/a.ply exports/a.splat exports/a.spz exports/a.glb --refine 20 --quiet >out 2>&1 || cat out
draw exports/a.ply -o drawn-ply --data plain --format exr
"$program" compress init-gb -o exports/small.gbt --quality 40 --quiet >out 2>&1 || cat out
for init in gb adaptive voxel; do "$program" init plain -o exports/$init.ply --init $init --quiet >out 2>&1 || cat out; done

# ---- compare
rm -rf plain bent fisheye masked pointless rolling out gaussians.ply points.ply
find . -type f ! -name '*.json' ! -name '*.obj' | LC_ALL=C sort | xargs sha256sum | sed 's/ [ *]\.\// /' >"$work.now"
platform="# $(getconf GNU_LIBC_VERSION), $("$program" doctor 2>/dev/null | sed -n 's/.*\(OpenImageIO [0-9.]*\).*/\1/p')"
case $platform in
*OpenImageIO\ [0-9]*) ;;
*) # not a reason to skip
    rm "$work.now"
    report 1 "the version of OpenImageIO" "gbtrace doctor does not say it: $platform"
    finish
    ;;
esac
if [ "$record" = - ]; then
    printf '%s\n' "$platform"
    cat "$work.now"
    rm "$work.now"
    exit 0
fi
if [ "$(head -n 1 "$record")" != "$platform" ]; then
    skip "recorded hashes" "recorded with $(head -n 1 "$record"), this is $platform"
else
    tail -n +2 "$record" | diff - "$work.now" >"$work.diff"
    report $? "$(wc -l <"$work.now") files have the recorded bits (threads $threads ${isa:-best}): if a result was meant to change, record anew" "$(head -n 40 "$work.diff")"
    rm -f "$work.diff"
fi
rm -f "$work.now"
finish
