#!/usr/bin/env bash
# Renders a sound that passes behind an object, for headphones: every 10 ms, 64 rays through a baked asset measure how much of
# the source is hidden. Builds and bakes what it needs, measures the sound, and draws its level over time.
#
#   samples/audio/run.sh [MESH] [options of the program]
#
# MESH is a mesh or a .nif file. Without one it is the Stanford dragon, if samples/run.sh has fetched it, or else a generated
# mesh. Options, e.g. --up z --front x --seconds 20, are in samples/audio/README.md. Results are in build/audio.
set -euo pipefail

case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
mesh=''
if [[ -n ${1-} && $1 != -* ]]; then
  mesh=$(realpath -m "$1")
  shift
fi
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

[[ -z $mesh || -r $mesh ]] || { say "samples/audio/run.sh: cannot read $mesh" && exit 2; }
[[ -n ${NIFKIT-} ]] || tools/setup.sh audio
prepare_nifkit
prepare_asset "$mesh"
options=("$@")
# The knot is seen from its side: it has a hole in front.
[[ $asset != build/samples/torus_knot.nif ]] || options=(--front x "$@")

out=build/audio
mkdir -p "$out"
cmake -S samples/audio -B "$out/build" -G Ninja -DCMAKE_PREFIX_PATH="$(realpath "$prefix")" >/dev/null
cmake --build "$out/build" >&2
name=$out/$(basename "$asset" .nif)
"$out/build/audio" "$asset" -o "$name.wav" --log "$name.csv" "${options[@]}"
"$out/build/audio" "$asset" -o "$name.open.wav" --no-occlusion "${options[@]}" >/dev/null
python3 samples/audio/levels.py "$name.wav" "$name.open.wav" "$name.csv" --svg "$name.svg" \
  --title "A source passes behind $(basename "$name")"
[[ -z $origin ]] || say "$origin"
printf 'Listen to %s with headphones, and to %s without the object. Level over time: %s\n' \
  "$name.wav" "$name.open.wav" "$name.svg"
