"""The answers of scenes: tuples of arrays, and the types of those arrays."""
from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Optional

import numpy as np

from ._abi import InstanceFlags
from ._asset import Asset

if TYPE_CHECKING:  # numpy.typing takes a while to load
    import numpy.typing as npt

    from ._rays import Kinds

    Bools = npt.NDArray[np.bool_]
    Floats = npt.NDArray[np.float32]
    Numbers = npt.NDArray[np.uint32]


class Instance(NamedTuple):
    """An instance of a scene, as it was last set, committed or not."""

    asset: Asset
    object: int
    """Its number in the asset."""
    transform: Floats
    """[3, 4] from object to world space; rounded to float32 if `Scene.add_asset()` added the instance."""
    origin: npt.NDArray[np.float64]
    """[3] what `Scene.set_instance_origin()` set."""
    mask: int
    flags: InstanceFlags
    user: int


class Answers(NamedTuple):
    """The answers of a query. Outputs that were not requested are None. `...` is the shape of the batch."""

    visible: Optional[Bools] = None
    """[...] True: visible, False: occluded."""
    visible_bits: Optional[npt.NDArray[np.uint8]] = None
    """[(count + 7) // 8] The same as bits: ray i is bit i % 8 (0 is the lowest) of byte i // 8."""
    probability: Optional[Floats] = None
    """[...] Calibrated probability that the ray is visible, 0 to 1; exactly 0 or 1 for certain rays."""
    certain: Optional[Bools] = None
    """[...] True: the answer is proven, not learned."""
    logit: Optional[npt.NDArray[np.int32]] = None
    """[...] The smallest network output of all instances: below 0 means occluded; plus or minus `LOGIT_CERTAIN` if no
    network decided."""


class Hits(NamedTuple):
    """Where rays first hit a scene. Outputs that were not requested are None. `...` is the shape of the batch."""

    hit: Optional[Bools] = None
    """[...] True: the ray hits something."""
    t: Optional[Floats] = None
    """[...] Where, in units of the ray's direction; infinite if nothing is hit."""
    normal: Optional[Floats] = None
    """[..., 3] Geometric normal, in world space, of unit length, on the side that the ray comes from; 0 if nothing is hit."""
    instance: Optional[Numbers] = None
    """[...] The scene's number of the instance; `NONE` if nothing is hit."""
    object: Optional[Numbers] = None
    """[...] That instance's object, as numbered in its asset; `NONE` if nothing is hit."""
    triangle: Optional[Numbers] = None
    """[...] The triangle, if the object has triangles (see `Object.source_triangles`); else `NONE`."""
    u: Optional[Floats] = None
    """[...] Weight of the triangle's second vertex."""
    v: Optional[Floats] = None
    """[...] Weight of its third."""
    certain: Optional[Bools] = None
    """[...] True: it is proven whether the ray hits something."""
    t_low: Optional[Floats] = None
    """[...] Proven: nothing is hit before this."""
    t_high: Optional[Floats] = None
    """[...] Proven: something is hit at or before this."""
    color: Optional[Floats] = None
    """[..., 3] Base colour of the surface, linear RGB, 0 to 1; 0.5 if the object has no colours."""
    user: Optional[npt.NDArray[np.uint64]] = None
    """[...] What `Scene.set_instance_user()` gave the instance; 0 if nothing is hit."""


class OpenRays(NamedTuple):
    """Rays that proofs leave open, for your own BVH: entry k is about ray number `rays[k]` of the batch (in C order); only its
    interval from `tmin[k]` to `tmax[k]` matters. The order may differ from run to run."""

    rays: Numbers
    """[count] Numbers of rays."""
    tmin: Floats
    """[count] In units of the ray's direction."""
    tmax: Floats
    """[count] Likewise."""
    instance: Numbers
    """[count] The instance, if only one leaves the ray open: then only it needs testing. `NONE` if several do."""
    answers: Answers
    """The answers for all rays. An open ray has visible False, certain False, probability 0.5 and logit -1."""


ANSWER_KINDS: Kinds = {
    "visible": (np.bool_, ()),
    "visible_bits": (np.uint8, ()),
    "probability": (np.float32, ()),
    "certain": (np.bool_, ()),
    "logit": (np.int32, ()),
}
HIT_KINDS: Kinds = {
    "hit": (np.bool_, ()),
    "t": (np.float32, ()),
    "normal": (np.float32, (3,)),
    "instance": (np.uint32, ()),
    "object": (np.uint32, ()),
    "triangle": (np.uint32, ()),
    "u": (np.float32, ()),
    "v": (np.float32, ()),
    "certain": (np.bool_, ()),
    "t_low": (np.float32, ()),
    "t_high": (np.float32, ()),
    "color": (np.float32, (3,)),
    "user": (np.uint64, ()),
}
