#!/usr/bin/env bash
# Renders a scene in Cycles, once with the shadow of an object's triangles and once with that of its asset, and compares the
# pictures. Cycles is unchanged: a library is preloaded between it and Embree.
#
#   samples/cycles/run.sh [SIZE [SAMPLES [MESH]]]
#
# SIZE is the width and height of the pictures in pixels (400), SAMPLES the paths per pixel (16). MESH is a mesh whose y axis
# points up. Without one it is the Stanford dragon, if samples/run.sh has fetched it or NIF_TEST_MESHES names a folder that has
# it, or else a generated mesh. NIF_CYCLES_ROUNDS is how often each picture is rendered (1); the shortest time counts.
# Results are in build/cycles.
set -euo pipefail

case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
size=${1:-400} samples=${2:-16} mesh=${3:+$(realpath -m "${3-}")} rounds=${NIF_CYCLES_ROUNDS:-1}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

for number in "$size" "$samples" "$rounds"; do
  [[ $number =~ ^[1-9][0-9]{0,3}$ ]] || { say "samples/cycles/run.sh: '$number' is not a number, 1 to 9999" && exit 2; }
done
(($# <= 3)) || { say 'samples/cycles/run.sh: too many words; see --help' && exit 2; }
[[ -z $mesh || -r $mesh ]] || { say "samples/cycles/run.sh: cannot read $mesh" && exit 2; }
[[ $mesh != *.nif ]] || { say 'samples/cycles/run.sh: give the mesh, not the asset; Cycles needs it' && exit 2; }
[[ -n ${NIFKIT-} ]] || tools/setup.sh blender
command -v blender >/dev/null || { say 'samples/cycles/run.sh: Blender is not installed (tools/setup.sh blender)' && exit 2; }
prepare_nifkit
prepare_asset "$mesh"

out=build/cycles
mkdir -p "$out"
cmake -S samples/cycles -B "$out/build" -G Ninja -DCMAKE_PREFIX_PATH="$(realpath "$prefix")" >/dev/null
cmake --build "$out/build" >&2
name=$out/$(basename "$asset" .nif)
"$nif" mesh convert "$model" -o "$name.obj" --quiet

# render SHADOW [VARIABLE=VALUE]...: one picture; prints the seconds of processor time.
render() {
  local shadow=$1 said
  shift
  said=$(env "$@" blender -b --factory-startup -P samples/cycles/scene.py -- \
    "$name.obj" "$name.$shadow.png" "$size" "$samples" "$shadow" 2>"$name.$shadow.log") \
    || { cat "$name.$shadow.log" >&2 && return 1; }
  sed -n 's/^seconds //p' <<<"$said"
}
# A relative path, because LD_PRELOAD splits at spaces and colons, which the path of this folder may contain.
preload=(NIF_CYCLES_ASSET="$asset" LD_PRELOAD="$out/build/libshadow_rays.so")
declare -A seconds
for ((round = 0; round < rounds; ++round)); do
  for shadow in triangles asset none; do
    variables=()
    [[ $shadow != asset ]] || variables=("${preload[@]}")
    took=$(render "$shadow" "${variables[@]}")
    seconds[$shadow]=$(printf '%s\n' "$took" "${seconds[$shadow]:-$took}" | sort -g | head -n 1)
  done
done
psnr=$(blender -b --factory-startup -P samples/cycles/compare.py -- \
  "$name.triangles.png" "$name.asset.png" "$name.none.png" "$name.beside.png")
psnr_of() { sed -n "s/^psnr $(basename "$name").$1.png //p" <<<"$psnr"; }

[[ -z $origin ]] || say "$origin"
grep '^shadow_rays: ' "$name.asset.log" \
  || { say "samples/cycles/run.sh: the asset was not queried, because the library was not loaded:" && cat "$name.asset.log" >&2 && exit 1; }
printf '\n%-28s %12s %12s\n' "shadow of the object by" "PSNR, dB" "CPU seconds"
printf '%-28s %12s %12s\n' "triangles (Embree)" '' "${seconds[triangles]}" \
  "its asset" "$(psnr_of asset)" "${seconds[asset]}" "nothing" "$(psnr_of none)" "${seconds[none]}"
printf '\nPictures, in this order: %s\n' "$name.beside.png"
