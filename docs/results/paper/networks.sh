#!/usr/bin/env bash
# Compares one pair of networks for all objects of a scene with separate networks for each object. Writes
# docs/results/paper/networks.md. Takes about ten minutes on two cores.
#
#   docs/results/paper/networks.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
mesh=build/paper/many.glb model='Models: made by `nif mesh generate`.'
source docs/results/paper/common.sh

generated statue_1 statue 500000 1
generated statue_2 statue 500000 2
generated tree_1 tree 300000 1
generated mail_1 chain-mail 300000 1
generated tori_1 tori 200000 1
{
  placed statue_1 -2.6 3.01 0.6 1 20
  placed statue_2 2.6 3.01 0.6 1 -20
  placed tree_1 0 0.1 -2.5 0.6
  placed tori_1 -0.9 0.75 2.2 0.6 40
  placed mail_1 1.2 0.4 2.2 0.9
} | assembled many

samples=64
view many importance "$front"
bake many_own many $samples
bake many_shared many $samples --shared-network
bake_ours many_ours --preset fast
for kind in own shared ours; do
  judge "many_$kind" "$out/many_$kind.nif" "$front" none --sheet "$out/many_$kind.png" --thumbnail 280
done
cp "$out/many_shared.png" "$pages/networks-spherical.png"
cp "$out/many_ours.png" "$pages/networks-segment.png"

declare -A stated=([own]='31.3 dB' [shared]='31.4 dB' [ours]='')
declare -A what=([own]='`spherical`, networks for each object' [shared]='`spherical`, one pair for all' [ours]='`segment`, preset `fast`, any view and light')
{
  heading 'Shared networks, and one for each object'
  printf 'Five objects: two busts of 500,000 triangles each, a tree and a sheet of chain mail of 300,000 each, two tori of 200,000. Trained\n'
  printf 'with %s samples a pixel from the view that is judged.\n\n' $samples
  printf '| | file | bits | probability | the paper states, for its scene |\n| --- | ---: | ---: | ---: | ---: |\n'
  for kind in shared own ours; do
    printf '| %s | %s | %s dB | %s dB | %s |\n' "${what[$kind]}" "$(size "$out/many_$kind.nif")" "$(psnr "many_$kind" bits)" \
      "$(psnr "many_$kind" probability)" "${stated[$kind]}"
  done
  printf '\nFrom left to right: Embree, one pair of networks for all by probability, and their difference times 3:\n\n![By spherical fields](networks-spherical.png)\n'
  printf '\nThe same with `segment`:\n\n![By segment fields](networks-segment.png)\n'
} >"$pages/networks.md.new"
mv "$pages/networks.md.new" "$pages/networks.md"
