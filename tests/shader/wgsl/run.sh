#!/usr/bin/env bash
# Runs nif.wgsl by two compilers, Dawn's in node and naga in deno, on the objects and rays of tests/shader, and compares with
# nifQuery and nifIntersect. Of planes and networks no answer may be called certain, because WGSL proves nothing, and what is
# visible may differ in one of a million rays. Objects with triangles are asked with proofs, as GLSL has them: no answer that
# differs may be called certain, and most must be. Each is answered by the text with the sections that it needs, and the text with
# every other combination of sections must compile.
#
#   tests/shader/wgsl/run.sh [RAYS]    RAYS: of each named set through a baked torus (100,000)
#
# Dawn runs on the SwiftShader that comes with Chromium, naga on Mesa's lavapipe. Both hosts come from npm. Prints "Skipped: ..."
# for what is missing.
set -euo pipefail
case ${1-} in
  -h | --help) sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" && exit 0 ;;
esac
rays=${1-100000}
if (($# > 1)) || [[ ! $rays =~ ^[1-9][0-9]{0,6}$ ]]; then
  echo "tests/shader/wgsl/run.sh: give one number of rays; see --help" >&2
  exit 2
fi
cd "$(dirname "${BASH_SOURCE[0]}")/../../.."
here=tests/shader/wgsl
for program in node npm; do
  command -v "$program" >/dev/null || { echo "Skipped: $program is not installed (tools/setup.sh web)" && exit 0; }
done
out=build/wgsl
mkdir -p "$out/npm"
modules=$out/npm/node_modules
if ! cmp -s "$here/package-lock.json" "$out/npm/package-lock.json" || [[ ! -d $modules ]]; then
  cp "$here/package.json" "$here/package-lock.json" "$out/npm"
  (cd "$out/npm" && npm ci --silent --ignore-scripts --no-audit --no-fund) || {
    rm -rf "$out/npm"
    echo 'Skipped: npm cannot fetch webgpu and deno'
    exit 0
  }
fi
# Found as a module beside answer.mjs.
cp "$here/answer.mjs" "$out/npm"

text=kernels/shader/nif.wgsl
swiftshader=${NIF_SWIFTSHADER-/usr/lib/chromium/vk_swiftshader_icd.json}
by_dawn() { VK_ICD_FILENAMES=$swiftshader timeout 900 node "$out/npm/answer.mjs" "$@"; }
by_naga() { timeout 900 "$modules/@deno/linux-x64-glibc/deno" run --no-lock -A "$out/npm/answer.mjs" "$@"; }
hosts=()
if [[ -r $swiftshader ]]; then
  hosts+=(dawn)
else
  echo 'Skipped: Dawn, because Chromium with its SwiftShader is not installed (tools/setup.sh pages)'
fi
if [[ ! -x $modules/@deno/linux-x64-glibc/deno ]]; then
  echo 'Skipped: naga, because npm has no deno for this machine'
else
  hosts+=(naga)
fi
((${#hosts[@]})) || exit 0

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cases=$(find build/release -name shader_cases -type f -executable -print -quit)
if [[ -z $cases ]]; then
  echo "$here/run.sh: build the target shader_cases first" >&2
  exit 1
fi
mkdir "$scratch/cases"
"$cases" "$scratch/cases" "$rays"

failures=0
fail() {
  echo "$here/run.sh: $*" >&2
  failures=$((failures + 1))
}
for host in "${hosts[@]}"; do
  # A process for each case: node does not always survive more.
  for file in "$scratch"/cases/*.case; do
    "by_$host" "${file%.case}.wgsl" "$file" 2>"$scratch/said" || fail "$host: $(grep -v XDG_RUNTIME_DIR "$scratch/said")"
  done >"$scratch/$host"
  awk -v host="$host" '
    $1 == "planes" { rays += $3; visible += $4; certain += $5; logit += $7; cases++; bad = $4 + $5 }
    $1 == "triangles" { asked += $3; other += $4; proven += $5; wrong += $6; meshes++; bad = $6 }
    { device = $8; for (k = 9; k <= NF; ++k) device = device " " $k; if (bad > 0) print "  " $0 }
    END {
      printf "%s (%s): %d cases, %d rays, %d visible differ, %d are called certain, %d logits differ\n", host, device, cases, rays,
             visible, certain, logit
      printf "  triangles with proofs: %d cases, %d rays, %d differ, %d are called certain, %d of these differ\n", meshes, asked,
             other, proven, wrong
      exit !(rays > 0 && visible * 1000000 <= rays && certain == 0 && asked > 0 && wrong == 0 && proven * 2 > asked)
    }' "$scratch/$host" || fail "$host: see above"
  (($(wc -l <"$scratch/$host") == $(find "$scratch/cases" -name '*.case' | wc -l))) || fail "$host: not all cases were answered"

  for file in "$text" "$scratch"/cases/sections-*.wgsl; do
    "by_$host" "$file" 2>"$scratch/said" || fail "$host: $(grep -v XDG_RUNTIME_DIR "$scratch/said")"
  done

  # This would see a text that is wrong, or claims proofs that it does not have.
  file=$scratch/cases/segment-segments.case
  sed 's/nif_known(!nif_blocked,/nif_known(true,/' "$text" >"$scratch/wrong.wgsl"
  ! cmp -s "$text" "$scratch/wrong.wgsl" || fail 'the text is not as this test thinks'
  visible=0 certain=0
  read -r _ _ _ visible _ < <("by_$host" "$scratch/wrong.wgsl" "$file" 2>/dev/null) || true
  ((visible > 0)) || fail "$host: a wrong text is not seen"
  sed 's/NIF_PROVES : bool = false;/NIF_PROVES : bool = true;/' "$text" >"$scratch/proves.wgsl"
  read -r _ _ _ _ certain _ < <("by_$host" "$scratch/proves.wgsl" "$file" 2>/dev/null) || true
  ((certain > 0)) || fail "$host: a text that proves is not seen"
  # Without the bounds of triangles, rays on edges are called certain.
  sed -E -f tests/shader/boundless.sed "$text" >"$scratch/boundless.wgsl"
  ! cmp -s "$text" "$scratch/boundless.wgsl" || fail 'the text is not as this test thinks'
  wrong=0
  read -r _ _ _ _ _ wrong _ < <("by_$host" "$scratch/boundless.wgsl" "$scratch/cases/golden-v2-bvh-2.case" 2>/dev/null) || true
  ((wrong > 0)) || fail "$host: a text without bounds is not seen"
done
((failures == 0)) || exit 1
