#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/package/test_python.sh -- the Python package in an environment of its own, around the library that was built; then its tests and its example.
# Usage: test_python.sh SOURCE BUILD. Needs python3 with venv, and PyPI.
set -u
source=$1
build=$2
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
. "$source/tests/package/checks.sh"
python=$work/env/bin/python
if python3 -m pip --python python3 --version >/dev/null 2>&1 && python3 -m venv --without-pip "$work/env" >/dev/null 2>&1; then
    pip="python3 -m pip --python $python" # copying pip into every environment takes longer than all the rest
elif python3 -m venv "$work/env" >/dev/null 2>&1; then
    pip="$python -m pip"
else
    give_up "python3 -m venv does not work here (Debian: python3-venv)"
fi
$pip -q install --no-compile --disable-pip-version-check --retries 1 --timeout 15 'scikit-build-core>=0.10' numpy >"$work/pip.log" 2>&1 ||
    give_up "no NumPy or scikit-build-core from PyPI: $(tail -n 1 "$work/pip.log")"
command -v ninja >/dev/null 2>&1 || give_up "ninja is not there"
library=$(find "$build" -maxdepth 1 -type f -name 'libgbtrace.so.*')

check "pip install ." $pip install --no-compile --disable-pip-version-check --no-build-isolation --no-deps "$source" \
    --config-settings=build-dir="$work/wheel" --config-settings=cmake.define.GBT_WHEEL_LIBRARY="$library"
check "the wheel is for every Python 3" grep -q '^Tag: py3-none-linux' "$work"/env/lib/python3*/site-packages/gbtrace-*.dist-info/WHEEL
# The wheel of a release: without the library, for every machine; GBTRACE_LIBRARY stands for the Debian package's.
check "the wheel of a release" $pip -q wheel --no-deps --disable-pip-version-check --no-build-isolation --config-settings=wheel.cmake=false --wheel-dir "$work/pure" "$source"
check "is for every machine" test -f "$work"/pure/gbtrace-*-py3-none-any.whl
check "and loads the system's library" env GBTRACE_LIBRARY="$library" PYTHONPATH="$(echo "$work"/pure/*.whl)" "$python" -c 'import gbtrace; gbtrace.version()'
check "a scene" "$build/gbtrace" make-scene tabletop -o "$work/data" --width 64 --height 48 --views 12 --points 300 --samples 4
check "a model" "$build/gbtrace" train "$work/data" -o "$work/run" --iterations 150
mkdir "$work/scratch"
GBT_MODEL=$work/run GBT_DATA=$work/data GBT_INCLUDE=$source/include GBT_SCRATCH=$work/scratch
export GBT_MODEL GBT_DATA GBT_INCLUDE GBT_SCRATCH
check "python/tests" "$python" "$source/python/tests/test_gbtrace.py"
check "examples/python/pose.py" sh -c "'$python' '$source/examples/python/pose.py' '$work/run' >'$work/pose.txt'"
check "examples/python/query.py" sh -c "'$python' '$source/examples/python/query.py' '$work/run' >'$work/query.txt'"
check "the query is answered" grep -q 'anchors, [1-9][0-9]* along the ray; the first is' "$work/query.txt"
check "the pose is found" awk '/^before/ { d = $2; a = $4 } /^after/ { ok = $2 < 0.01 * d && $4 < 0.01 * a } END { exit !ok }' "$work/pose.txt"
report "$work/pose.txt"
