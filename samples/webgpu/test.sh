#!/usr/bin/env bash
# Tests samples/webgpu: uses the page in a headless Chromium (test_page.py), with the Stanford dragon if NIF_TEST_MESHES is set.
# A picture of the page goes to build/samples/webgpu/pictures. Prints "Skipped: ..." and exits with 0 if Chromium, its driver or
# npm is not installed, or npm's registry cannot be reached.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

for program in chromium chromedriver node npm; do
  command -v "$program" >/dev/null || { echo "Skipped: $program is not installed (tools/setup.sh pages web)" && exit 0; }
done
three=three@$(node -p 'require("./samples/webgpu/package.json").dependencies.three')
npm view --silent --fetch-retries=0 "$three" version >/dev/null 2>&1 || { echo "Skipped: npm cannot fetch $three" && exit 0; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failures=0
fail() {
  echo "samples/webgpu/test.sh: $*" >&2
  failures=$((failures + 1))
}
# refused CODE TEXT ARGUMENTS...
refused() {
  local code=0
  samples/webgpu/run.sh "${@:3}" >/dev/null 2>"$scratch/said" || code=$?
  if ((code != $1)) || ! grep -q -- "$2" "$scratch/said"; then fail "run.sh ${*:3}: ended with $code: $(cat "$scratch/said")"; fi
}
refused 2 'unknown option' --fast
refused 2 'takes a value' --port
refused 2 'cannot read' missing.obj
refused 2 'one mesh at a time' a.obj b.obj
refused 2 'not the asset' tests/golden/v2-single.nif

prepare_nifkit
prepare_asset '' segment
page=$(nif=$nif samples/webgpu/build.sh "$asset" "$model" "$origin")
python3 samples/webgpu/test_page.py --page "$page" --nif "$nif" --mesh "$model" --asset "$asset" \
  --pictures build/samples/webgpu/pictures --triangles || fail 'the page is not as it should be'
((failures == 0)) || exit 1
echo 'samples/webgpu: all is well'
