"""_abi.py against nif.h: sizes, members, enumerators, and parameters."""
import ctypes
import re
import subprocess

import pytest
from conftest import ROOT

from nifkit import _abi

HEADER = ROOT / "runtime/include/nif/nif.h"
TEXT = re.sub(r"/\*.*?\*/", " ", HEADER.read_text(), flags=re.DOTALL)
STRUCTURES = [kind for kind in _abi.Structure.__subclasses__()]


def compiled(folder, lines: list[str]) -> list[int]:
    """The values of C expressions."""
    source = folder / "values.c"
    body = "".join(f'  printf("%lld\\n", (long long)({line}));\n' for line in lines)
    source.write_text(f"#include <nif/nif.h>\n#include <stddef.h>\n#include <stdio.h>\nint main(void) {{\n{body}}}\n")
    subprocess.run(["cc", "-I", HEADER.parents[1], source, "-o", folder / "values"], check=True)
    said = subprocess.run([folder / "values"], check=True, capture_output=True, text=True).stdout
    return [int(line) for line in said.split()]


@pytest.mark.parametrize("kind", STRUCTURES, ids=lambda kind: kind.__name__)
def test_structures(kind, tmp_path):
    name = kind.__name__
    body = re.search(rf"typedef struct {name} {{(.*?)}} {name};", TEXT, re.DOTALL).group(1)
    members = [re.findall(r"\w+", re.sub(r"\[.*?\]", "", part))[-1] for part in re.split(r"[;,]", body) if part.strip()]
    assert members == [field for field, _ in kind._fields_]
    expressions = [f"sizeof({name})"] + [f"offsetof({name}, {field})" for field in members]
    expressions += [f"sizeof((({name}*)0)->{field})" for field in members]
    fields = [getattr(kind, field) for field in members]
    assert compiled(tmp_path, expressions) == (
        [ctypes.sizeof(kind)] + [field.offset for field in fields] + [field.size for field in fields]
    )


@pytest.mark.parametrize(
    "kind, prefix",
    [(_abi.ErrorCode, "NIF_ERROR_"), (_abi.Encoding, "NIF_ENCODING_"), (_abi.InstanceFlags, "NIF_INSTANCE_"),
     (_abi.ShaderLanguage, "NIF_SHADER_")],
)
def test_enumerators(kind, prefix):
    written = dict(re.findall(rf"\b{prefix}(\w+) = (\d+)\b", TEXT))
    assert {name: int(number) for name, number in written.items()} == {
        item.name: item.value for item in kind if item.name != "OK"
    }


def test_constants(tmp_path):
    names = ["NIF_LOAD_COPY", "NIF_LOAD_IN_PLACE", "NIF_NONE", "NIF_LOGIT_CERTAIN"]
    names += ["NIF_VERSION_MAJOR", "NIF_VERSION_MINOR"]
    here = [_abi.LOAD_COPY, _abi.LOAD_IN_PLACE, _abi.NONE, _abi.LOGIT_CERTAIN, *_abi.ABI]
    assert compiled(tmp_path, names) == here


def kind_of(declared: str):
    """What ctypes has to say for a type of C: its size, and whether it is a pointer."""
    if "*" in declared or re.search(r"\bNif(Device|Asset|Scene|Job|Fallback)\b", declared):
        return "pointer"
    for name, kind in {"uint32_t": ctypes.c_uint32, "uint64_t": ctypes.c_uint64, "float": ctypes.c_float}.items():
        if re.search(rf"\b{name}\b", declared):
            return kind
    return None if re.search(r"\bvoid\b", declared) else ctypes.c_int32  # an enumeration


def kind_here(kind):
    pointer = kind in (ctypes.c_void_p, ctypes.c_char_p) or (
        kind is not None and (hasattr(kind, "contents") or issubclass(kind, ctypes._CFuncPtr))
    )
    return "pointer" if pointer else kind


@pytest.mark.parametrize("name", _abi.FUNCTIONS)
def test_functions(name):
    result, parameters = re.search(rf"NIF_API ([^;]*?)\b{name}\(([^;]*)\);", TEXT).groups()
    declared = [] if parameters == "void" else [kind_of(part) for part in parameters.split(",")]
    returned, here = _abi.FUNCTIONS[name]
    assert kind_here(returned) == kind_of(result)
    assert [kind_here(kind) for kind in here] == declared
