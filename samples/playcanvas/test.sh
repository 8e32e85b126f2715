#!/usr/bin/env bash
# Tests samples/playcanvas: uses the page in a headless Chromium, by the test of samples/webgpu, with the Stanford dragon if
# NIF_TEST_MESHES is set. A picture of the page goes to build/samples/playcanvas/pictures. Prints "Skipped: ..." and exits with 0
# if Chromium, its driver or npm is not installed, or npm's registry cannot be reached.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

for program in chromium chromedriver node npm; do
  command -v "$program" >/dev/null || { echo "Skipped: $program is not installed (tools/setup.sh pages web)" && exit 0; }
done
engine=playcanvas@$(node -p 'require("./samples/playcanvas/package.json").dependencies.playcanvas')
npm view --silent --fetch-retries=0 "$engine" version >/dev/null 2>&1 || { echo "Skipped: npm cannot fetch $engine" && exit 0; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
failures=0
fail() {
  echo "samples/playcanvas/test.sh: $*" >&2
  failures=$((failures + 1))
}
# refused CODE TEXT ARGUMENTS...
refused() {
  local code=0
  samples/playcanvas/run.sh "${@:3}" >/dev/null 2>"$scratch/said" || code=$?
  if ((code != $1)) || ! grep -q -- "$2" "$scratch/said"; then fail "run.sh ${*:3}: ended with $code: $(cat "$scratch/said")"; fi
}
refused 2 'unknown option' --fast
refused 2 'takes a value' --port
refused 2 'cannot read' missing.obj
refused 2 'one mesh at a time' a.obj b.obj
refused 2 'not the asset' tests/golden/v2-single.nif

prepare_nifkit
prepare_asset '' segment
page=$(nif=$nif samples/playcanvas/build.sh "$asset" "$model" "$origin")
python3 samples/webgpu/test_page.py --page "$page" --nif "$nif" --mesh "$model" --asset "$asset" \
  --pictures build/samples/playcanvas/pictures || fail 'the page is not as it should be'
((failures == 0)) || exit 1
echo 'samples/playcanvas: all is well'
