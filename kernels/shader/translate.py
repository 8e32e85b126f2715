#!/usr/bin/env python3
"""Translates kernels/shader/nif.glsl to WGSL.

    kernels/shader/translate.py nif.glsl nif.wgsl

It knows the narrow style of that file and no more: one declaration a statement, blocks in braces, no side effects in
conditional expressions, no structures but those two, no pointers. Lines of the preprocessor become comments, which mark what
may be left out. Whatever it does not know ends it with 1 and the line.
"""
import re
import sys

TYPES = {"float": "f32", "int": "i32", "uint": "u32", "bool": "bool", "vec3": "vec3<f32>", "ivec3": "vec3<i32>",
         "uvec3": "vec3<u32>", "bvec3": "vec3<bool>", "NifAnswer": "NifAnswer", "NifHit": "NifHit", "void": ""}
TYPE = "|".join(TYPES)
CALLS = {"floatBitsToUint": "bitcast<u32>", "uintBitsToFloat": "bitcast<f32>", "bitCount": "countOneBits",
         **{glsl: wgsl for glsl, wgsl in TYPES.items() if wgsl and not glsl.startswith("Nif")}}
HEAD = """\
// nif.wgsl: asks a nifkit object whether a ray is blocked, in a shader of your own. Made from nif.glsl, whose comments say
// how to use it. WGSL has no preprocessor: change what follows up to the structures to your needs.
@group(0) @binding(0) var<storage, read> nif_words : array<u32>;
fn nif_word(i : u32) -> u32 { return nif_words[i]; }
const NIF_PROVES : bool = false;  // WGSL may reorder sums, and for that no bound is derived: no answer is certain
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


def translate(glsl):
    text = glsl[glsl.index("struct NifAnswer"):]
    lines, inside, structure = [HEAD], False, False
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


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        glsl = file.read()
    try:
        wgsl = translate(glsl)
    except Unknown as unknown:
        sys.exit(f"{sys.argv[1]}: this cannot be translated: {unknown}")
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write(wgsl)


main()
