#!/usr/bin/env bash
# Serves the page: fetches PlayCanvas from npm, bakes the object, exports its words for shaders, and prints the address.
#
#   samples/playcanvas/run.sh [MESH] [--host HOST] [--port PORT]
#
# MESH is a mesh with y up. Without one it is the Stanford dragon, if samples/run.sh has fetched it, or else a generated mesh.
# --port is 8000 by default; 0 takes a free port. Browsers have WebGPU only in pages of this machine and of https.
set -euo pipefail

mesh='' serve=()
while (($#)); do
  case $1 in
    -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
    --host | --port)
      (($# > 1)) || { echo "samples/playcanvas/run.sh: $1 takes a value; see --help" >&2 && exit 2; }
      serve+=("$1" "$2")
      shift
      ;;
    -*) echo "samples/playcanvas/run.sh: unknown option '$1'; see --help" >&2 && exit 2 ;;
    *)
      [[ -z $mesh ]] || { echo 'samples/playcanvas/run.sh: one mesh at a time; see --help' >&2 && exit 2; }
      mesh=$(realpath -m "$1")
      ;;
  esac
  shift
done
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

[[ -z $mesh || -r $mesh ]] || { say "samples/playcanvas/run.sh: cannot read $mesh" && exit 2; }
[[ $mesh != *.nif ]] || { say 'samples/playcanvas/run.sh: give the mesh, not the asset: its triangles are drawn' && exit 2; }
prepare_nifkit
prepare_asset "$mesh" segment
export nif
page=$(samples/playcanvas/build.sh "$asset" "$model" "$origin")
exec python3 samples/web/serve.py "$page" "${serve[@]}"
