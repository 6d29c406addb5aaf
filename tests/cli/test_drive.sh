#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/cli/test_drive.sh -- what programs that start gbtrace read: JSON progress, TensorBoard events, the doctor, a run's own configuration.
# Usage: test_drive.sh PROGRAM BUILD
set -u
program=$1
build=$2
. "$(dirname "$0")/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1

# as_json FILE SCRIPT: the lines as a list of objects, and a Python condition on it.
as_json() {
    python3 -c 'import json, sys; e = [json.loads(line) for line in open(sys.argv[1])]; sys.exit(0 if eval(sys.argv[2]) else 1)' "$1" "$2"
}
command -v python3 >/dev/null || { skip "all" "python3 is not installed"; finish; }

# ---- a run, told as JSON
"$program" make-scene tabletop -o made --width 32 --height 24 --views 9 --samples 1 --points 50 >out 2>&1
report $? "a scene" "$(cat out)"
"$program" train -s made -m run --iterations 40 --eval-split every=3 --tensorboard --progress json >out 2>err
[ $? = 0 ] && [ ! -s out ] &&
    as_json err 'e[0] == {"event": "start", "schema": 1, "command": "train", "version": e[0]["version"]} and e[-1] == {"event": "done", "exit": 0}'
report $? "every line is JSON, the first and the last say so" "$(cat err)"
as_json err 'any(x["event"] == "progress" and x["stage"] == "train" and x["done"] == x["total"] == 40 and x["fraction"] == 1 and x["seconds_left"] == 0 and x["psnr"] > 5 and x["anchors"] > 0 for x in e)'
report $? "progress of training" "$(cat err)"
as_json err 'any(x["event"] == "progress" and x["stage"] == "score" and x["done"] == x["total"] == 3 for x in e) and any(x["event"] == "message" and x["text"].startswith("3 held-out views: PSNR ") for x in e)'
report $? "progress of scoring" "$(cat err)"
GBTRACE_PROGRESS=json "$program" render run --split all 2>err && [ "$(ls run/renders/all | wc -l)" = 9 ] && as_json err 'any(x.get("stage") == "render" and x["done"] == 9 for x in e)'
report $? "progress of rendering, into the run's own folder, by the environment" "$(cat err)"
"$program" export run plain.ply --refine 3 --progress=json >out 2>err && as_json err '{"bake", "refine"} <= {x.get("stage") for x in e}'
report $? "progress of an export" "$(cat err)"
"$program" eval "no\"thing" --progress json 2>err
[ $? = 4 ] && as_json err 'e[-1] == {"event": "failed", "exit": 4, "error": "no\"thing: not a run folder (wanted what gbtrace train wrote)"}'
report $? "a failure" "$(cat err)"
"$program" eval --progress json --prest fast 2>err
[ $? = 2 ] && [ "$(cat err)" = "error: --prest: unknown option (did you mean --preset?)" ]
report $? "a command line that was not understood is told in plain words" "$(cat err)"
"$program" train made -o paced --pace 1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,2 --eval-split every=9 --progress json 2>err && as_json err 'any(x.get("stage") == "train" and x["done"] == x["total"] == 21 for x in e)'
report $? "the total of a run with a pace" "$(cat err)"
as_json err '[x["total"] for x in e if x.get("stage") == "score" and x["done"] == 1 and x["seconds"] > 1e-4] == [1]' && "$program" render paced --progress json >out 2>err &&
    as_json err '[x["total"] for x in e if x.get("stage") == "render" and x["done"] == 1 and x["seconds"] > 1e-4] == [1]' && "$program" export paced paced.ply --refine 1 --progress json >out 2>err &&
    as_json err '[x["total"] for x in e if x.get("stage") == "refine" and x["done"] == 1 and x["seconds"] > 1e-4] == [1]'
report $? "the time of a stage is that of its first view or step, too" "$(cat err)"
"$program" train made -o none --pace 1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,2 --iterations 20 2>err
[ $? = 2 ] && [ "$(cat err)" = "error: --iterations: 20, but --pace adds up to 21 (wanted only one of the two)" ]
report $? "a pace and another number of iterations" "$(cat err)"
"$program" eval run --quiet >out 2>err && [ ! -s err ] && [ ! -s out ]
report $? "quiet" "$(cat err)"

# ---- the same run again, from its configuration
"$program" train --config run/config -o again 2>err && cmp run/model.gbt again/model.gbt >>err 2>&1
report $? "RUN/config repeats a run" "$(cat err)"

# ---- the form of its file is a setting, too
"$program" train made -o whole --iterations 20 --stop-at-step 10 --lossless >out 2>&1
grep -q '^lossless = 1$' whole/config && "$program" train -o whole --resume >out 2>&1 && "$program" train --config whole/config -o whole-again >>out 2>&1 &&
    cmp whole/model.gbt whole-again/model.gbt >>out && [ "$(wc -c <whole/model.gbt)" -gt $((2 * $(wc -c <run/model.gbt))) ]
report $? "a lossless run stays so when it is resumed or repeated" "$(cat out whole/config; ls -l whole run)"
"$program" train made -o small --iterations 20 >out 2>&1 && ! grep -q lossless small/config && "$program" train -o small --resume --lossless >out 2>&1 &&
    cmp small/model.gbt whole/model.gbt >>out && ! grep -q 'own settings' out && "$program" train -o small --resume >out 2>&1 && cmp small/model.gbt whole/model.gbt >>out
report $? "a run that is to be lossless from now on" "$(cat out small/config)"

# ---- a run without scores
"$program" train made -o unscored --iterations 20 --stop-at-step 1 >out 2>&1
"$program" report unscored >>out 2>&1
[ $? = 4 ] && tail -n 1 out | grep -q 'no scores yet (gbtrace eval makes them)'
report $? "a report before there are scores" "$(cat out)"

# ---- a terminal: lines are written over, unless it cannot, or is none
on_terminal() { # command
    python3 -c 'import pty, sys; sys.exit(pty.spawn(sys.argv[1:]))' "$@" >seen 2>&1 </dev/null
}
over=$(printf '\r.*step 3 .*\033.K')
set -- "$program" train made -o seen_run --overwrite --iterations 3
TERM=xterm on_terminal "$@" && grep -q "$over" seen
report $? "a line that is written over" "$(cat seen)"
TERM=dumb on_terminal "$@" && grep -q 'step 3 ' seen && ! grep -q "$over" seen && (unset TERM && on_terminal "$@") && grep -q 'step 3 ' seen && ! grep -q "$over" seen
report $? "no such terminal" "$(cat seen)"
TERM=xterm "$@" >seen 2>&1 && grep -q 'step 3 ' seen && ! grep -q "$over" seen
report $? "no terminal" "$(cat seen)"
over=$(printf '\r\033.Kerror: nothing: ')
TERM=xterm on_terminal "$program" eval nothing
grep -q "$over" seen && { TERM=dumb on_terminal "$program" eval nothing; grep -q 'error: nothing: ' seen; } && ! grep -q "$over" seen
report $? "an error is written over progress" "$(cat seen)"

# ---- TensorBoard, read by itself
python=python3
if ! $python -c 'import tensorboard' 2>/dev/null; then
    python=$build/tensorboard-env/bin/python
    "$python" -c 'import tensorboard' 2>/dev/null || # not there, or its installation was cut off
        { rm -rf "$build/tensorboard-env" && python3 -m venv "$build/tensorboard-env" && "$build/tensorboard-env/bin/pip" -q --retries 1 --timeout 10 install tensorboard setuptools; } >out 2>&1
fi
if "$python" -c 'import tensorboard' 2>/dev/null; then
    cat >read.py <<'END'
import csv, sys
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

run, last_step, pictures = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
events = EventAccumulator(run, size_guidance={"images": 0, "scalars": 0})
events.Reload()
rows = list(csv.DictReader(open(run + "/log.csv")))
for column, tag in (("loss", "loss/all"), ("train_psnr", "train/psnr"), ("anchors", "scene/anchors"), ("trace_ms", "ms/trace")):
    got = [(e.step, e.value) for e in events.Scalars(tag)]
    assert [g[0] for g in got] == [int(r["step"]) for r in rows] and got[-1][0] == last_step, (tag, got)
    assert all(abs(g[1] - float(r[column])) <= 1e-3 + 1e-5 * abs(g[1]) for g, r in zip(got, rows)), (tag, got)
assert len(events.Scalars("eval/psnr")) == 1 and events.Scalars("eval/psnr")[0].step == last_step
assert len(events.Tags()["images"]) == pictures, events.Tags()["images"]
for tag in events.Tags()["images"]:
    picture = events.Images(tag)[0]
    assert (picture.width, picture.height) == (32, 24) and picture.encoded_image_string[:4] == b"\x89PNG", tag
END
    "$python" read.py run 40 6 >out 2>&1
    report $? "TensorBoard reads scalars and pictures" "$(cat out)"
    # Stopped, its last record cut, and gone on: every step once, in order.
    "$program" train -s made -o long --iterations 5000 --eval-split every=3 --tensorboard --stop-at-step 2517 >out 2>&1
    [ $? = 130 ] && printf 'cut record' >>long/events.out.tfevents.0.train &&
        "$program" train -s made -o long --resume --tensorboard >>out 2>&1 && "$python" read.py long 5000 6 >>out 2>&1
    report $? "TensorBoard reads a run that was stopped and resumed" "$(cat out)"
    "$program" train -s made -o long --resume --tensorboard >>out 2>&1 && "$python" read.py long 5000 6 >>out 2>&1
    report $? "TensorBoard reads a run that was resumed at its end" "$(cat out)"
else
    skip "TensorBoard" "the package tensorboard cannot be had here"
fi

# ---- files of PyTorch: the command that import names makes what import reads. Stand-ins for torch and safetensors, with the calls it makes.
mkdir -p stubs/safetensors scaffold && : >stubs/safetensors/__init__.py
cat >stubs/torch.py <<'END'
import types

def network(inputs, outputs):
    return {"0.weight": (32, inputs), "0.bias": (32,), "2.weight": (outputs, 32), "2.bias": (outputs,)}

networks = {"opacity_mlp": network(35, 2), "cov_mlp": network(35, 14), "color_mlp": network(35, 6)}

def load(path, map_location):
    open(path).close()
    return networks

def load_script(path, map_location):
    open(path).close()
    return types.SimpleNamespace(state_dict=lambda: networks[path[:-len(".pt")]])

jit = types.SimpleNamespace(load=load_script)
END
cat >stubs/safetensors/torch.py <<'END'
import json, math, struct

def save_file(tensors, path):
    at, header, values = 0, {}, []
    for name, shape in tensors.items():
        count = math.prod(shape)
        header[name] = {"dtype": "F32", "shape": shape, "data_offsets": [at, at + 4 * count]}
        values += [0.01 * (i % 7) for i in range(count)]
        at += 4 * count
    text = json.dumps(header).encode()
    with open(path, "wb") as file:
        file.write(struct.pack("<Q", len(text)) + text + struct.pack(f"<{len(values)}f", *values))
END
{
    printf 'ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n'
    awk 'BEGIN { for (i = 0; i < 6; i++) print "property float f_offset_" i
        for (i = 0; i < 32; i++) print "property float f_anchor_feat_" i
        for (i = 0; i < 6; i++) print "property float scale_" i
        print "end_header"
        for (n = 0; n < 3; n++) for (i = 0; i < 47; i++) printf "%g%s", i * 0.01 + n, i < 46 ? " " : "\n" }'
} >scaffold/point_cloud.ply
for file in opacity_mlp.pt checkpoints.pth; do
    rm -rf imported scaffold/*.pt scaffold/*.pth scaffold/*.safetensors
    : >scaffold/$file
    [ $file = checkpoints.pth ] || : >scaffold/cov_mlp.pt >scaffold/color_mlp.pt
    "$program" import scaffold/$file -o imported >out 2>err
    [ $? = 3 ] && [ "$(wc -l <err)" = 1 ] && grep -q "^error: scaffold/$file: files of PyTorch are not read; run this in its folder, then import the folder: python3 -c \".*\"$" err
    report $? "import of $file says how to convert it" "$(cat err)"
    sed 's/.* folder: python3 -c/python3 -c/' err >command
    "$program" import scaffold -o imported >out 2>err
    [ $? = 4 ] && [ "$(sed 's/.* folder: python3 -c/python3 -c/' err)" = "$(cat command)" ]
    report $? "so does import of its folder" "$(cat err)"
    (cd scaffold && PYTHONPATH=../stubs sh ../command) >out 2>&1 && "$program" import scaffold -o imported >>out 2>&1 && grep -q '^scaffold/point_cloud.ply: 3 anchors with 2 Gaussians each' out
    report $? "and the command for $file does" "$(cat command out)"
done
mkdir -p widths/point_cloud/iteration_7 && cp scaffold/point_cloud.ply scaffold/*.safetensors widths/point_cloud/iteration_7
printf "Namespace(source_path='made', resolution=16)" >widths/cfg_args
"$program" import widths -o at_width >out 2>err && [ ! -s err ] && "$program" info at_width | grep -q '^  config    downscale = 2$'
report $? "a width in cfg_args divides the photos of the data set" "$(cat err out; "$program" info at_width)"
printf "Namespace(source_path='made', images='images_4', resolution=-1)" >widths/cfg_args
"$program" import widths -o at_quarter >out 2>err && "$program" info at_quarter | grep -q '^  config    downscale = 4$'
report $? "and so does images_4" "$(cat err out; "$program" info at_quarter)"
printf "Namespace(source_path='gone', resolution=16)" >widths/cfg_args
"$program" import widths -o unknown_width >out 2>err && [ "$(grep -c '^warning: trained on photos 16 pixels wide, .*: set the downscale when you run gbtrace eval ' err)" = 1 ]
report $? "without the data set it is told" "$(cat err out)"
cp at_width/model.gbt before.gbt && ! "$program" import widths -o at_width >out 2>err && [ "$(cat err)" = "error: at_width: holds a trained run (wanted another folder)" ] && cmp before.gbt at_width/model.gbt >>out
report $? "a run that was imported before stays" "$(cat err out)"

# ---- the doctor
"$program" doctor >out 2>err
code=$?
[ $code -le 1 ] && [ ! -s err ] && [ "$(grep -c -e '^ok ' -e '^warn ' -e '^fail ' out)" = 10 ] && [ "$(grep -c '^ok   \(tracer\|gradients\|speed\|libraries\) ' out)" = 4 ] &&
    grep -q '^\(ok\|warn\) *folder ' out # whether there is room is the machine's
report $? "the doctor" "$(cat err out)"
GBTRACE_THREDS=1 GBTRACE_THREADS=$(($(nproc --all) + 1)) GBT_ISA=plain "$program" doctor nowhere --json >out 2>err
[ $? = 1 ] && python3 -c 'import json, sys
d = json.load(open("out"))
c = {x["name"]: x for x in d["checks"]}
assert d["schema"] == 1 and d["failed"] == sum(x["level"] == "fail" for x in d["checks"]) >= 1
assert c["folder"]["level"] == "fail" and c["folder"]["found"] == "nowhere: no such folder" and c["folder"]["advice"]
assert c["environment"]["level"] == "warn" and "GBTRACE_THREDS" in c["environment"]["advice"] and c["environment"]["found"].startswith("1 variables set options, 1 ")
assert c["threads"]["level"] == "warn" and "GBTRACE_THREADS=" in c["threads"]["advice"]
assert c["processor"]["level"] == "warn" and "GBT_ISA=plain" in c["processor"]["advice"] and c["tracer"]["level"] == c["gradients"]["level"] == "ok"' 2>>err
report $? "the doctor finds what is wrong" "$(cat err out)"
finish
