#!/usr/bin/env python3
"""Do folders include only what docs/architecture.md says that they may use?

The page's table "Folders" has a row for each folder, whose last column names the folders that it may use. A file of a
folder may include what is in that folder, in those, and in what those may use. Prints each include that breaks this.
Ends with 77 outside a git work tree.
"""
import re
import subprocess
import sys

PAGE = "docs/architecture.md"


def read_table():
    """{folder: set of folders} of the table's rows, in its order; None: all folders of the rows before."""
    rows = {}
    text = open(PAGE, encoding="utf-8").read()
    table = text[text.index("| folder | what is in it | may use |"):]
    for line in table.split("\n\n")[0].splitlines()[2:]:
        folder, _, uses = [cell.strip() for cell in line.strip("|").rsplit("|", 2)] if line.count("|") == 4 else ("", "", "")
        names = re.findall(r"`([a-z_/0-9]+?)/?`", folder)
        if not names:
            continue
        used = set(re.findall(r"`([a-z_/0-9]+?)/?`", uses))
        rows[names[0]] = used | set(rows) if "all of the above" in uses else used
    return rows


def owner(path, folders):
    """The longest of the folders that the path is in."""
    inside = [folder for folder in folders if path.startswith(folder + "/")]
    return max(inside, key=len, default=None)


def allowed(folder, rows, seen=None):
    """The folder, and all that it may use, directly or not."""
    seen = set() if seen is None else seen
    if folder not in seen:
        seen.add(folder)
        for used in rows.get(folder, ()):
            allowed(used, rows, seen)
    return seen


def main():
    rows = read_table()
    listed = subprocess.run(["git", "ls-files", "*.cpp", "*.hpp", "*.h", "*.c"], capture_output=True, text=True)
    if listed.returncode != 0:
        return 77  # no git work tree, where nothing tells our files from others
    files = listed.stdout.split()
    known = set(files)
    wrong = 0
    for file in files:
        folder = owner(file, rows)
        if folder is None:
            continue
        may = allowed(folder, rows)
        for number, line in enumerate(open(file, encoding="utf-8"), 1):
            found = re.match(r'\s*#\s*include\s+["<]([^">]+)[">]', line)
            if not found:
                continue
            # The compilers' search path: the top, the file's folder, and the runtime's folders.
            tried = [found[1], file.rsplit("/", 1)[0] + "/" + found[1],
                     "runtime/src/" + found[1], "runtime/gpu/" + found[1], "runtime/include/" + found[1]]
            target = next((path for path in tried if path in known), None)
            if target is None or any(target.startswith(used + "/") for used in may):
                continue
            print(f"{file}:{number}: {folder} may not use {target} ({PAGE})")
            wrong += 1
    if len(rows) < 12 or wrong:
        print(f"tests/style/uses.py: {wrong} includes beyond the {len(rows)} rows of {PAGE}", file=sys.stderr)
        return 1
    return 0


sys.exit(main())
