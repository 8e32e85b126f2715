#!/usr/bin/env bash
# Measures the runtime beside Embree and writes docs/results/speed.md and .svg: the Stanford dragon with each instruction
# set, on one thread and on all, whether each set gives the reference's bits on ten million rays of every ray set, and,
# where NIF_TEST_MESHES names a folder that has it, a circuit board of 6.9 million triangles. Takes some twenty minutes on
# two cores, and is worth nothing on a machine that does other things meanwhile.
#
#   docs/results/speed.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

nif=build/release/bin/nif mesh=build/sample/stanford_dragon.ply.gz asset=build/sample/stanford_dragon.nif
[[ -f $asset ]] || samples/run.sh >/dev/null
[[ -f $mesh ]] || { echo 'docs/results/speed.sh: the dragon is not to be had' >&2 && exit 1; }
cmake --build build/release --target nif >&2
out=build/speed
mkdir -p "$out"

isas=()
for isa in sse4 avx2 avx512; do
  if "$nif" eval "$asset" --mesh "$mesh" --rays 10000000 --seed 4 --isa "$isa" --reference --json --quiet \
    >"$out/equal_$isa.json" 2>"$out/error.txt"; then
    isas+=("$isa")
  else
    cat "$out/error.txt" >&2
  fi
done
# The best set takes part in full; the others on fewer rays.
for isa in "${isas[@]}"; do
  "$nif" bench "$asset" --mesh "$mesh" --isa "$isa" -j 1 --rays 300000 --quiet >"$out/dragon_$isa.txt"
done
"$nif" bench "$asset" --mesh "$mesh" --rays 1000000 --plot docs/results/speed.svg --quiet >"$out/dragon.txt"

board=${NIF_TEST_MESHES:+$NIF_TEST_MESHES/kicad_board_6.94m.ply.zst}
if [[ -n $board && -f $board ]]; then
  [[ -f $out/board.nif ]] || "$nif" bake "$board" -o "$out/board.nif" --encoding segment --resolution 224 \
    --rays 0 --quiet
  "$nif" bench "$out/board.nif" --mesh "$board" --set outer-lines --set inner-surface -j 1 --rays 300000 --quiet \
    >"$out/board.txt"
fi

indent() { sed 's/^/    /; s/ *$//'; }
{
  printf '# Speed\n\n'
  printf 'Written by `docs/results/speed.sh`: change nothing here by hand. Machine: %s, %s cores.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(nproc)"
  printf 'Other programs may have run beside it; [benchmark.md](../benchmark.md) says how it is measured, and\n'
  printf '[cpu-kernels.md](cpu-kernels.md) what the kernels do.\n\n'
  printf 'Model: the Stanford dragon, Stanford University Computer Graphics Laboratory, preset `balanced`.\n\n'
  printf '## `nif bench dragon.nif --mesh dragon.ply.gz --rays 1000000`\n\n'
  indent <"$out/dragon.txt"
  printf '\n![Speed against bytes](speed.svg)\n'
  for isa in "${isas[@]}"; do
    printf '\n## `--isa %s`\n\n`nif bench dragon.nif --mesh dragon.ply.gz --isa %s -j 1 --rays 300000`\n\n' "$isa" "$isa"
    indent <"$out/dragon_$isa.txt"
  done
  printf '\n## The same bits\n\n'
  printf '`nif eval dragon.nif --mesh dragon.ply.gz --rays 10000000 --seed 4 --isa NAME --reference`: rays of all five sets,\n'
  printf 'and how many of them have an answer, certainty or logit other than the scalar reference.\n\n'
  printf '| instruction set | rays | different |\n| --- | ---: | ---: |\n'
  for isa in "${isas[@]}"; do
    jq -r --arg isa "$isa" '"| \($isa) | \(.reference.rays) | \(.reference.different) |"' "$out/equal_$isa.json"
  done
  if [[ -f $out/board.txt ]]; then
    printf '\n## A circuit board, 6.9 million triangles\n\n'
    printf 'Baked with `nif bake board.ply.zst -o board.nif --encoding segment --resolution 224`: %s bytes. Model: made from parts of the KiCad\n' \
      "$(stat -c %s "$out/board.nif")"
    printf 'libraries (CC-BY-SA 4.0 with exception).\n\n'
    printf '`nif bench board.nif --mesh board.ply.zst --set outer-lines --set inner-surface -j 1 --rays 300000`\n\n'
    indent <"$out/board.txt"
  fi
} >docs/results/speed.md.new
mv docs/results/speed.md.new docs/results/speed.md
