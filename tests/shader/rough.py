#!/usr/bin/env python3
"""Makes the arithmetic of nif.glsl looser than any that Vulkan allows.

    tests/shader/rough.py nif.glsl >rough.glsl

Each sum and product is moved by up to a unit in its last place, each quotient by up to two. What follows from small integers
alone is exact in every arithmetic, so it stays.
"""
import re
import sys

EXACT = {"step_size", "lower", "upper", "middle", "culling_reach", "most", "times", "enlarged"}
# Their arguments are integers.
OF_INTEGERS = {"float", "nif_float", "nif_number", "nif_vector"}
ROUGH = """\
float nif_rough(float x) {
  uint bits = floatBitsToUint(x);
  uint hash = bits * 2654435761u;
  hash = (hash ^ (hash >> 15)) * 2246822519u;
  bool exact = (bits & 0x7fffffffu) == 0u || (bits & 0x7f800000u) == 0x7f800000u;
  return exact ? x : uintBitsToFloat(bits + ((hash >> 16) % 3u) - 1u);
}
vec3 nif_rough(vec3 v) { return vec3(nif_rough(v.x), nif_rough(v.y), nif_rough(v.z)); }
"""
TOKEN = re.compile(r"\d[\d.]*(?:e[+-]?\d+)?u?|\w+|[<>=!]=|\|\||&&|<<|>>|\S")


class Expression:
    """One in which each result that rounds is to be made rough."""

    def __init__(self, text):
        self.tokens = TOKEN.findall(text)
        self.at = 0

    def peek(self):
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self):
        self.at += 1
        return self.tokens[self.at - 1]

    def whole(self):
        made = self.choice()
        if self.peek():
            sys.exit(f"rough.py does not know '{' '.join(self.tokens)}'")
        return made

    def choice(self):
        made = self.compared()
        if self.peek() != "?":
            return made
        self.take()
        yes = self.choice()
        self.take()
        return f"{made} ? {yes} : {self.choice()}"

    def compared(self):
        made = self.chain("+-", lambda: self.chain("*/", self.signed))
        while self.peek() in ("<", ">", "<=", ">=", "==", "!="):
            made += f" {self.take()} {self.chain('+-', self.signed)}"
        return made

    def chain(self, operators, part):
        made = part()
        while self.peek() and self.peek() in operators:
            operator = self.take()
            made = f"nif_rough({made} {operator} {part()})"
            made = f"nif_rough({made})" if operator == "/" else made
        return made

    def signed(self):
        return self.take() + self.signed() if self.peek() == "-" else self.member()

    def member(self):
        made = self.take()
        if made == "(":
            made = f"({self.choice()})"
            self.take()
        while self.peek() and self.peek() in "([.":
            opened = self.take()
            if opened == ".":
                made += "." + self.take()
            elif opened == "[" or made in OF_INTEGERS:
                made += opened + self.skipped()
            else:
                parts = [self.choice()]
                while self.peek() == ",":
                    self.take()
                    parts.append(self.choice())
                self.take()
                made += f"({', '.join(parts)})"
        return made

    def skipped(self):
        """Up to the end of these parentheses, as it is."""
        depth, made = 1, []
        while depth:
            made.append(self.take())
            depth += (made[-1] in "([") - (made[-1] in ")]")
        return " ".join(made)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        source = file.read()
    everywhere, here, rounds, lines = set(), set(), 0, []
    number, source = 0, source.split("\n")
    while number < len(source):
        line = source[number]
        number += 1
        if line == "}":
            here = set()
        if found := re.fullmatch(r"precise ([\w, ]+);", line):
            everywhere |= set(found[1].split(", "))
        found = re.match(r"( *)(precise (?:float|vec3) )?(\w+) = ", line)
        if found and (found[2] or found[3] in here | everywhere):
            here |= {found[3]} if found[2] else set()
            while ";" not in line:
                line += " " + source[number].strip()
                number += 1
            value, _, rest = line[found.end():].partition(";")
            if found[3] not in EXACT:
                line = found[0] + Expression(value).whole() + ";" + rest
                rounds += line.count("nif_rough(")
        lines.append(ROUGH + line if line.startswith("float nif_float(") else line)
    if rounds < 100 or ROUGH not in "\n".join(lines):
        sys.exit("rough.py: the text is not as this program thinks")
    print("\n".join(lines), end="")


main()
