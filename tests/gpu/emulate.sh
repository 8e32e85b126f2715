#!/usr/bin/env bash
# Answers a million rays of every named set by the GPU kernels, in the emulator, and compares each answer with the
# reference's: by the one kernel, and by the pipeline with the matrix instructions of every target. Needs no GPU.
#
#   tests/gpu/emulate.sh ASSET.nif MESH [RAYS]     RAYS: of each set, 1000000 by default
#
# Ends with 0 only where no answer differs. Builds build/release where need be.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
case ${1-} in
  '' | -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
[[ -d $root/build/release ]] || (cd "$root" && cmake --preset release -DNIF_BUILD_TESTS=ON >/dev/null)
cmake --build "$root/build/release" --target emulate_sets >/dev/null
"$root/build/release/bin/emulate_sets" "$@"
