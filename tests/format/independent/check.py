#!/usr/bin/env -S python3 -B
"""Checks assets and their golden answers with a reader that shares no code with nifkit.

    check.py [--self-test COUNT] FILE.nif [FILE.answers | FILE.hits]... [FILE.nif ...]...
    check.py --pieces FILE.nif [FILE.answers | FILE.hits]... [FILE.nif ...]...
    check.py --numbered TABLE NUMBER-NAME.nif...

This folder is written from docs/format.md and docs/answers.md alone, in plain Python 3.11, one operation of
single precision at a time. It shows that the documents are enough to write a reader. It is no tool: it is slow.

Refuses a file that breaks a rule of docs/format.md, and compares every part of every answer and of every first hit
(docs/answers.md, "Golden answers"). Prints a line for each file. Ends with 1 if a file is refused or an answer differs.

--self-test shows that this can fail. It damages each file COUNT times in each of three ways, and each array of
answers and hits, in memory, and demands that the damage is reported.

--pieces reads each object by itself, through ranges of the file, compares every tenth of its answers and first hits, and
demands that nothing of other objects' payloads is read.

--numbered takes files that each show a finding of `nif validate`, and TABLE is docs/validation.md, which has the
exit code of each number. Files of numbers with an exit code have to be refused with it, and those of the others
read.
"""

import random
import struct
import sys
from collections import Counter
from functools import partial
from pathlib import Path

from asset import Asset, Piece
from forge import PLACES, Forge, entries, with_checksums
from scene import object_scene, whole_scene
from shell import ENTRY, HEADER, Refused

ANSWER = struct.Struct("<I3f3fffiBBH")
HIT_RAY, HIT = struct.Struct("<I3f3fff"), struct.Struct("<6f3I5fBBH")
SIZES = {".answers": ANSWER.size, ".hits": HIT_RAY.size + HIT.size}
RESULTS = 36  # where the results begin, in records of both kinds
WHOLE = 2**32 - 1


class NotAnswered(ValueError):
    """A record asks an object that this reader cannot answer."""


def differing(asset, kind, records):
    """Counts the answers or hits that differ from the asset's."""
    return (differing_hits if kind == ".hits" else differing_answers)(asset, records)


def differing_answers(asset, answers):
    count = 0
    for number, (item, ox, oy, oz, dx, dy, dz, tmin, tmax, *expected) in enumerate(ANSWER.iter_unpack(answers)):
        if item >= len(asset.objects) or asset.objects[item] is None:
            raise NotAnswered(f"answer {number} is of object {item}, which this reader cannot answer")
        logit, visible, certain = asset.objects[item].answer((ox, oy, oz), (dx, dy, dz), tmin, tmax)
        count += [logit, visible, certain, 0] != expected
    return count


def differing_hits(asset, hits):
    count, scenes = 0, {}
    for at in range(0, len(hits), SIZES[".hits"]):
        which, *ray = HIT_RAY.unpack_from(hits, at)
        if which not in scenes:
            if which != WHOLE and (which >= len(asset.objects) or asset.objects[which] is None):
                raise NotAnswered(f"hit {at} is of object {which}, which this reader cannot answer")
            scenes[which] = whole_scene(asset) if which == WHOLE else object_scene(asset, which)
        expected = hits[at + HIT_RAY.size : at + SIZES[".hits"]]
        scene = scenes[which]
        count += scene is None or HIT.pack(*scene.outputs(ray[0:3], ray[3:6], *ray[6:8])) != expected
    return count


def check(path, answers):
    """Prints the line of a file. Returns whether all answers are right."""
    try:
        asset = Asset(path.read_bytes())
        queries = differ = 0
        for file in answers:
            data = file.read_bytes()
            size = SIZES[file.suffix]
            if not data or len(data) % size:
                raise ValueError(f"{file}: {len(data)} bytes are not a multiple of the record size {size}")
            queries += len(data) // size
            differ += differing(asset, file.suffix, data)
    except (Refused, OSError, ValueError) as error:
        print(f"{path}: refused: {error}" if isinstance(error, Refused) else f"{path}: {error}")
        return False
    counts = Counter(name or "that cannot be answered" for name in asset.encodings)
    objects = ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))
    print(f"{path}: {objects}; {queries} queries, {differ} differ")
    return differ == 0


def check_pieces(path, answers):
    """Prints the line of a file. Returns whether all is well."""
    data, faults, queries, most = path.read_bytes(), [], 0, 0
    arrays = [(file.suffix, every(10, file.read_bytes(), SIZES[file.suffix])) for file in answers]
    whole = Asset(data)
    (payloads,) = ((offset, size) for _, kind, _, offset, size, _ in entries(data) if kind == "DATA")
    for which, item in enumerate(whole.items):
        if item.unsupported:
            continue
        touched = set()

        def read(offset, length):
            touched.update(range(offset, offset + length))
            return data[offset : offset + length]

        asset = Piece(read, which)
        allowed = set()
        for start, end in own_ranges(data, item):
            allowed.update(range(payloads[0] + start, payloads[0] + end))
        touched = {at for at in touched if payloads[0] <= at < sum(payloads)}
        if touched != allowed:
            faults.append(f"object {which}: {len(touched)} bytes of payloads read, not {len(allowed)}")
        most = max(most, len(touched))
        for kind, array in arrays:
            size = SIZES[kind]
            own = b"".join(r for at in range(0, len(array), size) if (r := array[at : at + size])[:4] == which.to_bytes(4, "little"))
            queries += len(own) // size
            if differing(asset, kind, own):
                faults.append(f"object {which}: {kind} differ")
    print(f"{path}: {len(whole.items)} objects in pieces of at most {most} of {payloads[1]} bytes; {queries} queries")
    for fault in faults:
        print(f"{path}: {fault}")
    return not faults


def own_ranges(data, item):
    """Of DATA, by the page: from the first payload of an object to the end of the last one, and what it shares."""
    forge = Forge(data)
    records = {"planes": "PLAN", "triangles": "TRIS", "network": "NETW", "spherical": "SPHR", "holes": "HOLE"}
    stated = []
    for part, number in item.parts.items():
        stated += [forge.get(records[part], number, place, "QQ") for place in PLACES[records[part]][1]]
        if part in ("network", "spherical"):
            shared = "MLPS" if part == "network" else "SNET"
            offset, length = forge.get(shared, *forge.get(records[part], number, 0, "I"), *PLACES[shared][1], "QQ")
            yield offset, offset + length
        if part == "holes":
            for number in item.holes.maps:
                offset, length = forge.get("ALPH", number, *PLACES["ALPH"][1], "QQ")
                yield offset, offset + length
    yield min(offset for offset, _ in stated), max(sum(x) for x in stated)


def check_number(path, answers, codes):
    """Prints the line of a file if its number does not fit. Returns whether it fits."""
    found, why = None, "read"
    try:
        Asset(path.read_bytes())
    except Refused as error:
        found, why = error.code, f"refused: {error}"
    expected = codes[int(path.name[:3])]
    if found != expected:
        print(f"{path}: {why}; the table has {'no exit code' if expected is None else f'exit code {expected}'}")
    return found == expected


def read_codes(table):
    """The exit code of each number, from rows "| 101 | `name` | 12 | what |", or None if there is a word instead."""
    rows = (line.split("|") for line in table.read_text(encoding="utf-8").splitlines())
    rows = [[cell.strip() for cell in row] for row in rows if len(row) > 4]
    return {int(row[1]): int(row[3]) if row[3].isdigit() else None for row in rows if row[1].isdigit()}


def flip(data, bit):
    damaged = bytearray(data)
    damaged[bit // 8] ^= 1 << bit % 8
    return bytes(damaged)


def is_refused(data, queries=()):
    """True as well if an object is one that this reader cannot answer. Anything but these is an error of this reader, and ends
    the program. queries: pairs of a kind and records."""
    try:
        asset = Asset(data)
        for query in queries:
            differing(asset, *query)
    except (Refused, NotAnswered):
        return True
    return False


def every(nth, array, size):
    """Every nth record."""
    return b"".join(array[at : at + size] for at in range(0, len(array), nth * size))


def self_test(path, answers, count):
    """Prints the line of a file. Returns whether all damage was treated correctly."""
    data, draw = path.read_bytes(), random.Random(path.name)
    arrays = [(file.suffix, file.read_bytes()) for file in answers]
    faults = []

    # Every byte is covered by a checksum or known to be zero.
    for bit in draw.sample(range(8 * len(data)), count):
        if not is_refused(flip(data, bit)):
            faults.append(f"bit {bit} flipped, and not refused")
    for size in draw.sample(range(len(data)), count):
        if not is_refused(data[:size]):
            faults.append(f"cut to {size} bytes, and not refused")

    # With right checksums the rules decide. Some damage breaks none; then the file answers.
    if with_checksums(data) != data:
        faults.append("its checksums are not those of the document")
    places = [(0, HEADER)]
    for entry, _, _, offset, size, _ in entries(data):
        places += [(entry, ENTRY), (offset, size)] if size else [(entry, ENTRY)]
    some = [(kind, every(60, array, SIZES[kind])) for kind, array in arrays]
    refused = 0
    for _ in range(count):
        offset, size = draw.choice(places)
        refused += is_refused(with_checksums(flip(data, draw.randrange(8 * offset, 8 * (offset + size)))), some)
    if not refused:
        faults.append("no damage with right checksums is refused")

    # A wrong answer is reported, whichever part of it is wrong.
    asset, altered = Asset(data), 0
    for file, (kind, array) in zip(answers, arrays):
        size = SIZES[kind]
        for place in range(RESULTS, size):
            at = draw.randrange(len(array) // size) * size
            altered += 1
            if differing(asset, kind, flip(array[at : at + size], 8 * place + draw.randrange(8))) != 1:
                faults.append(f"{file}: byte {place} of the record at {at} altered, and not reported")

    print(f"{path}: {3 * count} damaged files, {refused} of {count} with right checksums refused; {altered} altered answers")
    for fault in faults:
        print(f"{path}: {fault}")
    return not faults


def main(arguments):
    run = check
    if arguments[:1] == ["--self-test"] and arguments[1:2] and arguments[1].isdigit():
        run = partial(self_test, count=int(arguments[1]))
        arguments = arguments[2:]
    elif arguments[:1] == ["--pieces"]:
        run, arguments = check_pieces, arguments[1:]
    elif arguments[:1] == ["--numbered"] and arguments[1:2]:
        run = partial(check_number, codes=read_codes(Path(arguments[1])))
        arguments = arguments[2:]
    files = {}
    for path in map(Path, arguments):
        if path.suffix == ".nif":
            files[path] = []
        elif path.suffix in SIZES and files:
            files[list(files)[-1]].append(path)
        else:
            sys.exit(f"check.py: {path}: neither a .nif, nor .answers or .hits after one")
    if not files:
        sys.exit(__doc__)
    return 0 if all([run(path, answers) for path, answers in files.items()]) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
