#!/usr/bin/env bash
# Measures characters that bend against brute force and Embree, and draws one that walks through a town; writes a page and a
# picture beside this script. Takes half an hour. FRAMES and RAYS make it shorter, to try it.
#
#   NIF_TEST_GAMES=FOLDER docs/results/characters.sh
#
# The folder holds knight/knight.glb and town/town_model.gltf, and may hold barbarian/barbarian.glb and mage/mage.glb (KayKit
# Character Pack: Adventurers), fox/fox.glb (Khronos' glTF sample assets) and morph/morph.gltf (MorphStressTest, there, too).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
: "${NIF_TEST_GAMES:?names the folder that holds the knight and the town}"
games=$(cd "$NIF_TEST_GAMES" && pwd)
frames=${FRAMES:-1000} rays=${RAYS:-2000000} rounds=${ROUNDS:-3} out=build/characters nif=${NIFKIT:-build/release}/bin/nif
mkdir -p "$out"

# Characters of games; and a small one of the tests, with eight weights a vertex and a morph target.
rm -f "$out"/*.json
mkdir -p "$out/tube"
tail -c +2 tests/corpus/mesh/character-glb >"$out/tube/tube.glb" # without the byte that chooses what to fuzz
for mesh in "$games"/{knight,barbarian,mage,fox,morph}/*.gl{b,tf} "$out/tube/tube.glb"; do
  [[ -f $mesh ]] || continue
  name=$(basename "${mesh%.*}")
  "$nif" bake "$mesh" -o "$out/$name.nif" --deforms --rays 0 --quiet
  "$nif" eval "$out/$name.nif" --mesh "$mesh" --clip all --frames "$frames" --rays "$rays" --reference --hits --json --quiet \
    >"$out/$name.eval.json"
  "$nif" bench "$out/$name.nif" --mesh "$mesh" --clip all --frames 76 --rays 760000 --rounds "$rounds" --json --quiet \
    >"$out/$name.bench.json"
done

# The knight with the props that its joints carry, and without, by turns.
"$nif" bake "$games/knight/knight.glb" -o "$out/knight-props.nif" --deforms --carry-props --rays 0 --quiet
"$nif" eval "$out/knight-props.nif" --mesh "$games/knight/knight.glb" --clip all --frames "$frames" --rays "$rays" --reference --hits \
  --json --quiet >"$out/knight-props.eval.json"
mkdir -p "$out/props"
rm -f "$out"/props/*.json
for turn in $(seq "$rounds"); do
  for name in knight knight-props; do
    "$nif" bench "$out/$name.nif" --mesh "$games/knight/knight.glb" --clip all --frames 76 --rays 760000 --rounds 1 --json --quiet \
      >"$out/props/$name.$turn.json"
  done
done

# The sample, which prints times and bytes of a frame.
for cast in knight figure; do
  samples/characters/run.sh "$cast" --every 60 | sed '/^Pictures: /d' >"$out/sample-$cast.txt"
done
samples/characters/run.sh knight --count 100 --every 1000 | sed '/^Pictures: /d' >"$out/sample-hundred.txt"

# The knight walks through the town, at four moments of a step.
"$nif" bake "$games/town/town_model.gltf" -o "$out/town.nif" --rays 0 --quiet
{
  cat <<TOML
[picture]
width = 720
height = 360
samples = 64
[[light]]
type = "sun"
direction = [0.4, 0.7, 0.5]
irradiance = [2.2, 2.1, 1.9]
[[light]]
type = "sky"
radiance = [0.5, 0.6, 0.8]
[[camera]]
name = "walk"
position = [20, 12.8, 25]
target = [15, 11.5, 16.5]
[[object]]
mesh = "$games/town/town_model.gltf"
nif = "town.nif"
TOML
  for step in 0 1 2 3; do
    cat <<TOML
[[object]]
mesh = "$games/knight/knight.glb"
nif = "knight.nif"
clip = "Walking_A"
time = $(awk -v step="$step" 'BEGIN { print 0.2 * step }')
translate = [$(awk -v step="$step" 'BEGIN { print 12 + 2.2 * step }'), 10.21, $(awk -v step="$step" 'BEGIN { print 18 + 0.4 * step }')]
TOML
  done
} >"$out/walk.toml"
"$nif" render "$out/walk.toml" -o "$out/pictures" --primary asset --json --quiet >"$out/walk.json"
cp "$out/pictures/walk-asset.png" docs/results/characters.png
python3 docs/results/characters.py "$out" "$(docs/results/machine.sh)" >docs/results/characters.md
