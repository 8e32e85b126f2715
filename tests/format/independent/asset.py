"""A whole file: all rules checked, and its objects ready to answer."""

import bvh
import exact
import extras
import planes
import proof
import segment
import spherical
from container import PARTS, File
from scene import IDENTITY

# In the order in which they are read: a network needs planes.
READERS = {"planes": planes.read, "triangles": bvh.read, "network": segment.read, "spherical": spherical.read}


class Asset:
    """objects: each has answer(origin, direction, tmin, tmax), which returns (logit, visible, certain); hit() of the
    same; and for scenes box() and scale.
    items: their records. encodings: what each one is called.
    source_triangles, colours: by object, where it has some.
    placed: of each instance its object, transform and remainder.
    """

    def __init__(self, data):
        file = File(data)
        self.encodings = [item.encoding for item in file.objects]
        for part, sections in PARTS.items():
            if sections[0] in file.sections:
                for item, value in zip(file.having(part), READERS[part](file)):
                    setattr(item, part, value)
        self.objects = [_object(item) for item in file.objects]
        spherical.read_primary(file)
        self.items = file.objects
        self.source_triangles = extras.read_source_triangles(file)
        self.colours = extras.read_colours(file)
        self.placed = [(fields[12], fields[:12], r) for fields, r in zip(file.instances, file.remainders)]
        if not file.instances and not file.places_nothing:
            self.placed = [(item, IDENTITY, (0.0,) * 3) for item in range(len(self.objects))]


def _object(item):
    if item.encoding == "exact":
        return exact.Exact(item.planes, item.triangles)
    if item.encoding == "proof":
        return proof.Proof(item.planes)
    return getattr(item, list(item.parts)[-1])
