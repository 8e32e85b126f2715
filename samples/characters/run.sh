#!/usr/bin/env bash
# Characters walk in a circle, posed in each frame and lit by assets only. Builds, generates and bakes what it needs, draws
# pictures, and prints times and bytes of a frame.
#
#   samples/characters/run.sh [figure|knight] [options of the program]
#
# figure: a generated character on a generated square. knight: the knight and the town of two games, which the folder that
# NIF_TEST_GAMES names has (knight/knight.glb, town/town_model.gltf). Without either: the knight if it is there. Options are in
# samples/characters/README.md. Results are in build/characters-sample.
set -euo pipefail

case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
cast=''
if [[ -n ${1-} && $1 != -* ]]; then
  cast=$1
  shift
fi
games=${NIF_TEST_GAMES:+$(realpath -m "$NIF_TEST_GAMES")}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=samples/prepare.sh
source samples/prepare.sh

if [[ -z $cast ]]; then
  cast=figure
  if [[ -n $games && -r $games/knight/knight.glb && -r $games/town/town_model.gltf ]]; then cast=knight; fi
fi
out=build/characters-sample
mkdir -p "$out"
case $cast in
  figure)
    python3 samples/characters/make_figure.py "$out"
    mesh=$out/figure.glb place=$out/plaza.glb options=()
    ;;
  knight)
    [[ -n $games ]] || { say 'samples/characters/run.sh: NIF_TEST_GAMES does not name a folder' && exit 2; }
    mesh=$games/knight/knight.glb place=$games/town/town_model.gltf
    # It carries everything that it can: it keeps a sword and the round shield.
    options=(--clip Walking_A --hide 1H_Sword_Offhand --hide 2H_Sword --hide Badge_Shield --hide Rectangle_Shield
      --hide Spike_Shield --count 9 --circle '13,18,4.6' --speed 1.9
      --eye '24,13.9,27' --target '14.2,11.1,18')
    ;;
  *) say "samples/characters/run.sh: figure or knight, not '$cast'; see --help" && exit 2 ;;
esac
for file in "$mesh" "$place"; do
  [[ -r $file ]] || { say "samples/characters/run.sh: cannot read $file" && exit 2; }
done
prepare_nifkit

cmake -S samples/characters -B "$out/build" -G Ninja -DCMAKE_PREFIX_PATH="$(realpath "$prefix")" >/dev/null
cmake --build "$out/build" >&2
# Shields stay separate, because the program hides them one by one.
except=()
if [[ $cast == knight ]]; then except=(--merge-except '*Shield*'); fi
"$nif" bake "$mesh" -o "$out/$cast.nif" --deforms --source-triangles "${except[@]}" --rays 0 --quiet
place_asset=$out/$(basename "${place%.*}").nif
"$nif" bake "$place" -o "$place_asset" --encoding exact --colors --rays 0 --quiet
"$out/build/characters" "$out/$cast.nif" "$mesh" "$place_asset" -o "$out/$cast" "${options[@]}" "$@"
printf '\nPictures: %s-000.png and so on\n' "$out/$cast"
