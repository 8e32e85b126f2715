#!/usr/bin/env bash
# Answers a million rays of every named set with the GPU kernels, in the emulator, and compares each answer with the
# reference's: with the one kernel, and with the pipeline using the matrix instructions of every target. For `segment` objects
# two more tables follow. One has the cost of the traversal with and without empty-space skipping (steps of a ray; steps that a
# wave of 32 or 64 rays waits for, in the order of the set; loads and bytes of a ray). The other has what is left to the network
# (open rays; hard ones with more than five intervals; intervals of an open ray). For `spherical` objects one follows for half
# precision: answers that differ from the reference's in single precision, answers that are wrong in either precision, by how
# much probabilities (dp) and log-odds (dz) move, and answers that are farther off than the arithmetic allows (beyond). Needs
# no GPU.
#
#   tests/measure/emulate_sets.sh ASSET.nif MESH [RAYS]     RAYS: per set, 1000000 by default
#
#   tests/measure/emulate_sets.sh build/sample/stanford_dragon.nif build/sample/stanford_dragon.ply.gz
#
# Exits with 0 only if no answer differs, and none is beyond in half precision. Builds build/release if necessary.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
case ${1-} in
  '' | -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
[[ -d $root/build/release ]] || (cd "$root" && cmake --preset release -DNIF_BUILD_TESTS=ON >/dev/null)
cmake --build "$root/build/release" --target emulate_sets >/dev/null
"$root/build/release/bin/emulate_sets" "$@"
