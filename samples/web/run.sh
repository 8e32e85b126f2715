#!/usr/bin/env bash
# Serves the page: builds nifkit for the web, fetches three.js and three-mesh-bvh from npm, bakes the object, and prints the address.
#
#   samples/web/run.sh [MESH] [--host HOST] [--port PORT]
#
# MESH is a mesh or a .nif file, with y up. Without one it is the Stanford dragon, if samples/run.sh has fetched it, or else a
# generated mesh. --host 0.0.0.0 serves a phone on the same network, too; by default, only this machine. --port is 8000 by
# default; 0 takes a free port.
set -euo pipefail

mesh='' serve=()
while (($#)); do
  case $1 in
    -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
    --host | --port)
      (($# > 1)) || { echo "samples/web/run.sh: $1 takes a value; see --help" >&2 && exit 2; }
      serve+=("$1" "$2")
      shift
      ;;
    -*) echo "samples/web/run.sh: unknown option '$1'; see --help" >&2 && exit 2 ;;
    *)
      [[ -z $mesh ]] || { echo 'samples/web/run.sh: one mesh at a time; see --help' >&2 && exit 2; }
      mesh=$(realpath -m "$1")
      ;;
  esac
  shift
done
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

[[ -z $mesh || -r $mesh ]] || { say "samples/web/run.sh: cannot read $mesh" && exit 2; }
tools/setup.sh web
prepare_nifkit
prepare_asset "$mesh"
export nif
page=$(samples/web/build.sh "$asset" "$model" "$origin")
exec python3 samples/web/serve.py "$page" "${serve[@]}"
