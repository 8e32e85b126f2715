#!/usr/bin/env bash
# Tests samples/web: serves the page, and uses it in a headless Chromium (test_page.py), with the Stanford dragon if
# NIF_TEST_MESHES is set. Pictures of the page go to build/samples/web/pictures. Prints "Skipped: ..." and exits with 0 if
# Chromium, its driver, Emscripten or node is not installed, or npm's registry cannot be reached.
#
#   samples/web/test.sh [--only start|picture|workers|both|hands|files|lacking|looks|memory]
set -euo pipefail
if (($#)) && [[ $# != 2 || $1 != --only ]]; then
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
  [[ $1 == -h || $1 == --help ]] && exit 0
  exit 2
fi
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

for program in chromium chromedriver emcmake node npm; do
  command -v "$program" >/dev/null || { echo "Skipped: $program is not installed (tools/setup.sh pages web)" && exit 0; }
done
three=three@$(node -p 'require("./samples/web/package.json").dependencies.three')
npm view --silent --fetch-retries=0 "$three" version >/dev/null 2>&1 || { echo "Skipped: npm cannot fetch $three" && exit 0; }
scratch=$(mktemp -d)
server=''
clean_up() {
  [[ -z $server ]] || kill "$server" 2>/dev/null || true
  wait
  rm -rf "$scratch"
}
trap clean_up EXIT
failures=0
fail() {
  echo "samples/web/test.sh: $*" >&2
  failures=$((failures + 1))
}

prepare_nifkit
prepare_asset ''

if ((!$#)); then
  # The one command. Its output is the address, and nothing else may be in it.
  samples/web/run.sh --port 0 >"$scratch/address" 2>"$scratch/said" &
  server=$!
  for _ in {1..3000}; do
    [[ ! -s $scratch/address ]] || break
    kill -0 "$server" 2>/dev/null || break
    sleep 0.1
  done
  python3 - "$(<"$scratch/address")" <<'EOF' || fail "run.sh serves no page: $(cat "$scratch/said")"
import sys, urllib.request
with urllib.request.urlopen(sys.argv[1]) as answer:
    assert "'self'" in answer.headers["Content-Security-Policy"]
    assert b"Shadows from an asset" in answer.read()
with urllib.request.urlopen(sys.argv[1] + "nifkit/nifkit-simd.wasm") as answer:
    assert answer.headers["Content-Type"] == "application/wasm"
EOF
  port=$(sed 's/.*:\([0-9]*\).*/\1/' "$scratch/address")
  ! timeout 20 samples/web/serve.py build --port "$port" 2>"$scratch/said" || fail 'serve.py takes a port that is in use'
  grep -q "cannot listen at port $port" "$scratch/said" || fail "serve.py says: $(cat "$scratch/said")"
  ! timeout 20 samples/web/serve.py missing --port 0 2>"$scratch/said" || fail 'serve.py takes a folder that is not there'
  grep -q 'there is no folder' "$scratch/said" || fail "serve.py says: $(cat "$scratch/said")"
  kill "$server" 2>/dev/null || true
  server=''
  # refused CODE TEXT ARGUMENTS...
  refused() {
    local code=0
    samples/web/run.sh "${@:3}" >/dev/null 2>"$scratch/said" || code=$?
    if ((code != $1)) || ! grep -q -- "$2" "$scratch/said"; then fail "run.sh ${*:3}: ended with $code: $(cat "$scratch/said")"; fi
  }
  refused 2 'unknown option' --fast
  refused 2 'takes a value' --port
  refused 2 'cannot read' missing.obj
  refused 2 'one mesh at a time' a.obj b.obj
fi
page=$(nif=$nif samples/web/build.sh "$asset" "$model" "$origin")
python3 samples/web/test_page.py --page "$page" --nif "$nif" --mesh "$model" --asset "$asset" --other tests/golden/v2-shapes.nif \
  --pictures build/samples/web/pictures "$@" || fail 'the page is not as it should be'
((failures == 0))
