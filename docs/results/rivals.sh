#!/usr/bin/env bash
# Studies twelve meshes of all kinds (nif study), keeps the figures in rivals/ beside this script, and writes the page of all that
# are there. A full study takes long, on cores that should be idle; what is in build/rivals goes on where it
# stopped, and meshes whose figures are kept are not studied again.
#
#   NIF_TEST_MESHES=FOLDER docs/results/rivals.sh [MESH...]    names of files, as in the page; by default all
#   docs/results/rivals.sh --page                              only writes the page
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
nif=build/release/bin/nif out=build/rivals kept=docs/results/rivals

if [[ ${1-} != --page ]]; then
  cmake --build build/release --target nif >&2
  mkdir -p "$out" "$kept"
  # shellcheck source=docs/results/meshes.sh
  source docs/results/meshes.sh
  find_meshes "$nif"
  mail=build/meshes/generated_chain-mail.ply
  [[ -f $mail ]] || "$nif" mesh generate chain-mail -o "$mail" --triangles 150000 --quiet
  paths+=("$mail")
  for path in "${paths[@]}"; do
    name=$(basename "$path")
    case $name in
      openscad_* | CesiumMan_* | kicad_board_6.94m*) continue ;; # smaller than any simplified mesh, or larger than memory allows
    esac
    if (($#)) && [[ " $* " != *" $name "* ]]; then continue; fi
    if [[ -f $kept/$name.json ]]; then continue; fi
    "$nif" study "$path" -o "$out/$name"
    python3 -c 'import json, os, sys
study = json.load(open(sys.argv[1])) | {"load_average": round(os.getloadavg()[2], 2)}
json.dump(study, open(sys.argv[2], "w"), separators=(",", ":"))' "$out/$name/study.json" "$kept/$name.json.new"
    mv "$kept/$name.json.new" "$kept/$name.json"
  done
fi
python3 docs/results/rivals.py "$kept" >"$out.md"
mv "$out.md" docs/results/rivals.md
