#!/usr/bin/env python3
"""Uses the page of samples/webgpu, or that of samples/playcanvas, in a headless Chromium.

    samples/webgpu/test_page.py --page FOLDER --nif PROGRAM --mesh MESH --asset ASSET.nif --pictures FOLDER [--triangles]

FOLDER is the output of build.sh for MESH and ASSET. --triangles: the page can ask triangles, too. Prints its measurements, and
writes pictures of the page. On failure, exits with 1 and says what is wrong.
"""
from __future__ import annotations

import argparse
import base64
import csv
import gzip
import json
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tests/pages"))
sys.path.insert(0, str(HERE.parents[0] / "vulkan"))
from browser import Browser  # noqa: E402
import compare  # noqa: E402

# Both WebGPU and what shows its pictures run on SwiftShader.
ARGUMENTS = ("--enable-unsafe-webgpu", "--enable-features=Vulkan", "--use-vulkan=swiftshader", "--use-angle=swiftshader",
             "--use-webgpu-adapter=swiftshader", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1")
FRAMES = 16
RAYS = 20000
MOST_BYTES = 200_000  # of words and text over the wire
MOST_DIFFERENT = 0.03  # of the answers by triangles, which are coarser than what was baked
# In decibels, for means over 4 x 4 pixels. Edges differ, because other triangles are drawn.
ENOUGH, TOO_LITTLE = 30.0, 26.0

failures = 0


def check(good: bool, what: str) -> None:
    global failures
    if not good:
        failures += 1
        print(f"samples/webgpu/test_page.py: {what}", file=sys.stderr)


class Served:
    """A folder, served."""

    def __init__(self, folder: Path) -> None:
        self.server = subprocess.Popen([sys.executable, str(HERE.parent / "web/serve.py"), str(folder), "--port", "0"],
                                       stdout=subprocess.PIPE, text=True)
        assert self.server.stdout
        self.address = self.server.stdout.readline().strip()

    def __enter__(self) -> str:
        return self.address

    def __exit__(self, *_: object) -> None:
        self.server.terminate()
        self.server.wait()


def wait(what: Callable[[], Any], why: str, browser: Browser, seconds: float = 300) -> Any:
    end = time.monotonic() + seconds
    while not (said := what()):
        if time.monotonic() > end:
            raise RuntimeError(f"waited {seconds} s: {why}; the page says: {message(browser)}; {browser.messages()}")
        time.sleep(0.1)
    return said


def message(browser: Browser) -> str:
    return browser.run("return document.getElementById('message').textContent")


def data(browser: Browser, name: str) -> Any:
    return browser.run(f"return document.body.dataset.{name}")


def picture(browser: Browser, file: Path) -> None:
    """The canvas alone."""
    x, y, width, height = browser.run("const b = document.getElementById('canvas').getBoundingClientRect();"
                                      "return [b.x, b.y, b.width, b.height]")
    shot = browser.devtools("Page.captureScreenshot", clip={"x": x, "y": y, "width": width, "height": height, "scale": 1})
    file.write_bytes(base64.b64decode(shot["data"]))


def render(options: argparse.Namespace, state: dict[str, Any], folder: Path, sun: list[float]) -> Path:
    """nif render's picture of the same view: triangles seen by Embree, and shadows by the asset."""
    folder.mkdir()
    (folder / "scene.toml").write_text(f"""
[picture]
width = {state["size"][0]}
height = {state["size"][1]}
samples = {FRAMES}
exposure = {state["exposure"]}
[ground]
albedo = {state["albedo"]["ground"]}
size = {state["groundSize"]}
[[object]]
mesh = {json.dumps(str(options.mesh.resolve()))}
nif = {json.dumps(str(options.asset.resolve()))}
albedo = {state["albedo"]["object"]}
[[light]]
type = "sun"
direction = {sun}
irradiance = {state["sunIrradiance"]}
angle = {state["sunAngle"]}
[[light]]
type = "sky"
radiance = {state["skyRadiance"]}
[[camera]]
name = "page"
position = {state["camera"]}
target = {state["target"]}
fov = {state["fov"]}
""")
    subprocess.run([options.nif, "render", folder / "scene.toml", "-o", folder, "--quiet"], check=True, stdout=subprocess.DEVNULL)
    return folder / "page-bits.png"


def test_picture(options: argparse.Namespace, browser: Browser, scratch: Path) -> None:
    with Served(options.page) as address:
        browser.show(address, 420, False, 400)
        first = wait(lambda: data(browser, "first"), "the first picture", browser)
        wait(lambda: int(data(browser, "frames") or 0) >= FRAMES, "enough frames", browser)
        cells = {name: browser.run(f"return document.getElementById('{name}').textContent")
                 for name in ("words", "text", "wire", "frame", "rate", "drawn")}
        print(f"first picture after {first} ms, in software; {data(browser, 'loaded')} ms of them load files and start the engine")
        print(", ".join(f"{k}: {v}" for k, v in cells.items()))
        wire = sum((options.page / name).stat().st_size for name in ("object.words.gz", "nif.wgsl.gz"))
        check(wire <= MOST_BYTES, f"words and text have {wire} bytes, packed")
        state = browser.run("return sample.state()")
        browser.picture(options.pictures / "page.png")
        picture(browser, scratch / "page.png")

        # The asset's answers in the page are the CPU's.
        low, high = browser.run("return sample.bounds")
        chance = random.Random(5)
        rays = []
        for _ in range(RAYS):
            a, b = ([chance.uniform(low[i] - 0.1 * (high[i] - low[i]), high[i] + 0.1 * (high[i] - low[i])) for i in range(3)]
                    for _ in range(2))
            rays.append([struct.unpack("f", struct.pack("f", x))[0]
                         for x in (*a, 0.0, *(q - p for p, q in zip(a, b)), 1.0)])
        expected = query(options, scratch, rays)
        asked = ask(browser, "visible", rays)
        different = sum(x != y for x, y in zip(expected, asked, strict=True))
        print(f"{different} of {RAYS} answers in the page differ from the CPU's; {RAYS - sum(expected)} are blocked")
        check(different == 0, f"{different} answers differ from the CPU's")
        check(RAYS // 20 < sum(expected) < RAYS, "the rays show nothing")
        if options.triangles:
            test_triangles(options, browser, scratch, [[*ray[:7], 1e30] for ray in rays])
        for text in browser.messages():
            check(False, f"the console has: {text}")
        browser.show("about:blank", 800, False, 300)  # which leaves the machine to `nif render`

    truth = render(options, state, scratch / "same", state["sun"])
    same = compare.psnr(str(scratch / "page.png"), str(truth))
    other = compare.psnr(str(scratch / "page.png"), str(render(options, state, scratch / "other", [-0.5, 0.6, 0.3])))
    print(f"{same:.1f} dB from nif render's picture; {other:.1f} dB with another sun")
    check(same >= ENOUGH, f"the picture is not like nif render's: {same:.1f} dB")
    check(other < TOO_LITTLE, f"another sun is not seen: {other:.1f} dB")
    if options.triangles:
        same = compare.psnr(str(scratch / "triangles.png"), str(truth))
        print(f"by three-mesh-bvh: {same:.1f} dB from nif render's picture")
        check(same >= ENOUGH, f"by three-mesh-bvh, the picture is not like nif render's: {same:.1f} dB")


def query(options: argparse.Namespace, scratch: Path, rays: list[list[float]]) -> list[int]:
    """The CPU's answers."""
    (scratch / "rays.csv").write_text("\n".join(",".join(map(repr, (*r[:3], *r[4:7], r[3], r[7]))) for r in rays) + "\n")
    answers = subprocess.run([options.nif, "query", options.asset, "--object", "0", "--rays", scratch / "rays.csv"],
                             check=True, capture_output=True, text=True).stdout
    return [int(row["visible"]) for row in csv.DictReader(answers.splitlines())]


def ask(browser: Browser, name: str, rays: list[list[float]]) -> list[int]:
    """The page's answers, by a function of `sample`."""
    browser.run(f"window.asked = null; sample.{name}({json.dumps([x for ray in rays for x in ray])}).then(v => window.asked = v)")
    return wait(lambda: browser.run("return window.asked"), "answers", browser)


def test_triangles(options: argparse.Namespace, browser: Browser, scratch: Path, rays: list[list[float]]) -> None:
    """The triangles that are drawn answer instead: like the asset, which was baked from finer ones. Speed and bytes of both."""
    def answer_by(name: str, frames: int) -> None:
        browser.run(f"document.querySelector('input[value={name}]').click()")
        wait(lambda: browser.run("return sample.by()") == name and int(data(browser, "frames") or 0) >= frames,
             f"frames by {name}", browser)

    answer_by("triangles", FRAMES)
    picture(browser, scratch / "triangles.png")
    browser.picture(options.pictures / "triangles.png")
    different = sum(x != y for x, y in zip(query(options, scratch, rays), ask(browser, "byTriangles", rays), strict=True))
    check(different < MOST_DIFFERENT * RAYS, f"{different} of {RAYS} answers by triangles differ from the asset's")
    frames: dict[str, list[float]] = {"asset": [], "triangles": []}
    for _ in range(3):
        for name, cell in (("asset", "frame"), ("triangles", "triangles-frame")):
            answer_by(name, 2)
            frames[name].append(float(browser.run(f"return parseFloat(document.getElementById('{cell}').textContent)")))
    asset, triangles = (min(frames[name]) for name in ("asset", "triangles"))
    rates = json.loads(data(browser, "rates"))
    cells = {name: browser.run(f"return document.getElementById('{name}').textContent")
             for name in ("buffers", "triangles-buffers", "triangles-built")}
    print(f"three-mesh-bvh, on the triangles drawn: buffers {cells['triangles-buffers']}, built in {cells['triangles-built']}; "
          f"the asset's buffer {cells['buffers']}; {different} of {RAYS} answers differ from the asset's")
    print(f"rays a second in software, in a compute pass, by turns: asset {rates['asset']:.3g}, triangles "
          f"{rates['triangles']:.3g}; the asset's rate is {rates['asset'] / rates['triangles']:.2f} times that of triangles")
    print(f"a frame, in software, the best of three by turns: asset {asset:.0f} ms, triangles {triangles:.0f} ms: "
          f"the asset's takes {asset / triangles:.2f} times as long")


def test_without_triangles(options: argparse.Namespace, browser: Browser, scratch: Path) -> None:
    """Without three-mesh-bvh, or with a device too small for it, the page says so, and the asset goes on answering."""
    folder = scratch / "without three-mesh-bvh"
    shutil.copytree(options.page, folder)
    (folder / "three-mesh-bvh/webgpu/index.js").unlink()
    # Too small from the first picture on, so that the asset has its buffer.
    script = """
        const limits = GPUSupportedLimits.prototype, name = 'maxStorageBufferBindingSize';
        const real = Object.getOwnPropertyDescriptor(limits, name).get;
        Object.defineProperty(limits, name, { get() { return document.body?.dataset.first ? 1000 : real.call(this); } });"""
    for what, page, source, text in (
            ("a missing module", folder, "", "three-mesh-bvh cannot be loaded"),
            ("small buffers", options.page, script, "allows 1000 bytes in a storage buffer, and the triangles need")):
        added = browser.devtools("Page.addScriptToEvaluateOnNewDocument", source=source)
        with Served(page) as address:
            browser.show(address, 800, False, 300)
            wait(lambda: data(browser, "first"), what, browser)
            browser.run("document.querySelector('input[value=triangles]').click()")
            wait(lambda: browser.run("return document.getElementById('message').classList.contains('wrong')"), what, browser)
            check(text in message(browser), f"{what}: the page says '{message(browser)}'")
            check(browser.run("return sample.by() + document.querySelector('input[name=by]:checked').value") == "assetasset",
                  f"{what}: the asset does not go on answering")
            browser.messages()
        browser.devtools("Page.removeScriptToEvaluateOnNewDocument", identifier=added["identifier"])


def test_wrong(options: argparse.Namespace, browser: Browser, scratch: Path) -> None:
    """Broken files and browsers that lack something: a sentence, and nothing is drawn."""
    planes = gzip.decompress((options.page / "object.words.gz").read_bytes())
    words = bytearray(len(planes))
    for i in range(4):
        words[i::4] = planes[i * len(planes) // 4:(i + 1) * len(planes) // 4]

    def packed(content: bytes) -> bytes:
        return gzip.compress(b"".join(content[i::4] for i in range(4)))

    version = words[:4] + struct.pack("<I", 9) + words[8:]
    wide = words[:84] + struct.pack("<I", 40) + words[88:]
    wrong: dict[str, tuple[str, bytes | None, str]] = {
        "missing words": ("object.words.gz", None, "object.words.gz cannot be read: the server answers with 404"),
        "damaged words": ("object.words.gz", b"hello", "object.words.gz is damaged"),
        "short words": ("object.words.gz", packed(words[:-4]), "words of"),
        "no words": ("object.words.gz", packed(b""), "too short"),
        "swapped words": ("object.words.gz", packed(b"SFIN" + words[4:]), "does not have the words of an object"),
        "another version": ("object.words.gz", packed(version), "version 9"),
        "a wide network": ("object.words.gz", packed(wide), "NIF_NETWORK_WORDS 40"),
        "no text": ("nif.wgsl.gz", gzip.compress(b"fn f() {}"), "nif.wgsl is not as this page knows it"),
        "no mesh": ("object.glb", b"glTF nonsense", "object.glb cannot be read"),
    }
    for what, (name, content, text) in wrong.items():
        folder = scratch / what
        shutil.copytree(options.page, folder)
        (folder / name).unlink()
        if content is not None:
            (folder / name).write_bytes(content)
        with Served(folder) as address:
            browser.show(address, 800, False, 300)
            wait(lambda: browser.run("return document.getElementById('message').classList.contains('wrong')"), what, browser, 30)
            said = message(browser)
        check(text in said, f"{what}: the page says '{said}'")
        check(data(browser, "first") is None, f"{what}: something is drawn")
    with Served(options.page) as address:
        for what, script, text in (
                ("no WebGPU", "Object.defineProperty(navigator, 'gpu', { value: undefined })", "this browser does not have"),
                ("no device", "GPU.prototype.requestAdapter = async () => null", "finds no device"),
                ("small buffers", "Object.defineProperty(GPUSupportedLimits.prototype, 'maxStorageBufferBindingSize', "
                 "{ get: () => 1000 })", "allows 1000 bytes")):
            added = browser.devtools("Page.addScriptToEvaluateOnNewDocument", source=script)
            browser.show(address, 800, False, 300)
            wait(lambda: browser.run("return document.getElementById('message').classList.contains('wrong')"), what, browser, 30)
            check(text in message(browser), f"{what}: the page says '{message(browser)}'")
            check(data(browser, "first") is None, f"{what}: something is drawn")
            browser.devtools("Page.removeScriptToEvaluateOnNewDocument", identifier=added["identifier"])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("page", "nif", "mesh", "asset", "pictures"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--triangles", action="store_true")
    options = parser.parse_args()
    options.pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, Browser(*ARGUMENTS) as browser:
        test_picture(options, browser, Path(folder))
        test_wrong(options, browser, Path(folder))
        if options.triangles:
            test_without_triangles(options, browser, Path(folder))
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())
