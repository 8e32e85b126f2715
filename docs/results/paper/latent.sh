#!/usr/bin/env bash
# Varies the size N of latent vectors: 3 to 7 in the outer grids; in the inner grids 2 to 5 over angles by 3 to 6 over the
# distance. Writes docs/results/paper/latent.md. Takes half an hour on two cores.
#
#   docs/results/paper/latent.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
source docs/results/paper/common.sh

samples=32
view view importance "$front"
for n in 3 4 5 6 7; do
  bake "latent_$n" view $samples --outer-features "$n"
  judge "latent_$n" "$out/latent_$n.nif" "$front" inside
done
for angles in 2 3 4 5; do
  for distance in 3 4 5 6; do
    name=latent_${angles}_$distance
    bake "$name" view $samples --inner-features "$angles" --distance-features "$distance"
    judge "$name" "$out/$name.nif" "$front" outside
  done
done
judge ours_outer "$ours" "$front" inside
judge ours_inner "$ours" "$front" outside

cell() { printf ' %s dB (%s), %s |' "$(psnr "$1" probability)" "$(psnr "$1" bits)" "$(size "$out/$1.nif")"; }
{
  heading 'Size of the latent vectors'
  printf 'Trained with %s samples a pixel from the view that is judged. The columns show PSNR by probability (and by bits), and the size of the whole\n' $samples
  printf 'file.\n\n'
  printf '## Outer grids\n\nEmbree answers the rays from inside.\n\n| N | |\n| ---: | --- |\n'
  for n in 3 4 5 6 7; do printf '| %s |%s\n' "$n" "$(cell "latent_$n")"; done
  printf '| `segment` | %s dB (%s), %s |\n' "$(psnr ours_outer probability)" "$(psnr ours_outer bits)" "$(size "$ours")"
  printf '\n## Inner grids\n\nEmbree answers the rays from outside.\n\n| over angles |'
  for distance in 3 4 5 6; do printf ' %s over the distance |' "$distance"; done
  printf '\n| ---: | --- | --- | --- | --- |\n'
  for angles in 2 3 4 5; do
    printf '| %s |' "$angles"
    for distance in 3 4 5 6; do cell "latent_${angles}_$distance"; done
    printf '\n'
  done
  printf '\n`segment` on the same rays: %s dB (%s), %s.\n' "$(psnr ours_inner probability)" "$(psnr ours_inner bits)" "$(size "$ours")"
} >"$pages/latent.md.new"
mv "$pages/latent.md.new" "$pages/latent.md"
