"""The package as a whole: names, documents, the example of the README, and how long an import takes."""
import inspect
import re
import subprocess
import sys
from pathlib import Path

from conftest import ROOT, golden

import nifkit

README = (ROOT / "bindings/python/README.md").read_text()


def test_version():
    header = (ROOT / "runtime/include/nif/nif.h").read_text()
    numbers = re.findall(r"#define NIF_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", header)
    assert nifkit.__version__ == ".".join(numbers)
    assert f"nifkit-{nifkit.__version__}-py3-none-linux_x86_64.whl" in README


def test_everything_is_documented():
    assert (Path(nifkit.__file__).parent / "py.typed").exists()
    for name in nifkit.__all__:
        thing = getattr(nifkit, name)
        if not inspect.isclass(thing) and not inspect.isfunction(thing):
            continue
        assert inspect.getdoc(thing), name
        for member, value in vars(thing).items() if inspect.isclass(thing) else ():
            if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                assert inspect.getdoc(value), f"{name}.{member}"


def test_readme(tmp_path):
    shown, baked = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    (tmp_path / "dragon.nif").write_bytes(golden("single").read_bytes())

    def said(example):
        command = [sys.executable, "-W", "error", "-c", example]
        return subprocess.run(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True, check=True).stdout

    assert re.fullmatch(r"\d+% lit, \d+% of it proven\n", said(shown))
    assert re.search(r"^  0% .*\n(?:.*\n)*(?:EXACT|BVH), \d+ bytes\n$", said(baked))
    assert (tmp_path / "tube.nif").exists()


def load_elsewhere(library: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-c", "import nifkit"], env={"NIF_LIBRARY": str(library)}, capture_output=True, text=True
    )
    assert done.returncode == 1
    return done.stderr.splitlines()[-1]


def test_other_libraries(tmp_path):
    for name, source in {"plain": "int nothing;", "other": "unsigned nifGetVersion(void) { return 200; }"}.items():
        stubs = " ".join(f"void {f}(void) {{}}" for f in nifkit._abi.FUNCTIONS if f != "nifGetVersion")
        code = source + (stubs if name == "other" else "")
        library = tmp_path / f"{name}.so"
        subprocess.run(["cc", "-shared", "-fPIC", "-x", "c", "-", "-o", library], input=code, text=True, check=True)
    assert "is not the runtime of nifkit 0.1" in load_elsewhere(tmp_path / "plain.so")
    assert "is version 0.2 of nifkit's runtime; this package is made for 0.1" in load_elsewhere(tmp_path / "other.so")
    assert "NIF_LIBRARY names it" in load_elsewhere(tmp_path / "none.so")
