#!/usr/bin/env bash
# Measures how fast meshes are read, beside the libraries that could read them, and what a large one takes in time and
# memory until it can be baked; writes docs/results/reading.md. Takes some minutes.
#
#   docs/results/reading.sh
#
# NIF_TEST_MESHES names a folder with kicad_board_6.94m.ply.zst; without it a bust of as many triangles stands for it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

cmake --build build/release --target nif read_speed >&2
nif=build/release/bin/nif read_speed=build/release/bin/read_speed
out=build/reading rounds=7
mkdir -p "$out"

mesh=build/sample/stanford_dragon.ply.gz
[[ -f $mesh ]] || samples/run.sh >/dev/null
[[ -f $mesh ]] || { echo 'docs/results/reading.sh: the dragon is not to be had' >&2 && exit 1; }
for name in dragon.ply dragon.stl dragon.obj dragon.off dragon.drc; do
  [[ -f $out/$name ]] || "$nif" mesh convert --quiet "$mesh" -o "$out/$name"
done
[[ -f $out/dragon-text.stl ]] || "$nif" mesh convert --quiet --text "$mesh" -o "$out/dragon-text.stl"
board=${NIF_TEST_MESHES-}/kicad_board_6.94m.ply.zst
if [[ -f $board ]]; then
  name='board of circuits, KiCad (kicad-packages3d, CC-BY-SA-4.0), `kicad_board_6.94m.ply.zst`'
else
  board=$out/bust.ply.gz name='bust, `nif mesh generate statue --triangles 6900000`'
  [[ -f $out/bust.ply ]] || "$nif" mesh generate statue --triangles 6900000 -o "$out/bust.ply"
  [[ -f $board ]] || gzip -k "$out/bust.ply"
fi
[[ -f $out/large.ply ]] || "$nif" mesh convert --quiet "$board" -o "$out/large.ply"

compared() {
  local library=$1 file=$2 what=$3 ours theirs ratio
  echo "docs/results/reading.sh: $file" >&2
  read -r ours theirs ratio < <("$read_speed" "$rounds" "$out/$file")
  printf '| %s | %s | %s | %s | %s |\n' "$what" "$library" "$ours" "$theirs" "$ratio"
}
readied() {
  local file=$1 what=$2 triangles arrays reading peak preparing peak_all
  echo "docs/results/reading.sh: $file" >&2
  read -r triangles arrays reading peak preparing peak_all < <("$read_speed" "$file")
  awk -v what="$what" -v t="$triangles" -v a="$arrays" -v r="$reading" -v p="$peak" -v s="$preparing" -v q="$peak_all" 'BEGIN {
    printf "| %s | %d | %.0f | %.2f | %.2f | %.2f | %.2f |\n", what, t, a / 1e6, r, p / a, s, q / a }'
}

{
  printf '# Reading\n\n'
  printf 'Written by `docs/results/reading.sh`: change nothing here by hand. Machine: %s, %s cores. Other programs may have run\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(nproc)"
  printf 'beside it.\n\n'
  printf '## Beside the libraries\n\n'
  printf 'The Stanford dragon (871,414 triangles; Stanford University Computer Graphics Laboratory) and the large mesh below, as\n'
  printf '`nif mesh convert` writes them. The library fills plain lists of positions and triangles (`tools/measure/read_speed.cpp`), as ours does, and\n'
  printf 'checks less: [meshes.md](../meshes.md) says why its readers are not used. `read_speed %s FILE`: medians of %s rounds, in each both\n' "$rounds" "$rounds"
  printf 'in turn; more than 1 is faster than the library. Draco works within ours: what ours takes besides is to copy and check\n'
  printf 'what it decoded. So does tinygltf, for the structure of a glTF alone, which leaves nothing to compare.\n\n'
  printf '| file | library | seconds | library, seconds | library : ours |\n| --- | --- | ---: | ---: | ---: |\n'
  compared OpenMesh dragon.ply 'dragon, binary PLY'
  compared OpenMesh large.ply 'large mesh, binary PLY'
  compared OpenMesh dragon.stl 'dragon, binary STL'
  compared OpenMesh dragon-text.stl 'dragon, text STL'
  compared OpenMesh dragon.obj 'dragon, OBJ'
  compared OpenMesh dragon.off 'dragon, OFF'
  compared Draco dragon.drc 'dragon, DRC'
  printf '\n## Until it can be baked\n\n'
  printf 'Large mesh: %s.\n`read_speed FILE`: what the arrays of positions and indices take; the time to\n' "$name"
  printf 'have them read and checked, and the most memory until then, in sizes of these arrays; then the time to prepare a bake\n'
  printf '(welded, duplicates dropped, closed pieces found), and the most memory of all.\n\n'
  printf '| file | triangles | arrays, MB | read, seconds | memory : arrays | prepared, seconds | memory : arrays |\n'
  printf '| --- | ---: | ---: | ---: | ---: | ---: | ---: |\n'
  readied "$out/large.ply" 'PLY'
  readied "$board" 'PLY, compressed'
} >"$out/reading.md"
mv "$out/reading.md" docs/results/reading.md
cat docs/results/reading.md
