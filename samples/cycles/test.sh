#!/usr/bin/env bash
# Tests samples/cycles: shadows by the asset match those of the triangles, and differ from no shadow; a missing or broken asset,
# a program without Embree and a wrong command line are reported, with an exit code. With NIF_TEST_MESHES also with the Stanford
# dragon. Prints "Skipped: ..." and exits with 0 if Blender is not installed, or its Cycles contains Embree.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

command -v blender >/dev/null || { echo 'Skipped: Blender is not installed (tools/setup.sh blender)' && exit 0; }
ldd "$(command -v blender)" | grep -q 'libembree3\.so' \
  || { echo 'Skipped: this Blender does not link Embree 3 dynamically' && exit 0; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failures=0
fail() {
  echo "samples/cycles/test.sh: $*" >&2
  failures=$((failures + 1))
}

# decibels NAME: the PSNR that run.sh printed for the line that starts so, without its decimals.
decibels() { sed -nE "s/^$1 +([0-9]+)\.[0-9]+ .*/\1/p" "$scratch/said"; }

# shadows NAME AT_LEAST [MESH]
shadows() {
  local name=$1 least=$2 asset none
  samples/cycles/run.sh 200 4 "${@:3}" >"$scratch/said" || { fail "run.sh with $name" && return; }
  cat "$scratch/said"
  asset=$(decibels 'its asset') none=$(decibels nothing)
  ((asset >= least)) || fail "$name: $asset dB by the asset, below $least"
  # Otherwise the comparison would show nothing.
  ((none < 25)) || fail "$name: $none dB without a shadow"
  grep -Eq '^shadow_rays: the asset answered [1-9][0-9]+ shadow rays, and blocked [1-9][0-9]+$' "$scratch/said" \
    || fail "$name: the asset was not queried"
  for picture in triangles asset none beside; do
    [[ -s build/cycles/$name.$picture.png ]] || fail "no picture $name.$picture.png"
  done
}

# The one command, as users run it, always with the knot.
mkdir -p build/samples
LC_ALL=C awk -f samples/torus_knot.awk >build/samples/knot.obj.new
cmp -s build/samples/knot.obj.new build/samples/knot.obj || cp build/samples/knot.obj.new build/samples/knot.obj
shadows knot 40 build/samples/knot.obj
if [[ -r ${NIF_TEST_MESHES-}/stanford_dragon_871k.ply.gz ]]; then
  shadows stanford_dragon_871k 40 "$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz"
else
  echo 'Skipped: the dragon, because NIF_TEST_MESHES does not name a folder that has it'
fi

# In a folder whose path has a space, at which LD_PRELOAD would split.
ln -s "$PWD" "$scratch/a folder"
(cd "$scratch/a folder" && samples/cycles/run.sh 50 1 build/samples/knot.obj >/dev/null) || fail 'run.sh in a folder whose path has a space'

# refuses TEXT COMMAND...: expects exit code 2 and the text.
refuses() {
  local code=0
  "${@:2}" >"$scratch/said" 2>&1 || code=$?
  ((code == 2)) || fail "'${*:2}' ended with $code"
  grep -qF -- "$1" "$scratch/said" || fail "'${*:2}' did not say '$1', but: $(cat "$scratch/said")"
}
library=build/cycles/build/libshadow_rays.so
# preloaded ASSET PROGRAM...: with the library
preloaded() { NIF_CYCLES_ASSET=$1 LD_PRELOAD=$library "${@:2}"; }
head -c 1000 build/samples/knot.nif >"$scratch/short.nif"
blender=(blender -b --factory-startup --version)
refuses 'NIF_CYCLES_ASSET: is not set' preloaded '' "${blender[@]}"
refuses "$scratch/no_such.nif" preloaded "$scratch/no_such.nif" "${blender[@]}"
refuses "$scratch/short.nif" preloaded "$scratch/short.nif" "${blender[@]}"
refuses 'leaves rays open' preloaded tests/golden/v2-proof.nif "${blender[@]}"
refuses 'does not link Embree 3' preloaded build/samples/knot.nif /bin/true
refuses "'0' is not a number" samples/cycles/run.sh 0
refuses 'cannot read' samples/cycles/run.sh 200 4 "$scratch/no_such.obj"
refuses 'give the mesh' samples/cycles/run.sh 200 4 build/samples/knot.nif
refuses 'too many words' samples/cycles/run.sh 200 4 build/samples/knot.obj more

((failures == 0)) || exit 1
echo 'samples/cycles: all is well'
