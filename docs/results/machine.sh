#!/usr/bin/env bash
# Prints what pages of results say of the machine: the processor's name, family and model. Those in the cloud are all called the same.
set -euo pipefail
awk -F': ' '/^cpu family/ { family = $2 } /^model\t/ { model = $2 } /^model name/ { name = $2 } /^$/ { exit }
  END { printf "%s%s\n", name, family ? " (family " family ", model " model ")" : "" }' /proc/cpuinfo
