#!/usr/bin/env bash
# Draws a forest by Embree, with a filter function that looks up where leaves are, and by an asset, which needs none. Prints
# what each takes in time and memory. Builds, generates and bakes what it needs.
#
#   samples/grove/run.sh [SCENE] [options of the program]
#
# SCENE is a .glb or .gltf. Without one it is a generated forest of a thousand instances. Options, e.g. --copies 1000 for the
# file of a single tree, are in samples/grove/README.md. Results are in build/grove.
set -euo pipefail

case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
scene=''
if [[ -n ${1-} && $1 != -* ]]; then
  scene=$(realpath -m "$1")
  shift
fi
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

[[ -z $scene || -r $scene ]] || { say "samples/grove/run.sh: cannot read $scene" && exit 2; }
prepare_nifkit

out=build/grove
mkdir -p "$out"
if [[ -z $scene ]]; then
  scene=$out/forest.glb
  "$nif" mesh generate forest -o "$scene" --quiet
fi
cmake -S samples/grove -B "$out/build" -G Ninja -DCMAKE_PREFIX_PATH="$(realpath "$prefix")" >/dev/null
cmake --build "$out/build" >&2
name=$(basename "$scene")
name=$out/${name%.*}
"$nif" bake "$scene" -o "$name.nif" --rays 0 --quiet
"$out/build/grove" "$scene" "$name.nif" -o "$name" "$@"
printf '\nPictures: %s-embree.png, %s-asset.png, and both side by side: %s-both.png\n' "$name" "$name" "$name"
