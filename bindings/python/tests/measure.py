"""Rates of Python beside C, import, and size of the wheel: prints the tables of docs/results/python.md.

    measure.py ASSET ANSWERS WHEEL [ROUNDS]      ANSWERS is answers.c, compiled with the same library
"""
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import nifkit

BATCHES = (1_000_000, 100_000, 10_000, 1_000, 100, 10, 1)


def rays_around(scene: nifkit.Scene, count: int) -> np.ndarray:
    """[count, 8] NifRay: from around the scene to points in its box."""
    random = np.random.default_rng(1)
    low, high = scene.bounds
    rays = np.zeros((count, 8), dtype=np.float32)
    rays[:, :3] = (low + high) / 2 + (high - low).max() * random.normal(size=(count, 3))
    rays[:, 4:7] = low + (high - low) * random.random((count, 3)) - rays[:, :3]
    rays[:, 7] = np.inf
    return rays


def rates(asset: Path, answers: str, threads: int, batch: int, rounds: int, rays: np.ndarray) -> str:
    """A row of the table. C and Python take turns; a ratio is the median over the rounds. Of processor time, unless it says
    otherwise: other programs on the machine change it less."""
    with nifkit.Device(threads=threads) as device, nifkit.load(asset, device=device) as loaded:
        scene = nifkit.Scene(loaded)
    origins, directions = rays[:batch, :3].copy(), rays[:batch, 4:7].copy()
    out = {"visible": np.empty(batch, dtype=bool)}
    calls = min(200_000 // batch + 1, 2000)

    def timed(call) -> tuple[float, float]:
        start = time.process_time(), time.perf_counter()
        for _ in range(calls):
            call()
        return (time.process_time() - start[0]) / calls, (time.perf_counter() - start[1]) / calls

    with tempfile.TemporaryDirectory() as folder:
        rays[:batch].tofile(f"{folder}/rays")
        command = [answers, asset, f"{folder}/rays", f"{folder}/out", str(batch), str(rounds + 1), str(threads)]
        program = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)

        def in_c() -> tuple[float, float]:
            program.stdin.write(b".")
            processor, wall = program.stdout.readline().split()
            return float(processor), float(wall)

        ways = (
            in_c,
            lambda: timed(lambda: scene.query(origins, directions, out=out)),
            lambda: timed(lambda: scene.visible(origins, directions)),
        )
        for way in ways:  # for what is done once
            way()
        seconds = np.empty((rounds, 3, 2))  # round, way, clock
        for i in range(rounds):
            for j in np.roll(np.arange(3), i):
                seconds[i, j] = ways[j]()
        program.stdin.close()
        program.wait()
        same = np.fromfile(f"{folder}/out", dtype=bool)
    assert (same == out["visible"]).all() and (same == scene.visible(origins, directions)).all()
    assert 0 < same.sum() or batch < 100
    processor, wall = seconds[..., 0], seconds[..., 1]
    ratios = np.stack([processor[:, 0] / processor[:, 1], processor[:, 0] / processor[:, 2], wall[:, 0] / wall[:, 1]])
    low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75), axis=1)
    shown = " | ".join(f"{m:.3f} ({a:.3f} to {b:.3f})" for a, m, b in zip(low, middle, high))
    more = np.median(processor[:, 1] - processor[:, 0]) * 1e6
    return f"| {batch:,} | {batch / np.median(processor[:, 0]) / 1e6:.2f} | {shown} | {more:.0f} |"


def imports(rounds: int) -> str:
    """Seconds in fresh processes, of numpy alone and of nifkit with numpy, which take turns."""
    code = (
        "import time; start = time.perf_counter(), time.process_time(); import {}; "
        "print(time.perf_counter() - start[0], time.process_time() - start[1])"
    )
    seconds = np.empty((rounds, 2, 2))  # round, package, clock
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    for i in range(-1, rounds):  # the first writes bytecode
        for j, name in enumerate(("numpy", "nifkit")):
            command = [sys.executable, "-c", code.format(name)]
            done = subprocess.run(command, stdout=subprocess.PIPE, check=True, env=environment)
            seconds[i, j] = [float(number) for number in done.stdout.split()]
    rows = (("nifkit, with numpy", seconds[:, 1]), ("numpy alone", seconds[:, 0]))
    return "\n".join(
        f"| {name} | {np.median(s[:, 0]):.3f} s | {s[:, 0].max():.3f} s | {np.median(s[:, 1]):.3f} s |" for name, s in rows
    )


def main() -> None:
    asset, answers, wheel = (Path(name) for name in sys.argv[1:4])
    rounds = int(sys.argv[4]) if len(sys.argv) > 4 else 41
    with nifkit.load(asset) as loaded:
        rays = rays_around(nifkit.Scene(loaded), max(BATCHES))
    for threads in (1, 2):
        print(f"\n{threads} thread{'s' * (threads > 1)}:\n")
        print("| rays | C, million rays/s | array given | new array | array given, by the clock | µs more |")
        print("| ---: | ---: | ---: | ---: | ---: | ---: |")
        for batch in BATCHES:
            print(rates(asset, str(answers), threads, batch, rounds, rays), flush=True)
    print("\n| import | by the clock, median | worst | of processors, median |\n| --- | ---: | ---: | ---: |")
    print(imports(21))
    print(f"\nWheel: {wheel.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
