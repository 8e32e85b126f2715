# shellcheck shell=bash
# For scripts of results that go on where they stopped, and source this file.

# once FILE COMMAND...: leaves what the command prints in the file.
once() {
  local file=$1
  shift
  [[ -f $file ]] && return
  "$@" >"$file.new"
  mv "$file.new" "$file"
}
