#!/usr/bin/env bash
# What each choice of the coder of payloads (docs/format.md, "Coded payloads") is worth: leaves them out of a copy of the
# sources, one at a time, and writes a page beside this script. Takes some ten minutes on two cores; bakes are kept in
# build/coding.
#
#   NIF_TEST_MESHES=FOLDER docs/results/coding.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
: "${NIF_TEST_MESHES:?names the folder that holds the meshes}"
page=$PWD/docs/results/coding.md nif=$PWD/build/release/bin/nif out=build/coding
models=formats/base/range_coder.hpp cells=formats/nif/planes/coded_cells.hpp
prediction=formats/nif/planes/cell_prediction.cpp occupancy=formats/nif/planes/coded_occupancy.hpp
features=formats/nif/network/coded_features.hpp

# What the bytes are of (1 occupancy, 2 planes, 3 features), what is different, a file, and what sed does to it.
variants=(
  "2|Bits: the quick estimate alone|$models|s/\(uint32_t\{quick_\} \+ steady_\) >> 1/quick_/"
  "2|Bits: the steady estimate alone|$models|s/\(uint32_t\{quick_\} \+ steady_\) >> 1/steady_/"
  "2|Bits: the quick estimate moves by 1/8|$models|s/kQuick = 4/kQuick = 3/"
  "2|Bits: the quick estimate moves by 1/32|$models|s/kQuick = 4/kQuick = 5/"
  "2|Bits: the steady estimate forgets after 63|$models|s/uint16_t, 255>/uint16_t, 63>/"
  "2|Numbers: the highest two bits have models like the others|$models|s/bits - b <= 2 \?/false ?/"
  "2|Cut: not by the level|$cells|s/cut\[cells_\.level\(cell\)\]/cut[0]/"
  "2|Cut: not by the distance of neighbours' planes|$cells|s/std::min\(neighbours\.thickest, 7u\)/0/"
  "2|Cut: not by how many neighbours are cut|$cells|s/std::min\(neighbours\.cut, 4u\)/0/"
  "2|Mask: not by siblings|$cells|s/mask\[siblings\]\[there\]/mask[0][0]/"
  "2|Mask: not by what is beyond the cell|$cells|s/surface_beyond\(cells_, cell, octant\) \/ 2/0/"
  "2|Mask: not by the number of children so far|$cells|s/std::min\(uint32_t\(std::popcount\(mask\)\), 7u\)/0/"
  "2|Bare: not by the level|$cells|s/bare\[cells_\.level\(cell\)\]/bare[0]/"
  "2|Separates: not by neighbours|$cells|s/separates\[bare\]\[separating\]\[passable\]/separates[bare][0][0]/"
  "2|Hints: all weights 1|$prediction|s/kWeights\[\] = \{8, 5, 2, 1\}/kWeights[] = {1, 1, 1, 1}/"
  "2|Hints: weights 8, 4, 2, 1|$prediction|s/kWeights\[\] = \{8, 5, 2, 1\}/kWeights[] = {8, 4, 2, 1}/"
  "2|Hints: weights 4, 3, 2, 1|$prediction|s/kWeights\[\] = \{8, 5, 2, 1\}/kWeights[] = {4, 3, 2, 1}/"
  "2|Hints: bounds half as far|$prediction|s/kFar\[\] = \{90, 154, 230\}/kFar[] = {45, 77, 115}/"
  "2|Hints: bounds twice as far|$prediction|s/kFar\[\] = \{90, 154, 230\}/kFar[] = {180, 308, 460}/"
  "2|Hints: larger neighbours weigh as much|$prediction|s/return \(weight \+ 1\) \/ 2/return weight/"
  "2|Thickness: not by the level|$cells|s/thickness\[cells_\.level\(cell\)\]/thickness[0]/"
  "2|Thickness: not by whether the cell separates|$cells|s/thickness\[cells_\.level\(cell\)\]\[separates\]/thickness[cells_.level(cell)][0]/"
  "2|Thickness: not by what neighbours expect|$cells|s/models\[thickness_class\(prediction, cell\)\]/models[0]/"
  "2|Normal: nothing is expected|$prediction|s/if \(prediction\.count > 0\) predict_normal/if (false) predict_normal/"
  "2|Normal: not by the doubt|$cells|s/([uv])\[prediction\.doubt\]/\1[0]/"
  "2|Normal: doubt of two classes|$prediction|s/2 \+ rank\(spread \/ prediction\.weight, kNormalSpreads\)/2/"
  "2|Normal: bounds of the doubt half as large|$prediction|s/\{3, 6, 10, 16, 24, 40\}/{1, 3, 5, 8, 12, 20}/"
  "2|Normal: bounds of the doubt twice as large|$prediction|s/\{3, 6, 10, 16, 24, 40\}/{6, 12, 20, 32, 48, 80}/"
  "2|Normal: not by the distance of the planes|$cells|s/rank\(thickness, CellModels::kForNormal\)/0/"
  "2|Normal: v not by how far u was off|$cells|s/rank\(std::abs\(missed\), CellModels::kMisses\)/0/"
  "2|Normal: never turned|$cells|s/kRim = 22/kRim = 99/"
  "2|Normal: may be turned from 27 on|$cells|s/kRim = 22/kRim = 27/"
  "2|Offset: nothing is expected|$prediction|s/^  if \(prediction\.count > 0\) \{/  if (false) {/"
  "2|Offset: not by the doubt|$cells|s/lower\[prediction\.doubt\]/lower[0]/"
  "2|Offset: bounds of the doubt half as large|$prediction|s/\{4, 10, 20, 40, 80\}/{2, 5, 10, 20, 40}/"
  "2|Offset: bounds of the doubt twice as large|$prediction|s/\{4, 10, 20, 40, 80\}/{8, 20, 40, 80, 160}/"
  "2|Offset: not by the distance of the planes|$cells|s/rank\(thickness, CellModels::kForOffset\)/0/"
  "1|Bricks: not by those before|$occupancy|s/->kind\[known_\.kind\(.*\)\]/->kind[0][0][0]/"
  "1|Voxels: not by those two away|$occupancy|s/state\(\{voxel\[0\]/i >= 9 ? 0 : &/"
  "1|Voxels: not by those across edges|$occupancy|s/state\(\{voxel\[0\]/i >= 3 \&\& i < 9 ? 0 : &/"
  "1|Voxels: not by later ones|$occupancy|s/context\.surface \|= 1u << \(kNeighbours - 1\)/context.surface |= 0/"
  "1|States: not by neighbours|$occupancy|s/state\[context\.like\]/state[0]/"
  "3|Features: one model for all channels|$features|s/i % channels\]/0]/"
)

meshes=(stanford_dragon_871k.ply.gz bunny_zipper_69k_open.ply skull_100k.obj openfoam_motorBike_332k_nasty.obj.gz
  kicad_acepack_195k.ply openscad_nonmanifold_1k.obj)
mkdir -p "$out"
cmake --build build/release --target nif >&2
files=()
for mesh in "${meshes[@]}"; do
  file=$PWD/$out/$mesh.nif how=(--encoding proof --preset high)
  [[ $mesh != openscad* ]] || how=(--encoding segment --preset fast) # features, too
  [[ -f $file ]] || "$nif" bake "$NIF_TEST_MESHES/$mesh" -o "$file" "${how[@]}" --rays 0 --uncoded --quiet
  files+=("$file")
done

rm -rf "$out/src"
mkdir -p "$out/src/tools/measure"
cp -r --parents formats/base formats/nif kernels/reference tools/measure/coded_bytes.cpp "$out/src"
cd "$out/src"
rm formats/nif/input_file_windows.cpp
find formats/nif -name '*.cpp' -printf '#include "%p"\n' | LC_ALL=C sort >all.cpp
printf '#include "tools/measure/coded_bytes.cpp"\n' >>all.cpp

# bytes: of the three kinds, a line for each mesh.
bytes() {
  "${CXX:-c++}" -std=c++20 -O1 -ffp-contract=off -I. all.cpp -o program
  ./program "${files[@]}"
}

bytes >as-it-is
{
  printf '# What the coder'\''s choices are worth\n\n'
  printf 'Generated by `docs/results/coding.sh`; do not edit by hand. [format.md](../format.md#coded-payloads) describes the coder.\n'
  printf 'The second table has the change of bytes of a payload when one choice of its coder is left out, or different: above 0, the\n'
  printf 'choice is worth that much. Five meshes as `proof`, preset `high`, and a small one as `segment`, preset `fast`. The constants\n'
  printf 'were tuned by hand in November 2026, on bakes of the first five. Some choices are worth nothing here, or less; a later form of\n'
  printf 'coding may leave them out.\n\n'
  header='| dragon | bunny | skull | motorbike | kicad | openscad |'
  rule='| ---: | ---: | ---: | ---: | ---: | ---: |'
  printf '| bytes of %s\n| --- %s\n' "$header" "$rule"
  for kind in 1:occupancy 2:planes 3:features; do
    awk -v k="${kind%:*}" -v name="${kind#*:}" '{ row = row " | " ($k ? $k : "") } END { print "| " name row " |" }' as-it-is
  done
  printf '\n| changed %s\n| --- %s\n' "$header" "$rule"
  for variant in "${variants[@]}"; do
    IFS='|' read -r kind name file edit <<<"$variant"
    cp "$file" right
    sed -E -i "$edit" "$file"
    if cmp -s "$file" right; then
      echo "$name: nothing in $file is changed by $edit" >&2
      exit 1
    fi
    bytes >changed
    mv right "$file"
    paste as-it-is changed | awk -v k="$kind" -v name="$name" '
      { row = row " | " ($k ? sprintf("%+.1f %%", 100 * ($(k + 3) / $k - 1)) : "") } END { print "| " name row " |" }'
  done
} >page
mv page "$page"
