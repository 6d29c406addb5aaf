#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# bench/ranks.sh -- what a second process is worth: 1 process of 1 thread against 2 of 1 thread each, pinned to cores, at 2 views a step.
# Usage: bench/ranks.sh DATA [PROGRAM] [ITERATIONS] [VIEWS]        (needs two free cores; Open MPI)
set -eu
data=$1
program=${2:-build/release/gbtrace}
iterations=${3:-300}
views=${4:-2}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
set -- train "$data" --views "$views" --iterations "$iterations" --threads 1 --eval-split none --quiet
taskset -c 0 "$program" "$@" -o "$work/one"
mpirun.openmpi -n 2 --bind-to core "$program" "$@" -o "$work/two"
python3 - "$work" "$data" "$views" <<'END'
import json, os, sys
work, data, views = sys.argv[1:]
one, two = (json.load(open(f"{work}/{name}/train.json")) for name in ("one", "two"))
same = open(f"{work}/one/model.gbt", "rb").read() == open(f"{work}/two/model.gbt", "rb").read()
a, b = (run["stage_ms_per_step"]["all"] for run in (one, two))
c = two["communication"]
print(f"{os.path.basename(data.rstrip('/'))}, {views} views a step: {a:.2f} ms with 1 process, {b:.2f} ms with 2: {a / b:.2f} times; "
      f"{c['bytes_per_step'] / 1e6:.2f} MB and {c['ms_per_step']:.2f} ms of rows, {c['waiting_ms_per_step']:.2f} ms of waiting a step; "
      f"models {'are the same' if same else 'DIFFER'}")
END
