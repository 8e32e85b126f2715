#!/usr/bin/env bash
# Tests samples/audio: behind the object, the level falls as much as rays are hidden, and then recovers; errors are reported
# with an exit code and leave no file. With NIF_TEST_MESHES also with the Stanford dragon. Prints "Skipped: ..." and exits with 0
# if OpenAL Soft is not installed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

if ! printf '#include <AL/alext.h>\n' | cc -E - >/dev/null 2>&1; then
  echo 'Skipped: OpenAL Soft is not installed (tools/setup.sh audio)'
  exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failures=0
fail() {
  echo "samples/audio/test.sh: $*" >&2
  failures=$((failures + 1))
}

# The tests must not depend on a user's configuration.
export ALSOFT_CONF=/dev/null ALSOFT_DRIVERS=null
levels=samples/audio/levels.py

# passes ASSET [options of the program]: uses the program built with sanitizers, to find leaks and overruns.
passes() {
  local asset=$1 name
  shift
  name=$scratch/$(basename "$asset" .nif)
  "$audio" "$asset" -o "$name.wav" --log "$name.csv" "$@" || { fail "no sound from $asset" && return; }
  "$audio" "$asset" -o "$name.open.wav" --no-occlusion "$@" || { fail "no open sound from $asset" && return; }
  python3 "$levels" "$name.wav" "$name.open.wav" "$name.csv" --check --svg "$name.svg" || fail "levels of $asset"
  python3 -c 'import sys, xml.dom.minidom; xml.dom.minidom.parse(sys.argv[1])' "$name.svg" || fail "$name.svg is not XML"
  # The check must fail if the object has no effect on the sound.
  if python3 "$levels" "$name.open.wav" "$name.open.wav" "$name.csv" --check >/dev/null 2>&1; then
    fail "a sound without occlusion passes the check"
  fi
  # The sound is reproducible.
  if ! "$audio" "$asset" -o "$name.again.wav" "$@" >/dev/null || ! cmp "$name.wav" "$name.again.wav"; then
    fail "another sound, again"
  fi
}

# refuses CODE TEXT ARGUMENT...: expects one line with the text, this exit code, and no file in the folder "made".
refuses() {
  local code=0 wanted=$1 text=$2
  shift 2
  "$audio" "$@" >"$scratch/said" 2>&1 || code=$?
  ((code == wanted)) || fail "'$*' ended with $code, not $wanted"
  if [[ $(wc -l <"$scratch/said") != 1 ]] || ! grep -qF -- "$text" "$scratch/said"; then
    fail "'$*' did not say '$text', but: $(cat "$scratch/said")"
  fi
  [[ -z $(ls -A "$scratch/made") ]] || fail "'$*' left a file: $(ls -A "$scratch/made")"
}

# The one command, as users run it, always with the knot.
prepare_nifkit
mkdir -p build/samples
LC_ALL=C awk -f samples/torus_knot.awk >build/samples/knot.obj.new
cmp -s build/samples/knot.obj.new build/samples/knot.obj || cp build/samples/knot.obj.new build/samples/knot.obj
samples/audio/run.sh build/samples/knot.obj --front x --seconds 4 || fail 'run.sh'
for file in wav open.wav csv svg; do [[ -s build/audio/knot.$file ]] || fail "run.sh made no knot.$file"; done
for wrong in no_such_mesh.obj README.md; do
  code=0
  samples/audio/run.sh "$wrong" >"$scratch/said" 2>&1 || code=$?
  if ((code == 0)) || ! grep -qF "$wrong" "$scratch/said"; then
    fail "run.sh $wrong ended with $code: $(cat "$scratch/said")"
  fi
done

# A mesh elsewhere with the same name gets its own asset, and so does the knot after it.
mkdir "$scratch/elsewhere"
printf '%s\n' 'v 0 0 0' 'v 1 0 0' 'v 0 1 0' 'v 0 0 1' 'f 1 3 2' 'f 1 2 4' 'f 1 4 3' 'f 2 3 4' >"$scratch/elsewhere/knot.obj"
touch -d 2001-01-01 "$scratch/elsewhere/knot.obj"
cp build/samples/knot.nif "$scratch/knot.nif"
prepare_asset "$scratch/elsewhere/knot.obj"
! cmp -s "$asset" "$scratch/knot.nif" || fail 'a mesh got the asset of another'
prepare_asset build/samples/knot.obj
cmp "$asset" "$scratch/knot.nif" || fail 'the knot got the asset of another'

cmake -S samples/audio -B "$scratch/build" -G Ninja -DCMAKE_PREFIX_PATH="$(realpath "$prefix")" -DCMAKE_BUILD_TYPE=Debug \
  '-DCMAKE_C_FLAGS=-Werror -fsanitize=address,undefined -fno-sanitize-recover=all' >/dev/null
cmake --build "$scratch/build" >/dev/null
audio=$scratch/build/audio
passes build/samples/knot.nif --front x --seconds 4
passes build/samples/knot.nif --front x --up z --seconds 4
if [[ -r ${NIF_TEST_MESHES-}/stanford_dragon_871k.ply.gz ]]; then
  prepare_asset "$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz"
  passes "$asset"
else
  echo 'Skipped: the dragon, because NIF_TEST_MESHES does not name a folder that has it'
fi

knot=build/samples/knot.nif
mkdir "$scratch/made" "$scratch/folder"
wav=$scratch/made/sound.wav
head -c 1000 "$knot" >"$scratch/short.nif"
: >"$scratch/empty.nif"
refuses 2 'give an asset' -o "$wav"
refuses 2 'give an asset' "$knot"
refuses 2 "'other.nif'" "$knot" other.nif -o "$wav"
refuses 2 "unknown option '--what'" "$knot" --what
refuses 2 '-o takes the name of a file' "$knot" -o
refuses 2 '--seconds takes a number, 1 to 600' "$knot" -o "$wav" --seconds nan
refuses 2 '--seconds takes a number, 1 to 600' "$knot" -o "$wav" --seconds 0.5
refuses 2 '--up takes x, y or z' "$knot" -o "$wav" --up w
refuses 2 'the same axis' "$knot" -o "$wav" --up z
refuses 1 "$scratch/no_such.nif" "$scratch/no_such.nif" -o "$wav"
refuses 1 "$scratch/folder" "$scratch/folder" -o "$wav"
refuses 1 "$scratch/empty.nif" "$scratch/empty.nif" -o "$wav"
refuses 1 "$scratch/short.nif" "$scratch/short.nif" -o "$wav"
refuses 1 README.md README.md -o "$wav"
refuses 1 'tests/golden/v2-proof.nif: an asset of the encoding proof' tests/golden/v2-proof.nif -o "$wav"
refuses 1 "cannot write $scratch/no_such/sound.wav" "$knot" -o "$scratch/no_such/sound.wav"
refuses 1 "cannot write $scratch/folder" "$knot" -o "$scratch/folder"
refuses 1 'cannot write /dev/full' "$knot" -o /dev/full
refuses 1 "cannot write $scratch/no_such/log.csv" "$knot" -o "$wav" --log "$scratch/no_such/log.csv"
printf '[general]\nhrtf-paths = %s\n' "$scratch/no_such" >"$scratch/alsoft.conf"
ALSOFT_CONF=$scratch/alsoft.conf refuses 1 'no HRTF' "$knot" -o "$wav"
# A file system without room.
(
  ulimit -f 10
  trap '' XFSZ
  refuses 1 "cannot write $wav: File too large" "$knot" -o "$wav"
  exit "$failures"
) || fail 'see above'
"$audio" --help | grep -q -- '--no-occlusion' || fail 'no help'

for wrong in "$scratch/no_such.wav $knot $knot" "$knot $knot $knot"; do
  read -ra files <<<"$wrong"
  code=0
  python3 "$levels" "${files[@]}" >"$scratch/said" 2>&1 || code=$?
  if ((code != 1)) || ! grep -q "^levels.py: ${files[0]}" "$scratch/said"; then
    fail "levels.py $wrong ended with $code: $(cat "$scratch/said")"
  fi
done

((failures == 0)) || exit 1
echo 'samples/audio: all is well'
