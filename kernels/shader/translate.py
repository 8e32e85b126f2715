#!/usr/bin/env python3
"""Translates kernels/shader/nif.glsl to another language, which the name of the second file tells.

    kernels/shader/translate.py nif.glsl nif.wgsl
    kernels/shader/translate.py nif.glsl nif.hlsl
    kernels/shader/translate.py nif.glsl nif.metal

It knows the narrow style of that file and no more: one declaration a statement, blocks in braces, no side effects in
conditional expressions, no structures but those two, no pointers. WGSL is written anew, statement by statement; lines of the
preprocessor become comments there, which mark what may be left out. HLSL and Metal's language are close to GLSL: the text stays, with
other names. Whatever it does not know ends it with 1 and the line.
"""
import re
import sys

TYPES = {"float": "f32", "int": "i32", "uint": "u32", "bool": "bool", "vec3": "vec3<f32>", "ivec3": "vec3<i32>",
         "uvec3": "vec3<u32>", "bvec3": "vec3<bool>", "NifAnswer": "NifAnswer", "NifHit": "NifHit", "void": ""}
TYPE = "|".join(TYPES)
CALLS = {"floatBitsToUint": "bitcast<u32>", "uintBitsToFloat": "bitcast<f32>", "bitCount": "countOneBits", "NIF_DOT4": "nif_dot",
         **{glsl: wgsl for glsl, wgsl in TYPES.items() if wgsl and not glsl.startswith("Nif")}}
WGSL_HEAD = """\
// nif.wgsl: asks a nifkit object whether a ray is blocked, in a shader of your own. Made from nif.glsl, whose comments say
// how to use it. WGSL has no preprocessor: change what follows up to the structures to your needs.
@group(0) @binding(0) var<storage, read> nif_words : array<u32>;
fn nif_word(i : u32) -> u32 { return nif_words[i]; }
const NIF_PROVES : bool = false;  // WGSL may reorder operations, so no bound holds: no answer is certain
// #if NIF_PLANES || NIF_SCENES // Such marks, up to `// #endif`, have what may be left out; `nif export-shader` does that.
const NIF_CERTAIN_REACH : f32 = 8192.0;
// #endif
// #if NIF_PLANES && NIF_NETWORK
const NIF_NETWORK_WORDS : u32 = 12u;
// #endif
"""


class Unknown(Exception):
    """A statement that this does not know."""


def closing(text, at):
    """Index of the parenthesis that closes the one at `at`."""
    depth = 0
    for i in range(at, len(text)):
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(text[i], 0)
        if depth == 0:
            return i
    raise Unknown("unbalanced: " + text)


def split(text, mark):
    """Parts between marks that are in no parentheses."""
    parts, depth, start = [], 0, 0
    for i, c in enumerate(text):
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(c, 0)
        if c == mark and depth == 0:
            parts.append(text[start:i])
            start = i + 1
    return [*parts, text[start:]]


def expression(text):
    """An expression in WGSL: select() for ?:, and other names of types and functions."""
    parts = split(text, ",")
    if len(parts) > 1:
        return ", ".join(expression(part.strip()) for part in parts)
    ask = split(text, "?")
    if len(ask) > 1:
        condition, rest = ask[0].strip(), "?".join(ask[1:])
        # The colon that belongs to the first question mark is the one after as many others.
        yes, no, depth, level = "", "", 0, 0
        for i, c in enumerate(rest):
            depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(c, 0)
            level += (c == "?") - (c == ":") if depth == 0 else 0
            if level < 0:
                yes, no = rest[:i].strip(), rest[i + 1:].strip()
                break
        return f"select({expression(no)}, {expression(yes)}, {expression(condition)})"
    done, i = "", 0
    while i < len(text):
        if text[i] in "([":
            end = closing(text, i)
            done += text[i] + expression(text[i + 1:end]) + text[end]
            i = end + 1
        else:
            done += text[i]
            i += 1
    return re.sub(r"\b(\w+)\(", lambda m: CALLS.get(m[1], "nif_word" if m[1] == "NIF_WORD" else m[1]) + "(", done)


def changes(name, body):
    """Whether a local name gets another value in a function."""
    return re.search(rf"(\+\+|--){name}\b|(?<![\w.]){name}(\[\w+\]|\.\w+)?\s*(=(?!=)|[+|]=)", body) is not None


def statement(text, body):
    """A simple statement without its semicolon. `body`: what follows it in its function."""
    text = text.removeprefix("precise ")
    if declared := re.fullmatch(rf"(const )?({TYPE}) (\w+)(\[\w+\])? = (.*)", text):
        keyword = "var" if changes(declared[3], body) else "let"
        return f"{keyword} {declared[3]} : {TYPES[declared[2]]} = {expression(declared[5])}"
    if declared := re.fullmatch(rf"({TYPE}) (\w+)", text):
        return f"var {declared[2]} : {TYPES[declared[1]]}"
    if text.startswith(("++", "--")):
        return text[2:] + text[:2]
    if assigned := re.fullmatch(r"([\w.\[\]]+) ([+|]?=) (.*)", text):
        return f"{expression(assigned[1])} {assigned[2]} {expression(assigned[3])}"
    if text.startswith("return"):
        return ("return " + expression(text[6:].strip())).strip()
    if text in ("continue", "break", "") or re.fullmatch(r"\w+\(.*\)", text):
        return expression(text)
    raise Unknown(text)


def loop(head, body):
    first, condition, step = (part.strip() for part in split(head, ";"))
    first = statement(first, "++" + first.split()[1] if first else "") if first else ""
    return f"for ({first}; {expression(condition)}; {statement(step, '') if step else ''}) {{"


def line_of(code, rest):
    """One logical line. `rest`: those after it, up to the end of its function."""
    if code in ("}", "} else {", "};") or not code:
        return code
    if found := re.fullmatch(r"if \((.*)\) \{", code):
        return f"if ({expression(found[1])}) {{"
    if found := re.fullmatch(r"for \((.*)\) \{", code):
        return loop(found[1], rest)
    if found := re.fullmatch(rf"({TYPE}) (\w+)\((.*?)\) \{{(?: (.*); \}})?", code):
        parameters = [parameter.split() for parameter in split(found[3], ",")] if found[3] else []
        listed = ", ".join(f"{name} : {TYPES[kind]}" for kind, name in parameters)
        result = f" -> {TYPES[found[1]]}" if found[1] != "void" else ""
        return f"fn {found[2]}({listed}){result} {{" + (f" {statement(found[4], '')}; }}" if found[4] else "")
    if code.endswith(";"):
        return statement(code[:-1], rest) + ";"
    raise Unknown(code)


def of_file(code):
    """A line outside of functions."""
    if found := re.fullmatch(rf"const ({TYPE}) (\w+) = (.*);", code):
        return f"const {found[2]} : {TYPES[found[1]]} = {found[3]};"
    if found := re.fullmatch(rf"({TYPE}) (\w+(?:, \w+)*);", code):
        return " ".join(f"var<private> {name} : {TYPES[found[1]]};" for name in found[2].split(", "))
    if found := re.fullmatch(rf"({TYPE}) (\w+)\[(\w+)\];", code):
        return f"var<private> {found[2]} : array<{TYPES[found[1]]}, {found[3]}>;"
    return None


def to_wgsl(glsl):
    text = glsl[glsl.index("struct NifAnswer"):]
    lines, inside, structure = [WGSL_HEAD], False, False
    source, number = text.split("\n"), 0
    while number < len(source):
        if source[number].startswith(("#", "precise ")):  # the latter says more of a name, which WGSL cannot
            lines += ["// " + source[number]] if source[number][0] == "#" else []
            number += 1
            continue
        code, mark, comment = source[number].partition("//")
        indent = code[:len(code) - len(code.lstrip())]
        code = code.strip()
        while code and code[-1] not in "{};" and number + 1 < len(source):  # goes on in the next line
            number += 1
            code += " " + source[number].strip()
        number += 1
        if structure and (found := re.fullmatch(rf"({TYPE}) (\w+);", code)):
            done = f"{found[2]} : {TYPES[found[1]]},"
        elif code.startswith("struct "):
            structure, done = True, code
        elif code == "};":
            structure, done = False, "}"
        elif not inside and (done := of_file(code)) is not None:
            pass
        else:
            end = next((i for i in range(number, len(source)) if source[i] == "}"), len(source))
            done = line_of(code, "\n".join(source[number:end]))
            inside = code != "}" if not indent and code else inside
            if re.search(r"; \}$", code):
                inside = False
        lines.append((indent + done + ("  " if done and mark else "") + mark + comment).rstrip())
    wgsl = "\n".join(lines)
    # WGSL has no infinity. What is compared with it is smaller than this.
    return wgsl.replace("bitcast<f32>(0x7f800000u)", "3.40282346e+38")


HLSL_HEAD = """\
// nif.hlsl: asks a nifkit object whether a ray is blocked, in a shader of your own. HLSL for shader model 6. Made from nif.glsl.
//
//   NifAnswer answer = nif_query(0u, origin, direction, 0.0, 1.0e30);
//   if (answer.visible) ...
//
// Bind the words of nifGetShaderTables as a StructuredBuffer<uint>. Define what you want otherwise than below before you
// include this file. What to call is at the end, and docs/shaders.md says more.
//
// The arithmetic is that of the CPU, operation by operation: each sum, product and quotient makes a `precise` value, so
// that no compiler fuses or reorders it. No stack, no pointers, no array in memory that is not the buffer.

#ifndef NIF_WORD  // (i): reads word i. If you define it, nothing is bound here
#ifndef NIF_REGISTER
#define NIF_REGISTER t0  // where the buffer is bound
#endif
#ifndef NIF_SPACE
#define NIF_SPACE space0
#endif
StructuredBuffer<uint> nif_words : register(NIF_REGISTER, NIF_SPACE);
#define NIF_WORD(i) nif_words[i]
#endif
"""
METAL_HEAD = """\
// nif.metal: asks a nifkit object whether a ray is blocked, in a shader of your own. Metal's language. Made from nif.glsl.
//
//   Nif nif;
//   nif.nif_words = words;  // a `device const uint*`, an argument of your function: the words of nifGetShaderTables
//   NifAnswer answer = nif.nif_query(0u, origin, direction, 0.0f, 1.0e30f);
//   if (answer.visible) ...
//
// Define what you want otherwise than below before you include this file. What to call is at the end, and docs/shaders.md
// says more. No stack, no array in memory that is not the buffer.
#include <metal_stdlib>
#pragma METAL fp contract(off)
using namespace metal;

#ifndef NIF_WORD  // (i): reads word i. If you define it, `Nif` has no pointer
#define NIF_OWN_WORDS
#define NIF_WORD(i) nif_words[i]
#endif
#ifndef NIF_PROVES  // true only if you compile without fast math (-fno-fast-math), which the proofs need
#define NIF_PROVES false
#endif
"""
VECTORS = {"vec3": "float3", "ivec3": "int3", "uvec3": "uint3", "bvec3": "bool3"}
LANGUAGES = {
    "hlsl": {"head": HLSL_HEAD, "constant": "static const", "state": "static ",
             "calls": {"floatBitsToUint": "asuint", "uintBitsToFloat": "asfloat", "bitCount": "countbits"}},
    "metal": {"head": METAL_HEAD, "constant": "constant", "state": "",
              "calls": {"floatBitsToUint": "as_type<uint>", "uintBitsToFloat": "as_type<float>", "bitCount": "popcount"}},
}


def with_calls(text, name, change):
    """Text with change(arguments) in place of each call name(arguments)."""
    done, rest = "", text
    while found := re.search(rf"\b{name}\(", rest):
        end = closing(rest, found.end() - 1)
        done += rest[:found.start()] + change(with_calls(rest[found.end():end], name, change))
        rest = rest[end + 1:]
    return done + rest


def floats(code):
    """Code whose numbers with a point say that they are floats."""
    return re.sub(r"(?<![\w.])(\d+\.\d+(?:e[-+]?\d+)?)", r"\1f", code)


def near_glsl(code, language):
    """Some code of GLSL in a language that is close to it."""
    own = LANGUAGES[language]
    for glsl, name in VECTORS.items():
        def construct(arguments, name=name):
            # One argument may be a vector, or a number for all three: HLSL has casts for that.
            cast = language == "hlsl" and len(split(arguments, ",")) == 1
            return f"(({name})({arguments}))" if cast else f"{name}({arguments})"
        code = re.sub(rf"\b{glsl}\b", name, with_calls(code, glsl, construct))
    for glsl, name in own["calls"].items():
        code = re.sub(rf"\b{glsl}\(", name + "(", code)
    for structure in ("NifAnswer", "NifHit"):
        if language == "hlsl":
            code = re.sub(rf"\b{structure}\(", f"nif_make_{structure[3:].lower()}(", code)
        else:
            code = with_calls(code, structure, lambda arguments, structure=structure: f"{structure}{{{arguments}}}")
    if language == "hlsl":
        return re.sub(r"\btriangle\b", "triangle_number", code)  # a keyword there
    return floats(code.replace("precise ", ""))


def maker(name, members):
    """A function of HLSL that makes a structure of its members."""
    listed = ", ".join(f"{kind} {member}" for kind, member in members)
    fill = "\n".join(f"  made.{member} = {member};" for _, member in members)
    return f"{name} nif_make_{name[3:].lower()}(\n    {listed}) {{\n  {name} made;\n{fill}\n  return made;\n}}"


def to_near_glsl(glsl, language):
    own = LANGUAGES[language]
    text = glsl[glsl.index("#ifndef NIF_PROVES" if language == "hlsl" else "#ifndef NIF_PLANES"):]
    is_precise = set(re.findall(r"\w+", " ".join(re.findall(r"^precise (.*);$", text, re.M))))
    # Statements that go on in the next line are joined only to look at them: calls may span lines.
    lines, source, number = [own["head"].rstrip("\n")], text.rstrip("\n").split("\n"), 0
    structure, members = None, []
    while number < len(source):
        line = source[number]
        number += 1
        if line.startswith("#"):
            lines.append(floats(line) if language == "metal" and line.startswith("#define") else line)
            continue
        if line.startswith("precise "):
            continue
        code, mark, comment = line.partition("//")
        while code.count("(") != code.count(")"):  # goes on in the next line
            more, mark, comment = source[number].partition("//")
            code += "\n" + more
            number += 1
        if found := re.fullmatch(r"struct (\w+) \{\s*", code):
            structure, members = found[1], []
        elif structure and (found := re.fullmatch(r"  (\w+) (\w+);\s*", code)):
            members.append(near_glsl(f"{found[1]} {found[2]}", language).split())
        if found := re.fullmatch(rf"const ({TYPE}) (\w+) = (.*);\s*", code):
            code = f"{own['constant']} {code[6:]}"
        elif found := re.fullmatch(rf"({TYPE}) (\w+(?:, \w+)*|\w+\[\w+\]);(\s*)", code):
            names = re.findall(r"\w+", found[2])
            precise = [name in is_precise for name in names if name.startswith("nif_")]
            if any(precise) != all(precise):
                raise Unknown(code)
            code = own["state"] + ("precise " if all(precise) else "") + code
        code = near_glsl(code, language)
        if code.strip() and mark:  # in the same column, if there is room
            code = (code.rstrip() + "  ").ljust(len(line.partition("//")[0]))
        lines.append((code + mark + comment).rstrip())
        if structure and line == "};":
            if language == "hlsl":
                lines.append(maker(structure, members))
            structure = None
        if language == "metal" and "NIF_CERTAIN_LOGIT = " in code:
            lines += ["", "struct Nif {", "#ifdef NIF_OWN_WORDS", "device const uint* nif_words;", "#endif"]
    return "\n".join(lines + (["};"] if language == "metal" else [])) + "\n"


def main():
    language = sys.argv[2].rpartition(".")[2] if len(sys.argv) == 3 else ""
    if language != "wgsl" and language not in LANGUAGES:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        glsl = file.read()
    try:
        text = to_wgsl(glsl) if language == "wgsl" else to_near_glsl(glsl, language)
    except Unknown as unknown:
        sys.exit(f"{sys.argv[1]}: this cannot be translated: {unknown}")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write(text)


main()
