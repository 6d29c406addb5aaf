#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/cluster/test_cluster.sh -- one task on several processes that mpirun has started: the same bytes as from one, one voice, one end.
# Usage: test_cluster.sh PROGRAM BUILD openmpi|mpich
set -u
program=$1
build=$2
mpi=$3
. "$(dirname "$0")/../cli/report.sh"
command -v "mpirun.$mpi" >/dev/null || { skip "$mpi" "mpirun.$mpi is not installed"; finish; }
[ -f "$build/gbtrace_$mpi.so" ] || { skip "$mpi" "its headers are not installed, so no module was built"; finish; }
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
GBTRACE_THREADS=1
# More processes than processors: those that wait must let others run.
# Names that one MPI or version knows and the others ignore.
export GBTRACE_THREADS OMPI_MCA_rmaps_base_oversubscribe=1 PRTE_MCA_rmaps_default_mapping_policy=core:oversubscribe OMPI_MCA_mpi_yield_when_idle=1
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 PRTE_ALLOW_RUN_AS_ROOT=1 PRTE_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_btl_vader_single_copy_mechanism=none # containers forbid it
on() { # PROCESSES COMMAND...
    count=$1
    shift
    "mpirun.$mpi" -n "$count" "$@"
}
errors() { grep -c '^error:' err; }

"$program" make-scene tabletop -o data --width 64 --height 48 --views 9 --samples 1 --points 200 --quiet >out 2>&1
report $? "a scene" "$(cat out)"

# ---- training
"$program" train data -o alone --views 4 --iterations 30 --exposure --quiet >out 2>&1
report $? "views of a step in one process" "$(cat out)"
"$program" train data -o threads --views 4 --iterations 30 --exposure --quiet --threads 3 >out 2>&1 && cmp alone/model.gbt threads/model.gbt
report $? "views of a step beside each other: the same model" "$(cat out)"
for count in 2 4; do
    on $count "$program" train data -o run$count --views 4 --iterations 30 --exposure --quiet >out 2>&1 && cmp alone/model.gbt run$count/model.gbt &&
        cmp alone/exposure.json run$count/exposure.json
    report $? "$count processes: the same model" "$(cat out)"
done
"$program" train data -o alone8 --views 8 --iterations 15 --quiet >out 2>&1 && on 8 "$program" train data -o run8 --views 8 --iterations 15 --quiet >out 2>&1 &&
    cmp alone8/model.gbt run8/model.gbt
report $? "8 processes: the same model" "$(cat out)"
grep -q '"bytes_per_step"' run4/train.json && ! grep -q '"bytes_per_step"' alone/train.json
report $? "train.json says what was sent" "$(cat run4/train.json)"
on 2 "$program" train data -o goes-on --views 4 --iterations 30 --exposure --stop-at-step 12 --quiet >out 2>err
code=$?
[ $code = 130 ] && [ "$(errors)" = 1 ] && on 4 "$program" train -o goes-on --resume --quiet >out 2>&1 && cmp alone/model.gbt goes-on/model.gbt
report $? "stopped with 2, resumed with 4: the same model" "code $code: $(cat out err)"
on 4 "$program" train data -o many --iterations 30 >out 2>err
code=$?
[ $code = 2 ] && [ "$(errors)" = 1 ] && grep -q '^error: --views: 1 per step cannot be shared by 4 processes (wanted a number that divides it)$' err
report $? "more processes than views" "code $code: $(cat out err)"
on 2 "$program" train data -o many --no-such-option >out 2>err
code=$?
[ $code = 2 ] && [ "$(errors)" = 1 ]
report $? "one process tells what is wrong with the command line" "code $code: $(cat out err)"

# ---- trouble on another process
on 2 sh -c 'case ${OMPI_COMM_WORLD_RANK:-$PMI_RANK} in 1) cd / ;; esac; exec "$@"' sh "$program" train data -o "$work/lost" --views 2 --iterations 30 >out 2>err
code=$?
[ $code = 4 ] && [ "$(errors)" = 1 ] && [ ! -e lost/model.gbt ]
report $? "data that one process does not find" "code $code: $(cat out err)"
mkdir other && cp -r data other && cp data/images/0001.png other/data/images/0002.png
on 2 sh -c 'case ${OMPI_COMM_WORLD_RANK:-$PMI_RANK} in 1) cd other ;; esac; exec "$@"' sh "$program" train data -o "$work/differs" --views 2 --iterations 30 >out 2>err
code=$?
[ $code = 3 ] && [ "$(errors)" = 1 ] && grep -q '^error: process 1 reads other data than process 0 (data has photos of the same names, but other pictures)$' err && [ ! -e differs/config ]
report $? "data that differ" "code $code: $(cat out err)"
"$program" train data -o forked --views 2 --iterations 30 --stop-at-step 6 --quiet >out 2>&1
mkdir fork && cp -r data forked fork
"$program" train -o forked --resume --stop-at-step 12 --quiet >>out 2>&1
on 2 sh -c 'case ${OMPI_COMM_WORLD_RANK:-$PMI_RANK} in 1) cd fork ;; esac; exec "$@"' sh "$program" train -o forked --resume --quiet >>out 2>err
code=$?
[ $code = 3 ] && [ "$(errors)" = 1 ] && grep -q '^error: process 1 resumes from another checkpoint (step 6 with [0-9]* anchors, not 12 with [0-9]*)$' err
report $? "checkpoints that differ" "code $code: $(cat out err)"
on 2 "$program" train data -o "$work/killed" --views 2 --iterations 1000000 --save-every 1s --quiet >out 2>err &
started=$!
while [ ! -e killed/checkpoints/last.gbt ] && kill -0 $started; do sleep 0.1; done 2>/dev/null
for process in /proc/[0-9]*; do
    tr '\0' '\n' <"$process/cmdline" 2>/dev/null | grep -q "^$work/killed\$" && tr '\0' '\n' <"$process/environ" 2>/dev/null | grep -qE '^(OMPI_COMM_WORLD_RANK|PMI_RANK)=1$' &&
        kill -9 "${process#/proc/}"
done
wait $started
code=$?
[ $code != 0 ]
report $? "a process that is killed ends them all" "code $code: $(cat out err)"
"$program" train -o killed --resume --stop-at-step 1 --quiet >out 2>err
code=$?
[ $code = 130 ] && [ "$(errors)" = 1 ]
report $? "and the run goes on from what was saved" "code $code: $(cat out err)"

# ---- pictures and scores
same() { # FOLDER FOLDER: files of the same names and bytes
    diff -r "$1" "$2" >different 2>&1
}
same alone/renders/test run4/renders/test
report $? "pictures of a run that was scored by 4" "$(cat different)"
"$program" eval alone --json one.json --quiet >out 2>&1 && on 2 "$program" eval alone --json two.json --quiet >out 2>&1 &&
    grep -v '"seconds"' one.json >one && grep -v '"seconds"' two.json >two && cmp one two
report $? "scores of 2 processes" "$(cat out; diff one two)"
"$program" render alone -o views1 --split all --quiet >out 2>&1 && on 2 "$program" render alone -o views2 --split all --quiet >out 2>&1 && same views1 views2 &&
    [ "$(ls views2 | wc -l)" = 9 ]
report $? "views rendered by 2 processes" "$(cat out different)"
"$program" render alone -o path1 --path orbit --frames 5 --quiet >out 2>&1 && on 4 "$program" render alone -o path2 --path orbit --frames 5 --quiet >out 2>&1 &&
    same path1 path2
report $? "frames rendered by 4 processes" "$(cat out different)"
if command -v ffmpeg >/dev/null; then
    "$program" render alone -o film1.gif --path orbit --frames 5 --quiet >out 2>&1 && on 2 "$program" render alone -o film2.gif --path orbit --frames 5 --quiet >out 2>&1 &&
        cmp film1.gif film2.gif
    report $? "a film by 2 processes" "$(cat out)"
else
    skip "a film" "ffmpeg is not installed"
fi
"$program" make-scene district -o large --views 6 --points 1000 --samples 1 --gaussians 200000 --quiet >out 2>&1
echo '{"origin": [-30, -50, 30], "target": [10, 10, 0], "up": [0, 0, 1], "fov_x_deg": 75, "width": 160, "height": 90}' >roofs.json
below() { # WHERE COMMAND...: all of the scene does not fit
    where=$1
    shift
    "$@" render large/gaussians.ply --memory 190M --camera roofs.json --format exr -o "$where" --quiet >out 2>&1
}
below cells1 "$program"
report $? "a picture by cells in one process" "$(cat out)"
for count in 2 3; do
    below cells$count on $count "$program" && "$program" compare cells$count/roofs.exr cells1/roofs.exr >out 2>&1 && awk '/PSNR/ && $2 >= 90 { good = 1 } END { exit !good }' out
    report $? "a picture by cells that $count processes share" "$(cat out)"
done
"$program" render large/gaussians.ply --memory 190M --data large --path orbit --size 64x36 --frames 2 -o orbit1 --quiet >out 2>&1 &&
    on 2 "$program" render large/gaussians.ply --memory 190M --data large --path orbit --size 64x36 --frames 2 -o orbit2 --quiet >out 2>&1 && same orbit1 orbit2
report $? "as many pictures by cells as processes: the same bytes" "$(cat out different)"
on 2 "$program" render large/gaussians.ply --memory 1M --camera roofs.json -o cells0 >out 2>err
code=$?
[ $code = 5 ] && [ "$(errors)" = 1 ] && [ ! -e cells0/roofs.png ]
report $? "too little memory for shares is told once" "code $code: $(cat out err)"
on 2 "$program" render alone -o nothing --camera no.json >out 2>err
code=$?
[ $code = 4 ] && [ "$(errors)" = 1 ]
report $? "a failure to render is told once" "code $code: $(cat out err)"

# ---- studies: of sixteen trainings, so by one of the two MPIs
if [ "$mpi" = openmpi ] || ! command -v mpirun.openmpi >/dev/null; then
    "$program" study anchors data -o study1 --iterations 20 --seeds 1 --quiet >out 2>&1 && on 2 "$program" study anchors data -o study2 --iterations 20 --seeds 1 --quiet >out 2>&1 &&
        (cd study1 && find runs -name model.gbt | sort | xargs sha256sum) >one && (cd study2 && find runs -name model.gbt | sort | xargs sha256sum) >two && [ -s one ] && cmp one two &&
        [ -s study2/anchors.json ]
    report $? "a study by 2 processes" "$(cat out; diff one two)"
fi

# ---- commands that do not share their work
on 2 "$program" info run2/model.gbt >out 2>&1 && [ "$(grep -c '^  size ' out)" = 1 ]
report $? "info is told once" "$(cat out)"
on 2 "$program" export run2 -o two.ply >out 2>err && "$program" export run2 -o one.ply >out1 2>&1 && cmp one.ply two.ply && [ "$(grep -c '^two.ply: ' out)" = 1 ]
report $? "an export is written once" "$(cat out err)"
on 2 "$program" export nothing -o two.ply >out 2>err
code=$?
[ $code = 4 ] && [ "$(errors)" = 1 ]
report $? "a failure to export is told once" "code $code: $(cat out err)"
finish
