#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""tests/pose/false_colmap.py -- stands in the place of colmap: FALSE_COLMAP says what goes wrong, and where.

Copied into a folder that is in PATH, as colmap, beside a folder `five` with a data set; with FALSE_COLMAP=few, and as the smaller of two
models, it hands out that of a folder `three`.
"""
import os, shutil, signal, sqlite3, sys, time

what = os.environ.get("FALSE_COLMAP", "")
verb = sys.argv[1]
given = dict(zip(sys.argv[2::2], sys.argv[3::2]))
work = os.path.dirname(os.path.abspath(__file__))
if "-h" in sys.argv:
    print("  --SiftExtraction.use_gpu arg (=1)\n  --SiftMatching.use_gpu arg (=1)")
    if what != "old":
        print("  --ImageReader.single_camera_per_image arg (=0)\n  --Mapper.ba_global_function_tolerance arg (=0)")
    sys.exit(0)
with open(work + "/calls", "a") as calls:
    calls.write(verb + "\n")
with open(work + "/arguments", "a") as arguments:
    arguments.write(" ".join(sys.argv[1:]) + "\n")
if what == verb + "-fails":
    print("Processed file [1/5]\nERROR: no space left\n")
    sys.exit(1)
if what == verb + "-hangs":
    def stop(*_):
        open(work + "/interrupted", "w").close()
        sys.exit(0)
    signal.signal(signal.SIGINT, stop)
    open(work + "/hanging", "w").close()
    time.sleep(600)
if what == verb + "-dies":
    os.kill(os.getpid(), signal.SIGKILL)
if verb == "feature_extractor":
    if what == "junk":
        open(given["--database_path"], "wb").write(b"no database at all" * 100)
        sys.exit(0)
    base = sqlite3.connect(given["--database_path"])
    base.executescript("CREATE TABLE IF NOT EXISTS images(image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER, prior_tx REAL);"
        "CREATE TABLE IF NOT EXISTS keypoints(image_id INTEGER PRIMARY KEY, rows INTEGER);"
        "CREATE TABLE IF NOT EXISTS two_view_geometries(pair_id INTEGER PRIMARY KEY, rows INTEGER);")
    names = open(given["--image_list_path"]).read().splitlines()
    for i, name in enumerate(names):
        base.execute("INSERT OR IGNORE INTO images(name, camera_id, prior_tx) VALUES (?, 1, ?)", (name, 7.5 if what == "positions" else None))
        base.execute("INSERT OR REPLACE INTO keypoints VALUES ((SELECT image_id FROM images WHERE name = ?), 500)", (name,))
        print("Processed file [%d/%d]" % (i + 1, len(names)))
    base.commit()
elif verb == "exhaustive_matcher":
    base = sqlite3.connect(given["--database_path"])
    base.execute("INSERT OR REPLACE INTO two_view_geometries VALUES (?, 77)", (1 * 2147483647 + 4,))
    base.commit()
    print("Matching block [1/1, 1/1] in 0.1s")
elif verb == "mapper":
    if what == "no-start":
        print("ERROR: failed to create sparse model")
        sys.exit(1)
    models = given["--output_path"]
    for i, scene in enumerate(["three"] if what == "few" else ["three", "five"]):
        shutil.copytree(work + "/../" + scene + "/sparse/0", "%s/%d" % (models, i))
    if what == "garbage":
        open(models + "/0/images.bin", "wb").write(b"garbage that goes on and on" * 9)
    if what == "cut":
        os.truncate(models + "/1/points3D.bin", 100)
    print("Registering image #4 (5)")
