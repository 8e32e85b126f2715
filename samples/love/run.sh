#!/usr/bin/env bash
# Starts the game "Statues": builds nifkit's library, bakes a statue, and runs LÖVE.
#
#   samples/love/run.sh [MESH] [--up y|z] [--screenshot FILE.png]
#
# MESH is a mesh or a .nif file. Without one it is the Stanford dragon, if samples/run.sh has fetched it, or else a generated
# mesh. --screenshot plays by itself for five seconds, on a virtual screen, and writes a picture of the game.
set -euo pipefail

usage() { sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; }
mesh='' up=y screenshot=''
while (($#)); do
  case $1 in
    -h | --help) usage && exit 0 ;;
    --up | --screenshot)
      (($# > 1)) || { echo "samples/love/run.sh: $1 takes a value; see --help" >&2 && exit 2; }
      if [[ $1 == --up ]]; then up=$2; else screenshot=$(realpath -m "$2"); fi
      shift
      ;;
    -*) echo "samples/love/run.sh: unknown option '$1'; see --help" >&2 && exit 2 ;;
    *)
      [[ -z $mesh ]] || { echo 'samples/love/run.sh: one mesh at a time; see --help' >&2 && exit 2; }
      mesh=$(realpath -m "$1")
      ;;
  esac
  shift
done
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

[[ -z $mesh || -r $mesh ]] || { say "samples/love/run.sh: cannot read $mesh" && exit 2; }
[[ -n $screenshot || -n ${DISPLAY-}${WAYLAND_DISPLAY-} ]] \
  || { say 'samples/love/run.sh: there is no display; --screenshot FILE.png needs none' && exit 2; }
[[ -n ${NIFKIT-} ]] || tools/setup.sh love
prepare_nifkit
prepare_asset "$mesh"
library=$(realpath "$prefix"/lib*/libnif.so | head -n 1)
game=(samples/love --asset "$(realpath "$asset")" --library "$library" --up "$up")
[[ -z $origin ]] || say "$origin"
if [[ -z $screenshot ]]; then
  say "Starting the game with $asset"
  exec love "${game[@]}"
fi
script=$(mktemp)
trap 'rm -f "$script"' EXIT
printf 'wait 5\nshot %s\n' "$screenshot" >"$script"
xvfb-run -a -s '-screen 0 1400x900x24' love "${game[@]}" --script "$script"
echo "A picture of the game: $screenshot"
