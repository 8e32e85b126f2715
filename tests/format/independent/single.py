"""Numbers: IEEE 754 single and double precision (docs/answers.md, "Numbers").

Python has doubles only. A sum, product, quotient or root of singles, computed in double and then rounded to
single, has the right bits. Expressions in double precision are written as such; what is in single precision
passes through single() after each operation.
"""

import math
import struct

_single = struct.Struct("f")  # native: a double that is too large becomes an infinity
_pack, _unpack = _single.pack, _single.unpack


def single(x):
    return _unpack(_pack(x))[0]


def divide(a, b):
    """A quotient of doubles by IEEE 754, also where Python raises an error."""
    if b != 0 or b != b:
        return a / b
    if a == 0 or a != a:
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def least(a, b):
    return a if a < b else b


def largest(a, b):
    return a if a > b else b


def index(x, top):
    if not x > 0:
        return 0
    return int(x) if x < top else top
