#!/usr/bin/env -S python3 -B
"""What this reader makes of files of later versions, of other writers, and of files that break the rules about them
(docs/format.md, "What may be added", "Objects that a reader cannot answer", "Levels", "Numbers", "Payloads").

    growth_test.py GOLDEN_FOLDER

Each test changes a golden file and puts it together again with right checksums. A changed file either answers as
before, or is refused with the exit code of the page.
"""

import math
import struct
import sys
import unittest
from pathlib import Path

from asset import Asset, Piece
from check import SIZES, WHOLE, differing, every
from extras import unpack
from forge import Forge, entries, with_table_checksums
from holes import AlphaMap
from scene import object_scene, whole_scene
from shell import KEEP, PAYLOADS, REQUIRED, Refused, crc32c

DAMAGED, UNSUPPORTED = 32, 33
GOLDEN = Path("tests/golden")
RECORDS = "OBJS INST PLAN TRIS NETW MLPS SPHR SNET HOLE ALPH NUMS COLR".split()
# The first has 5 objects: segment, bvh (2), exact (2), those from 1 to 3 with source triangles; none is an instance. The
# second has objects of all encodings, with 4 instances.
SOURCE, PLACED, SINGLE = "v2-source", "v2-translations", "v2-single"
# Three objects without holes, then four with, of three maps.
CUTOUT = "v2-cutout"


def forge(name):
    return Forge((GOLDEN / f"{name}.nif").read_bytes())


def reader(data):
    return lambda offset, length: data[offset : offset + length]


class Growth(unittest.TestCase):
    def answers(self, file, name, without=()):
        """The file answers as the golden one does, except for some objects. Returns the asset."""
        data = file if isinstance(file, bytes) else file.bytes()
        asset = Asset(data)
        for kind, step in ((".answers", 60), (".hits", 40)):
            array, size = every(step, (GOLDEN / (name + kind)).read_bytes(), SIZES[kind]), SIZES[kind]
            records = [array[at : at + size] for at in range(0, len(array), size)]
            left = [r for r in records if int.from_bytes(r[:4], "little") not in without]
            self.assertTrue(left)
            self.assertEqual(differing(asset, kind, b"".join(left)), 0)
        return asset

    def refused(self, file, code=DAMAGED):
        data = file if isinstance(file, bytes) else file.bytes()
        with self.assertRaises(Refused) as caught:
            Asset(data)
        self.assertEqual(caught.exception.code, code, str(caught.exception))

    def changed(self, name, *change):
        file = forge(name)
        file.set(*change)
        return file

    def test_unchanged(self):
        for name in (SOURCE, PLACED, SINGLE, CUTOUT):
            data = (GOLDEN / f"{name}.nif").read_bytes()
            self.assertEqual(forge(name).bytes(), data)
            self.answers(data, name)

    # Flags

    def test_flags_of_header(self):
        for bit in (1, 15):
            file = forge(SINGLE)
            struct.pack_into("<I", file.header, 36, 1 << bit)
            self.refused(file, UNSUPPORTED)
        file = forge(SINGLE)
        struct.pack_into("<I", file.header, 36, 0xFFFF0000)
        self.answers(file, SINGLE)

    def test_flags_of_sections(self):
        for kind, flags, code in (
            ("META", KEEP, None),
            ("META", REQUIRED, DAMAGED),
            ("META", PAYLOADS, DAMAGED),
            ("OBJS", 0, DAMAGED),
            ("OBJS", REQUIRED | PAYLOADS, DAMAGED),
            ("DATA", REQUIRED, DAMAGED),
            ("DATA", PAYLOADS, DAMAGED),
            ("OBJS", REQUIRED | 8, UNSUPPORTED),
            ("INST", REQUIRED | 1 << 15, UNSUPPORTED),
            ("NUMS", 1 << 16, None),
            ("OBJS", REQUIRED | 0xFFFF0000, None),
        ):
            file = forge(SOURCE)
            if kind == "META":
                file.sections.append(["META", 0, 0, bytearray(b"{}")])
            file.section(kind)[1] = flags
            with self.subTest(kind=kind, flags=flags):
                self.refused(file, code) if code else self.answers(file, SOURCE)

    def test_flags_of_instances(self):
        for bit in (1, 15):
            self.refused(self.changed(PLACED, "INST", 0, 84, "I", 1 << bit), UNSUPPORTED)
        self.answers(self.changed(PLACED, "INST", 0, 84, "I", 0xFFFF0000), PLACED)

    # Objects that cannot be answered

    def test_unknown_flags_of_an_object(self):
        for which, bit in ((0, 1), (2, 2), (4, 15)):
            file = self.changed(SOURCE, "OBJS", which, 0, "I", 1 << bit)
            # Nothing of its records and payloads is looked at.
            for kind, part in (("PLAN", 4), ("TRIS", 8), ("NETW", 12)):
                (number,) = file.get("OBJS", which, part, "I")
                if number != WHOLE:
                    size = file.section(kind)[2]
                    file.set(kind, number, 0, f"{size}s", b"\xff" * size)
            asset = self.answers(file, SOURCE, {which, WHOLE})
            self.assertIsNone(asset.objects[which])
            self.assertTrue(asset.items[which].unsupported)
            self.assertTrue(asset.items[which].name)
            self.assertNotIn(which, asset.source_triangles)
            self.assertIsNone(whole_scene(asset))
            with self.assertRaises(Refused) as caught:
                Piece(reader(file.bytes()), which)
            self.assertEqual(caught.exception.code, UNSUPPORTED)
            Piece(reader(file.bytes()), 1)

    def test_hints_of_an_object(self):
        self.answers(self.changed(SOURCE, "OBJS", 0, 0, "I", 0xFFFF0000), SOURCE)

    def test_unknown_parts(self):
        file = forge(SOURCE)
        del file.section("PLAN")[3][:96]
        for which, planes in ((0, WHOLE), (3, 0), (4, 1)):
            file.set("OBJS", which, 4, "I", planes)
        asset = self.answers(file, SOURCE, {0, WHOLE})
        self.assertEqual([x is None for x in asset.objects], [True, False, False, False, False])
        self.assertIsNone(asset.encodings[0])

    def test_no_parts(self):
        file = forge(SINGLE)
        file.sections = [s for s in file.sections if s[0] not in ("PLAN", "NETW", "MLPS")]
        file.set("OBJS", 0, 4, "4I", *[WHOLE] * 4)
        self.assertEqual(Asset(file.bytes()).objects, [None])

    def test_records_of_an_unknown_object_count(self):
        file = self.changed(SOURCE, "OBJS", 2, 0, "I", 1)
        del file.section("TRIS")[3][-40:]
        self.refused(file)
        for part in (4, 8):
            file = self.changed(SOURCE, "OBJS", 2, 0, "I", 1)
            file.set("OBJS", 2, part, "I", 77)
            self.refused(file)

    def test_fields_of_an_unknown_object_are_checked(self):
        for place, layout, value in ((24, "I", 1), (32, "f", math.nan), (20, "I", 1), (56, "f", -1), (72, "I", 1)):
            file = self.changed(SOURCE, "OBJS", 4, 0, "I", 1)
            file.set("OBJS", 4, place, layout, value)
            self.refused(file)

    # Arithmetic and prover

    def test_arithmetic(self):
        for value in (0, 2, 2**32 - 1):
            file = forge(SINGLE)
            struct.pack_into("<I", file.header, 40, value)
            self.refused(file, UNSUPPORTED)

    def test_later_prover(self):
        file = forge(SINGLE)
        struct.pack_into("<I", file.header, 44, 7)
        self.answers(file, SINGLE)

    def test_nothing_is_proven(self):
        file = forge(PLACED)
        struct.pack_into("<I", file.header, 44, 0)
        unproven, proven = Asset(file.bytes()), Asset(forge(PLACED).bytes())
        answers = every(7, (GOLDEN / f"{PLACED}.answers").read_bytes(), SIZES[".answers"])
        were_certain = 0
        for which, *ray in struct.iter_unpack("<I3f3fff8x", answers):
            ray = ray[0:3], ray[3:6], *ray[6:8]
            logit, visible, certain = proven.objects[which].answer(*ray)
            were_certain += certain
            self.assertEqual(unproven.objects[which].answer(*ray), (logit, visible, False))
        self.assertGreater(were_certain, 10)
        scenes = [(whole_scene(proven), whole_scene(unproven))]
        scenes += [(object_scene(proven, n), object_scene(unproven, n)) for n in range(len(proven.items))]
        for before, after in scenes:
            for origin, tmin, tmax in (((1e4, 0, 0), 0, 1), ((0, 0, 0), 1, 0), ((0, 0, 0), 0, 1e9)):
                old, new = (s.outputs(origin, (0.0, 0.6, 0.8), float(tmin), float(tmax)) for s in (before, after))
                self.assertEqual(new[1:3], (-math.inf, math.inf))
                self.assertEqual((new[0], *new[3:-2]), (old[0], *old[3:-2]))
                self.assertFalse(new[-2])

    def test_identifiers(self):
        data = forge(SINGLE).bytes()
        for digits in (b"10", b"21", b"30", b"99"):
            self.refused(data[:5] + digits + data[7:], UNSUPPORTED)
            self.refused(data[:5] + digits + data[7:40], UNSUPPORTED)
        self.refused(data[:5] + b"2x" + data[7:])
        self.refused(b"\x2b" + data[1:7] + b"\x3b" + data[8:])
        self.refused(data[:5] + b"30" + b"\x3b" + data[8:])
        self.refused(b"\x2bNIF 30" + data[7:], 30)

    # Sections

    def test_unknown_sections(self):
        for kind in ("ZEBR", "acme", "Z\x01\n\xff"):
            for flags in (0, PAYLOADS | KEEP, KEEP | 1 << 31):
                file = forge(SINGLE)
                file.sections.insert(2, [kind, flags, 24, bytearray(b"\xff" * 48)])
                self.answers(file, SINGLE)
            for flags, code in ((REQUIRED, UNSUPPORTED), (8, UNSUPPORTED)):
                file.section(kind)[1] = flags
                self.refused(file, code)
            for size in (20, 12, 32):
                file.section(kind)[1:3] = 0, size
                self.refused(file)

    def test_checksum_of_payloads(self):
        data = bytearray(forge(SINGLE).bytes())
        data[data.index(b"DATA") + 24] = 1
        data = with_table_checksums(data)
        self.refused(data)
        with self.assertRaises(Refused):
            Piece(reader(data), 0)

    def test_sizes_of_records(self):
        for name in (SOURCE, PLACED, CUTOUT, "v2-colors"):
            file = forge(name)
            for kind in RECORDS:
                if any(section[0] == kind for section in file.sections):
                    if kind == "OBJS" and name != CUTOUT:
                        file.widen(kind, 8, 0xFF)  # no holes
                    file.widen(kind, 8 if kind < "N" else 72)
            self.answers(file, name)
        file = forge(SOURCE)
        file.widen("OBJS", 4)
        self.refused(file)
        for kind, size in (("NAME", 8), ("DATA", 8), ("PLAN", 0), ("INST", 88), ("INST", 0)):
            file = forge(SINGLE)
            file.section(kind)[2] = size
            self.refused(file)
        file = forge(PLACED)
        file.section("INST")[2] = 48
        self.refused(file)

    # Payloads

    def test_holes(self):
        for name, by in ((SOURCE, 192), (CUTOUT, 64), ("v2-spherical", 64)):
            file = forge(name)
            file.open_hole(by)
            data = file.bytes()
            asset = self.answers(data, name)
            for which in range(len(asset.objects)):
                Piece(reader(data), which)

    def test_places_of_payloads(self):
        file = forge(SOURCE)
        first, length, _, _ = file.get("TRIS", 0, 16, "QQII")
        second, _ = file.get("TRIS", 1, 16, "QQ")
        size = len(file.section("DATA")[3])
        for offset in (first + 1, first + 32, second, 2**64 - 64, (size + 63) // 64 * 64, size - size % 64):
            file = self.changed(SOURCE, "TRIS", 0, 16, "Q", offset)
            self.refused(file)
        for count in (length + 1, 2**64 - 1, 2**64 - first, size):
            self.refused(self.changed(SOURCE, "TRIS", 0, 24, "Q", count))
        self.refused(self.changed(SOURCE, "TRIS", 0, 36, "I", 1))
        # Two objects with one payload
        file = forge("v2-bvh")
        file.set("TRIS", 1, 0, "40s", file.section("TRIS")[3][:40])
        self.refused(file)
        # Copies of payloads elsewhere: one behind those that come after it, and one at no multiple of 64.
        self.answers(self.moved("TRIS", 3, 16, 64), SOURCE)
        self.refused(self.moved("TRIS", 3, 16, 32))
        self.refused(self.moved("MLPS", 0, 64, 64))

    def test_payloads_beyond_their_section(self):
        for offset, length in ((2**40, 64), (0, 2**40), (2**64 - 64, 128)):
            data = self.changed(SOURCE, "TRIS", 3, 16, "QQ", offset, length).bytes()
            self.refused(data)
            with self.assertRaises(Refused):
                Piece(reader(data), 4)

    @staticmethod
    def moved(kind, record, place, by):
        """A payload of DATA moved behind the last one."""
        file = forge(SOURCE)
        offset, length = file.get(kind, record, place, "QQ")
        data = file.section("DATA")[3]
        data += bytes(-len(data) % 64 + by)
        file.set(kind, record, place, "Q", len(data))
        data += data[offset : offset + length]
        return file

    def test_checksums_of_payloads(self):
        for kind, place in (("MLPS", 64), ("PLAN", 48), ("PLAN", 72), ("TRIS", 16), ("NETW", 56), ("NUMS", 16)):
            data = bytearray(forge(SOURCE).bytes())
            stated = struct.pack("<QQI", *forge(SOURCE).get(kind, 0, place, "QQI"))
            data[data.index(stated, data.index(forge(SOURCE).section(kind)[3])) + 16] ^= 1
            for entry, name, _, offset, size, _ in entries(data):
                if name == kind:
                    struct.pack_into("<I", data, entry + 24, crc32c(data[offset : offset + size]))
            self.refused(with_table_checksums(data))

    def test_padding_of_payloads(self):
        file = forge(SOURCE)
        data = file.section("DATA")[3]
        offset, length = file.get("TRIS", 0, 16, "QQ")
        self.assertNotEqual((offset + length) % 64, 0)
        data[offset + length] = 1
        self.refused(file)

    # Triangles with holes

    def test_flag_of_holes(self):
        (flags,) = forge(CUTOUT).get("OBJS", 4, 0, "I")
        self.assertEqual(flags, 1)
        self.refused(self.changed(CUTOUT, "OBJS", 4, 0, "I", 0))
        self.refused(self.changed(CUTOUT, "OBJS", 0, 0, "I", 1))
        self.refused(self.changed(SOURCE, "OBJS", 1, 0, "I", 1))
        self.refused(self.changed(CUTOUT, "OBJS", 4, 80, "I", 0))
        self.refused(self.changed(CUTOUT, "OBJS", 4, 80, "I", WHOLE))
        self.answers(self.changed(CUTOUT, "OBJS", 4, 84, "I", 7), CUTOUT)
        file = forge(SOURCE)
        file.widen("OBJS", 8, 0)
        self.refused(file)

    def test_objects_with_holes_may_be_unknown(self):
        file = self.changed(CUTOUT, "OBJS", 4, 0, "I", 1 | 2)
        file.set("HOLE", 1, 0, "40s", b"\xff" * 40)
        asset = self.answers(file, CUTOUT, {4, WHOLE})
        self.assertIsNone(asset.objects[4])
        self.refused(self.changed(CUTOUT, "OBJS", 4, 0, "I", 2))

    def test_records_of_holes(self):
        count = len(Asset(forge(CUTOUT).bytes()).items[4].triangles.triangles)
        for place, value in ((0, 0), (0, count + 1), (4, 1), (12, 1), (24, 8)):
            self.refused(self.changed(CUTOUT, "HOLE", 1, place, "I", value))

    def test_holes(self):
        for place, value in ((0, 3), (4, 17), (4, 2**32 - 1)):
            file = forge(CUTOUT)
            offset, _ = file.get("HOLE", 1, 16, "QQ")
            struct.pack_into("<I", file.section("DATA")[3], offset + place, value)
            self.refused(file)
        # All bits of the numbers of patches.
        file = forge(CUTOUT)
        offset, length = file.get("HOLE", 1, 16, "QQ")
        (patches,) = file.get("HOLE", 1, 0, "I")
        file.section("DATA")[3][offset + 32 * patches : offset + length] = b"\xff" * (length - 32 * patches)
        self.refused(file)

    def test_alpha_maps(self):
        for place, layout, value in ((0, "I", 0), (4, "I", 16385), (8, "B", 3), (9, "B", 255), (10, "B", 1), (15, "B", 1)):
            self.refused(self.changed(CUTOUT, "ALPH", 1, place, layout, value))

    def test_beyond_alpha_maps(self):
        for beyond, expected in enumerate(("012012012", "210012210", "000012222")):
            self.assertEqual("".join(str(AlphaMap._within(texel, 3, beyond)) for texel in range(-3, 6)), expected)

    def test_most_tiles(self):
        file = forge(CUTOUT)
        record = bytearray(file.section("ALPH")[3][-40:])
        struct.pack_into("<2I", record, 0, 16384, 16384)
        file.section("ALPH")[3] += record * 4
        self.refused(file)

    # Levels

    def test_levels(self):
        file = forge(SOURCE)
        for which, level in enumerate((2, 1, 0, 1, 0)):
            file.set("OBJS", which, 20, "I", level)
        asset = self.answers(file, SOURCE, {WHOLE})
        self.assertEqual([item for item, *_ in asset.placed], [2, 4])
        self.assertEqual([x.number for x in whole_scene(asset).instances], [0, 1])
        for levels in ((1, 0, 0, 0, 1), (2, 0, 0, 0, 0), (16,) * 5, (0, 3, 2, 0, 0), (2**32 - 1, 0, 0, 0, 0)):
            for which, level in enumerate(levels):
                file.set("OBJS", which, 20, "I", level)
            self.refused(file)

    def test_most_levels(self):
        for count in (16, 17):
            file = forge(SINGLE)
            file.sections = [s for s in file.sections if s[0] not in ("PLAN", "NETW", "MLPS")]
            file.section("OBJS")[3] *= count
            for which in range(count):
                file.set("OBJS", which, 4, "7I", *[WHOLE] * 4, count - 1 - which, which, 0)
            file.section("NAME")[3][:] = bytes(count)
            Asset(file.bytes()) if count == 16 else self.refused(file)

    def test_instances_of_levels(self):
        file = forge(PLACED)
        used = {file.get("INST", n, 60, "I")[0] for n in range(len(file.section("INST")[3]) // 96)}
        which = min(used - {6})
        file.set("OBJS", which, 20, "I", 1)
        self.refused(file)

    def test_error(self):
        self.answers(self.changed(SINGLE, "OBJS", 0, 64, "f", 0.25), SINGLE)
        for value in (-1, math.nan, math.inf):
            self.refused(self.changed(SINGLE, "OBJS", 0, 64, "f", value))

    # Instances

    def test_instances(self):
        file = forge(PLACED)
        count = len(file.section("INST")[3]) // 96
        file.set("INST", 0, 80, "I", 0)
        file.set("INST", 1, 84, "I", 1)
        file.set("INST", 2, 88, "I", 1)
        file.set("INST", 2, 72, "Q", 2**64 - 2)
        asset = self.answers(file, PLACED, {WHOLE})
        self.assertEqual([x.number for x in whole_scene(asset).instances], list(range(2, count)))
        self.assertEqual((asset.instances[2].parent, asset.instances[2].user), (1, 2**64 - 2))
        for place, layout, value in (
            (88, "I", 2),
            (88, "I", 2**32 - 2),
            (92, "I", 1),
            (60, "I", 7),
            (0, "d", math.nan),
            (0, "d", -math.inf),
            (8, "d", 2.0**128),
            (8, "d", math.nextafter(2.0**128 - 2.0**104, math.inf)),
            (16, "d", 1 / 3),
            (16, "d", 5e-324),
            (24, "f", math.nan),
            (56, "f", math.inf),
        ):
            with self.subTest(place=place, value=value):
                self.refused(self.changed(PLACED, "INST", 2, place, layout, value))
        for value in (2.0**128 - 2.0**104, 1e7 + 2.0**-20, -0.0, 2.0**-149):
            Asset(self.changed(PLACED, "INST", 2, 0, "d", value).bytes())

    # Numbers

    def with_numbers(self, which, kind, n, payload, front=False):
        """One more record of numbers, behind those that there are, or an empty one in front of them."""
        file = forge(SOURCE)
        numbers, values = file.section("NUMS")[3], file.section("NVAL")[3]
        if not front:
            values += bytes(-len(values) % 64)
        record = struct.pack("<4IQQII", which, kind, n, 0, 0 if front else len(values), len(payload), 0, 0)
        numbers[:] = record + numbers if front else numbers + record
        values += payload
        return file

    def test_numbers(self):
        asset = Asset(forge(SOURCE).bytes())
        last = max(asset.source_triangles)
        tree = asset.items[last].triangles
        for kind, count in ((2, len(tree.triangles)), (3, len(tree.triangles)), (4, len(tree.vertices))):
            numbers = [n * 2654435761 % 2**32 for n in range(count)]
            payload = struct.pack(f"<{count}I", *numbers)
            found = self.answers(self.with_numbers(last, kind, 0, payload), SOURCE).numbers
            self.assertEqual(found[kind], {last: numbers})
            self.refused(self.with_numbers(last, kind, 0, payload + bytes(4)))
            self.refused(self.with_numbers(last, kind, 2**32 - 1, b"\xff" * len(payload)))
            file = self.with_numbers(last, kind, 0, payload)
            file.set("NUMS", len(file.section("NUMS")[3]) // 40 - 1, 12, "I", 1)
            self.refused(file)
        ones = self.with_numbers(last, 3, 1, bytes((len(tree.triangles) + 31) // 32 * 4))
        self.assertEqual(Asset(ones.bytes()).numbers[3][last], [0] * len(tree.triangles))

    def test_order_of_numbers(self):
        last = max(Asset(forge(SOURCE).bytes()).source_triangles)
        self.refused(self.with_numbers(last, 1, 0, bytes(4)))  # twice
        self.refused(self.with_numbers(last, 0, 0, b""))  # behind kind 1
        self.refused(self.with_numbers(0, 9, 0, b""))  # behind another object
        self.refused(self.with_numbers(5, 9, 0, b""))  # there is no object 5

    def test_unknown_kinds(self):
        last = max(Asset(forge(SOURCE).bytes()).source_triangles)
        for kind in (5, 2**32 - 1):
            file = self.with_numbers(last, kind, 1, b"\xff" * 7)
            number = len(file.section("NUMS")[3]) // 40 - 1
            file.set("NUMS", number, 12, "IQQII", 1, 2**63, 2**63, 3, 4)
            self.answers(file, SOURCE)
        # Of an object without triangles, too.
        for kind in (0, 5):
            self.answers(self.with_numbers(0, kind, 0, b"", front=True), SOURCE)
        for kind in range(1, 5):
            self.refused(self.with_numbers(0, kind, 0, b"", front=True))

    def test_limit_of_numbers(self):
        count = len(Asset(forge(SOURCE).bytes()).items[4].triangles.triangles)
        for kind in (1, 2):
            for n in (1, 2, count, 0):
                bits = max((n - 1) % 2**32, 1).bit_length()
                zeros = bytes((bits * count + 31) // 32 * 4)
                Asset(self.with_numbers(4, kind, n, zeros).bytes())
        if count % 32:
            self.refused(self.with_numbers(4, 2, 2, bytes((count + 31) // 32 * 4 - 1) + b"\x80"))
        self.assertEqual(unpack(struct.pack("<2I", 7, 2**32 - 1), 2, 2**32, ""), [7, 2**32 - 1])

    def test_optional_sections_come_in_pairs(self):
        for kind in ("NUMS", "NVAL"):
            file = forge(SOURCE)
            file.sections.remove(file.section(kind))
            self.refused(file)
        file = forge(SOURCE)
        file.section("NUMS")[3].clear()
        self.refused(file)

    # In pieces

    def test_damage_of_others_does_not_matter(self):
        data = bytearray(forge(SOURCE).bytes())
        offset, _ = forge(SOURCE).get("TRIS", 0, 16, "QQ")
        data[data.index(forge(SOURCE).section("DATA")[3]) + offset] ^= 1
        self.refused(bytes(data))
        for which in range(5):
            if which != 1:
                Piece(reader(data), which)
        with self.assertRaises(Refused):
            Piece(reader(data), 1)

    def test_pieces_that_end_early(self):
        data = forge(SOURCE).bytes()
        for size in (10, 100, 700, data.index(forge(SOURCE).section("DATA")[3]) + 100):
            with self.assertRaises((Refused, ValueError)):
                Piece(reader(data[:size]), 4)


if __name__ == "__main__":
    GOLDEN = Path(sys.argv.pop(1)) if len(sys.argv) > 1 else GOLDEN
    unittest.main()
