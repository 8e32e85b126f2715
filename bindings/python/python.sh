# shellcheck shell=bash
# What build.sh and test.sh share; to be sourced.

# find_python MODULE...: prints a Python 3 that has these modules: NIF_PYTHON, that on PATH, or Debian's.
find_python() {
  local python
  local all='import importlib.util, sys; sys.exit(not all(map(importlib.util.find_spec, sys.argv[1:])))'
  for python in ${NIF_PYTHON:+"$NIF_PYTHON"} python3 /usr/bin/python3; do
    if "$python" -c "$all" "$@" >/dev/null 2>&1; then
      echo "$python"
      return
    fi
  done
  return 1
}
