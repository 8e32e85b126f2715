#!/usr/bin/env bash
# Writes the pages that nif makes for people, and looks at them in a headless Chromium (check.py): the report of a bake, the page
# of a manifest with more assets than fit, and a study.
#
#   tests/pages/run.sh [NIF]    NIF: the program; by default build/release/bin/nif
#
# Pictures of all pages go to build/pages. Needs tools/setup.sh pages; without these packages it prints why it is skipped.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

if [[ ${1-} == -h || ${1-} == --help ]]; then
  sed -n '2,/^set /{/^set /d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
  exit 0
fi
nif=$(realpath "${1-build/release/bin/nif}")
for program in chromium chromedriver; do
  command -v "$program" >/dev/null || { echo "Skipped: there is no $program; tools/setup.sh pages installs it" && exit 0; }
done

folder=build/pages
rm -rf "$folder"
mkdir -p "$folder/library"
"$nif" mesh generate statue -o "$folder/statue.ply" --triangles 20000 --quiet
"$nif" bake "$folder/statue.ply" -o "$folder/statue.nif" --preset fast --encoding segment --rays 20000 \
  --report "$folder/report.html" --quiet
"$nif" study "$folder/statue.ply" -o "$folder/study" --quick --rays 5000 --quiet
# Names that need escaping, long ones, and one that fails.
for name in 'a & b' '<i>c' "$(printf 'long%.0s' {1..20})" d e f g h; do
  "$nif" mesh generate torus -o "$folder/library/$name.ply" --triangles 500 --quiet
done
echo nonsense >"$folder/library/broken.ply"
cat >"$folder/library.toml" <<END
[defaults]
encoding = "bvh"
[[asset]]
mesh = "library/*.ply"
output = "baked/{stem}.nif"
END
# Ends with the code of the mesh that is none.
if "$nif" bake --manifest "$folder/library.toml" --keep-going --report "$folder/manifest.html" --quiet 2>"$folder/manifest.log"; then
  echo 'a mesh that is none was baked' >&2
  exit 1
fi
python3 tests/pages/check.py "$folder" "$folder/report.html" "$folder/study/study.html" "$folder/manifest.html"
echo "3 pages are as they should be; pictures in $folder"
