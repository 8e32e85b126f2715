#!/usr/bin/env bash
# Makes docs/results/front.png, the picture in README.md: the Stanford dragon under sun and sky, with shadows by Embree, by
# an asset of preset `balanced`, and by the paper's method (preset `paper`). Also writes docs/results/front.md, with all
# numbers and where they come from. Neither bake knows the view or the lights.
#
# Needs the Debian packages jq, librsvg2-bin and fonts-dejavu-core. Takes some 3 minutes of one core.
#
#   docs/results/front.sh       NIF=PROGRAM: a `nif` that is built already
#
# Speeds are not measured here. They are read from docs/results/speed.md and docs/results/paper/time.md, which were measured
# on a quiet machine.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
for program in jq rsvg-convert; do
  command -v $program >/dev/null || { echo "docs/results/front.sh: $program is not installed" >&2 && exit 1; }
done

nif=${NIF-build/release/bin/nif}
mesh=build/sample/stanford_dragon.ply.gz ours=build/sample/stanford_dragon.nif out=build/front pages=docs/results
mkdir -p "$out"
[[ -f $ours ]] || samples/run.sh >/dev/null
[[ -f $mesh ]] || { echo 'docs/results/front.sh: the Stanford dragon is missing' >&2 && exit 1; }
[[ -n ${NIF-} ]] || cmake --build build/release --target nif >&2
papers=$out/paper.nif
[[ -f $papers ]] || "$nif" bake "$mesh" -o "$papers" --preset paper --rays 0 --quiet

# One scene for each asset; they differ in its name alone. The second camera looks at the neck from nearby.
for asset in ours papers; do
  cat >"$out/$asset.toml" <<END
[picture]
samples = 64
ground_level = 0.8

[[object]]
mesh = "../../$mesh"
nif = "../../${!asset}"
albedo = [0.24, 0.45, 0.32]

[ground]
albedo = [0.72, 0.68, 0.62]
size = 60

[[light]]
type = "sun"
direction = [0.8, 0.6, 0.13]
irradiance = [3.2, 2.75, 2.15]
angle = 0.53

[[light]]
type = "sky"
radiance = [0.22, 0.28, 0.39]

[[camera]]
name = "whole"
position = [-0.235, 0.262, 0.365]
target = [-0.013, 0.116, 0.0]
fov = 25

[[camera]]
name = "near"
position = [-0.36, 0.33, 0.62]
target = [-0.047, 0.137, 0.02]
fov = 4.2
END
  "$nif" render "$out/$asset.toml" -o "$out/$asset" --camera whole --width 516 --height 412 --quiet --json \
    >"$out/$asset.whole.json"
  "$nif" render "$out/$asset.toml" -o "$out/$asset" --camera near --width 516 --height 272 --quiet --json \
    >"$out/$asset.near.json"
  "$nif" eval "${!asset}" --mesh "$mesh" --bvh --set inner-surface --quiet --json >"$out/$asset.eval.json"
done

# number FILTER FILE, megabytes FILTER FILE, percent FILTER FILE: from JSON, to print.
number() { jq -r "$1" "$2"; }
megabytes() { jq -r "$1" "$2" | LC_ALL=C awk '{ printf($1 < 1e7 ? "%.2f MB" : "%.1f MB", $1 / 1e6) }'; }
percent() { jq -r "$1" "$2" | LC_ALL=C awk '{ printf("%.2f %%", 100 * $1) }'; }
# Times the speed of Embree, from the pages: the first table of speed.md, and the column "Embree / `spherical`" of time.md.
our_speed=$(awk '$1 == "inner-surface" { print $(NF - 1); exit }' $pages/speed.md)
papers_speed=$(awk -F ' *[|] *' '$2 == "dragon" && $4 == "inner-surface" { print $13; exit }' $pages/paper/time.md)
for speed in "$our_speed" "$papers_speed"; do
  [[ $speed =~ ^[0-9]+\.[0-9]+$ ]] || { echo "docs/results/front.sh: no speed in the results: '$speed'" >&2 && exit 1; }
done
round_to_tenth() { LC_ALL=C awk -v number="$1" 'BEGIN { printf("%.1f", number) }'; }

# panel X TITLE SUBTITLE WHOLE NEAR BYTES WRONG SPEED: a column of the picture, as SVG.
panel() {
  printf '<g transform="translate(%s 0)">\n' "$1"
  printf '<text x="0" y="38" font-size="27" font-weight="bold" fill="#1c2321">%s</text>\n' "$2"
  printf '<text x="0" y="64" font-size="17" fill="#5b6663">%s</text>\n' "$3"
  printf '<image x="0" y="80" width="516" height="412" href="%s"/>\n' "$4"
  printf '<image x="0" y="500" width="516" height="272" href="%s"/>\n' "$5"
  local x=0 row label value
  for row in "in memory|$6" "shadow rays wrong|$7" "speed (Embree: 1)|$8"; do
    label=${row%%|*} value=${row#*|}
    printf '<text x="%s" y="811" font-size="28" font-weight="bold" fill="#1c2321">%s</text>\n' "$x" "$value"
    printf '<text x="%s" y="836" font-size="16" fill="#5b6663">%s</text>\n' "$x" "$label"
    x=$((x + 176))
  done
  printf '</g>\n'
}
embree_bytes=$(megabytes .bvh.embree_default.bytes "$out/ours.eval.json")
our_bytes=$(megabytes .bytes.resident "$out/ours.eval.json") papers_bytes=$(megabytes .bytes.resident "$out/papers.eval.json")
our_error=$(percent .cameras.whole.error "$out/ours.whole.json")
papers_error=$(percent .cameras.whole.error "$out/papers.whole.json")
{
  printf '<svg xmlns="http://www.w3.org/2000/svg" width="1600" height="856" font-family="DejaVu Sans">\n'
  printf '<rect width="1600" height="856" fill="#ffffff"/>\n'
  panel 12 'Embree' "BVH of all $(number .triangles "$out/ours.eval.json" | sed -E ':a;s/([0-9])([0-9]{3})($|,)/\1,\2\3/;ta') triangles" \
    ours/whole-reference.png ours/near-reference.png "$embree_bytes" '0 %' '1 ×'
  panel 542 'nifkit' 'field, preset &#8220;balanced&#8221;' ours/whole-bits.png ours/near-bits.png "$our_bytes" "$our_error" \
    "$(round_to_tenth "$our_speed") ×"
  panel 1072 'The paper&#8217;s method' 'Neural Intersection Function 2023, for any view' papers/whole-bits.png papers/near-bits.png \
    "$papers_bytes" "$papers_error" "$(round_to_tenth "$papers_speed") ×"
  printf '</svg>\n'
} >"$out/front.svg"
rsvg-convert "$out/front.svg" -o "$out/front.png"
mv "$out/front.png" "$pages/front.png"

cell() { number ".cameras.$1.pictures.bits.psnr | . * 10 | round / 10" "$out/$2.$1.json"; }
{
  printf '# The picture in the README\n\n'
  printf 'Written by `docs/results/front.sh`: do not edit by hand.\n\n'
  printf '![The Stanford dragon with shadows by Embree, by nifkit and by the method of the paper](front.png)\n\n'
  printf 'Camera rays are answered by Embree in all pictures. Shadow rays are answered by Embree (left), by an asset of preset\n'
  printf '`balanced` (middle), and by one of preset `paper` (right): 64 rays through each pixel, each with one shadow ray to the sun\n'
  printf 'and one to the sky. The lower row shows the neck from nearby. Both assets were baked from rays of all directions and know\n'
  printf 'neither the view nor the lights. The paper (Fujieda, Kao, Harada, HPG 2023) trains for one view and its lights, which is an\n'
  printf 'easier task; [paper/](paper/README.md) repeats its experiments that way.\n\n'
  printf '| | Embree | nifkit, `balanced` | paper, `paper` | measured by |\n'
  printf '| --- | ---: | ---: | ---: | --- |\n'
  printf '| bytes in memory | %s | %s | %s | `nif eval --bvh` |\n' "$(number .bvh.embree_default.bytes "$out/ours.eval.json")" \
    "$(number .bytes.resident "$out/ours.eval.json")" "$(number .bytes.resident "$out/papers.eval.json")"
  printf '| bytes of the file | | %s | %s | `nif eval` |\n' "$(number .bytes.file "$out/ours.eval.json")" \
    "$(number .bytes.file "$out/papers.eval.json")"
  for camera in whole near; do
    printf '| shadow rays wrong, %s view | | %s | %s | `nif render` |\n' "$camera" \
      "$(percent ".cameras.$camera.error" "$out/ours.$camera.json")" "$(percent ".cameras.$camera.error" "$out/papers.$camera.json")"
    printf '| PSNR, %s view | | %s dB | %s dB | `nif render` |\n' "$camera" "$(cell $camera ours)" "$(cell $camera papers)"
  done
  printf '| a million `inner-surface` rays wrong | | %s | %s | `nif eval` |\n' \
    "$(percent '.sets["inner-surface"].error' "$out/ours.eval.json")" "$(percent '.sets["inner-surface"].error' "$out/papers.eval.json")"
  printf '| speed on `inner-surface`, one thread | 1 | %s | %s | [speed.md](speed.md), [paper/time.md](paper/time.md) |\n' \
    "$our_speed" "$papers_speed"
  printf '\nEmbree is its default build, and its speed that of the fastest of all its builds and calls. The two speeds come from two\n'
  printf 'runs, each beside Embree. `inner-surface` rays start on the surface in random directions; [speed.md](speed.md)\n'
  printf 'has other rays, too.\n\n'
  printf 'Model: the Stanford dragon, Stanford University Computer Graphics Laboratory, from the Stanford 3D Scanning Repository\n'
  printf '(<https://graphics.stanford.edu/data/3Dscanrep/>). Acknowledge the source; free for research; no commercial use without\n'
  printf 'permission.\n'
} >"$pages/front.md.new"
mv "$pages/front.md.new" "$pages/front.md"
