#!/usr/bin/env bash
# Measures a scene of ten thousand instances of the Stanford dragon, at random places and of random sizes, and writes
# docs/results/instances.md: time to commit it, bytes, and frames in which all of them move.
#
#   docs/results/instances.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

asset=build/sample/stanford_dragon.nif
[[ -f $asset ]] || samples/run.sh >/dev/null
[[ -f $asset ]] || { echo 'docs/results/instances.sh: the dragon is not to be had' >&2 && exit 1; }

# samples/engine, on an installed package as its own users have it.
cmake --build build/release --target nif_runtime >&2
cmake --install build/release/runtime --prefix build/installed >/dev/null
cmake --fresh -S samples/engine -B build/engine -DCMAKE_PREFIX_PATH="$PWD/build/installed" >/dev/null
cmake --build build/engine >/dev/null

indent() { sed 's/^/    /; s/ *$//'; }
run() { build/engine/engine "$asset" --scatter --instances "$1" --frames 100 --threads 1; }
{
  printf '# Ten thousand instances\n\n'
  printf 'Written by `docs/results/instances.sh`: change nothing here by hand. Machine: %s, %s cores.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)" "$(nproc)"
  printf 'Times are those of a machine that others use, too.\n\n'
  printf "Copies of the Stanford dragon, a game's frames: in each, all copies move and turn (\`move\`: new transforms, and\n"
  printf 'the commit), then 40,000 shadow rays are asked (`shadows`).\n\n'
  for run in 1 2 3; do
    printf '## `engine dragon.nif --scatter --instances 10000 --threads 1`, run %s\n\n' "$run"
    run 10000 | tail -n +3 | indent
    echo
  done
  printf '## The same with one instance\n\n'
  run 1 | tail -n +3 | indent
} >docs/results/instances.md.new
mv docs/results/instances.md.new docs/results/instances.md
