#!/usr/bin/env bash
# Measures triangles in shaders on Mesa's lavapipe, which is Vulkan on the CPU: two scenes of games and one scan, as `bvh` and as
# `exact`, and writes a page beside this script. Takes some ten minutes on two cores. Run it on an idle machine. RAYS and ROUNDS
# make it shorter, to try it.
#
#   NIF_TEST_MESHES=FOLDER NIF_TEST_GAMES=FOLDER docs/results/shaders.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
: "${NIF_TEST_MESHES:?names the folder that holds the meshes}" "${NIF_TEST_GAMES:?names the folder that holds the scenes}"
nif=build/release/bin/nif speed=build/release/bin/shader_speed out=build/shaders rays=${RAYS:-100000} rounds=${ROUNDS:-3}
load=$(cut -d' ' -f1 /proc/loadavg)
cmake --build build/release --target nif shader_speed >&2
mkdir -p "$out"
scenes=(
  "town|$NIF_TEST_GAMES/town/town_model.gltf"
  "ship|$NIF_TEST_GAMES/ship/dutch_ship_medium_1k.gltf"
  "dragon|$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz"
)
for scene in "${scenes[@]}"; do
  IFS='|' read -r name file <<<"$scene"
  for encoding in bvh exact; do
    "$nif" bake "$file" -o "$out/$name-$encoding.nif" --ignore-alpha --encoding $encoding --rays 0 --quiet
  done
  "$speed" "$rays" "$rounds" "$out/$name-bvh.nif" "$out/$name-exact.nif"
done >"$out/rows"

{
  cat <<PAGE
# Triangles in shaders

Made by \`docs/results/shaders.sh\`; do not edit by hand. Machine: $(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1), $(nproc) threads, by Mesa's
lavapipe. When it began, the load average was $load: compare only what stands in one row, or in rows of one scene and set.

$rays rays through the bounds (\`lines\`), and from what they hit in any direction (\`bounces\`), by \`nif_query_scene\` and
\`nif_first_hit_scene\`. Both encodings answer the same rays by turns, and of $rounds rounds the fastest counts. Not certain: answers that
single precision cannot prove. Wrong: certain ones, of both kinds, that are not the CPU's.

| scene | set | triangles | words, kB | bytes a triangle | visibility, 10^6 rays/s | first hits, 10^6 rays/s | not certain, visibility | first hits | wrong |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
PAGE
  awk -F'\t' '{ printf "| `%s` | `%s` | %d | %.0f | %.1f | %s | %s | %s %% | %s %% | %d |\n", $1, $2, $3, $5 / 1000, $5 / $3, $6, $7, $8, $9, $10 }' "$out/rows"
  cat <<'PAGE'

All that shaders need is counted: the tree, the vertices and, for `exact`, the planes. Where both rows of a scene have the same bytes,
`exact` found no planes that pay, and stored `bvh`: what their speeds differ by is noise. Lavapipe runs eight rays together, so that they wait for the longest.
PAGE
} >docs/results/shaders.md.new
mv docs/results/shaders.md.new docs/results/shaders.md
