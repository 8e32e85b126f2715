"""A whole file: all rules checked, and its objects ready to answer."""

import bvh
import exact
import extras
import proof
import segment
import spherical
from container import File

READERS = {1: segment.read, 2: spherical.read, 3: bvh.read, 4: exact.read, 5: proof.read}


class Asset:
    """objects: each has answer(origin, direction, tmin, tmax), which returns (logit, visible, certain).
    encodings: the number of each one's encoding.
    """

    def __init__(self, data):
        file = File(data)
        self.encodings = [item.encoding for item in file.objects]
        of_encoding = {encoding: READERS[encoding](file) for encoding in sorted(set(self.encodings))}
        self.objects = [of_encoding[item.encoding][item.record] for item in file.objects]
        spherical.read_primary(file)
        extras.read_source_triangles(file, self.objects)
        extras.read_colours(file, self.objects)
