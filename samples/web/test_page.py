#!/usr/bin/env python3
"""Uses the page of samples/web in a headless Chromium, like a user.

    samples/web/test_page.py --page FOLDER --nif PROGRAM --mesh MESH --asset ASSET.nif --other ASSET.nif --pictures FOLDER

FOLDER is the output of build.sh for MESH and ASSET; --other is an asset of another object. Prints its measurements, and writes
pictures of the page. On failure, exits with 1 and says what is wrong.
"""
from __future__ import annotations

import argparse
import base64
import contextlib
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tests/pages"))
from browser import Browser  # noqa: E402
from check import CONTRAST, TOO_WIDE  # noqa: E402

# No other host resolves, so a request to one leaves an error in the console.
ARGUMENTS = ("--enable-unsafe-swiftshader", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1")
SAMPLES = 64
# For means over 4 x 4 pixels, so that noise matters less than the lighting.
ENOUGH, TOO_LITTLE = 48.0, 40.0

COMPARE = """
const [first, second] = arguments.length ? arguments : ARGUMENTS;
const pixels = async data => {
  const picture = new Image();
  picture.src = 'data:image/png;base64,' + data;
  await picture.decode();
  const canvas = new OffscreenCanvas(picture.width, picture.height), context = canvas.getContext('2d');
  context.drawImage(picture, 0, 0);
  return context.getImageData(0, 0, picture.width, picture.height);
};
const [a, b] = [await pixels(first), await pixels(second)];
if (a.width !== b.width || a.height !== b.height) return [a.width, a.height, b.width, b.height];
const psnr = side => {
  let sum = 0, count = 0;
  for (let y = 0; y + side <= a.height; y += side) for (let x = 0; x + side <= a.width; x += side) for (let c = 0; c < 3; ++c) {
    let difference = 0;
    for (let v = 0; v < side; ++v) for (let u = 0; u < side; ++u) {
      const at = 4 * ((y + v) * a.width + x + u) + c;
      difference += (a.data[at] - b.data[at]) / 255;
    }
    sum += (difference / side ** 2) ** 2;
    ++count;
  }
  return -10 * Math.log10(sum / count);
};
return [psnr(1), psnr(4)];
"""
KEY_CODES = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Tab": 9}

failures = 0


def check(good: bool, what: str) -> None:
    global failures
    if not good:
        failures += 1
        print(f"samples/web/test_page.py: {what}", file=sys.stderr)


class Page:
    """The page in a window, served by its own server."""

    def __init__(self, browser: Browser, address: str) -> None:
        self.browser = browser
        self.address = address

    def open(self, width: int, height: int, dark: bool = False, query: str = "") -> None:
        self.browser.show(self.address + query, width, dark, height)

    def data(self, name: str) -> Any:
        return self.browser.run(f"return document.body.dataset.{name}")

    def wait(self, what: Callable[[], Any], why: str, seconds: float = 90) -> Any:
        end = time.monotonic() + seconds
        while not (said := what()):
            if time.monotonic() > end:
                raise RuntimeError(f"waited {seconds} s: {why}; the page says: {self.message()}")
            time.sleep(0.05)
        return said

    def message(self) -> str:
        return self.browser.run("return document.getElementById('message').textContent")

    def wrong(self) -> bool:
        return self.browser.run("return document.getElementById('message').classList.contains('wrong')")

    def cell(self, row: str, column: int) -> str:
        return self.browser.run(f"return document.querySelector('#{row}').cells[{column}].textContent")

    def ready(self, samples: int = 1) -> None:
        self.wait(lambda: int(self.data("samples") or 0) >= samples, f"{samples} samples")

    def measured(self) -> dict[str, Any]:
        """The contents of the table, once both have answered."""
        def both() -> Any:
            result = json.loads(self.data("measured") or "{}")
            return result if "different" in result else None
        return self.wait(both, "both are measured")

    def state(self) -> dict[str, Any]:
        return self.browser.run("return sample.picture()")

    def key(self, key: str) -> None:
        code = KEY_CODES.get(key) or ord(key.upper())
        text = {"text": key} if len(key) == 1 else {}
        for kind in ("keyDown", "keyUp"):
            self.browser.devtools("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code,
                                  **(text if kind == "keyDown" else {}))

    def drop(self, *files: Path) -> None:
        data = {"items": [], "files": [str(file.resolve()) for file in files], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.browser.devtools("Input.dispatchDragEvent", type=kind, x=200, y=200, data=data)

    def dropped(self, *files: Path) -> str:
        """The page's message after it has dealt with the files."""
        self.browser.run("document.getElementById('message').textContent = ''")
        self.drop(*files)
        self.wait(lambda: self.message() not in ("",) and not self.message().startswith("Loading"), "the files are dealt with")
        return self.message()

    def picture(self) -> str:
        """The canvas as PNG, in base64, without overlays."""
        style = "document.querySelectorAll('#sun, #progress').forEach(e => e.style.visibility = '%s')"
        self.browser.run(style % "hidden")
        x, y, width, height = self.browser.run(
            "const b = document.getElementById('canvas').getBoundingClientRect(); return [b.x, b.y, b.width, b.height]")
        shot = self.browser.devtools("Page.captureScreenshot",
                                     clip={"x": x, "y": y, "width": width, "height": height, "scale": 1})["data"]
        self.browser.run(style % "visible")
        return shot

    def psnr(self, first: str, second: str) -> list[float]:
        script = COMPARE.replace("arguments.length ? arguments : ARGUMENTS", json.dumps([first, second]))
        return self.browser.run(f"return (async () => {{ {script} }})()")  # of equal pictures: infinite, and so None

    def complaints(self) -> list[str]:
        """The messages in the console, except those from taking screenshots."""
        return [text for text in self.browser.messages() if "GPU stall due to ReadPixels" not in text]


@contextlib.contextmanager
def served(folder: Path) -> Iterator[str]:
    with subprocess.Popen([sys.executable, str(HERE / "serve.py"), str(folder), "--port", "0"], stdout=subprocess.PIPE,
                          text=True) as server:
        assert server.stdout
        try:
            yield server.stdout.readline().strip()
        finally:
            server.terminate()


def render(options: argparse.Namespace, state: dict[str, Any], folder: Path) -> str:
    """nif render's picture of the same view, as PNG in base64."""
    light, camera = state["light"], state["camera"]
    folder.mkdir()
    (folder / "scene.toml").write_text(f"""
[picture]
width = {state["size"][0]}
height = {state["size"][1]}
samples = {SAMPLES}
exposure = {light["exposure"]}
[ground]
albedo = {light["albedo"]["ground"]}
size = {light["groundSize"]}
[[object]]
mesh = {json.dumps(str(options.mesh.resolve()))}
nif = {json.dumps(str(options.asset.resolve()))}
albedo = {light["albedo"]["object"]}
[[light]]
type = "sun"
direction = {state["sun"]}
irradiance = {light["sunIrradiance"]}
angle = {light["sunAngle"]}
[[light]]
type = "sky"
radiance = {light["skyRadiance"]}
[[camera]]
name = "page"
position = {camera["position"]}
target = {state["target"]}
fov = 40
""")
    subprocess.run([options.nif, "render", folder / "scene.toml", "-o", folder, "--primary", "asset", "--quiet"], check=True,
                   stdout=subprocess.DEVNULL)
    return base64.b64encode((folder / "page-asset.png").read_bytes()).decode()


def test_start(options: argparse.Namespace) -> None:
    """A browser that has never seen the page: time to the first picture, and that the controls work."""
    times = []
    for _ in range(5):
        with served(options.page) as address, Browser(*ARGUMENTS) as browser:
            page = Page(browser, address)
            page.open(1280, 800)
            times.append(int(page.wait(lambda: page.data("interactive"), "the first picture")))
    print(f"first picture after {', '.join(map(str, sorted(times)))} ms, rendered in software")
    check(min(times) < 3000, f"the first picture takes {min(times)} ms")


def test_picture(page: Page, options: argparse.Namespace, scratch: Path) -> None:
    """Equal to nif render's picture; and another sun, or missing occlusion of the sky, is detected."""
    page.open(880, 360)
    page.ready(SAMPLES)
    shot, state = page.picture(), page.state()
    plain, smooth = page.psnr(shot, render(options, state, scratch / "same"))
    print(f"PSNR with nif render {plain:.1f} dB, of 4 x 4 pixels {smooth:.1f} dB")
    check(smooth >= ENOUGH, f"the picture differs from nif render's: {smooth:.1f} dB")
    page.browser.run("document.querySelector('#sun').focus()")
    page.key("ArrowRight")
    page.ready(SAMPLES)
    _, other = page.psnr(page.picture(), shot)
    print(f"5 degrees of the sun: {other:.1f} dB")
    check(other < TOO_LITTLE, f"5 degrees of the sun are not seen: {other:.1f} dB")
    broken = scratch / "page without occlusion"
    shutil.copytree(options.page, broken)
    tracer = (broken / "tracer.js").read_text()
    changed = tracer.replace("if (this.#visible[i] !== 0)", "if (this.#visible[i] !== 0 || this.#weights[i] < 0)")
    check(tracer != changed, "the tracer is not as this test thinks")
    (broken / "tracer.js").write_text(changed)
    with served(broken) as address:
        other_page = Page(page.browser, address)
        other_page.open(880, 360)
        other_page.ready(SAMPLES)
        _, other = page.psnr(other_page.picture(), shot)
    print(f"nothing hides the sky: {other:.1f} dB")
    check(other < TOO_LITTLE, f"missing occlusion of the sky is not seen: {other:.1f} dB")


def test_workers(page: Page) -> None:
    """Three workers make the same picture as one, to the last bit."""
    shots = []
    for threads in (2, 4):
        page.browser.devtools("Emulation.setHardwareConcurrencyOverride", hardwareConcurrency=threads)
        page.open(400, 300)
        page.ready(256)
        shots.append(page.picture())
    page.browser.devtools("Emulation.setHardwareConcurrencyOverride", hardwareConcurrency=2)
    check(page.psnr(*shots) == [None, None], "three workers make another picture than one")


def test_both(page: Page) -> None:
    page.open(1280, 800)
    result = page.measured()
    rates, share = result["rates"], result["different"] / result["rays"]
    print(f"rays a second, one thread: nifkit {rates['asset']:.3g}, three-mesh-bvh {rates['triangles']:.3g}: "
          f"{rates['asset'] / rates['triangles']:.1f} times; {100 * share:.2f} % of {result['rays']} answers differ")
    for column, name in ((1, "nifkit"), (2, "three-mesh-bvh")):
        print(f"{name}: " + ", ".join(f"{row} {page.cell(row, column)}" for row in ("file", "memory", "ready", "rate")))
    check(share < 0.02, f"{100 * share:.2f} % of the answers differ")
    # The other engine makes the same picture.
    page.open(880, 360)
    page.measured()
    page.ready(SAMPLES)
    shot = page.picture()
    page.key("t")
    check(page.browser.run("return document.querySelector('input[value=triangles]').checked"), "T does not change who lights")
    page.ready(SAMPLES)
    _, smooth = page.psnr(page.picture(), shot)
    print(f"PSNR of the pictures by both, of 4 x 4 pixels: {smooth:.1f} dB")
    check(smooth >= 30, f"both make other pictures: {smooth:.1f} dB")


def test_hands(page: Page) -> None:
    """Keys, mouse and fingers."""
    page.open(1280, 800)
    page.ready()
    start = page.state()
    for key, field in (("ArrowLeft", "sun"), ("ArrowUp", "sun"), ("a", "camera"), ("w", "camera"), ("+", "camera")):
        before = page.state()[field]
        page.key(key)
        check(page.state()[field] != before, f"key {key} moves nothing")
    page.key("r")
    check(page.state() == start, "R does not go back to the start")
    # Everything can be reached by Tab.
    reached = set()
    for _ in range(12):
        page.key("Tab")
        reached.add(page.browser.run("const e = document.activeElement; return e.id || e.value || e.textContent"))
    for wanted in ("canvas", "sun", "asset", "choose", "Keys"):
        check(wanted in reached, f"Tab does not reach {wanted}: {reached}")
    middle = "const b = document.getElementById('sun').getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]"

    def moved_by(what: str, press: Callable[[str, float, float], None]) -> None:
        x, y = page.browser.run(middle)
        before = page.state()
        for kind, dx in (("down", 0), ("move", -60), ("move", -120), ("up", -120)):
            press(kind, x + dx, y)
        after = page.state()
        check(after["sun"] != before["sun"] and after["camera"] == before["camera"], f"{what} does not drag the sun")
        there = page.browser.run(middle)
        check(abs(there[0] - x + 120) < 8 and abs(there[1] - y) < 8, f"the sun is not where {what} has dragged it")

    def mouse(kind: str, x: float, y: float) -> None:
        names = {"down": "mousePressed", "move": "mouseMoved", "up": "mouseReleased"}
        page.browser.devtools("Input.dispatchMouseEvent", type=names[kind], x=x, y=y, button="left", clickCount=1)

    def finger(kind: str, x: float, y: float) -> None:
        names = {"down": "touchStart", "move": "touchMove", "up": "touchEnd"}
        page.browser.devtools("Input.dispatchTouchEvent", type=names[kind], touchPoints=[] if kind == "up" else [{"x": x, "y": y}])

    moved_by("the mouse", mouse)
    # The picture follows while the sun is dragged.
    x, y = page.browser.run(middle)
    mouse("down", x, y)
    before, start_time, moves = int(page.data("pictures")), time.monotonic(), 0
    while time.monotonic() < start_time + 2:
        mouse("move", x + moves % 100, y)
        moves += 1
    pictures = int(page.data("pictures")) - before
    mouse("up", x, y)
    print(f"{moves} moves of the sun in 2 s, {pictures} pictures")
    check(pictures >= 4, f"while the sun is dragged for 2 s there are {pictures} pictures")
    page.key("r")
    page.browser.devtools("Emulation.setTouchEmulationEnabled", enabled=True)
    moved_by("a finger", finger)
    page.browser.devtools("Emulation.setTouchEmulationEnabled", enabled=False)


def glb(description: dict[str, Any], data: bytes) -> bytes:
    text = json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if data:
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def triangle(indices: tuple[int, ...], positions: tuple[float, ...], uri: str | None = None) -> bytes:
    data = struct.pack("<3I", *indices) + struct.pack("<9f", *positions)
    return glb({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0}]}],
        "buffers": [{"byteLength": len(data)} | ({"uri": uri} if uri else {})],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 12}, {"buffer": 0, "byteOffset": 12, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5125, "count": 3, "type": "SCALAR"},
                      {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 1]}],
    }, b"" if uri else data)


def test_files(page: Page, options: argparse.Namespace, scratch: Path) -> None:
    """Errors are reported, and the object stays; valid files are shown."""
    page.open(1280, 800)
    page.measured()
    asset, triangles = options.asset.read_bytes(), (options.page / "object.glb").read_bytes()
    corner = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    damaged = bytearray(asset)
    damaged[len(damaged) // 2] ^= 255
    wrong = {
        "damaged.nif": (bytes(damaged), "damaged.nif"),
        "short.nif": (asset[:100], "short.nif"),
        "empty.nif": (b"", "empty.nif"),
        "picture.nif": (b"\x89PNG\r\n\x1a\n" + bytes(200), "picture.nif"),
        "short.glb": (triangles[:len(triangles) // 2], "short.glb"),
        "empty.glb": (b"", "empty.glb"),
        "text.glb": (b"hello, world; this is no glTF at all", "does not begin like one"),
        "corner.glb": (triangle((0, 1, 7), corner), "a corner 7, of 3"),
        "number.glb": (triangle((0, 1, 2), (float("nan"),) + corner[1:]), "no numbers"),
        "point.glb": (triangle((0, 1, 2), (1.0,) * 9), "point.glb has no size"),
        "nothing.glb": (glb({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}, b""), "no triangles"),
        "elsewhere.glb": (triangle((0, 1, 2), corner, "http://example.com/data.bin"), "refers to other files"),
        "notes.txt": (b"hello", "neither a .nif nor a .glb"),
    }
    before = [page.cell(row, column) for row in ("file", "memory") for column in (1, 2)]
    for name, (data, text) in wrong.items():
        file = scratch / name
        file.write_bytes(data)
        said = page.dropped(file)
        check(page.wrong() and text in said, f"{name}: the page says '{said}'")
        check(before == [page.cell(row, column) for row in ("file", "memory") for column in (1, 2)], f"{name}: the object has changed")
    check("a spherical object" in page.dropped(options.other.parent / "v2-spherical.nif"), "an asset without first hits is taken")
    two = [scratch / "short.nif", scratch / "damaged.nif"]
    check("two .nif" in page.dropped(*two), "two assets are taken")
    # Rendering continues.
    page.key("ArrowLeft")
    page.ready(2)

    def good(what: str, *files: Path) -> None:
        said = page.dropped(*files)
        check(not page.wrong() and said.startswith(f"Showing {files[0].name}"), f"{what}: the page says '{said}'")
        page.ready()

    mesh = scratch / "mesh.glb"
    mesh.write_bytes(triangles)
    good("an asset of another object", options.other)
    check(page.cell("file", 2) == "–", "the triangles of another object stay")
    said = page.dropped(mesh, options.other)
    check(page.wrong() and "different objects" in said, f"two objects: the page says '{said}'")
    good("asset and triangles", options.asset, mesh)
    page.measured()
    good("triangles alone, of the same object", mesh)
    page.measured()
    # By the button, too.
    node = page.browser.devtools("Runtime.evaluate", expression="document.getElementById('files')")["result"]["objectId"]
    page.browser.devtools("DOM.setFileInputFiles", files=[str(options.other.resolve())], objectId=node)
    page.wait(lambda: options.other.name in page.message() and not page.message().startswith("Loading"), "the chosen file is shown")


def renderer_bytes() -> int:
    """Memory of all of Chromium's renderers that this process has started, with shared parts split."""
    parents, names = {}, {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError, IndexError):
            parents[int(status.parent.name)] = int(status.read_text().rpartition(")")[2].split()[1])
            names[int(status.parent.name)] = (status.parent / "cmdline").read_bytes()
    total = 0
    for process, name in names.items():
        ancestor = process
        while ancestor > 1 and ancestor != os.getpid():
            ancestor = parents.get(ancestor, 0)
        if ancestor == os.getpid() and b"--type=renderer" in name:
            with contextlib.suppress(OSError):
                rollup = (Path("/proc") / str(process) / "smaps_rollup").read_text()
                total += 1024 * int(next(line for line in rollup.splitlines() if line.startswith("Pss:")).split()[1])
    return total


def test_memory(page: Page, options: argparse.Namespace, scratch: Path) -> None:
    """Dropping valid and broken files again and again keeps memory flat."""
    page.open(880, 360)
    page.measured()
    broken = scratch / "broken.nif"
    broken.write_bytes(options.asset.read_bytes()[:-1])

    def rounds(count: int) -> int:
        for _ in range(count):
            page.dropped(options.asset)
            page.dropped(broken)
        page.browser.devtools("HeapProfiler.collectGarbage")
        time.sleep(1)
        return renderer_bytes()

    rounds(20)
    first = rounds(20)
    second = rounds(40)
    print(f"memory of the page after 80 files {first / 1e6:.0f} MB, after 160 {second / 1e6:.0f} MB")
    check(second < 1.1 * first, f"memory grows from {first} to {second} bytes")


def test_lacking(page: Page) -> None:
    """Browsers that lack something."""
    lacks = {
        "web workers": "delete globalThis.Worker",
        "WebGL 2": "HTMLCanvasElement.prototype.getContext = () => null",
    }
    for what, script in lacks.items():
        added = page.browser.devtools("Page.addScriptToEvaluateOnNewDocument", source=script)
        page.open(1280, 800)
        page.wait(page.wrong, f"a sentence about {what}")
        check(what in page.message(), f"without {what} the page says '{page.message()}'")
        page.browser.devtools("Page.removeScriptToEvaluateOnNewDocument", identifier=added["identifier"])
    page.open(1280, 800, query="?simd=off")
    page.ready()
    check("SIMD" in page.message(), f"without vectors the page says '{page.message()}'")


def test_looks(page: Page, pictures: Path) -> None:
    for width, height, device in ((1280, 800, "wide"), (390, 844, "phone")):
        for dark, colours in ((False, "light"), (True, "dark")):
            page.open(width, height, dark)
            page.ready(12)
            if device == "phone":
                check(page.cell("file", 2) == "–", "a phone loads the triangles unasked")
                page.browser.run("document.getElementById('triangles').click()")
            page.measured()
            page.ready(12)
            over, elements = page.browser.run(TOO_WIDE)
            check(over <= 0 and not elements, f"{device}: {over} pixels wider than the window: {elements}")
            check(page.browser.run(CONTRAST) >= 7, f"{device}, {colours}: text is too near to its background")
            page.browser.picture(pictures / f"{device}-{colours}.png")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("page", "nif", "mesh", "asset", "other", "pictures"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--only", help="the name of one test, e.g. files")
    options = parser.parse_args()
    options.pictures.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, served(options.page) as address, Browser(*ARGUMENTS) as browser:
        page, scratch = Page(browser, address), Path(folder)
        tests: dict[str, Callable[[], None]] = {
            "start": lambda: test_start(options),
            "picture": lambda: test_picture(page, options, scratch),
            "workers": lambda: test_workers(page),
            "both": lambda: test_both(page),
            "hands": lambda: test_hands(page),
            "files": lambda: test_files(page, options, scratch),
            "lacking": lambda: test_lacking(page),
            "looks": lambda: test_looks(page, options.pictures),
            "memory": lambda: test_memory(page, options, scratch),
        }
        for name, test in tests.items():
            if options.only in (None, name):
                start = time.monotonic()
                test()
                for text in page.complaints():
                    check(False, f"{name}: the console has: {text}")
                print(f"{name}: {time.monotonic() - start:.0f} s", flush=True)
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())
