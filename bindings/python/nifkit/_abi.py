"""The declarations of nif.h for ctypes: structures, enumerators, and the types of all functions that this package calls.

tests/test_abi.py compares them with the header. Handles and pointers to arrays are c_void_p.
"""
from __future__ import annotations

import ctypes
import enum
from ctypes import POINTER, c_char_p, c_double, c_float, c_int32, c_uint32, c_uint64, c_uint8, c_void_p
from typing import Any

# Version of nif.h that these are made from. Before 1.0 a library of another minor version may differ.
ABI = (0, 1)


class ErrorCode(enum.IntEnum):
    """Error codes. The numbers never change; codes for files are also exit codes of the program `nif`."""

    OK = 0
    UNKNOWN = 1
    INVALID_ARGUMENT = 2
    INVALID_OPERATION = 3
    OUT_OF_MEMORY = 4
    NOT_AVAILABLE = 5
    CANCELLED = 6
    SINGULAR_TRANSFORM = 7
    FILE_NOT_FOUND = 10
    FILE_UNREADABLE = 11
    FILE_EMPTY = 12
    FILE_TRUNCATED = 13
    NOT_A_NIF = 30
    FOREIGN_NIF = 31
    DAMAGED_NIF = 32
    UNSUPPORTED_NIF = 33
    DEVICE_LOST = 60
    OUT_OF_DEVICE_MEMORY = 61
    WRONG_POINTER = 62


class Encoding(enum.IntEnum):
    """How an object stores what blocks rays. The numbers never change."""

    SEGMENT = 1
    """Voxels, and a small network for what they leave open; compact, may err."""
    SPHERICAL = 2
    """The published Neural Intersection Function, for comparison; may err."""
    BVH = 3
    """The triangles in a compressed BVH; exact."""
    EXACT = 4
    """Planes that prove most answers, and the triangles for the rest; exact."""
    PROOF = 5
    """The planes alone: rays that they do not prove are left to your own BVH."""
    CUTOUT = 6
    """Triangles of which some have holes, as leaves and fences have; exact."""


class ShaderLanguage(enum.IntEnum):
    """A language of functions for shaders. The numbers never change."""

    GLSL = 1
    """For Vulkan."""
    WGSL = 2
    """For WebGPU."""
    HLSL = 3
    """For Direct3D 12."""
    METAL = 4
    """For Metal."""


class InstanceFlags(enum.IntFlag):
    """Flags of an instance of a scene."""

    DISABLED = 1
    """No ray meets it; answers are as if it were removed."""


LOAD_COPY, LOAD_IN_PLACE = 0, 1
NONE = 0xFFFFFFFF
LOGIT_CERTAIN = 0x7FFFFFFF


class Structure(ctypes.Structure):
    """A structure of nif.h, made with its struct_size set."""

    def __init__(self) -> None:
        super().__init__(struct_size=ctypes.sizeof(type(self)))


class NifDeviceInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("threads", c_uint32),
        ("reserved", c_uint32),
        ("isa", c_char_p),
        ("backend", c_char_p),
        ("gpu", c_char_p),
    ]


class NifBackendInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("name", c_char_p),
        ("available", c_uint32),
        ("reserved", c_uint32),
        ("reason", c_char_p),
    ]


class NifGpuInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("name", c_char_p),
        ("target", c_char_p),
        ("driver", c_char_p),
        ("memory_bytes", c_uint64),
        ("available", c_uint32),
        ("pci_domain", c_uint32),
        ("reason", c_char_p),
        ("backend", c_char_p),
        ("pci_bus", c_uint32),
        ("pci_device", c_uint32),
        ("uuid", c_uint8 * 16),
        ("luid", c_uint8 * 8),
        ("has_luid", c_uint32),
        ("reserved", c_uint32),
    ]


class NifAssetInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("object_count", c_uint32),
        ("instance_count", c_uint32),
        ("network_count", c_uint32),
        ("format_version", c_uint32),
        ("file_bytes", c_uint64),
        ("resident_bytes", c_uint64),
        ("metadata", c_void_p),
        ("metadata_bytes", c_uint64),
        ("gpu_bytes", c_uint64),
        ("places_nothing", c_uint32),
        ("arithmetic", c_uint32),
        ("prover", c_uint32),
        ("proves", c_uint32),
    ]


class NifPartInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("name", c_char_p),
        ("file_bytes", c_uint64),
        ("resident_bytes", c_uint64),
    ]


class NifObjectInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("name", c_char_p),
        ("encoding", c_uint32),
        ("network", c_uint32),
        ("bounds_min", c_float * 3),
        ("bounds_max", c_float * 3),
        ("bias", c_float),
        ("triangles", c_uint32),
        ("resident_bytes", c_uint64),
        ("proves", c_uint32),
        ("source_triangles", c_uint32),
        ("colors", c_uint32),
        ("level", c_uint32),
        ("error", c_float),
        ("unsupported", c_char_p),
        ("vertices", c_uint32),
        ("joints", c_uint32),
        ("targets", c_uint32),
        ("reserved", c_uint32),
    ]


class NifAssetInstanceInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("name", c_char_p),
        ("object", c_uint32),
        ("parent", c_uint32),
        ("transform", c_float * 12),
        ("user", c_uint64),
        ("mask", c_uint32),
        ("flags", c_uint32),
    ]


class NifPose(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("joints", c_void_p),
        ("weights", c_void_p),
        ("joint_count", c_uint32),
        ("target_count", c_uint32),
        ("positions", c_void_p),
        ("position_stride", c_uint64),
        ("memory", c_uint32),
        ("flags", c_uint32),
        ("stream", c_void_p),
    ]


class NifInstanceInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("asset", c_void_p),
        ("object", c_uint32),
        ("mask", c_uint32),
        ("user", c_uint64),
        ("origin", c_double * 3),
        ("transform", c_float * 12),
        ("flags", c_uint32),
        ("reserved", c_uint32),
    ]


class NifSceneInfo(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("instance_count", c_uint32),
        ("instance_end", c_uint32),
        ("bounds_min", c_float * 3),
        ("bounds_max", c_float * 3),
        ("resident_bytes", c_uint64),
        ("origin", c_double * 3),
        ("committed", c_uint32),
        ("reserved", c_uint32),
    ]


class NifRays(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("count", c_uint64),
        ("origin", c_void_p * 3),
        ("origin_stride", c_uint64),
        ("direction", c_void_p * 3),
        ("direction_stride", c_uint64),
        ("tmin", c_void_p),
        ("tmin_stride", c_uint64),
        ("tmax", c_void_p),
        ("tmax_stride", c_uint64),
        ("mask", c_void_p),
        ("mask_stride", c_uint64),
        ("memory", c_uint32),
        ("flags", c_uint32),
        ("scratch", c_void_p),
        ("scratch_bytes", c_uint64),
        ("stream", c_void_p),
    ]


class NifAnswers(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("visible", c_void_p),
        ("visible_bits", c_void_p),
        ("probability", c_void_p),
        ("certain", c_void_p),
        ("logit", c_void_p),
    ]


class NifOpenRays(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("capacity", c_uint64),
        ("rays", c_void_p),
        ("tmin", c_void_p),
        ("tmax", c_void_p),
        ("count", c_void_p),
        ("instance", c_void_p),
    ]


class NifHits(Structure):
    _fields_ = [
        ("struct_size", c_uint64),
        ("hit", c_void_p),
        ("t", c_void_p),
        ("normal", c_void_p),
        ("instance", c_void_p),
        ("object", c_void_p),
        ("triangle", c_void_p),
        ("u", c_void_p),
        ("v", c_void_p),
        ("certain", c_void_p),
        ("t_low", c_void_p),
        ("t_high", c_void_p),
        ("color", c_void_p),
        ("user", c_void_p),
    ]


NifFallback = ctypes.CFUNCTYPE(None, c_void_p, c_uint64, c_void_p, c_void_p)

# Name: return type, and types of the parameters.
FUNCTIONS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "nifGetVersion": (c_uint32, ()),
    "nifGetErrorMessage": (c_char_p, ()),
    "nifNewDevice": (c_int32, (c_char_p, c_void_p, POINTER(c_void_p))),
    "nifReleaseDevice": (None, (c_void_p,)),
    "nifGetDeviceInfo": (c_int32, (c_void_p, POINTER(NifDeviceInfo))),
    "nifGetBackendInfo": (c_int32, (c_uint32, POINTER(NifBackendInfo))),
    "nifGetGpuInfo": (c_int32, (c_uint32, POINTER(NifGpuInfo))),
    "nifLoadAssetFile": (c_int32, (c_void_p, c_char_p, c_int32, POINTER(c_void_p))),
    "nifLoadAssetMemory": (c_int32, (c_void_p, c_void_p, c_uint64, c_int32, POINTER(c_void_p))),
    "nifRetainAsset": (None, (c_void_p,)),
    "nifReleaseAsset": (None, (c_void_p,)),
    "nifGetAssetInfo": (c_int32, (c_void_p, POINTER(NifAssetInfo))),
    "nifGetPartInfo": (c_int32, (c_void_p, c_uint32, POINTER(NifPartInfo))),
    "nifGetObjectInfo": (c_int32, (c_void_p, c_uint32, POINTER(NifObjectInfo))),
    "nifGetAssetInstanceInfo": (c_int32, (c_void_p, c_uint32, POINTER(NifAssetInstanceInfo))),
    "nifGetShaderTables": (c_int32, (c_void_p, c_uint32, c_void_p, c_uint64, POINTER(c_uint64))),
    "nifGetShaderSource": (c_char_p, (c_int32,)),
    "nifNewScene": (c_int32, (c_void_p, POINTER(c_void_p))),
    "nifReleaseScene": (None, (c_void_p,)),
    "nifAddInstance": (c_int32, (c_void_p, c_void_p, c_uint32, c_void_p, POINTER(c_uint32))),
    "nifAddAsset": (c_int32, (c_void_p, c_void_p, c_void_p, POINTER(c_uint32), POINTER(c_uint32))),
    "nifRemoveInstance": (c_int32, (c_void_p, c_uint32)),
    "nifSetInstanceTransform": (c_int32, (c_void_p, c_uint32, c_void_p)),
    "nifSetInstanceTransforms": (c_int32, (c_void_p, c_uint64, c_void_p, c_void_p, c_uint64)),
    "nifSetInstanceVertices": (c_int32, (c_void_p, c_uint32, c_void_p, c_uint64)),
    "nifPoseInstance": (c_int32, (c_void_p, c_uint32, POINTER(NifPose))),
    "nifSetInstanceOrigin": (c_int32, (c_void_p, c_uint32, c_void_p)),
    "nifSetSceneOrigin": (c_int32, (c_void_p, c_void_p)),
    "nifSetInstanceMask": (c_int32, (c_void_p, c_uint32, c_uint32)),
    "nifSetInstanceFlags": (c_int32, (c_void_p, c_uint32, c_uint32)),
    "nifSetInstanceUser": (c_int32, (c_void_p, c_uint32, c_uint64)),
    "nifGetInstanceInfo": (c_int32, (c_void_p, c_uint32, POINTER(NifInstanceInfo))),
    "nifCommitScene": (c_int32, (c_void_p,)),
    "nifGetSceneInfo": (c_int32, (c_void_p, POINTER(NifSceneInfo))),
    "nifGetSceneShaderTables": (c_int32, (c_void_p, c_void_p, c_uint64, POINTER(c_uint64))),
    "nifQuery": (c_int32, (c_void_p, POINTER(NifRays), POINTER(NifAnswers))),
    "nifQueryWithFallback": (c_int32, (c_void_p, POINTER(NifRays), POINTER(NifAnswers), c_float, NifFallback, c_void_p)),
    "nifQueryOpen": (c_int32, (c_void_p, POINTER(NifRays), POINTER(NifAnswers), POINTER(NifOpenRays))),
    "nifIntersect": (c_int32, (c_void_p, POINTER(NifRays), POINTER(NifHits))),
    "nifQueryAsync": (c_int32, (c_void_p, POINTER(NifRays), POINTER(NifAnswers), POINTER(c_void_p))),
    "nifIntersectAsync": (c_int32, (c_void_p, POINTER(NifRays), POINTER(NifHits), POINTER(c_void_p))),
    "nifWaitJob": (c_int32, (c_void_p,)),
    "nifIsJobDone": (c_int32, (c_void_p, POINTER(c_uint32))),
    "nifCancelJob": (c_int32, (c_void_p,)),
    "nifReleaseJob": (None, (c_void_p,)),
}
