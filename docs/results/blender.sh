#!/usr/bin/env bash
# Measures the add-on for Blender with the Stanford dragon: from the selection to the asset, beside `nif bake` of the mesh's
# file, and the pictures of what it shows. Writes a page beside this script. Takes some ten minutes on two cores. Let nothing
# else run meanwhile.
#
#   NIF_TEST_MESHES=FOLDER docs/results/blender.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
: "${NIF_TEST_MESHES:?names the folder that holds the meshes}"
load=$(cut -d' ' -f1 /proc/loadavg)
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

dragon=$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz out=build/blender rounds=3
prepare_nifkit
mkdir -p $out
bindings/blender/package.sh $out/nifkit_blender.zip >/dev/null
[[ -f $out/dragon.obj ]] || "$nif" mesh convert "$dragon" -o $out/dragon.obj --quiet
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export BLENDER_USER_CONFIG=$scratch/config BLENDER_USER_SCRIPTS=$scratch/scripts
NIF_PROGRAM=$(realpath "$nif")
export NIF_PROGRAM

# seconds COMMAND...: how long it takes.
seconds() {
  local start=$EPOCHREALTIME
  "$@" >/dev/null
  awk -v start="$start" -v end="$EPOCHREALTIME" 'BEGIN { printf "%.1f\n", end - start }'
}
for ((round = 1; round <= rounds; ++round)); do
  file=$(seconds "$nif" bake "$dragon" -o $out/file.nif --preset fast --rays 0 --quiet)
  selection=$(blender -b --factory-startup --python-exit-code 1 -P docs/results/blender.py -- bake $out/nifkit_blender.zip \
    $out/dragon.obj $out/selection.nif 2>/dev/null | sed -n 's/^seconds //p')
  printf '%s %s\n' "$file" "$selection" | tee /dev/stderr
done >"$out/seconds"
blender -b --factory-startup --python-exit-code 1 -P docs/results/blender.py -- show $out/nifkit_blender.zip $out/dragon.obj \
  $out/selection.nif docs/results/blender.png >"$out/said" 2>/dev/null

{
  cat <<PAGE
# The add-on for Blender

Made by \`docs/results/blender.sh\`: the Stanford dragon, 871,414 triangles, in $(blender --version | head -n 1), on $(nproc) threads of
$(lscpu | sed -n 's/^Model name: *//p' | head -n 1). Bakes use \`--preset fast --rays 0\`. When
it began, the load average was $load.

| round | \`nif bake\` of the file, s | from the selection to the asset, s | longer by, s | of which the selection is taken and written, s |
| ---: | ---: | ---: | ---: | ---: |
PAGE
  awk '{ printf "| %d | %s | %s | %.1f | %s |\n", NR, $1, $2, $2 - $1, $3 }' "$out/seconds"
  cat <<PAGE

The file is \`stanford_dragon_871k.ply.gz\`; the selection is written as a temporary \`.glb\`, and read from there. In Blender the
time is that of the operator, without the start of Blender and the import.

![What the asset sees, what Blender's own rays see, and where they differ](blender.png)

Ambient occlusion of each vertex by the asset, the same by Blender's own rays, and the share of rays whose answers differ, from
grey (none) to red ($(sed -n 's/^scale //p' "$out/said") or more). $(sed -n 's/^Info: \(.* otherwise than .*\)/\1/p' "$out/said" | tail -n 1). Model: the Stanford dragon, Stanford University
Computer Graphics Laboratory (acknowledge the source; free for research; no commercial use without permission).

| what is shown, $(sed -n 's/^vertices //p' "$out/said") vertices, 16 rays each | seconds |
| --- | ---: |
| errors | $(sed -n 's/^errors //p' "$out/said") |
| what the asset sees | $(sed -n 's/^asset //p' "$out/said") |
PAGE
} >docs/results/blender.md
