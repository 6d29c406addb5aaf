#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
# tests/mutate/mutate.py -- changes single places of src/, and sees whether the tests of their room notice.
"""usage: mutate.py [--count N] [--seed S] [--begin K] [--chosen] [--check] [--tree DIR] [FILE...]

Each mutant is one change of one line, in a copy of the tree under build/mutate: another comparison or arithmetic operator, another constant,
a condition turned round, a statement left out. The tests of the file's room are built and run with it, the quickest first: a failed test, or one
that takes much longer than before, kills it; where the pictures' bits depend on a room, golden_avx2 comes last.
--count draws so many at random from the files (default 20 from all of src/), those that do not compile not counted, from the K-th on; --chosen takes those of
chosen.txt, with the tests that are named there; --check only sees whether each of them can still be made; --tree puts the copy elsewhere. Prints one line for each, and totals; exit code 1 when one survives.
"""
import argparse, glob, os, random, re, resource, shutil, signal, subprocess, sys

here = os.path.dirname(os.path.abspath(__file__))
top = os.path.dirname(os.path.dirname(here))
tree = build = None  # the copy, and its build folder
jobs = os.environ.get("GBT_JOBS") or str(len(os.sched_getaffinity(0)))
# Rooms without tests of their own, and rooms whose faults other tests see better.
tests_of = {"base": ["base", "image"], "data": ["data", "fuzz", "cells", "render"], "shim": ["base", "image"], "run": ["train", "render"], "eval": ["eval", "train"], "command": ["command", "cli", "render", "bake"],
            "library": ["library", "train"], "render": ["render", "command"]}
golden_rooms = "base image bvh gb anchor trace raster frame growth train run render".split()
slow_seconds = 60  # tests that take longer than this unchanged are left out

swaps = [(" < ", " <= "), (" <= ", " < "), (" > ", " >= "), (" >= ", " > "), (" == ", " != "), (" != ", " == "), (" + ", " - "), (" - ", " + "),
         (" * ", " / "), (" && ", " || "), (" || ", " && "), (" += ", " -= ")]


def run(command, limit=None):
    """True, or False after a failure or beyond the limit: seconds of one process on a core, or thirty times as many by the clock."""
    def bound():
        if limit is not None:
            resource.setrlimit(resource.RLIMIT_CPU, (int(limit), int(limit)))
    nothing = subprocess.DEVNULL
    child = subprocess.Popen(command, cwd=tree, stdout=nothing, stderr=nothing, stdin=nothing, preexec_fn=bound, start_new_session=True)
    try:
        return child.wait(30 * limit if limit else None) == 0
    except subprocess.TimeoutExpired:
        return False
    finally:  # what the test started, too
        try:
            os.killpg(child.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        child.wait()


def copy_tree():
    """Only what changed is written, so that a copy that was built stays built."""
    names = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=top, capture_output=True, check=True).stdout
    for name in names.decode().split("\0"):
        source, target = os.path.join(top, name), os.path.join(tree, name)
        if not name or not os.path.isfile(source):
            continue
        if os.path.isfile(target) and open(source, "rb").read() == open(target, "rb").read():
            continue
        os.makedirs(os.path.dirname(target), exist_ok=True)
        shutil.copy(source, target)


def code_only(text):
    """Comments, texts and preprocessor lines blanked out, every character at its place."""
    blank = lambda m: re.sub(r"[^\n]", " ", m.group())
    text = re.sub(r'/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', blank, text, flags=re.S)
    return re.sub(r"^#.*(?:\\\n.*)*$", blank, text, flags=re.M)


def mutants_of(name):
    """(file, line, old line, new line) of every change."""
    text = open(os.path.join(top, name)).read()
    found, depth = [], 0
    for number, (line, code) in enumerate(zip(text.split("\n"), code_only(text).split("\n")), 1):
        inside, depth = depth > 0, depth + code.count("{") - code.count("}")
        if not inside or re.search("log_|text_|printf|_fail", code):
            continue
        for old, new in swaps:
            for m in re.finditer(re.escape(old), code):
                found.append((name, number, line, line[: m.start()] + new + line[m.end():]))
        for m in re.finditer(r"(?<![\w.\[])(\d+\.\d+f?|\d+)(?![\w.\]])", code):
            digits = m.group().rstrip("f")
            new = str(int(digits) + 1) if digits.isdigit() else repr(float(digits) * 1.5 + (0.5 if float(digits) == 0 else 0))
            found.append((name, number, line, line[: m.start()] + new + m.group()[len(digits):] + line[m.end():]))
        m = re.match(r"(\s*(?:\} else )?if )\((.*)\)( \{)?$", code)
        if m:
            found.append((name, number, line, line[: m.end(1)] + "(!(" + line[m.start(2): m.end(2)] + "))" + (m.group(3) or "")))
        if re.match(r"\s+[\w.>\[\]*-]+(?: [-+*/|&]?= .*|\(.*\)|\+\+|--);$", code) and not re.match(r"\s+(return|goto|mem_free|free|close|const|\w+_free)\b", code):
            found.append((name, number, line, re.match(r"\s*", line).group() + ";"))
    return found


def tests_in(folders):
    """[(name, program)] of the tests in these folders of tests/; ctest itself says nothing of programs that are not built yet."""
    found = []
    for folder in folders:
        for path in glob.glob(os.path.join(build, "tests", folder, "CTestTestfile.cmake")):
            found += [(name, os.path.basename(program)) for name, program in re.findall(r'add_test\(\[=\[(\w+)\]=\] "([^"]+)"', open(path).read())]
    return found


def tests_for(room):
    return tests_in(tests_of.get(room, [room])) + ([("golden_avx2", "bash")] if room in golden_rooms else [])


known_seconds = {}  # of processor time


def unchanged(tests, longest):
    """Builds and times them without a change; those that pass and do not take longer than that, the quickest first."""
    fresh = [t for t in tests if t[0] not in known_seconds]
    targets = sorted({p for _, p in fresh if p.startswith("test_")})
    if any(not p.startswith("test_") for _, p in fresh):  # scripts, and programs that run gbtrace
        targets += ["gbtrace", "faults_shim", "malformed"]
    if fresh and not run(["cmake", "--build", build, "-j", jobs, "--target", *targets]):
        sys.exit("mutate: the unchanged tree does not build: " + " ".join(targets))
    for name, _ in fresh:
        begin = os.times()
        passed = run(["ctest", "--test-dir", build, "-R", "^%s$" % name])
        end = os.times()
        known_seconds[name] = end[2] + end[3] - begin[2] - begin[3] if passed else None
        if not passed:
            print("(%s fails unchanged and is left out)" % name)
    fine = [t for t in tests if known_seconds[t[0]] is not None and known_seconds[t[0]] < longest]
    return sorted(fine, key=lambda t: known_seconds[t[0]])


def judge(name, text, tests):
    """Who kills the tree with `text` in the place of the file; None: nobody."""
    path = os.path.join(tree, name)
    good = open(path).read()
    try:
        open(path, "w").write(text)
        for test, program in tests:
            target = program if program.startswith("test_") else "gbtrace"
            if not run(["cmake", "--build", build, "-j", jobs, "--target", target]):
                return "the compiler"
            if not run(["ctest", "--test-dir", build, "-R", "^%s$" % test], 5 + 2 * known_seconds[test]):
                return test
    finally:
        open(path, "w").write(good)
    return None


def chosen(files):
    """(file, line, old, new, names of tests) of chosen.txt; every old text must be in its file."""
    for row in open(os.path.join(here, "chosen.txt")):
        if row.startswith("#") or not row.strip():
            continue
        name, names, old, new = (part.strip() for part in row.split("|" if "||" not in row else " | "))
        if files and name not in files:
            continue
        text = open(os.path.join(top, name)).read()
        if old not in text:
            sys.exit("mutate: chosen.txt: %s: no \"%s\"" % (name, old))
        yield name, text[: text.index(old)].count("\n") + 1, old, new, names.split()


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("\n")[0][7:])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--begin", type=int, default=0)
    parser.add_argument("--chosen", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--tree", default=os.path.join(top, "build", "mutate"))
    parser.add_argument("files", nargs="*")
    a = parser.parse_args()
    if a.check:
        print("%d changes can be made" % len(list(chosen([]))))
        return 0
    global tree, build
    tree = os.path.abspath(a.tree)
    build = os.path.join(tree, "build", "release")
    copy_tree()
    if not run(["cmake", "--preset", "release"]):
        sys.exit("mutate: cmake --preset release failed in " + tree)
    if a.chosen:
        every = tests_in(["*"])
        work = [(m, [t for t in every if t[0] in m[4]]) for m in chosen(a.files)]
        for m, tests in work:
            if len(tests) != len(m[4]):
                sys.exit("mutate: chosen.txt: %s: no such tests: %s" % (m[0], " ".join(sorted(set(m[4]) - {t[0] for t in tests}))))
    else:
        names = a.files or sorted(subprocess.run(["git", "ls-files", "src/*.c", "src/*.h"], cwd=top, capture_output=True, text=True, check=True).stdout.split())
        every = [m for name in names for m in mutants_of(name)]
        random.Random(a.seed).shuffle(every)
        work = [(m, tests_for(m[0].split("/")[1])) for m in every[a.begin:]]
    killed = survived = broken = 0
    for m, tests in work:
        if not a.chosen and killed + survived == a.count:
            break
        text = open(os.path.join(top, m[0])).read()
        if a.chosen:
            text = text.replace(m[2], m[3], 1)
        else:
            lines = text.split("\n")
            lines[m[1] - 1] = m[3]
            text = "\n".join(lines)
        tests = unchanged(tests, float("inf") if a.chosen else slow_seconds)
        if not tests:
            print("no tests  %s" % m[0], flush=True)
            broken += a.chosen
            continue
        by = judge(m[0], text, tests)
        if by == "the compiler":
            print("no build  %s:%d: %s" % (m[0], m[1], m[3].strip()), flush=True)
            broken += a.chosen
            continue
        killed, survived = killed + (by is not None), survived + (by is None)
        print("%s  %s:%d: %s -> %s%s" % ("killed  " if by else "SURVIVED", m[0], m[1], m[2].strip(), m[3].strip(), "  (%s)" % by if by else ""), flush=True)
    print("%d mutants, %d killed, %d survived" % (killed + survived, killed, survived))
    return survived + broken > 0


if __name__ == "__main__":
    sys.exit(main())
