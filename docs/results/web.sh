#!/usr/bin/env bash
# Measures bindings/web under node beside the native library with SSE4, then samples/web in Chromium where that is installed, and
# prints the tables of web.md.
#
#   docs/results/web.sh [ROUNDS]
#
# With NIF_TEST_MESHES it takes the Stanford dragon, else a generated knot; baked with the preset `fast`, learned and exact.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh
prepare_nifkit
prepare_asset ''
sizes=$(bindings/web/build.sh 2>/dev/null)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
c++ -std=c++20 -O2 -I runtime/include bindings/web/test/speed.cpp build/release/runtime/libnif.a -ldl -pthread -o "$scratch/speed"
for encoding in segment exact; do
  "$nif" bake "$model" -o "$scratch/$encoding.nif" --preset fast --encoding $encoding --rays 0 --quiet
  printf '## %s, `%s`, %d bytes, node %s\n\n' "$(basename "$asset" .nif)" "$encoding" "$(stat -c %s "$scratch/$encoding.nif")" "$(node --version)"
  node bindings/web/test/speed.mjs "$scratch/$encoding.nif" "$scratch/speed" "${1-9}"
  echo
done
printf '%s\n' "$sizes"
printf '\n## A page\n\n'
for part in start both picture memory; do samples/web/test.sh --only $part 2>&1 | sed '/: [0-9]* s$/d; s/^/    /'; done
