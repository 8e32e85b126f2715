#!/usr/bin/env bash
# Builds the npm package and tests it under node: the bits of the library of this machine, errors, resources. Prints
# "Skipped: ..." and ends with 0 where Emscripten or node is not installed.
#
#   bindings/web/test/run.sh [--built]    --built: the package is there already
set -euo pipefail
case ${1-} in
  '' | --built) ;;
  *) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2 && exit 2 ;;
esac
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
for program in emcmake node npm; do
  if ! command -v "$program" >/dev/null; then
    echo "Skipped: $program is not installed (tools/setup.sh web)"
    exit 0
  fi
done
[[ ${1-} == --built ]] || bindings/web/build.sh

# What the library of this machine answers, with its best instruction set.
[[ -f build/release/build.ninja ]] || cmake --preset release >/dev/null
cmake --build build/release --parallel "$(nproc)" --target nif_runtime >&2
answers=build/web/native
mkdir -p "$answers"
c++ -std=c++20 -O1 -I runtime/include bindings/web/test/native.cpp build/release/runtime/libnif.a -ldl -pthread -o "$answers/native"
trap 'rm -f "$answers"/*.answers' EXIT
for asset in tests/golden/*.nif; do
  "$answers/native" "$asset" 40000 "$answers/$(basename "$asset").answers"
done
node --test bindings/web/test/*.test.mjs
