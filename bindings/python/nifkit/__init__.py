"""nifkit: load .nif assets and ask whether rays are blocked, in numpy arrays; bake assets from meshes.

    import nifkit, numpy

    with nifkit.load("dragon.nif") as asset:
        scene = nifkit.Scene(asset)
    visible = scene.visible(origins, directions)     # float32 [n, 3] each -> bool [n]

Queries release the GIL, and read arrays of float32 of any strides without a copy. `Error` has the code and the sentence of what
was refused. bindings/python/README.md in the source tree says more.
"""
from ._abi import LOGIT_CERTAIN, NONE, Encoding, ErrorCode, InstanceFlags, ShaderLanguage
from ._answers import Answers, Hits, Instance, OpenRays
from ._asset import Asset, AssetInstance, Object, Part, load
from ._bake import bake, bake_file
from ._device import BackendInfo, GpuInfo, Device, backends, gpus, default_device
from ._job import Job
from ._library import Error, library_version
from ._program import find_program
from ._scene import Scene
from ._shader import shader_source

__version__ = library_version()
__all__ = [
    "Answers",
    "Asset",
    "AssetInstance",
    "BackendInfo",
    "GpuInfo",
    "Device",
    "Encoding",
    "Error",
    "ErrorCode",
    "Hits",
    "Instance",
    "InstanceFlags",
    "Job",
    "LOGIT_CERTAIN",
    "NONE",
    "Object",
    "OpenRays",
    "Part",
    "Scene",
    "ShaderLanguage",
    "backends",
    "bake",
    "bake_file",
    "gpus",
    "default_device",
    "find_program",
    "load",
    "shader_source",
]
