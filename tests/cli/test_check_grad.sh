#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/cli/test_check_grad.sh -- gbtrace check-grad on short runs of every kind: all errors below their limits, all stages there.
# Usage: test_check_grad.sh PROGRAM
set -u
program=$1
. "$(dirname "$0")/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
"$program" make-scene tabletop -o made --width 64 --height 48 --views 6 --samples 2 --points 300 --quiet &&
    "$program" make-scene tabletop -o bent --width 64 --height 48 --views 6 --samples 2 --points 300 --lens distorted --quiet &&
    cp -r made masked && mkdir masked/masks && for photo in masked/images/*.png; do
        # a mask is any picture: bright parts of a photo of the scene count
        cp masked/images/0001.png "masked/masks/${photo##*/}"
    done || exit 1

# check NAME DATA STAGES TRAINING...
check() {
    name=$1
    data=$2
    stages=$3
    shift 3
    "$program" train "$data" -o run --iterations 60 --overwrite --quiet "$@" >out 2>&1 && "$program" check-grad run >out 2>err
    got=$?
    [ "$got" = 0 ] && [ ! -s err ] && [ "$(grep -c broken out)" = 0 ] &&
        [ "$(sed -n 's/^\([a-z-]*\)  *[a-z ]*[a-z]  *[0-9.e-]*  *[0-9.e-]*$/\1/p' out | uniq | tr '\n' ' ')" = "$stages " ]
    report $? "$name" "  wanted 0 and $stages, got $got: $(cat err out)"
}
check "a run of splats and rays" made "rasterizer tracer decode chain" --splats-until 0.7
cp run/model.gbt small.gbt
check "rays alone, no footprint" made "rasterizer tracer decode chain" --footprint 0
check "a run by splats" made "rasterizer tracer decode chain" --renderer raster
check "a run by splats at each ray" made "rasterizer per-ray tracer decode chain" --renderer per-ray
check "the reference method" made "rasterizer tracer decode chain" --compat --voxel-size 0.02
check "a lossless model" made "rasterizer tracer decode chain" --lossless
check "matrices of exposure" made "rasterizer tracer decode chain" --exposure
check "masks" masked "rasterizer tracer decode chain"
check "distorted photos have no splats" bent "tracer decode chain" --splats-until 0.7
"$program" check-grad small.gbt >out 2>err && grep -q '^chain' out
report $? "a model file" "$(cat err out)"
for threads in 1 2; do
    "$program" check-grad run --threads $threads >out-$threads 2>err
done
cmp -s out-1 out-2
report $? "the rows do not depend on the threads" "$(cat out-1 out-2)"
finish
