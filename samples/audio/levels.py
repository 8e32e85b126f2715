#!/usr/bin/env python3
"""Measures the sound of samples/audio: its level against the share of visible rays.

    levels.py SOUND.wav OPEN.wav LOG.csv [--svg PICTURE.svg] [--title TEXT] [--check]

SOUND.wav is the sound with the object, OPEN.wav the one without (--no-occlusion), LOG.csv the log of the first. Each 10 ms
of the first are compared with the same 10 ms of the second, so that variations of the sound itself cancel out. Prints the
figures. With --check it exits with 1 and a reason unless the level falls behind the object, recovers, and follows the share
of visible rays.
"""
import argparse
import array
import csv
import math
import statistics
import sys
import wave
from dataclasses import dataclass
from xml.sax.saxutils import escape

STEPS_A_SECOND = 100
HIDDEN = 0.1  # "behind" means that at most this share of the rays is visible
SETTLE = 5  # steps that the filter may ramp after the share is 1 again

# The requirements of --check. A fully hidden source loses 12 dB at all frequencies, and more at high ones (main.c).
LEAST_FALL = 12.0  # dB, while the source is behind the object
MOST_REST = 0.5  # dB, before and after
LEAST_CORRELATION = 0.95  # of decibels and share of visible rays
LEAST_SIDE = 3.0  # dB by which the nearer ear is louder at the start and at the end, because HRTF is on


class Unusable(Exception):
    """A file that cannot be measured; the text says which, and why."""


@dataclass
class Figures:
    """The measurements. Levels are in decibels relative to the open sound."""

    times: list[float]
    shares: list[float]  # 0 to 1
    levels: list[float]
    before: float  # median level before the object hides anything
    behind: float  # median level while at most HIDDEN of the rays are visible
    after: float  # median level once it hides nothing any more
    correlation: float  # of levels and shares
    side_start: float  # left against right ear in the first half second, of the open sound
    side_end: float  # right against left ear in the last half second


def decibels(energy: float) -> float:
    return 10 * math.log10(max(energy, 1e-3))


def read_wav(path: str) -> list[tuple[float, float]]:
    """The energy at the left and the right ear, for each 10 ms."""
    try:
        with wave.open(path, "rb") as file:
            if (file.getnchannels(), file.getsampwidth()) != (2, 2):
                raise Unusable(f"{path}: not stereo with 16 bits")
            samples = array.array("h", file.readframes(file.getnframes()))
            step = 2 * file.getframerate() // STEPS_A_SECOND
    except (OSError, EOFError, wave.Error) as error:
        raise Unusable(f"{path}: {error}") from error
    if sys.byteorder == "big":
        samples.byteswap()
    parts = [samples[start : start + step] for start in range(0, len(samples) - step + 1, step)]
    return [(float(sum(s * s for s in part[0::2])), float(sum(s * s for s in part[1::2]))) for part in parts]


def read_log(path: str) -> tuple[list[float], list[float]]:
    """Times in seconds, and shares of visible rays."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return [float(row["seconds"]) for row in rows], [float(row["visible"]) for row in rows]
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise Unusable(f"{path}: not a log of samples/audio: {error}") from error


def correlation(a: list[float], b: list[float]) -> float:
    """Pearson's correlation; 0 if one of the two is constant."""
    mean_a, mean_b = statistics.fmean(a), statistics.fmean(b)
    both = sum((x - mean_a) * (y - mean_b) for x, y in zip(a, b))
    alone = math.sqrt(sum((x - mean_a) ** 2 for x in a) * sum((y - mean_b) ** 2 for y in b))
    return both / alone if alone > 0 else 0.0


def measure(sound_path: str, open_path: str, log_path: str) -> Figures:
    sound, unhidden = read_wav(sound_path), read_wav(open_path)
    times, shares = read_log(log_path)
    if not len(sound) == len(unhidden) == len(shares):
        raise Unusable(f"{sound_path}, {open_path} and {log_path} are not equally long")
    levels = [decibels(sum(a)) - decibels(sum(b)) for a, b in zip(sound, unhidden)]
    partly = [i for i, share in enumerate(shares) if share < 1]
    behind = [level for level, share in zip(levels, shares) if share <= HIDDEN]
    if not partly or not behind:
        raise Unusable(f"{log_path}: the source is never behind the object")
    before, after = levels[: partly[0]], levels[partly[-1] + SETTLE :]
    if not before or not after:
        raise Unusable(f"{log_path}: the source is hidden at the start or at the end")
    half = STEPS_A_SECOND // 2
    ears = [[decibels(sum(pair[ear] for pair in part)) for ear in (0, 1)] for part in (unhidden[:half], unhidden[-half:])]
    return Figures(
        times,
        shares,
        levels,
        statistics.median(before),
        statistics.median(behind),
        statistics.median(after),
        correlation(levels, shares),
        ears[0][0] - ears[0][1],
        ears[1][1] - ears[1][0],
    )


def problems(figures: Figures) -> list[str]:
    """What --check finds wrong; empty if nothing."""
    fall = figures.before - figures.behind
    found = []
    if fall < LEAST_FALL:
        found.append(f"the level falls by {fall:.1f} dB behind the object, less than {LEAST_FALL} dB")
    for when, level in (("before", figures.before), ("after", figures.after)):
        if abs(level) > MOST_REST:
            found.append(f"{when} the object the level is {level:+.1f} dB off, more than {MOST_REST} dB")
    if figures.correlation < LEAST_CORRELATION:
        found.append(f"level and visible share have a correlation of {figures.correlation:.3f} only")
    for when, side in (("start", figures.side_start), ("end", figures.side_end)):
        if side < LEAST_SIDE:
            found.append(f"at the {when} the nearer ear is {side:.1f} dB louder, less than {LEAST_SIDE} dB")
    return found


def draw(figures: Figures, title: str) -> str:
    """An SVG: the share of visible rays above, the level below."""
    width, left, right, panel, top, gap = 860, 64, 24, 150, 66, 34
    end = figures.times[-1] + 1 / STEPS_A_SECOND
    lowest = 5 * math.floor(min(figures.levels) / 5)
    height = top + 2 * panel + gap + 48
    second = top + panel + gap

    def x(time: float) -> float:
        return left + (width - left - right) * time / end

    def y_share(share: float) -> float:
        return top + panel * (1 - share)

    def y_level(level: float) -> float:
        return second + panel * (2 - level) / (2 - lowest)

    def text(at_x: float, at_y: float, words: str, style: str) -> str:
        return f'<text x="{at_x:.1f}" y="{at_y:.1f}" class="{style}">{escape(words)}</text>'

    lines = []
    for share in (0, 0.5, 1):
        lines.append(f'<path class="grid" d="M{left} {y_share(share):.1f}H{width - right}"/>')
        lines.append(text(left - 8, y_share(share) + 4, f"{100 * share:.0f} %", "tick end"))
    for level in range(lowest, 1, 5):
        lines.append(f'<path class="grid" d="M{left} {y_level(level):.1f}H{width - right}"/>')
        lines.append(text(left - 8, y_level(level) + 4, f"{level} dB".replace("-", "\u2212"), "tick end"))
    for time in range(0, math.floor(end) + 1, max(1, round(end / 8))):
        lines.append(text(x(time), second + panel + 20, f"{time} s", "tick middle"))
    area = " ".join(f"{x(t):.1f} {y_share(s):.1f}" for t, s in zip(figures.times, figures.shares))
    curve = " ".join(f"{x(t):.1f} {y_level(v):.1f}" for t, v in zip(figures.times, figures.levels))
    lines.append(f'<path class="share" d="M{x(0):.1f} {y_share(0):.1f}L{area} {x(figures.times[-1]):.1f} {y_share(0):.1f}Z"/>')
    lines.append(f'<path class="level" d="M{curve}"/>')
    lines.append(text(left, 26, title, "title"))
    lines.append(text(left, top - 12, "rays from the listener that reach the source", "name share-name"))
    lines.append(text(left, second - 10, "level, against the sound without the object", "name level-name"))
    summary = (
        f"{figures.before - figures.behind:.1f} dB softer behind it, {figures.after:+.1f} dB after it, "
        f"correlation {figures.correlation:.3f}"
    ).replace("-", "\u2212")
    lines.append(text(width - right, second - 10, summary, "tick end"))
    style = """
  svg { background: #fcfcfb; font-family: system-ui, sans-serif }
  .grid { stroke: #dcdcd8; fill: none } .tick { font-size: 12px; fill: #5d5d58 }
  .title { font-size: 16px; font-weight: 600; fill: #1d1d1b } .name { font-size: 13px }
  .end { text-anchor: end } .middle { text-anchor: middle }
  .share { fill: #8db8de; fill-opacity: .6; stroke: #2f6fa8; stroke-width: 1.5 } .share-name { fill: #2f6fa8 }
  .level { fill: none; stroke: #b4480f; stroke-width: 2; stroke-linejoin: round } .level-name { fill: #b4480f }
  @media (prefers-color-scheme: dark) {
    svg { background: #1a1a19 } .grid { stroke: #3a3a37 } .tick { fill: #b5b5ae } .title { fill: #f2f2ee }
    .share { stroke: #7db4e6 } .share-name { fill: #7db4e6 } .level { stroke: #f0905a } .level-name { fill: #f0905a }
  }
"""
    body = "\n".join(lines)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">\n'
        f"<title>{escape(title)}</title>\n<style>{style}</style>\n{body}\n</svg>\n"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sound", metavar="SOUND.wav")
    parser.add_argument("open", metavar="OPEN.wav")
    parser.add_argument("log", metavar="LOG.csv")
    parser.add_argument("--svg", metavar="FILE", help="draw share and level over time")
    parser.add_argument("--title", default="A source passes behind an object", help="of the picture")
    parser.add_argument("--check", action="store_true", help="end with 1 unless the level follows the visible rays")
    arguments = parser.parse_args()
    try:
        figures = measure(arguments.sound, arguments.open, arguments.log)
        if arguments.svg:
            with open(arguments.svg, "w", encoding="utf-8") as file:
                file.write(draw(figures, arguments.title))
    except (Unusable, OSError) as error:
        print(f"levels.py: {error}", file=sys.stderr)
        return 1
    print(f"level before the object  {figures.before:+6.1f} dB against the sound without it")
    print(f"level behind it          {figures.behind:+6.1f} dB")
    print(f"level after it           {figures.after:+6.1f} dB")
    print(f"correlation of level and visible share  {figures.correlation:.3f}")
    print(f"nearer ear louder by  {figures.side_start:.1f} dB at the start, {figures.side_end:.1f} dB at the end")
    found = problems(figures) if arguments.check else []
    for problem in found:
        print(f"levels.py: {problem}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
