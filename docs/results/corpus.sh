#!/usr/bin/env bash
# Reads every mesh of some Debian packages, and those of NIF_TEST_MESHES where that is set, by `nif mesh info`, and
# writes docs/results/corpus.md: what was read and what is wrong with it, or why it was refused. Takes a minute or two.
#
#   apt-get install libcgal-demo openfoam-examples assimp-testmodels
#   docs/results/corpus.sh
#
# Ends with 1 where a mesh took more than a minute, or ended `nif` in another way than by reading or refusing it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

nif=${NIF:-build/release/bin/nif}
[[ -x $nif ]] || { echo "docs/results/corpus.sh: there is no $nif; build it first" >&2 && exit 1; }
packages=(libcgal-demo openfoam-examples assimp-testmodels)
for package in "${packages[@]}"; do
  dpkg -s "$package" >/dev/null 2>&1 || { echo "docs/results/corpus.sh: install $package first" >&2 && exit 1; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

meshes() { find "$1" -type f | grep -iE '\.(obj|ply|stl|off|gltf|glb|drc)(\.gz|\.zst)?$' | LC_ALL=C sort; }
# cell TEXT: as it may stand in a table.
cell() { sed 's/[|]/\\|/g; s/[<>]/ /g' <<<"$1" | tr -d '\n'; }

# row FOLDER FILE: one row of the table, and a line of outcomes.
row() {
  local folder=$1 file=$2 code=0 name
  name=${file#"$folder"/}
  timeout 60 "$nif" mesh info --json --self-intersections off "$file" >"$work/info" 2>"$work/error" || code=$?
  if ((code == 0)); then
    echo read >>"$work/outcomes"
    printf '| %s | ' "$(cell "$name")"
    jq -r '[.triangles, "\(.components) (\(.closed_components))", .boundary_edges, .non_manifold_edges, .inconsistent_edges,
            .degenerate, .duplicate] | map(tostring) | join(" | ") + " | |"' "$work/info"
  else
    ((code >= 10 && code < 30)) || { echo "$file: exit code $code" >>"$work/failures"; }
    echo "refused, $code" >>"$work/outcomes"
    # The sentence without the path of the file, which begins it.
    local why
    why=$(sed -n '/^nif: /{s///p;q}' "$work/error")
    why=${why//"$file"/}
    printf '| %s | | | | | | | | %s: %s |\n' "$(cell "$name")" "$code" "$(cell "$(sed "s/^[: ]*//; s|$folder/||g" <<<"$why")")"
  fi
}

# part TITLE FOLDER TEXT: a section.
part() {
  echo "docs/results/corpus.sh: $1" >&2
  : >"$work/outcomes"
  {
    printf '\n## %s\n\n%s\n\n' "$1" "$3"
    printf '| file | triangles | pieces (closed) | boundary edges | non-manifold | inconsistent | without area | duplicate | refused |\n'
    printf '| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |\n'
    meshes "$2" | while IFS= read -r file; do row "$2" "$file"; done
  } >>"$work/sections"
  local read refused
  read=$(grep -cx read "$work/outcomes" || true) refused=$(grep -c refused "$work/outcomes" || true)
  printf '| %s | %s | %s | %s |\n' "$1" "$((read + refused))" "$read" "$refused" >>"$work/summary"
}

version() { dpkg-query -W -f='${Version}' "$1"; }

mkdir "$work/cgal"
for archive in data demo; do tar xzf "/usr/share/doc/libcgal-dev/$archive.tar.gz" -C "$work/cgal"; done
part 'CGAL' "$work/cgal" "Debian \`libcgal-demo\` $(version libcgal-demo), \`data.tar.gz\` and \`demo.tar.gz\`: data of CGAL's
examples. Licence: CGAL as a whole is under GPL-3.0-or-later and LGPL-3.0-or-later; none is stated for single models."
part 'OpenFOAM' /usr/share/doc/openfoam-examples/examples "Debian \`openfoam-examples\` $(version openfoam-examples): surfaces of OpenFOAM's
tutorials. Licence: GPL-3.0-or-later."
part 'Assimp' /usr/share/assimp/models "Debian \`assimp-testmodels\` $(version assimp-testmodels): models of Assimp's tests, many of them
broken on purpose (\`invalid\`). Licence: BSD-3-Clause."
if [[ -n ${NIF_TEST_MESHES-} ]]; then
  part 'Test meshes' "$NIF_TEST_MESHES" "The folder that \`NIF_TEST_MESHES\` names. Origin and licence, from its \`SOURCES.txt\`:

$(awk 'NF > 7 && $1 ~ /\.|_/ && $2 ~ /^[0-9]+$/ { name = $1; $1 = $2 = $3 = $4 = $5 = $6 = $7 = ""; sub(/^ +/, ""); print "- `" name "`: " $0 }
       /accessor tris|Draco decode|1 skin|KHR_draco/ { print "- " $0 }' "$NIF_TEST_MESHES/SOURCES.txt" | sed 's/  */ /g')"
fi

{
  printf '# Meshes of others\n\n'
  printf 'Written by `docs/results/corpus.sh`, by `nif mesh info`: change nothing here by hand. Each file is read, with what is\n'
  printf 'wrong with its surface counted, or refused with an exit code ([README](../../README.md#exit-codes)) and a sentence. None ended\n'
  printf '`nif` in another way. *Pieces* are connected over edges; *inconsistent* edges are between triangles that face different ways\n'
  printf '([mesh-toolkit.md](../mesh-toolkit.md#info)).\n\n'
  printf '| from | files | read | refused |\n| --- | ---: | ---: | ---: |\n'
  cat "$work/summary" "$work/sections"
} >"$work/corpus.md"
if [[ -s $work/failures ]]; then
  cat "$work/failures" >&2
  exit 1
fi
mv "$work/corpus.md" docs/results/corpus.md
sed -n '/^| from/,/^$/p' docs/results/corpus.md
