#!/usr/bin/env bash
# Tests the add-on in a real Blender, without a window: made as a zip, installed from it, and used. Prints "Skipped: ..." and
# ends with 0 where Blender is not installed.
#
#   bindings/blender/tests/run.sh [TEST...]    e.g. test_bake.Bake.test_instances
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

command -v blender >/dev/null || { echo 'Skipped: Blender is not installed (tools/setup.sh blender)' && exit 0; }
prepare_nifkit
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# The user's own Blender stays as it is, and what is left behind is found.
export BLENDER_USER_CONFIG=$scratch/config BLENDER_USER_SCRIPTS=$scratch/scripts TMPDIR=$scratch/temporary
mkdir "$TMPDIR"
NIF_PROGRAM=$(realpath "$nif")
NIF_PROOF=$PWD/tests/golden/v2-proof.nif
export NIF_PROGRAM NIF_PROOF
bindings/blender/package.sh "$scratch/addon.zip" >/dev/null
bindings/blender/package.sh "$scratch/again.zip" >/dev/null
cmp "$scratch/addon.zip" "$scratch/again.zip"
blender -b --factory-startup --python-exit-code 1 -P bindings/blender/tests/main.py -- "$scratch/addon.zip" "$@"
# A window, on a screen that nobody sees.
if command -v xvfb-run >/dev/null; then
  mkdir "$scratch/window"
  xvfb-run -a -s '-screen 0 1000x700x24' blender --factory-startup --enable-event-simulate \
    -P bindings/blender/tests/window.py -- "$scratch/addon.zip" "$scratch/window" | tee "$scratch/said"
  grep -q '^window.py: all is well' "$scratch/said"
  [[ -z $(ls -A "$scratch/window") ]] || { echo 'Blender leaves a file when it closes' >&2 && exit 1; }
else
  echo 'Skipped: baking in a window, because Xvfb is not installed (tools/setup.sh blender)'
fi
rm -f "$TMPDIR/quit.blend" # Blender's own
[[ -z $(ls -A "$TMPDIR") ]] || { echo "left behind: $(ls -A "$TMPDIR")" >&2 && exit 1; }
echo 'bindings/blender: all is well'
