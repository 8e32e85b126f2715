"""The triangles of objects: the tree and its answers (docs/format.md, "Triangles", "The BVH payload";
docs/answers.md, "bvh", and "First hits": "Of triangles").
"""

import struct

from hits import Hit, none
from shell import PAYLOAD, require, reserved
from single import divide, single

LAYOUT = "4I" + PAYLOAD
NODE = struct.Struct("<3I3I8s24s24s")
MAX = 2**31 - 1
LIMIT_DEPTH = 40


def always(weight, total, number):
    return True


class Tree:
    """triangles     three vertices each, in the order of the payload
    root_low, root_high  of the root's used slots
    extent
    """

    proven = True

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
        """The answer to an invalid ray, or None."""
        far, steep = max(map(abs, o)), max(map(abs, d))
        finite = all(x - x == 0 for x in (*o, *d))
        too_far = max(far, self.extent) > 2.0**61 or far > single(self.extent * 2.0**32)
        if not finite or too_far or not 2.0**-60 <= steep <= 2.0**60 or not tmin <= tmax:
            return MAX, True, tmin > tmax
        return None

    def certain(self, o):
        return max(map(abs, o)) <= single(self.extent * 2.0**20)

    def answer(self, o, d, tmin, tmax, blocks=always):
        """blocks(weight, total, number): whether a triangle blocks a ray that meets it there"""
        answer = self.settled(o, d, tmin, tmax)
        if answer is None:
            met = any(blocks(*met[1:]) for met in self._met(o, d, tmin, tmax))
            answer = (-MAX if met else MAX), not met, self.certain(o)
        return answer

    def hit(self, o, d, tmin, tmax, blocks=always):
        answer = self.settled(o, d, tmin, tmax)
        if answer is not None:
            return none(answer[2])
        # The first of several at the same t.
        counting = (met for met in self._met(o, d, tmin, tmax) if blocks(*met[1:]))
        nearest = min(counting, key=lambda met: met[0], default=None)
        if nearest is None:
            return none(self.certain(o))
        t, weight, total, number = nearest
        hit = Hit(t=single(t), u=single(weight[1] / total), v=single(weight[2] / total), triangle=number)
        if self.certain(o):
            hit.low = hit.high = hit.t
        p, q, r = self.triangles[number]
        e, f = [b - a for a, b in zip(p, q)], [b - a for a, b in zip(p, r)]
        n = [e[b] * f[c] - e[c] * f[b] for b, c in ((1, 2), (2, 0), (0, 1))]
        largest = max(map(abs, n))
        hit.normal = tuple(single(x / largest) if largest else 0.0 for x in n)
        return hit

    def box(self):
        margin = 2.0**-14 * self.extent
        return [x - margin for x in self.root_low], [x + margin for x in self.root_high]

    @property
    def scale(self):
        return single(64 / self.extent)

    def _met(self, o, d, tmin, tmax):
        """For each triangle that the ray meets: t, three weights and their sum, and its number."""
        k2 = 0
        if abs(d[1]) > abs(d[0]):
            k2 = 1
        if abs(d[2]) > abs(d[k2]):
            k2 = 2
        k0, k1 = (k2 + 1) % 3, (k2 + 2) % 3
        o0, o1, o2, d2 = o[k0], o[k1], o[k2], d[k2]
        sx, sy = d[k0] / d2, d[k1] / d2
        error = max(*map(abs, o), self.extent) * 2.0**-49
        for number, corners in enumerate(self.triangles):
            z = [p[k2] - o2 for p in corners]
            x = [p[k0] - o0 - sx * c for p, c in zip(corners, z)]
            y = [p[k1] - o1 - sy * c for p, c in zip(corners, z)]
            side = [x[2] * y[1] - y[2] * x[1], x[0] * y[2] - y[0] * x[2], x[1] * y[0] - y[1] * x[0]]
            apart = min(-min(side), max(side))
            width, height = max(x) - min(x), max(y) - min(y)
            if apart > 2.0**56 * error * error or apart > 4 * error * (width + height + 8 * error):
                continue
            larger = max(width, height)
            total = side[0] + side[1] + side[2]
            if apart > 0 or abs(total) < 0.25 * larger * larger:
                depth, weight = close(side, x, y, z, error)
                total = 1.0
            else:
                depth, weight = (divide(mean(side, z), total) if total != 0 else None), side
            if depth is not None and tmin <= depth / d2 <= tmax:
                yield depth / d2, weight, total, number


def mean(weights, values):
    return weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2]


def close(side, x, y, z, error):
    """The depth at which the ray passes a triangle that is close to it, or seen edge-on, and the weights of its
    vertices there; None where it does not.
    """
    if side == [0, 0, 0]:
        return None, None
    total = side[0] + side[1] + side[2]
    if total != 0:
        weights = list(side)
        for _ in range(16):
            whole = weights[0] + weights[1] + weights[2]
            weights = [divide(w, whole) for w in weights]
            aside, across = mean(weights, x), mean(weights, y)
            if max(abs(aside), abs(across)) <= 4 * error:
                if min(weights) >= 0:
                    return mean(weights, z), weights
                break
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                weights[i] -= divide(aside * (y[k] - y[j]) - across * (x[k] - x[j]), total)
    nearest, depth, weights = 128 * error, None, [0.0] * 3
    for i, j in ((0, 1), (1, 2), (2, 0)):
        along_x, along_y = x[j] - x[i], y[j] - y[i]
        square = along_x * along_x + along_y * along_y
        part = -(x[i] * along_x + y[i] * along_y) / square if square > 0 else 0.0
        part = min(max(part, 0.0), 1.0)
        distance = max(abs(x[i] + part * along_x), abs(y[i] + part * along_y))
        if distance <= nearest:
            nearest, depth = distance, z[i] + part * (z[j] - z[i])
            weights = [0.0] * 3
            weights[i], weights[j] = 1 - part, part
    return depth, weights


def contains(box, point):
    return all(low <= x <= high for low, x, high in zip(box[0], point, box[1]))


def read(item, fields, payloads):
    place = f"{item.place}: triangles"
    nodes, vertices, triangles, zero = fields[0:4]
    reserved((zero,), place)
    return Tree(payloads.take(fields[4:8], place), nodes, vertices, triangles, place)
