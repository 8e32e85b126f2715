#!/usr/bin/env bash
# Bakes meshes of 1,000 to a million triangles as fields and as BVHs, races the two, and writes
# docs/results/encoding.md: what each costs, and which of them `nif bake --encoding auto` takes. Takes an hour or so on
# two cores; assets that build/encoding holds already are not baked again.
#
#   NIF_TEST_MESHES=FOLDER docs/results/encoding.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
: "${NIF_TEST_MESHES:?names the folder that holds the meshes}"

meshes=(openscad_nonmanifold_1k.obj CesiumMan_skinned_4.7k.glb self_intersect_17k.obj
  cycloidal_43k_nonmanifold_100comp.ply bunny_zipper_69k_open.ply skull_100k.obj openfoam_DTC_hull_116k.stl.gz
  kicad_acepack_195k.ply openfoam_motorBike_332k_nasty.obj.gz stanford_dragon_871k.ply.gz kicad_board_1.0m.ply.zst)
nif=build/release/bin/nif out=build/encoding
mkdir -p "$out"

# bake NAME ENCODING: the asset, with what the program said of it beside it.
bake() {
  local at=$out/$1.$2
  if [[ -f $at.nif && -f $at.json ]]; then return; fi
  "$nif" bake "$NIF_TEST_MESHES/$1" -o "$at.nif" --encoding "$2" --rays 0 --quiet --json >"$at.json.new"
  mv "$at.json.new" "$at.json"
}

for mesh in "${meshes[@]}"; do
  bake "$mesh" bvh
  bake "$mesh" auto
  if [[ ! -f $out/$mesh.segment.nif && $(jq -r '.objects[0].encoding' "$out/$mesh.auto.json") == segment ]]; then
    cp "$out/$mesh.auto.nif" "$out/$mesh.segment.nif"  # the same field
    cp "$out/$mesh.auto.json" "$out/$mesh.segment.json"
  fi
  bake "$mesh" segment
  "$nif" bench "$out/$mesh.segment.nif" --against "$out/$mesh.bvh.nif" --mesh "$NIF_TEST_MESHES/$mesh" --threads 1 \
    --set outer-lines --set inner-surface --rays 200000 --quiet --json >"$out/$mesh.bench.json"
done

# A line a mesh: figures of the race, of the choice, and its reason.
rows() {
  for mesh in "${meshes[@]}"; do
    jq -r -s --arg mesh "$mesh" '
      .[0] as $auto | .[1] as $bench | $auto.objects[0] as $object | $bench.sets["outer-lines"] as $outer
      | $bench.sets["inner-surface"] as $inner
      | [$mesh, $auto.triangles, $outer.against.bytes, $outer.nif.bytes, $outer.error, $inner.error,
         $outer.against.error, $inner.against.error, $outer.ratio, $inner.ratio,
         $outer.against.mrays_per_s / $outer.embree.mrays_per_s, $inner.against.mrays_per_s / $inner.embree.mrays_per_s,
         $outer.against.ratio, $inner.against.ratio,
         (1 / $outer.against.mrays_per_s + 1 / $inner.against.mrays_per_s)
           / (1 / $outer.nif.mrays_per_s + 1 / $inner.nif.mrays_per_s),
         ($object.compared.bvh.work // 0) / ($object.compared.segment.work // 1), $object.encoding, $object.reason] | @tsv
    ' "$out/$mesh.auto.json" "$out/$mesh.bench.json"
  done
}

{
  printf '# Fields or BVHs\n\nWritten by `docs/results/encoding.sh`: change nothing here by hand. Machine: %s, one thread.\n' \
    "$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1)"
  rows | LC_ALL=C awk -F '\t' '
    function grouped(n,    text, out) {
      text = sprintf("%d", n)
      while (length(text) > 3) { out = "," substr(text, length(text) - 2) out; text = substr(text, 1, length(text) - 3) }
      return text out
    }
    function kilobytes(n) { return grouped(n / 1000 + 0.5) }
    { line[NR] = $0 }
    END {
      print "\n## What each takes and how often it is wrong\n"
      print "`nif bake MESH --encoding segment`, preset `balanced`, and `nif bake MESH --encoding bvh`; kilobytes are what the"
      print "runtime holds for the asset, as `nif bench` states them. The last column is what `--encoding auto` took.\n"
      print "| mesh | triangles | BVH, kB | field, kB | field wrong: outer-lines | inner-surface | BVH wrong | auto |"
      print "| --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |"
      for (i = 1; i <= NR; ++i) {
        split(line[i], f, "\t")
        printf "| %s | %s | %s | %s | %.3f %% | %.3f %% | %.4f %% | %s |\n", f[1], grouped(f[2]), kilobytes(f[3]),
               kilobytes(f[4]), 100 * f[5], 100 * f[6], 50 * (f[7] + f[8]), f[17]
      }
      print "\n## How fast they are\n"
      print "`nif bench FIELD --against BVH --mesh MESH --threads 1 --set outer-lines --set inner-surface --rays 200000`: all"
      print "figures are ratios of speeds that were measured in the same rounds. \"Embree\" is the best of its calls and builds."
      print "*Counted* is field / BVH for both sets together as the baker foretells it from voxels, rays left to the network,"
      print "nodes and leaves, which it counts (`bake/encoding.cpp`); beside it what was measured. Counting knows nothing of"
      print "caches: BVHs that no cache holds are slower than it says, so that auto errs on the side of exact answers.\n"
      print "| mesh | outer-lines: field / Embree | BVH / Embree | field / BVH | inner-surface: field / Embree | BVH / Embree | field / BVH | both: measured | counted |"
      print "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
      for (i = 1; i <= NR; ++i) {
        split(line[i], f, "\t")
        printf "| %s | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |\n", f[1], f[9], f[11], f[13], f[10], f[12],
               f[14], f[15], f[16]
      }
      print "\n## What auto says\n"
      print "By the rule of [../model.md](../model.md): a gain (bytes x work) of 100 for each percent of wrong answers.\n"
      for (i = 1; i <= NR; ++i) {
        split(line[i], f, "\t")
        printf "- `%s` is %s: %s\n", f[1], f[17], f[18]
      }
    }'
} >docs/results/encoding.md.new
mv docs/results/encoding.md.new docs/results/encoding.md
