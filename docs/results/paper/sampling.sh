#!/usr/bin/env bash
# Training directions drawn uniformly, or by the sky's light, after 32 and 128 samples a pixel. Writes
# docs/results/paper/sampling.md. Takes about ten minutes on two cores.
#
#   docs/results/paper/sampling.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
source docs/results/paper/common.sh

for sampling in uniform importance; do
  view "$sampling" "$sampling" "$front"
  for samples in 32 128; do
    bake "${sampling}_$samples" "$sampling" "$samples"
    judge "${sampling}_$samples" "$out/${sampling}_$samples.nif" "$front" none
  done
done
judge ours_both "$ours" "$front" none
{
  heading 'Uniform and importance sampling of training directions'
  printf '| training directions | samples a pixel | file | bits | probability |\n| --- | ---: | ---: | ---: | ---: |\n'
  for sampling in uniform importance; do
    for samples in 32 128; do
      name=${sampling}_$samples
      printf '| %s | %s | %s | %s dB | %s dB |\n' "$sampling" "$samples" "$(size "$out/$name.nif")" "$(psnr "$name" bits)" "$(psnr "$name" probability)"
    done
  done
  printf '| `segment`, any light | | %s | %s dB | %s dB |\n' "$(size "$ours")" "$(psnr ours_both bits)" "$(psnr ours_both probability)"
} >"$pages/sampling.md.new"
mv "$pages/sampling.md.new" "$pages/sampling.md"
