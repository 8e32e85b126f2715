#!/usr/bin/env python3
"""Compares docs/bindings.md with nif.h and with what the bindings call.

    tests/style/bindings.py [ROOT]    nifkit's folder; by default the one that this file is in

Every function of nif.h needs a row of its own, and every cell has to be right: a dash where the binding does not call the
function, and words where it does. For C++, nif.hpp must also have each name of a cell, in the class that the cell says, that
class must call the function, and the page must say after the table why a function has a dash. Ends with 1, and says what is
wrong. A binding whose folder is not here is left out, and named.
"""
import re
import sys
from pathlib import Path

# For each column: the files that call functions, and those that only declare them.
BINDINGS: dict[str, tuple[str, tuple[str, ...]]] = {
    "C++": ("runtime/include/nif/nif.hpp", ()),
    "Python": ("bindings/python/nifkit/*.py", ("_abi.py",)),
    "web": ("bindings/web/src/*.cpp", ()),
    "LÖVE": ("samples/love/nif.lua", ()),
}
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
FUNCTION = re.compile(r"\bNIF_API\b[^;(]*?\b(nif[A-Z]\w*)\s*\(")
NAME = re.compile(r"\bnif[A-Z]\w*")
CLASS = re.compile(r"^class (\w+)[^;{]*\{.*?^\};", re.DOTALL | re.MULTILINE)
CPP_NAME = re.compile(r"`(?:(\w+)::)?(~?\w+)(\(\))?`")  # of a cell: Class::member(), function() or Class
HEADER = ["nif.h", *BINDINGS]


def functions_of(header: Path) -> list[str]:
    return FUNCTION.findall(COMMENT.sub(" ", header.read_text(encoding="utf-8")))


def table_of(page: Path) -> list[list[str]]:
    """The rows of the table whose head is HEADER, without it; each a list of cells."""
    rows: list[list[str]] = []
    inside = False
    for line in page.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else []
        if cells == HEADER:
            inside = True
        elif inside and not cells:
            break
        elif inside and not re.fullmatch(r"[-: ]+", "".join(cells)):
            rows.append(cells)
    return rows


def calls_of(root: Path, files: str, but: tuple[str, ...]) -> set[str] | None:
    """The functions that a binding names; None if it is not here."""
    found = [path for path in root.glob(files) if path.name not in but]
    if not found:
        return None
    return {name for path in found for name in NAME.findall(path.read_text(encoding="utf-8"))}


def reasons_of(page: Path) -> str:
    """The text between the table and the next heading."""
    text = page.read_text(encoding="utf-8").partition(f"| {' | '.join(HEADER)} |")[2]
    return re.split(r"^#", "\n".join(line for line in text.splitlines() if not line.startswith("|")), flags=re.MULTILINE)[0]


def cpp_problems(root: Path, rows: list[list[str]]) -> list[str]:
    """What is wrong with the names of nif.hpp in the table's second column."""
    header = COMMENT.sub(" ", (root / BINDINGS["C++"][0]).read_text(encoding="utf-8"))
    classes = {found[1]: found[0] for found in CLASS.finditer(header)}
    outside = CLASS.sub(" ", header)
    reasons = reasons_of(root / "docs/bindings.md")
    found = []
    for function, cell in ((row[0].strip("`"), row[1]) for row in rows):
        if cell == "-":
            if not re.search(rf"`{function}`", reasons):
                found.append(f"docs/bindings.md: {function}: a dash for C++, and no reason below the table")
            continue
        names = CPP_NAME.findall(cell)
        if not names:
            found.append(f"docs/bindings.md: {function}: '{cell}' names nothing of nif.hpp")
        for owner, name, call in names:
            # A constructor, a destructor and a class's own name are in the class.
            owner = owner or (name.strip("~") if name.strip("~") in classes else "")
            place = classes.get(owner, "") if owner else outside
            if not re.search(rf"(?<![\w~]){name}" + (r"\s*\(" if call else r"\b"), place):
                found.append(f"docs/bindings.md: {function}: nif.hpp has no {owner + '::' if owner else ''}{name}{call}")
            elif not re.search(rf"\b{function}\b", place):
                found.append(f"docs/bindings.md: {function}: {owner or name} does not call it in nif.hpp")
    return found


def problems(root: Path) -> list[str]:
    functions = functions_of(root / "runtime/include/nif/nif.h")
    rows = table_of(root / "docs/bindings.md")
    if not functions:
        return ["runtime/include/nif/nif.h: no functions found"]
    if not rows:
        return [f"docs/bindings.md: no table with the head {' | '.join(HEADER)}"]
    found = [f"docs/bindings.md: a row has {len(row)} cells: {row[0]}" for row in rows if len(row) != len(HEADER)]
    if found:
        return found
    names = [row[0].strip("`") for row in rows]
    found += [f"docs/bindings.md: no row for {name}" for name in functions if name not in names]
    found += [f"docs/bindings.md: {name} is no function of nif.h" for name in names if name not in functions]
    found += [f"docs/bindings.md: two rows for {name}" for name in sorted(set(names)) if names.count(name) > 1]
    found += cpp_problems(root, rows)
    for column, (binding, (files, but)) in enumerate(BINDINGS.items(), start=1):
        calls = calls_of(root, files, but)
        if calls is None:
            print(f"{binding} is not here: {files}")
            continue
        for name, row in zip(names, rows):
            if row[column] == "":
                found.append(f"docs/bindings.md: {name}: the cell of {binding} is empty")
            elif (row[column] == "-") == (name in calls):
                what = "a dash, but it is called" if row[column] == "-" else f"'{row[column]}', but nothing calls it"
                found.append(f"docs/bindings.md: {name}: {binding} has {what} in {files}")
    return found


def main() -> int:
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parents[2]
    found = problems(root)
    for problem in found:
        print(f"tests/style/bindings.py: {problem}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
