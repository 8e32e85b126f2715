"""Nothing leaks, and nothing that threads do at the same time ends the process."""
import gc
import linecache
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
from nifkit._job import Work


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
            (KeyError, lambda: networks.query_with_fallback(*rays, fallback=raising)),
        ):
            with pytest.raises(kind):
                call()
        networks.query_async(*rays)
        networks.query_with_fallback(*rays, fallback=lambda rays, visible: visible)

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
        scene.query_with_fallback(*some_rays(scene, 100), fallback=fallback)
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

    thread = threading.Thread(target=lambda: result.append(scene.query_with_fallback(*rays, fallback=wait)))
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
            lambda: networks.set_instance_transform(0, np.eye(4)),
            lambda: networks.commit(),
        ):
            with pytest.raises(nifkit.Error, match="the scene is in use by another thread") as info:
                change()
            assert info.value.code == ErrorCode.INVALID_OPERATION

    got, rays = while_querying(networks, action)
    assert (got == networks.visible(*rays)).all()
    networks.set_instance_transform(0, np.eye(4))


def test_close_while_it_is_queried():
    asset = nifkit.load(golden("networks"))
    scene = nifkit.Scene(device=asset.device)
    scene.add_instance(asset)
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
        patch.setattr(Work, "done", lambda self: False)  # however fast it was
        for change in (lambda: scene.set_instance_transform(0, np.eye(4)), lambda: scene.commit()):
            with pytest.raises(nifkit.Error, match="a job of the scene is not done") as info:
                change()
            assert info.value.code == ErrorCode.INVALID_OPERATION
    job.wait()
    scene.set_instance_transform(0, np.eye(4))
    scene.commit()


def test_no_changes_while_garbage_is_collected(scene, monkeypatch):
    """A job in it is waited for, and threads go on meanwhile. Its weak references are gone by then."""

    class Before:
        def __del__(self):
            try:
                scene.commit()
            except nifkit.Error as error:
                said.append(str(error))

    said = []
    cycle = Before()
    cycle.job = scene.query_async(*some_rays(scene, 100))
    cycle.itself = cycle
    with monkeypatch.context() as patch:
        patch.setattr(Work, "done", lambda self: False)
        del cycle
        gc.collect()
    assert said == ["a job of the scene is not done; wait for it first"]
    assert not Work.running
    scene.commit()


def test_jobs_that_are_done_keep_nothing(scene):
    """What may be at work is kept by the package itself, no longer than that."""
    ways = (lambda job: job.wait(), lambda job: [None for _ in iter(job.done, True)], lambda job: None)
    for way in ways:
        out = np.empty(1000, dtype=bool)
        gone = weakref.ref(out)
        job = scene.query_async(*some_rays(scene, 1000), out={"visible": out})
        way(job)
        del out, job
        assert gone() is None and not Work.running
    job = scene.query_async(*some_rays(scene, 1000))
    while scene.instance_count:
        try:
            scene.commit()
        except nifkit.Error:
            continue
        break
    assert not Work.running
    # One that does not begin.
    with nifkit.Scene(device=scene.device) as other, pytest.raises(nifkit.Error, match="commit"):
        other.query_async(*some_rays(scene, 10))
    assert not Work.running


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # in __del__
def test_interrupted_anywhere(scene):
    """A KeyboardInterrupt between any two lines leaves a handle as usable as before."""
    files = ("_handle.py", "_scene.py", "_job.py", "contextlib.py")
    left = 0  # lines before it

    def trace(frame, event, argument):
        nonlocal left
        file = frame.f_code.co_filename
        if os.path.basename(file) not in files:
            return None
        if linecache.getline(file, frame.f_lineno).strip() == "with self._lock:":
            return trace  # at its end, where none comes before the lock is given back
        left -= 1
        if left < 0:
            sys.settrace(None)
            raise KeyboardInterrupt
        return trace

    def interrupted(call, lines: int) -> bool:
        nonlocal left
        left = lines
        outer = sys.gettrace()
        sys.settrace(trace)
        try:
            call()
        except KeyboardInterrupt:
            pass
        finally:
            sys.settrace(outer)
        return left < 0

    rays = some_rays(scene, 10)
    move = lambda: scene.set_instance_transform(0, np.eye(4))  # noqa: E731
    for call in (lambda: scene.committed, move, lambda: scene.query_async(*rays).wait()):
        scene.commit()
        lines = 0
        while interrupted(call, lines):
            lines += 1
            scene.set_instance_transform(0, np.eye(4))  # is refused where a use is left
            scene.commit()
        assert lines > 10


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


def run(program: str, *arguments: str) -> tuple[int, str, str]:
    """A program of its own: how it ended, and what it said."""
    command = [sys.executable, "-c", program, str(golden("networks")), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=20)
    return done.returncode, done.stdout, done.stderr


def test_process_ends_before_a_job():
    """Which is kept by something that goes away after this package's modules have."""
    program = """
import numpy, sys, threading, nifkit
scene = nifkit.Scene(nifkit.load(sys.argv[1], device=nifkit.Device(threads=2)))
rays = numpy.random.default_rng(1).normal(size=(2, 1_000_000, 3)).astype("f4")
def keeps(job=scene.query_async(*rays, outputs=("visible", "probability"))): pass
threading.keeps = keeps
del rays
print("end")
"""
    assert run(program) == (0, "end\n", "")


@pytest.mark.parametrize("does", ["nothing", "drops", "closes", "queries"])
def test_fork_with_threads(does):
    """A forked process has none of the threads that the device of its parent would end, and that its jobs wait for."""
    program = """
import numpy, os, sys, nifkit
does = sys.argv[2]
device = nifkit.Device(threads=4)
scene = nifkit.Scene(nifkit.load(sys.argv[1], device=device))
rays = numpy.random.default_rng(1).normal(size=(2, 200_000, 3)).astype("f4")
if does != "queries":
    job = scene.query_async(*rays)
if os.fork():
    sys.exit(os.waitstatus_to_exitcode(os.wait()[1]))
assert not nifkit._job.Work.running
if does == "drops":
    del job, scene, device
elif does == "closes":
    scene.close()
    device.close()
elif does == "queries":
    scene.query_async(*rays).wait()
    scene.commit()
"""
    assert run(program, does) == (0, "", "")


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
