#!/usr/bin/env python3
"""Prints the page of rivals from what nif study has found out about some meshes.

    docs/results/rivals.py FOLDER    with a study.json of each mesh, as MESH.json
"""
from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

Study = dict[str, Any]
OURS = ("segment", "exact", "bvh")
SIMPLIFIED = ("OpenMesh: ", "meshoptimizer: ")
BUDGETS = (100_000, 300_000, 1_000_000)
MESHES = 12
# What was aimed for: at each size, fewer wrong answers or a tie on so many of the meshes, and speeds beside Embree on the best
# simplified mesh; at equal error, bytes beside those of that mesh.
WINS, SPEEDS, SAVED = 10, {"outer-lines": 2.5, "sun": 1.0}, 3.0
# What the literature states for itself; none of it was run here.
LITERATURE = """
## What others state

None of these was run here. The figures are their authors', on their meshes, rays and machines, mostly GPUs, and cannot be put into
the tables above.

| work | what it states | beside ours |
| --- | --- | --- |
| NIF: Fujieda, Kao, Harada 2023, arXiv 2306.07191 | fields for shadow rays, trained for a view and its lights | `spherical` is that, trained for all views; its experiments are in [paper/](paper/README.md) |
| LSNIF: Fujieda, Kao, Harada 2025, arXiv 2504.21627 | up to 106.2 times smaller than a compressed BVH (abstract); also hit points, normals and materials | bytes of a network and its hash grid for one object; the bytes above are all that a runtime holds. It states the quality of pictures, not the share of wrong answers |
| N-BVH: Weier et al. 2024, arXiv 2405.16237 | 42 times smaller than the geometry that it stands for, 13 times over that whole scene (figure 1) | made for one scene, with its appearance; it answers more than visibility |
| SSVDAG: Jaspe Villanueva, Marton, Gobbetti 2016 | the PowerPlant at 65,536 voxels a side: nearly 6 billion voxels in less than 86 MB, 0.123 bits each (figure 1) | `voxels` above merges no equal subtrees, and so takes more bytes; both are wrong near the surface by up to a voxel |
| DGF: the Vulkan extension VK_AMDX_dense_geometry_format | blocks of 128 bytes with at most 64 triangles, so at least 2 bytes each | triangles with rounded vertices, without the BVH above them |
"""


def at(study: Study, bytes_: int, family: str) -> dict[str, Any] | None:
    for one in study["at_equal_bytes"]:
        if one["resident"] == bytes_:
            found: dict[str, Any] | None = one["families"].get(family)
            return found
    return None


def best(study: Study, bytes_: int, families: list[str]) -> tuple[str, dict[str, Any]] | None:
    found = [(name, one) for name in families if (one := at(study, bytes_, name))]
    return min(found, key=lambda pair: pair[1]["error"]) if found else None


def families(study: Study) -> list[str]:
    return list(dict.fromkeys(point["family"] for point in study["points"]))


def simplified(study: Study) -> list[str]:
    return [name for name in families(study) if name.startswith(SIMPLIFIED)]


def points(study: Study, family: str) -> list[tuple[int, float]]:
    """(resident bytes, mean error), by bytes."""
    found = []
    for point in study["points"]:
        if point["family"] == family and "sets" in point:
            errors = [one["error"] for one in point["sets"].values()]
            found.append((point["bytes"]["resident"], sum(errors) / len(errors)))
    return sorted(found)


def whole_mesh_bytes(study: Study) -> int:
    """The least that all triangles take, in any form."""
    names = [name for name in families(study) if name in ("exact", "bvh") or name.startswith("all triangles")]
    return min(size for name in names for size, _ in points(study, name))


def bytes_for(study: Study, error: float) -> float:
    """What the smallest simplified mesh takes that is wrong no more often; the whole mesh where none is as good."""
    smallest = float(whole_mesh_bytes(study))
    for family in simplified(study):
        before: tuple[int, float] | None = None
        for size, own in points(study, family):
            if own <= error:
                if before and own > 0:
                    share = (math.log(before[1]) - math.log(error)) / (math.log(before[1]) - math.log(own))
                    smallest = min(smallest, math.exp(math.log(before[0]) * (1 - share) + math.log(size) * share))
                else:
                    smallest = min(smallest, size)
                break
            before = (size, own)
    return smallest


def percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def geometric_mean(values: list[float]) -> float:
    return math.exp(sum(map(math.log, values)) / len(values))


def row(study: Study, bytes_: int) -> tuple[str, str, dict[str, float]]:
    """Its line in a budget's table; "win", "loss", "tie" or "none"; speeds by ray set, and the errors that belong to them."""
    name, ours, other = study["study"]["mesh"], best(study, bytes_, list(OURS)), best(study, bytes_, simplified(study))
    figures: dict[str, float] = {}
    if whole_mesh_bytes(study) <= bytes_:
        return f"| {name} | the whole mesh fits | | | | | |", "tie", figures
    if not ours:
        return f"| {name} | none is as small | | {other[0] if other else '-'} | {percent(other[1]['error']) if other else '-'} | | |", \
            "loss" if other else "none", figures
    if not other:
        return f"| {name} | {ours[0]} | {percent(ours[1]['error'])} | none is as small | | | |", "win", figures
    embree = best(study, bytes_, [family for family in simplified(study) if "Embree" in family])
    speeds = []
    for set_ in ("outer-lines", "sun"):
        if embree and set_ in ours[1]["ratio"] and set_ in embree[1]["ratio"]:
            figures[set_] = ours[1]["ratio"][set_] / embree[1]["ratio"][set_]
            speeds.append(f"{figures[set_]:.2f}")
        else:
            speeds.append("")
    if embree:
        figures |= {"embree": embree[1]["error"], "ours": ours[1]["error"]}
    outcome = "win" if ours[1]["error"] < other[1]["error"] else "loss"
    return (f"| {name} | {ours[0]} | {percent(ours[1]['error'])} | {other[0]} | {percent(other[1]['error'])} | {speeds[0]} | "
            f"{speeds[1]} |", outcome, figures)


def wins_beside_embree(study: Study, bytes_: int) -> bool:
    """Fewer wrong answers than of simplified meshes in Embree, without our `exact` objects of them."""
    ours = best(study, bytes_, list(OURS))
    embree = best(study, bytes_, [name for name in simplified(study) if "Embree" in name])
    if not ours or whole_mesh_bytes(study) <= bytes_:
        return False
    return not embree or ours[1]["error"] < embree[1]["error"]


def main() -> int:
    studies: list[Study] = [json.loads(path.read_text()) for path in sorted(Path(sys.argv[1]).glob("*.json"))]
    studies.sort(key=lambda study: study["study"]["triangles"])
    if not studies:
        print("docs/results/rivals.py: no studies", file=sys.stderr)
        return 1
    tables, losses, summary, missed, slower = [], [], [], [], []
    for bytes_ in BUDGETS:
        lines, outcomes, ratios = [], [], {"outer-lines": [], "sun": []}
        for study in studies:
            line, outcome, figures = row(study, bytes_)
            lines.append(line)
            outcomes.append(outcome)
            for set_ in ratios:
                if set_ in figures:
                    ratios[set_].append(figures[set_])
            if outcome == "loss":
                losses.append(f"{study['study']['mesh']} at {bytes_ // 1000} kB")
            if figures.get("outer-lines", 1) < 1:
                slower.append(f"{study['study']['mesh']} at {bytes_ // 1000} kB ({figures['outer-lines']:.2f} x; there "
                              f"{percent(figures['embree'])} of Embree's answers are wrong, of ours {percent(figures['ours'])})")
        counts = {outcome: outcomes.count(outcome) for outcome in ("win", "tie", "loss", "none")}
        if counts["win"] + counts["tie"] + MESHES - len(studies) < WINS:
            missed.append(f"fewer wrong answers or a tie at {bytes_ // 1000} kB on {counts['win'] + counts['tie']} of {len(studies)} meshes, "
                          f"not {WINS} of {MESHES}")
        for set_, aim in SPEEDS.items():
            if ratios[set_] and geometric_mean(ratios[set_]) < aim:
                missed.append(f"{geometric_mean(ratios[set_]):.2f} x Embree's speed on {set_} at {bytes_ // 1000} kB, not {aim} x")
        means = [f"{geometric_mean(ratios[set_]):.2f} x on {set_}" if ratios[set_] else f"not measured on {set_}"
                 for set_ in ratios]
        alone = sum(wins_beside_embree(study, bytes_) for study in studies)
        summary.append(f"- {bytes_ // 1000} kB: fewer wrong answers on {counts['win']} meshes, a tie on {counts['tie']}, more on "
                       f"{counts['loss']}, nothing that small on either side on {counts['none']}; where Embree answers for the simplified mesh, fewer wrong answers on {alone}; speed beside Embree on the simplified mesh: "
                       + ", ".join(means) + " (geometric means).")
        tables.append(f"\n## At {bytes_ // 1000} kB\n\n| mesh | ours | wrong | best simplified mesh | wrong | speed: outer-lines | sun |\n"
                      "| --- | --- | ---: | --- | ---: | ---: | ---: |\n" + "\n".join(lines))
    saved = []
    for study in studies:
        own = at(study, 300_000, "segment")
        if own and own["error"] > 0:
            taken = min(300_000, points(study, "segment")[-1][0])
            saved.append((study["study"]["mesh"], taken, own["error"], bytes_for(study, own["error"])))
    if saved and (mean := geometric_mean([size / taken for _, taken, _, size in saved])) < SAVED:
        missed.append(f"at equal error {mean:.1f} x fewer bytes, not {SAVED} x")
    loads = [study["load_average"] for study in studies if "load_average" in study]
    version, processors = studies[0]["study"]["version"], sorted({study["study"]["processor"] for study in studies})
    quick = any(study["study"]["quick"] for study in studies)
    print("# Beside what people would use instead\n")
    print("Generated by `docs/results/rivals.sh`; do not edit by hand. The figures are kept in [rivals/](rivals).")
    print(f"nifkit {version}; machine: {', '.join(processors)}; {len(studies)} of {MESHES} meshes"
          f"{'; QUICK STUDIES: two sizes of each' if quick else ''}.\n")
    print("**Where we lose.** " + ("At equal bytes more answers are wrong than with the best simplified mesh for: " + ", ".join(losses) + "."
                                   if losses else "Nowhere in errors at equal bytes, on these meshes."))
    print("Slower than Embree on the simplified mesh, on outer-lines: " + ("; ".join(slower) if slower else "nowhere") + ".")
    print("Aims that were missed: " + ("; ".join(missed) if missed else "none") + ".")
    print("\n".join(["", *summary]))
    print("\n\"Ours\" is the one of `segment`, `exact` and `bvh` with the fewest wrong answers, the mean of all ray sets. Simplified meshes are\n"
          "those of OpenMesh and meshoptimizer, asked by Embree, Embree compact, or as our `exact` objects. Speeds are ours divided by\n"
          "that of the better one of Embree's forms on the simplified mesh; [study.md](../study.md) says how all of it is measured.")
    if loads:
        print(f"\nSpeeds of both sides were taken in turn. The load average of the machine over the last 15 minutes of a study\n"
              f"was {min(loads):.1f} to {max(loads):.1f}, of which the study itself is up to 2: more means that other programs ran, too. "
              f"{len(loads)} of\nthe {len(studies)} studies noted it.")
    print("\n".join(tables))
    if saved:
        print("\n## At equal error\n\nWhat a simplified mesh takes that is wrong as rarely as `segment` is at 300 kB, or at its largest size below.\n")
        print("| mesh | ours | wrong | simplified mesh | times ours |\n| --- | ---: | ---: | ---: | ---: |")
        for name, taken, error, size in saved:
            print(f"| {name} | {taken / 1000:,.0f} kB | {percent(error)} | {size / 1000:,.0f} kB | {size / taken:.1f} |")
        print(f"\nGeometric mean: {geometric_mean([size / taken for _, taken, _, size in saved]):.1f} times.")
    print(LITERATURE, end="")
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        sys.exit(0 if len(sys.argv) == 2 else 2)
    sys.exit(main())
