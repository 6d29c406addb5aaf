#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# tests/pose/test_pose.sh -- gbtrace pose with tools that fail: a false colmap or ffmpeg stands first in PATH. What the real
# COLMAP does is in test_known.c. Usage: test_pose.sh PROGRAM
set -u
program=$1
here=$(cd "$(dirname "$0")" && pwd)
. "$here/../cli/report.sh"
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
tools=$PATH # what the program finds
command -v python3 >/dev/null || { skip "all" "python3 is not installed"; finish; }

# says NAME CODE PATTERN ARGUMENTS...: exit code; one line of error that matches, or none for code 0.
says() {
    name=$1
    code=$2
    pattern=$3
    shift 3
    PATH=$tools "$program" "$@" >out 2>err </dev/null
    got=$?
    wanted=1
    [ "$code" = 0 ] && wanted=0
    [ "$got" = "$code" ] && [ "$(grep -c '^error: ' err)" = "$wanted" ] && cat out err | grep -q -e "$pattern"
    report $? "$name" "  wanted $code with $pattern
  got    $got: $(head -c 2000 err) $(head -c 1000 out)"
}

# ---- photos, and models that the false colmap hands out
"$program" make-scene tabletop -o five --width 80 --height 64 --views 5 --samples 1 --points 200 --quiet >out 2>err
"$program" make-scene tabletop -o three --width 80 --height 64 --views 3 --samples 1 --points 100 --quiet >>out 2>>err
report $? "scenes" "$(cat out err)"
mkdir "my photos" && cp five/images/*.png "my photos/"

says "no photos" 3 "^error: .*three/sparse: 0 photos (wanted 3 or more, PNG or JPEG)" pose three/sparse -o a
says "nothing there" 4 "^error: nothing: no such file or folder" pose nothing -o a
says "frames of photos" 2 "^error: --frames: only for a film (my photos is a folder of photos)" pose "my photos" -o a --frames 50
says "photos and data in one folder" 2 "^error: my photos: the photos are in the folder itself" pose "my photos" -o "my photos"
says "a folder that holds another data set" 2 "^error: three/sparse: already exists (choose another folder)" pose "my photos" -o three
[ ! -e three/colmap ] && [ ! -e a ]
report $? "and nothing was made" "$(ls three)"
says "train names the command" 3 "^error: my photos: photos without camera poses (find them with: gbtrace pose 'my photos' -o DATA)" train "my photos" -o run
touch film.mp4
says "and for a film" 3 "^error: film.mp4: a film without camera poses (find them with: gbtrace pose film.mp4 -o DATA)" train film.mp4 -o run

mkdir phone && touch phone/IMG_1.HEIC phone/IMG_2.HEIC
says "photos of a phone that are not read" 3 "^warning: left out: 2 photos in formats that are not read, IMG_[12].HEIC for one: convert them" pose phone -o a
says "train, of the same photos" 3 "^error: phone: photos without camera poses" train phone -o run

# ---- no tools
mkdir none
tools=$work/none
says "no colmap" 4 "^error: colmap: this program is needed, but not installed (Debian, Ubuntu: sudo apt-get install colmap)" pose "my photos" -o a
tools=$work/tools:$PATH

# ---- a false colmap: FALSE_COLMAP says what goes wrong, and where (false_colmap.py)
mkdir tools
cp "$here/false_colmap.py" tools/colmap
chmod +x tools/colmap

export FALSE_COLMAP=feature_extractor-fails
says "features fail: what it said, and the log" 4 "^error: colmap: failed (code 1): ERROR: no space left (log: fails/colmap/features.log)" pose "my photos" -o fails
grep -q 'no space' fails/colmap/features.log && [ ! -e fails/sparse ]
report $? "the log has it, and there is no model" "$(ls -R fails)"
printf '#!/bin/sh\nexec env --ignore-signal=CHLD "%s" "$@"\n' "$program" >ignoring && chmod +x ignoring
usual=$program
program=$work/ignoring
says "features fail, and who started us ignores how children end" 4 "^error: colmap: failed (code 1): ERROR: no space left" pose "my photos" -o ignored
program=$usual
[ ! -e ignored/colmap/features.done ]
report $? "and are not done" "$(ls -R ignored)"
export FALSE_COLMAP=mapper-fails
says "mapping fails" 4 "^error: colmap: failed (code 1): ERROR: no space left" pose "my photos" -o fails
export FALSE_COLMAP=mapper-dies
says "mapping is killed" 4 "^error: colmap: ended by signal 9, as when memory runs out (log: fails/colmap/mapping.log)" pose "my photos" -o fails
export FALSE_COLMAP=no-start
says "no two photos to begin with" 3 "^error: .*: no photo could be registered: too few matches" pose "my photos" -o nostart
export FALSE_COLMAP=garbage
says "a model that is none" 3 "^error: garbage/colmap/models/0/images.bin" pose "my photos" -o garbage
[ ! -e garbage/sparse ]
report $? "gives no data set" "$(ls garbage)"
export FALSE_COLMAP=cut
says "a model that is cut" 3 "^error: cut/colmap/models/1/points3D.bin" pose "my photos" -o cut
export FALSE_COLMAP=
says "is made again" 0 "^cut: 5 of 5 photos registered" pose "my photos" -o cut
export FALSE_COLMAP=junk
says "a database that is none" 3 "^error: junk/colmap/database.db: not a database of COLMAP" pose "my photos" -o junk
export FALSE_COLMAP=
says "after failures it goes on, and takes the larger of two models" 0 "^fails: 5 of 5 photos registered" pose "my photos" -o fails
: >tools/calls
says "once more it only reports" 0 "^fails: 5 of 5 photos registered" pose "my photos" -o fails
[ ! -s tools/calls ] && "$program" info fails >out 2>&1 && grep -q '30 found\|5 found' out
report $? "without COLMAP, and info reads it" "$(cat tools/calls out)"
says "other options in the same folder" 2 "^error: fails: was begun with other photos or options" pose "my photos" -o fails --matcher sequential
mkdir swapped && cp "my photos"/*.png swapped/
says "photos of a folder" 0 "^replaced: 5 of 5 photos registered" pose swapped -o replaced
cp swapped/0001.png swapped/0002.png
says "another photo of the same name" 2 "^error: replaced: was begun with other photos or options" pose swapped -o replaced
sed -i 's/^\(photo = .*\) [0-9]* [0-9]*$/\1/' replaced/colmap/settings
says "a folder that says names alone" 0 "^replaced: 5 of 5 photos registered" pose swapped -o replaced
export FALSE_COLMAP=few
says "some photos are not registered" 0 "^few: 3 of 5 photos registered" pose "my photos" -o few
grep -q '^  without   0003.png: few matches: 77 with 1 registered photos' out && grep -q '^  without   0004.png: matches no other photo (500 features)' out
report $? "and why" "$(cat out)"
"$program" train few -o few_run --iterations 2 --quiet >out 2>err
report $? "train reads it" "$(cat err)"

# ---- a photo whose header is whole, and whose pixels are not
mkdir spoiled && cp "my photos"/*.png spoiled/
printf 'spoiled' | dd of=spoiled/0002.png bs=1 seek=$(($(wc -c <spoiled/0002.png) / 2)) conv=notrunc 2>dd_said
export FALSE_COLMAP=few
says "a damaged photo is left out" 0 "^warning: left out: .*spoiled/0002.png@.*: PNG chunk is damaged" pose spoiled -o whole
grep -q 'of 4 photos registered' out && [ -e whole/images/0001.png ] && [ ! -e whole/images/0002.png ]
report $? "and not in the data set" "$(cat out err)"

# ---- a signal is passed on, and the next run goes on where the last one was
export FALSE_COLMAP=exhaustive_matcher-hangs
PATH=$tools "$program" pose "my photos" -o stopped >out_stopped 2>err_stopped </dev/null &
gbtrace=$!
while [ ! -e tools/hanging ] && kill -0 $gbtrace 2>/dev/null; do sleep 0.1; done
says "two in one folder" 4 "^error: stopped: another process works in it" pose "my photos" -o stopped
kill -INT $gbtrace
wait $gbtrace
[ $? = 130 ] && [ -e tools/interrupted ] && [ ! -e stopped/sparse ]
report $? "SIGINT reaches colmap; 130" "$(cat err_stopped)"
export FALSE_COLMAP=
: >tools/calls
says "the same command goes on" 0 "^stopped: 5 of 5 photos registered" pose "my photos" -o stopped
[ "$(tr '\n' ' ' <tools/calls)" = "exhaustive_matcher mapper " ]
report $? "finished stages are skipped" "$(cat tools/calls)"
rm -f tools/hanging
export FALSE_COLMAP=mapper-hangs
PATH=$tools "$program" pose "my photos" -o killed >out_killed 2>err_killed </dev/null &
gbtrace=$!
while [ ! -e tools/hanging ] && kill -0 $gbtrace 2>/dev/null; do sleep 0.1; done
kill -KILL $gbtrace
wait $gbtrace 2>/dev/null
export FALSE_COLMAP=
says "after a kill too" 0 "^killed: 5 of 5 photos registered" pose "my photos" -o killed

# ---- photos that are in DATA/images already
mkdir placed && cp -R "my photos" placed/images && PATH=$tools "$program" pose placed -o placed >out 2>err && grep -q '^placed: 5 of 5' out
report $? "in place" "$(cat out err)"

# ---- data within the folder of the photos: links to them are not photos more
mkdir holding && cp "my photos"/*.png holding/ && PATH=$tools "$program" pose holding -o holding/data >out 2>err && says "the data in the photos' own folder" 0 "^holding/data: 5 of 5" pose holding -o holding/data

# ---- masks in the photos' own folder
mkdir masked && cp "my photos"/*.png masked/ && cp -R "my photos" masked/masks
says "masks are no photos" 0 "^masked_data: 5 of 5" pose masked -o masked_data
[ "$(grep -c '^warning: .*masked/masks: not used to find poses (copy it to masked_data/masks' err)" = 1 ] && [ ! -e masked_data/images/masks ]
report $? "and where they belong" "$(cat err)"

# ---- colmap as a script around the program: a signal reaches what it started
mkdir wrapped && printf '#!/bin/sh\n"%s" "$@"\nexit $?\n' "$PWD/tools/colmap" >wrapped/colmap && chmod +x wrapped/colmap && rm -f tools/hanging tools/interrupted
export FALSE_COLMAP=mapper-hangs
PATH=$work/wrapped:$tools "$program" pose "my photos" -o wrapping >out 2>err </dev/null &
gbtrace=$!
while [ ! -e tools/hanging ] && kill -0 $gbtrace 2>/dev/null; do sleep 0.1; done
kill -INT $gbtrace
wait $gbtrace
[ $? = 130 ] && [ -e tools/interrupted ]
report $? "SIGINT reaches a program in a script" "$(cat err)"
export FALSE_COLMAP=
rm -f tools/hanging

# ---- two cameras: progress goes over both, and a stage that is done again keeps the cameras of the database
"$program" make-scene tabletop -o other --width 96 --height 72 --views 3 --samples 1 --points 50 --quiet >out 2>err
mkdir both && cp five/images/*.png both/ && for file in other/images/*.png; do cp "$file" "both/other_${file##*/}"; done
says "photos of two cameras" 0 '"stage": "features", "done": 8, "total": 8' pose both -o two --progress json
grep -q 'features: 8 photos, 2 cameras by size and EXIF' err && [ "$(wc -l <two/colmap/camera_2.txt)" = 3 ]
report $? "and which they are" "$(cat err; ls two/colmap)"
rm -r two/sparse two/colmap/features.done two/colmap/m*.done tools/arguments
says "features once more" 0 '5 of 8 photos registered' pose both -o two
grep -q 'existing_camera_id 1' tools/arguments
report $? "with the camera that they had" "$(cat tools/arguments)"

# ---- what colmap is asked for
rm -f tools/arguments
says "five photos of one camera" 0 "^one: 5 of 5 photos registered" pose "my photos" -o one
grep -q '^feature_extractor .*--ImageReader.camera_model SIMPLE_RADIAL --ImageReader.single_camera 1 ' tools/arguments
report $? "share a camera of few parameters" "$(cat tools/arguments)"
mkdir twenty && for i in $(seq -w 0 19); do cp five/images/0000.png twenty/00$i.png; done
rm -f tools/arguments
says "twenty photos of one camera" 0 "^one_of_twenty: 5 of 20 photos registered" pose twenty -o one_of_twenty
grep -q '^feature_extractor .*--ImageReader.camera_model OPENCV --ImageReader.single_camera 1 ' tools/arguments
report $? "share one of all parameters" "$(cat tools/arguments)"
rm -f tools/arguments
says "photos near each other, without positions" 3 "^error: .*my photos: no photo has a position from GPS in its EXIF" pose "my photos" -o nowhere --matcher spatial
export FALSE_COLMAP=positions
says "with positions" 0 "^near: 5 of 5 photos registered" pose "my photos" -o near --matcher spatial
[ "$(grep -c '^spatial_matcher ' tools/arguments)" = 1 ]
report $? "are matched by them" "$(cat tools/arguments)"

# ---- photos of one size, of two focal lengths
mkdir lenses && python3 - "$here/../fuzz/seeds/photo/turned" <<'END'
import struct, sys
seed = open(sys.argv[1], "rb").read() # a JPEG of 8 x 8 pixels; here 64 x 64, each block of them the same 6 bits
size = seed.index(b"\xff\xc0") + 5
head = seed[seed.index(b"\xff\xdb"):size] + struct.pack(">HH", 64, 64) + seed[size + 4:]
scan = head.index(b"\xff\xda") + 2
head = head[:scan + struct.unpack(">H", head[scan:scan + 2])[0]]
for i, focal in enumerate([24, 35, 24]):
    exif = b"Exif\0\0MM\0*" + struct.pack(">IHHHIII", 8, 1, 0x8769, 4, 1, 26, 0) + struct.pack(">HHHIIIII", 1, 0x920a, 5, 1, 44, 0, focal, 1)
    open("lenses/%d.jpg" % i, "wb").write(b"\xff\xd8\xff\xe1" + struct.pack(">H", 2 + len(exif)) + exif + head + b"\x28\xa2\x8a" * 16 + b"\xff\xd9")
END
export FALSE_COLMAP=mapper-fails
says "two focal lengths" 4 "features: 3 photos, 2 cameras by size and EXIF" pose lenses -o lensed
[ "$(cat lensed/colmap/camera_1.txt)" = "$(printf '0.jpg\n2.jpg')" ] && [ "$(cat lensed/colmap/camera_2.txt)" = 1.jpg ]
report $? "and which photo has which" "$(cat lensed/colmap/camera_*.txt)"
export FALSE_COLMAP=

# ---- more cameras than eight, and options that an older colmap lacks
mkdir many && python3 - <<'END'
import struct, zlib
def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
for width in range(64, 73):
    rows = (b"\0" + bytes(range(width))) * 64
    open("many/%04d.png" % (width - 64), "wb").write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, 64, 8, 0, 0, 0, 0)) +
        chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
END
for colmap in old new; do
    rm -f tools/arguments
    export FALSE_COLMAP=$colmap
    says "photos of nine cameras, $colmap" 0 "features: 9 photos, SIMPLE_RADIAL, a camera for each" pose many -o "many_$colmap"
    wanted=2
    [ $colmap = old ] && wanted=0
    [ "$(grep -c -e '^feature_extractor.* --ImageReader.single_camera_per_image 1' -e '^mapper.* --Mapper.ba_global_function_tolerance' tools/arguments)" = $wanted ]
    report $? "with $wanted options that not all have" "$(cat tools/arguments)"
done
export FALSE_COLMAP=

# ---- a film
printf '#!/bin/sh\necho "Invalid data found when processing input" >&2\nexit 1\n' >tools/ffmpeg
chmod +x tools/ffmpeg
says "ffmpeg fails" 4 "^error: ffmpeg: failed (code 1): Invalid data found when processing input (log: film/colmap/measure.log)" pose film.mp4 -o film
printf '#!/bin/sh\necho "P5 what is this"\n' >tools/ffmpeg
says "ffmpeg gives something else" 4 "^error: ffmpeg: unexpected output" pose film.mp4 -o film
[ ! -e film/images ]
report $? "no frames are left" "$(ls -R film)"
cat >tools/ffmpeg <<'END'
#!/usr/bin/env python3
import sys
if "-progress" in sys.argv:
    sys.exit("no room for frames")
sys.stderr.write("  Duration: N/A, bitrate: N/A\n  Stream #0:0: Video: mjpeg, gray, 64x48, 2 fps, 2 tbr\n")
sys.stderr.flush()
for i in range(100):
    sys.stdout.buffer.write(b"P5\n64 48\n255\n" + bytes((i + k) % 256 for k in range(64 * 48)))
END
PATH=$tools "$program" pose film.mp4 -o lasting --progress json >out 2>err
[ $? = 4 ] && grep -q ': 100 of 100 frames chosen, ' err && [ "$(grep -c '"stage": "frames, measuring"' err)" -lt 50 ]
report $? "a film that does not say how long it is: three a second all the same" "$(cat err)"
echo more >>film.mp4
says "another film of the same name" 2 "^error: lasting: was begun with other photos or options" pose film.mp4 -o lasting
rm tools/ffmpeg
if command -v ffmpeg >/dev/null; then
    ffmpeg -hide_banner -loglevel error -y -f lavfi -i testsrc=size=320x240:rate=25:duration=4 "a film.mp4" </dev/null
    says "a film of a test picture" 0 "^film 100%: 5 of 20 photos registered" pose "a film.mp4" -o "film 100%" --frames 20
    [ "$(ls "film 100%/images" | wc -l)" = 20 ] && [ -e "film 100%/images/frame_00020.jpg" ]
    report $? "20 of its frames" "$(ls -R "film 100%" | head -50; cat err)"
    rm tools/calls
    says "frames that follow each other" 0 "^seq: 5 of 20 photos registered" pose "a film.mp4" -o seq --frames 20 --matcher sequential
    grep -q '^sequential_matcher' tools/calls && grep -q '^matches_importer' tools/calls && [ "$(wc -l <seq/colmap/key_frames.txt)" = 45 ]
    report $? "and key frames with each other" "$(cat tools/calls; wc -l seq/colmap/key_frames.txt)"
else
    skip "a film" "ffmpeg is not installed"
fi
finish
