"""What the tests share: golden assets with their answers, and rays. test.sh runs them on the installed wheel."""
from __future__ import annotations

import gc
from pathlib import Path

import numpy as np
import pytest

import nifkit

ROOT = Path(__file__).resolve().parents[3]
GOLDEN = sorted((ROOT / "tests/golden").glob("*.nif"))
# GoldenAnswer of tests/golden/golden.hpp.
ANSWER = np.dtype(
    [("object", "<u4"), ("origin", "<f4", 3), ("direction", "<f4", 3), ("tmin", "<f4"), ("tmax", "<f4"),
     ("logit", "<i4"), ("visible", "u1"), ("certain", "u1"), ("zero", "<u2")]
)  # fmt: skip


def golden(name: str) -> Path:
    return ROOT / f"tests/golden/v2-{name}.nif"


def some_rays(scene: nifkit.Scene, count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Rays from around a scene to points in it."""
    random = np.random.default_rng(seed)
    low, high = scene.bounds
    middle, size = (low + high) / 2, (high - low).max()
    origins = (middle + size * random.normal(size=(count, 3))).astype(np.float32)
    ends = low + (high - low) * random.random((count, 3))
    return origins, (ends - origins).astype(np.float32)


@pytest.fixture
def scene():
    """One object, so that many rays meet it."""
    with nifkit.load(golden("single")) as asset, nifkit.Scene(asset) as made:
        yield made


@pytest.fixture
def networks():
    """Objects that do not answer every ray for certain."""
    with nifkit.load(golden("networks")) as asset, nifkit.Scene(device=asset.device) as made:
        made.add_instance(asset, 0)
        made.commit()
        yield made


@pytest.fixture(autouse=True)
def collected():
    yield
    gc.collect()
