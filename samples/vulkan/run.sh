#!/usr/bin/env bash
# Draws an object in sun and sky by a Vulkan compute shader that asks its asset. Builds and bakes what it needs.
#
#   samples/vulkan/run.sh [MESH] [options of the program]
#
# MESH is a mesh or a .nif file. Without one it is the Stanford dragon, if samples/run.sh has fetched it, or else a generated
# mesh. Options, e.g. --sun 120,30 --check, are in samples/vulkan/README.md. The picture is in build/vulkan.
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

[[ -z $mesh || -r $mesh ]] || { say "samples/vulkan/run.sh: cannot read $mesh" && exit 2; }
[[ -n ${NIFKIT-} ]] || tools/setup.sh shader
prepare_nifkit
prepare_asset "$mesh" segment

out=build/vulkan
mkdir -p "$out"
cmake -S samples/vulkan -B "$out/build" -G Ninja -DCMAKE_PREFIX_PATH="$(realpath "$prefix")" >/dev/null
cmake --build "$out/build" >&2
picture=$out/$(basename "$asset" .nif).png
"$out/build/picture" "$asset" -o "$picture" "$@"
[[ -z $origin ]] || say "$origin"
printf 'Picture: %s\n' "$picture"
