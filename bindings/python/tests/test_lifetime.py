"""Nothing leaks, and nothing that threads do at the same time ends the process."""
import gc
import os
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest
from conftest import golden, some_rays

import nifkit
from nifkit import ErrorCode


def resident() -> int:
    """Bytes of memory of this process."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def grows(work, rounds: int) -> int:
    """Bytes that `rounds` of work add after a tenth of it, which fills what is kept for later."""
    for _ in range(rounds // 10):
        work()
    gc.collect()
    before = resident()
    for _ in range(rounds):
        work()
    gc.collect()
    return resident() - before


def test_ten_thousand_loads():
    content = golden("networks").read_bytes()

    def closed():
        with nifkit.load(content) as asset, nifkit.Scene(asset) as scene:
            assert scene.visible((0, 0, 0), (0, 0, 1)).shape == ()

    def dropped():
        scene = nifkit.Scene(nifkit.load(golden("networks")))
        scene.intersect((0, 0, 0), (0, 0, 1))

    # A load that leaks the file alone would add 160 MB.
    assert grows(closed, 10_000) < 2_000_000
    assert grows(dropped, 2_000) < 2_000_000


def test_refusals_leak_nothing(networks):
    rays = some_rays(networks, 64)
    damaged = golden("networks").read_bytes()[:-1]
    out = np.empty(64, dtype=bool)

    def raising(rays, visible):
        raise KeyError

    def work():
        for kind, call in (
            (nifkit.Error, lambda: nifkit.load(damaged)),
            (nifkit.Error, lambda: nifkit.load("/no/such.nif")),
            (nifkit.Error, lambda: nifkit.Device(isa="what")),
            (ValueError, lambda: networks.query(*rays, out={"visible": out, "certain": out})),
            (KeyError, lambda: networks.query(*rays, fallback=raising)),
        ):
            with pytest.raises(kind):
                call()
        networks.query_async(*rays)
        networks.query(*rays, fallback=lambda rays, visible: visible)

    # pytest.raises() makes cycles; a leak of one answer, job or exception for each round would be more than this.
    assert grows(work, 3_000) < 1_000_000


def test_devices_end_their_threads():
    def work():
        with nifkit.Device(threads=3):
            pass

    before = len(os.listdir("/proc/self/task"))
    assert grows(work, 300) < 2_000_000
    assert len(os.listdir("/proc/self/task")) == before


def test_drops_without_collection():
    """Reference counts alone release everything: no cycles."""
    gc.collect()
    gc.disable()
    try:
        asset = nifkit.load(golden("single"))
        scene = nifkit.Scene(asset)
        job = scene.query_async(*some_rays(scene, 100))
        fallback = lambda rays, visible: visible  # noqa: E731
        scene.query(*some_rays(scene, 100), fallback=fallback)
        gone = [weakref.ref(thing) for thing in (asset, scene, job, fallback)]
        del asset, scene, job, fallback
        assert [thing() for thing in gone] == [None] * 4
    finally:
        gc.enable()


def test_threads(networks):
    """Many threads query one scene, while others load, query and close."""
    rays = some_rays(networks, 20_000)
    wanted = networks.query(*rays, outputs=("visible", "logit"))
    failures = []

    def guarded(work):
        def run():
            try:
                work()
            except BaseException as error:
                failures.append(error)

        return threading.Thread(target=run)

    def query():
        for _ in range(10):
            got = networks.query(*rays, outputs=("visible", "logit"))
            assert (got.visible == wanted.visible).all() and (got.logit == wanted.logit).all()

    def load():
        for _ in range(30):
            with nifkit.load(golden("shapes")) as asset, nifkit.Scene(asset) as scene:
                scene.visible(*(array[:100] for array in rays))

    threads = [guarded(query) for _ in range(4)] + [guarded(load) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures


def while_querying(scene: nifkit.Scene, action):
    """Runs action(done) while another thread is in a query; done() lets that go on. Returns what the query answered."""
    inside, leave, result = threading.Event(), threading.Event(), []
    rays = some_rays(scene, 5000)

    def wait(rays, visible):
        inside.set()
        assert leave.wait(30)
        return visible

    thread = threading.Thread(target=lambda: result.append(scene.query(*rays, fallback=wait)))
    thread.start()
    try:
        assert inside.wait(30)
        action()
    finally:
        leave.set()
        thread.join()
    return result[0].visible, rays


def test_changes_while_it_is_queried(networks):
    def action():
        for change in (
            lambda: networks.set_transform(0, np.eye(4)),
            lambda: networks.commit(),
        ):
            with pytest.raises(nifkit.Error, match="the scene is in use by another thread") as info:
                change()
            assert info.value.code == ErrorCode.INVALID_OPERATION

    got, rays = while_querying(networks, action)
    assert (got == networks.visible(*rays)).all()
    networks.set_transform(0, np.eye(4))


def test_close_while_it_is_queried():
    asset = nifkit.load(golden("networks"))
    scene = nifkit.Scene(device=asset.device)
    scene.add_object(asset)
    scene.commit()

    def action():
        scene.close()
        asset.close()
        with pytest.raises(nifkit.Error, match="the scene is closed"):
            scene.visible((0, 0, 0), (0, 0, 1))

    got, _ = while_querying(scene, action)
    assert got.any()


def test_jobs_keep_what_they_need():
    with nifkit.Device(threads=2) as device:
        scene = nifkit.Scene(nifkit.load(golden("single"), device=device))
    rays = some_rays(scene, 200_000)
    wanted = scene.visible(*rays)
    jobs = [scene.query_async(*(array.copy() for array in rays)) for _ in range(5)]
    scene.close()
    del scene, rays
    for job in jobs:
        assert (job.wait().visible == wanted).all()


def test_no_changes_before_a_job_is_done(scene, monkeypatch):
    job = scene.query_async(*some_rays(scene, 100))
    with monkeypatch.context() as patch:
        patch.setattr(nifkit.Job, "done", lambda self: False)  # however fast it was
        for change in (lambda: scene.set_transform(0, np.eye(4)), lambda: scene.commit()):
            with pytest.raises(nifkit.Error, match="a job of the scene is not done") as info:
                change()
            assert info.value.code == ErrorCode.INVALID_OPERATION
    job.wait()
    scene.set_transform(0, np.eye(4))
    scene.commit()


def test_process_ends(tmp_path):
    """With everything alive, jobs at work, and the library in use by a thread that nobody waits for."""
    program = f"""
import numpy, threading, nifkit
scene = nifkit.Scene(nifkit.load({str(golden("single"))!r}))
rays = numpy.random.default_rng(1).normal(size=(2, 300_000, 3)).astype("f4")
jobs = [scene.query_async(*rays) for _ in range(3)]
def forever():
    while True:
        scene.visible(*rays)
threading.Thread(target=forever, daemon=True).start()
cycle = [scene, jobs]
cycle.append(cycle)
print("end")
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (0, "end\n", "")


def test_fork():
    """A forked process has its own default device."""
    scene = nifkit.Scene(nifkit.load(golden("single")))
    rays = some_rays(scene, 30_000)
    wanted = scene.visible(*rays)
    child = os.fork()
    if child == 0:
        code = 1
        try:
            mine = nifkit.Scene(nifkit.load(golden("single")))
            code = 0 if (mine.visible(*rays) == wanted).all() else 2
        finally:
            os._exit(code)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
