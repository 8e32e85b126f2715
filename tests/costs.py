#!/usr/bin/env python3
"""Which tests of a plain `tests/run.sh` take more processor time than they may (CONTRIBUTING.md says what that means).

  tests/costs.py [--limit SECONDS] [BUILD [REGEX]]

Runs the tests of a build folder (build/release) one by one, or those whose names a regular expression finds, and prints the
processor and wall seconds of each. At the end it lists those above the limit (3 processor seconds) that are not labelled
`long`. Processor seconds, of a test and all that it starts, depend little on what else the machine does.
"""
import argparse
import json
import os
import re
import subprocess
import time
from pathlib import Path

def spent() -> float:
    times = os.times()
    return times.children_user + times.children_system


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--limit", type=float, default=3)
    parser.add_argument("build", nargs="?", type=Path, default=Path("build/release"))
    parser.add_argument("regex", nargs="?", default="")
    arguments = parser.parse_args()
    listed = subprocess.run(["ctest", "--show-only=json-v1"], cwd=arguments.build, check=True, stdout=subprocess.PIPE)
    took = []
    for test in json.loads(listed.stdout)["tests"]:
        properties = {each["name"]: each["value"] for each in test.get("properties", [])}
        left_out = "long" in properties.get("LABELS", []) or properties.get("DISABLED") or "command" not in test
        if left_out or not re.search(arguments.regex, test["name"]):
            continue
        environment = dict(os.environ)
        environment.update(pair.split("=", 1) for pair in properties.get("ENVIRONMENT", []))
        before, start = spent(), time.monotonic()
        done = subprocess.run(test["command"], cwd=properties.get("WORKING_DIRECTORY", arguments.build), env=environment,
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        took.append((spent() - before, test["name"]))
        print(f"{took[-1][0]:8.2f} {time.monotonic() - start:8.2f}  {test['name']}"
              f"{'  (failed)' if done.returncode else ''}", flush=True)
    print(f"\n{len(took)} tests: {sum(seconds for seconds, _ in took):.0f} processor seconds; above {arguments.limit:g}:")
    for seconds, name in sorted(took, reverse=True):
        if seconds > arguments.limit:
            print(f"{seconds:8.2f}  {name}")


if __name__ == "__main__":
    main()
