#!/usr/bin/env bash
# Does the judge find faults? Puts faults into a copy of the tree, one at a time, and judges for a minute.
#
#   tests/exact/mutations.sh [NAME...]     the named ones, or all; prints for each how long it took to find it
#
# Each takes about two minutes to build on two cores. The copy is in build/mutations, or in NIF_MUTATIONS. Ends with 1 if a
# fault is not found, or if the line that it changes no longer exists.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
copy=${NIF_MUTATIONS:-build/mutations} seconds=60

# A name, a file, and what sed does to it. Seams closed by slivers were once a fault. The judge leaves slivers out of half of
# its BVHs, so that seams open up there without tolerance at edges.
faults=(
  'no padding of boxes|kernels/reference/triangles/triangles_query.hpp|s/kBvhPadding = 0x1p-20f/kBvhPadding = 0/'
  'no padding of cells|bake/planes/fit_cells.cpp|s/^using kernels::kSurfacePadding;/constexpr double kSurfacePadding = 0;/'
  'planes moved inwards|bake/planes/fit_cells.cpp|s/kHeightMargin \+ kHeightRoom/kHeightMargin - 20/'
  'walls everywhere|bake/planes/fit_cells.cpp|s/wall = is_wall\(/wall = true || is_wall(/'
  'pockets called inside|bake/planes/fit_cells.cpp|s/(sides\.(above|below)\(number\))/(\1 ? \1 : 2)/g'
  'parity miscounted|bake/planes/fit_cells.cpp|s/if \(is_double_\[i\]\) continue/if (false) continue/'
  'no tolerance at edges|kernels/reference/triangles/triangles_query.hpp|s/kSurelyApart = 128 /kSurelyApart = 0 /'
  'nothing is looked at edge-on|kernels/reference/triangles/triangles_query.hpp|s/kEdgeOn = 0x1p-2f/kEdgeOn = 0/'
  'sides times depths in single precision|kernels/cpu/triangles/triangles-inl.hpp|s/\(\(u \* inverse\) \* z\[0\] \+ \(v \* inverse\) \* z\[1\]\) \+ \(w \* inverse\) \* z\[2\]/((u * z[0] + v * z[1]) + w * z[2]) * inverse/'
  'skewed instances far from their own origin|kernels/reference/instance.hpp|s/kMostOffset = 0x1p\+11f/kMostOffset = 0x1p+40f/'
  'boxes at the ends of floats|kernels/reference/instance.hpp|s/kMostT = 0x1p\+127f/kMostT = __builtin_inff()/'
)

mkdir -p "$copy"
copy=$(realpath "$copy")
# Unchanged files keep their time, so that they are not built again.
git ls-files -z | while IFS= read -r -d '' file; do
  cmp -s "$file" "$copy/$file" || { mkdir -p "$copy/$(dirname "$file")" && cp "$file" "$copy/$file"; }
done
cd "$copy"
launcher=()
if command -v ccache >/dev/null; then
  launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
fi
cmake --preset release -DNIF_BUILD_TESTS=ON -DNIF_UNITY=ON -DNIF_WITH_CGAL=OFF -DNIF_GPU_TARGETS= "${launcher[@]}" >/dev/null

missed=0
for fault in "${faults[@]}"; do
  IFS='|' read -r name file edit <<<"$fault"
  if (($# > 0)); then
    wanted=0
    for one in "$@"; do [[ $one != "$name" ]] || wanted=1; done
    ((wanted)) || continue
  fi
  cp -p "$file" "$file.right"
  sed -E -i "$edit" "$file"
  if cmp -s "$file" "$file.right"; then
    echo "$name: nothing in $file is changed by $edit"
    missed=1
  elif ! cmake --build build/release --target judge_rays >build/log 2>&1; then
    echo "$name: does not compile; see $copy/build/log"
    missed=1
  else
    start=$EPOCHREALTIME
    # Until the first wrong answer.
    if build/release/bin/judge_rays --first --seed 3 --seconds "$seconds" >build/said; then
      echo "$name: NOT FOUND: $(tail -n 1 build/said)"
      missed=1
    else
      awk -v name="$name" -v from="$start" -v to="$EPOCHREALTIME" 'NR == 1 { sub(/ o -?0x.*/, "")
        printf "%s: found in %.1f s: %s\n", name, to - from, $0 }' build/said
    fi
  fi
  mv "$file.right" "$file"
  touch "$file"
done
exit "$missed"
