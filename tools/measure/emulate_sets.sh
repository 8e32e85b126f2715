#!/usr/bin/env bash
# Answers a million rays of every named set by the GPU kernels, in the emulator, and compares each answer with the
# reference's: by the one kernel, and by the pipeline with the matrix instructions of every target. Of `segment` objects two
# more tables follow: of what the walk costs voxel by voxel and by leaps (steps of a ray; steps that a wave of 32 or 64 rays
# waits for, in the order of the set; loads and bytes of a ray), and of what it leaves to the network (open rays; hard ones
# of more than five runs; runs of an open ray). Of `spherical` objects one follows for half precision: answers that differ
# from the reference's in single precision, answers that are wrong in either, by how much probabilities (dp) and log-odds
# (dz) move, and answers that are farther off than the arithmetic allows (beyond). Needs no GPU.
#
#   tools/measure/emulate_sets.sh ASSET.nif MESH [RAYS]     RAYS: of each set, 1000000 by default
#
#   tools/measure/emulate_sets.sh build/sample/stanford_dragon.nif build/sample/stanford_dragon.ply.gz
#
# Ends with 0 only where no answer differs, and none is beyond in half precision. Builds build/release where need be.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
case ${1-} in
  '' | -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
[[ -d $root/build/release ]] || (cd "$root" && cmake --preset release -DNIF_BUILD_TESTS=ON >/dev/null)
cmake --build "$root/build/release" --target emulate_sets >/dev/null
"$root/build/release/bin/emulate_sets" "$@"
