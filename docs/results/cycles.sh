#!/usr/bin/env bash
# Measures samples/cycles with the Stanford dragon, and writes a page about it, with its picture, beside this script. Takes a few
# minutes on two cores. Let nothing else run meanwhile.
#
#   NIF_TEST_MESHES=FOLDER docs/results/cycles.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
: "${NIF_TEST_MESHES:?names the folder that holds the meshes}"
load=$(cut -d' ' -f1 /proc/loadavg)

size=400 samples=16 rounds=5
dragon=$NIF_TEST_MESHES/stanford_dragon_871k.ply.gz
said=$(NIF_CYCLES_ROUNDS=$rounds samples/cycles/run.sh $size $samples "$dragon")
name=build/cycles/stanford_dragon_871k
cp $name.beside.png docs/results/cycles.png

# row START: the line of the table that starts so, as cells.
row() { sed -nE "s/^$1 +([0-9.]+) +([0-9.]+)$/\1 | \2/p" <<<"$said"; }
triangles=$(sed -nE 's/^triangles \(Embree\) +([0-9.]+)$/\1/p' <<<"$said")
seconds=$(sed -nE "s/^its asset +[0-9.]+ +([0-9.]+)$/\1/p" <<<"$said")
grouped() { sed -E ':a; s/([0-9])([0-9]{3})($|,)/\1,\2\3/; ta' <<<"$1"; }
read -r asked blocked < <(sed -nE 's/^shadow_rays: .* answered ([0-9]+) .* blocked ([0-9]+)$/\1 \2/p' <<<"$said")
cat >docs/results/cycles.md <<PAGE
# Shadow rays of Cycles through an asset

Made by \`docs/results/cycles.sh\`: [samples/cycles](../../samples/cycles/README.md) with the Stanford dragon, ${size} x ${size}
pixels and $samples samples a pixel, on $(nproc) threads of $(lscpu | sed -n 's/^Model name: *//p' | head -n 1), $(blender --version | head -n 1). When it
began, the load average was $load.

![The dragon with its shadow by triangles, by its asset, and without one](cycles.png)

Shadow by triangles, by the asset, and none. Model: the Stanford dragon, Stanford University Computer Graphics Laboratory
(acknowledge the source; free for research; no commercial use without permission).

| shadow of the dragon by | PSNR against the first, dB | processor time, s, the least of $rounds |
| --- | ---: | ---: |
| triangles (Embree in Cycles) | | $triangles |
| its asset, preset \`fast\` | $(row 'its asset') |
| nothing | $(row nothing) |

**The picture by the asset takes $(awk "BEGIN { printf \"%.2f\", $seconds / $triangles }") times as long.** Cycles asks for one ray at a time, so the asset is asked so,
too, and its speed is in batches ([speed.md](speed.md)); and Embree's shadow rays are a small part of this picture's time.

The asset answered $(grouped "$asked") shadow rays in each picture, and blocked $(grouped "$blocked") of them. The time is that of all threads, for
the whole picture, from the scene to the file, with Cycles' own build of Embree's BVH, which all three need for camera rays;
the second one also builds a scene of the other objects. The pictures take turns.
PAGE
