# shellcheck shell=bash
# The meshes of several pages of results, for scripts that source this file: find_meshes sets `paths`. Of the environment it
# takes NIF_TEST_MESHES, the folder that holds them; tree and terrain are made in build/meshes, with `nif mesh generate`.

find_meshes() {
  local nif=$1 meshes generated mesh shape path
  : "${NIF_TEST_MESHES:?names the folder that holds the meshes}"
  meshes=(openscad_nonmanifold_1k.obj CesiumMan_skinned_4.7k.glb self_intersect_17k.obj
    cycloidal_43k_nonmanifold_100comp.ply bunny_zipper_69k_open.ply skull_100k.obj openfoam_DTC_hull_116k.stl.gz
    kicad_acepack_195k.ply openfoam_motorBike_332k_nasty.obj.gz stanford_dragon_871k.ply.gz kicad_board_1.0m.ply.zst
    kicad_board_6.94m.ply.zst)
  generated=(tree:500000 terrain:1000000)
  mkdir -p build/meshes
  paths=()
  for mesh in "${meshes[@]}"; do paths+=("$NIF_TEST_MESHES/$mesh"); done
  for shape in "${generated[@]}"; do
    path=build/meshes/generated_${shape%:*}.ply
    [[ -f $path ]] || "$nif" mesh generate "${shape%:*}" -o "$path" --triangles "${shape#*:}" --quiet
    paths+=("$path")
  done
}
