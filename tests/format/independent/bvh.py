"""`bvh` objects: the tree and its answers (docs/format.md, "The BVH payload"; docs/answers.md, "bvh")."""

import struct

from container import Payloads, require, reserved
from single import divide, single

NODE = struct.Struct("<3I3I8s24s24s")
MAX = 2**31 - 1
LIMIT_DEPTH = 40


class Tree:
    """triangles     three vertices each, in the order of the payload
    root_low, root_high  of the root's used slots
    extent
    """

    def __init__(self, data, nodes, vertices, triangles, place):
        require(nodes > 0 and triangles > 0, place, "no node or no triangle")
        size = 80 * nodes + 12 * vertices + 3 * triangles
        require(len(data) == size, place, f"a BVH payload of {len(data)} bytes, not {size}")
        self.place = place
        self.nodes = list(NODE.iter_unpack(data[: 80 * nodes]))
        self.vertices = list(struct.iter_unpack("<3f", data[80 * nodes : 80 * nodes + 12 * vertices]))
        self.corners = data[80 * nodes + 12 * vertices :]
        self.triangles = []
        self._visit()

    def _visit(self):
        named_nodes, named_triangles = 1, 0
        everywhere = ((float("-inf"),) * 3, (float("inf"),) * 3)
        waiting = [(0, 1, everywhere)]
        while waiting:
            number, depth, parent = waiting.pop()
            place = f"{self.place}: node {number}"
            require(depth <= LIMIT_DEPTH, place, "deeper than 40 nodes")
            *frames, first_node, first_triangle, first_vertex, slots, lower, upper = self.nodes[number]
            exponents = [frame & 255 for frame in frames]
            require(all(27 <= e <= 187 for e in exponents), place, "exponent is not in range")
            scales = [2.0 ** (e - 127) for e in exponents]
            bases = [(frame >> 8) - ((frame >> 31) << 24) for frame in frames]
            used = len(slots.rstrip(b"\0"))
            require(used > 0, place, "no slot is used")

            inner = triangles = 0
            boxes = []
            for slot in range(8):
                kind, rank = slots[slot] >> 5, slots[slot] & 31
                if slot >= used:
                    require(not any(lower[slot::8] + upper[slot::8]), place, f"slot {slot} is empty, but its box is not 0")
                    continue
                require(kind in (1, 2, 3, 4, 7), place, f"slot {slot} has kind {kind}")
                low = tuple((bases[a] + lower[8 * a + slot]) * scales[a] for a in range(3))
                high = tuple((bases[a] + upper[8 * a + slot]) * scales[a] for a in range(3))
                ordered = all(lower[8 * a + slot] <= upper[8 * a + slot] for a in range(3))
                require(ordered, place, f"slot {slot}: a lower end above its upper end")
                require(contains(parent, low) and contains(parent, high), place, f"slot {slot}: its box leaves its parent's")
                boxes.append((low, high))
                require(rank == (inner if kind == 7 else triangles), place, f"slot {slot} has rank {rank}")
                if kind == 7:
                    inner += 1
                else:
                    for nth in range(first_triangle + triangles, first_triangle + triangles + kind):
                        require(3 * nth < len(self.corners), place, "more triangles than there are")
                        self._add_triangle(nth, first_vertex, (low, high), f"{place}: triangle {nth}")
                    triangles += kind
            require(first_node == (named_nodes if inner else 0), place, f"first node {first_node}")
            require(first_triangle == named_triangles, place, f"first triangle {first_triangle}, not {named_triangles}")
            require(triangles or first_vertex == 0, place, "a first vertex without triangles")
            named_nodes += inner
            named_triangles += triangles
            require(named_nodes <= len(self.nodes), place, "more nodes than there are")
            if number == 0:
                self._root(bases, scales, boxes)
            inside = [box for slot, box in enumerate(boxes) if slots[slot] >> 5 == 7]
            waiting += reversed([(first_node + nth, depth + 1, box) for nth, box in enumerate(inside)])
        require(named_nodes == len(self.nodes), self.place, "nodes that no node names")
        require(3 * named_triangles == len(self.corners), self.place, "triangles that no node names")

    def _root(self, bases, scales, boxes):
        planes = [abs((base + end) * scale) for base, scale in zip(bases, scales) for end in (0, 255)]
        self.extent = max(planes)
        require(self.extent <= 2.0**61, self.place, "a plane of the root's frame is beyond 2^61")
        self.root_low = tuple(min(low[a] for low, _ in boxes) for a in range(3))
        self.root_high = tuple(max(high[a] for _, high in boxes) for a in range(3))

    def _add_triangle(self, nth, first_vertex, box, place):
        corners = [first_vertex + c for c in self.corners[3 * nth : 3 * nth + 3]]
        require(max(corners) < len(self.vertices), place, "a vertex beyond the last one")
        points = tuple(self.vertices[c] for c in corners)
        require(all(contains(box, p) for p in points), place, "leaves its slot's box")
        self.triangles.append(points)

    def settled(self, o, d, tmin, tmax):
        """The answer to what is no ray for this tree, or None."""
        far, steep = max(map(abs, o)), max(map(abs, d))
        finite = all(x - x == 0 for x in (*o, *d))
        too_far = max(far, self.extent) > 2.0**61 or far > single(self.extent * 2.0**32)
        if not finite or too_far or not 2.0**-60 <= steep <= 2.0**60 or not tmin <= tmax:
            return MAX, True, tmin > tmax
        return None

    def answer(self, o, d, tmin, tmax):
        answer = self.settled(o, d, tmin, tmax)
        if answer is None:
            certain = max(map(abs, o)) <= single(self.extent * 2.0**20)
            answer = (-MAX, False, certain) if self._meets(o, d, tmin, tmax) else (MAX, True, certain)
        return answer

    def _meets(self, o, d, tmin, tmax):
        k2 = 0
        if abs(d[1]) > abs(d[0]):
            k2 = 1
        if abs(d[2]) > abs(d[k2]):
            k2 = 2
        k0, k1 = (k2 + 1) % 3, (k2 + 2) % 3
        o0, o1, o2, d2 = o[k0], o[k1], o[k2], d[k2]
        sx, sy = d[k0] / d2, d[k1] / d2
        for a, b, c in self.triangles:
            z0, z1, z2 = a[k2] - o2, b[k2] - o2, c[k2] - o2
            x0, x1, x2 = a[k0] - o0 - sx * z0, b[k0] - o0 - sx * z1, c[k0] - o0 - sx * z2
            y0, y1, y2 = a[k1] - o1 - sy * z0, b[k1] - o1 - sy * z1, c[k1] - o1 - sy * z2
            u = x2 * y1 - y2 * x1
            v = x0 * y2 - y0 * x2
            w = x1 * y0 - y1 * x0
            if (u < 0 or v < 0 or w < 0) and (u > 0 or v > 0 or w > 0):
                continue
            total = u + v + w
            if total == 0:
                continue
            depth = divide(u * z0 + v * z1 + w * z2, total)
            x, y = (x0, x1, x2), (y0, y1, y2)
            width, height = max(x) - min(x), max(y) - min(y)
            larger = max(width, height)
            if abs(total) < 2.0**-8 * larger * larger:
                depth = kept(depth, y if height > width else x, (z0, z1, z2))
                if depth is None:
                    continue
            t = depth / d2
            if tmin <= t <= tmax:
                return True
        return False


def kept(depth, a, z):
    """The depth, kept to those that the triangle has where `a` is 0; None where it has none."""
    side = [c <= 0 for c in a]
    if len(set(side)) == 1:
        side = [c < 0 for c in a]
        if len(set(side)) == 1:
            return None
    p = next(i for i in range(3) if side.count(side[i]) == 1)
    ends = [z[p] + (z[k] - z[p]) * (a[p] / (a[p] - a[k])) for k in range(3) if k != p]
    depth = depth if depth > min(ends) else min(ends)
    return depth if depth < max(ends) else max(ends)


def contains(box, point):
    return all(low <= x <= high for low, x, high in zip(box[0], point, box[1]))


def read(file):
    """The objects of this encoding; each answers."""
    payloads = Payloads(file.sections["BVHS"])
    records = file.sections["BVHR"].records("4IQQ")
    require(len(records) == len(file.of_encoding(3)), "BVHR", "a record that belongs to no object")
    trees = []
    for number, (nodes, vertices, triangles, zero, *payload) in enumerate(records):
        place = f"bvh {number}"
        reserved((zero,), place)
        trees.append(Tree(payloads.take(*payload, place), nodes, vertices, triangles, place))
    payloads.finish()
    return trees
