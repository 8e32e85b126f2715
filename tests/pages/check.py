#!/usr/bin/env python3
"""Looks at pages that nif has written, in a headless Chromium.

    tests/pages/check.py FOLDER PAGE.html...

Each page is opened wide and as on a phone, light and dark. It must ask for no other file, say nothing on the console, fit into the
window's width, keep its text apart from what is behind it, and sort and filter its tables. Pictures of all of it go to FOLDER.
Ends with 1, and says what is wrong.
"""
from __future__ import annotations

import sys
from pathlib import Path

from browser import Browser

WIDE, PHONE = 1280, 360

# What does not fit: the page itself, and every element that reaches beyond the window.
TOO_WIDE = """
const width = document.documentElement.clientWidth;
const beyond = [...document.body.querySelectorAll('*')].filter(e => e.getBoundingClientRect().right > width + 1);
return [document.documentElement.scrollWidth - width, beyond.slice(0, 3).map(e => e.outerHTML.slice(0, 120))];
"""
# Contrast of text and background by WCAG 2.1, of the page's own colours.
CONTRAST = """
const light = text => { const [r, g, b] = text.match(/[\\d.]+/g).map(v => { v /= 255;
  return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4 }); return 0.2126 * r + 0.7152 * g + 0.0722 * b };
const style = getComputedStyle(document.body), a = light(style.color), b = light(style.backgroundColor);
return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
"""
NETWORK = "return performance.getEntriesByType('resource').map(e => e.name).filter(n => !n.startsWith('data:'))"
BROKEN_PICTURES = "return [...document.images].filter(i => { i.loading = 'eager'; return i.complete && !i.naturalWidth }).map(i => i.alt)"
# Sorts each table by each of its columns, both ways, and filters it; returns what went wrong.
SORTS = """
const wrong = [];
for (const table of document.querySelectorAll('table.sorted')) {
  const body = table.tBodies[0], rows = () => [...body.rows], count = rows().length;
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = head.querySelector('button');
    if (!button) return;
    for (const down of [false, true]) {
      button.click();
      const number = head.classList.contains('number');
      const values = rows().map(r => r.cells[column].dataset.value).filter(v => v !== '');
      for (let i = 1; i < values.length; ++i) {
        const order = number ? values[i - 1] - values[i]
                             : values[i - 1].localeCompare(values[i], undefined, {numeric: true});
        if (down ? order < 0 : order > 0) { wrong.push(`${head.textContent}: not in order`); break }
      }
    }
  });
  if (rows().length !== count) wrong.push('rows were lost');
  const filter = table.previousElementSibling.querySelector('input');
  filter.value = 'no row has this';
  filter.dispatchEvent(new Event('input'));
  if (rows().some(r => !r.hidden)) wrong.push('the filter hides nothing');
  filter.value = '';
  filter.dispatchEvent(new Event('input'));
  if (rows().some(r => r.hidden)) wrong.push('the filter shows nothing again');
}
return wrong;
"""


def problems_of(browser: Browser, page: Path, width: int, dark: bool, picture: Path) -> list[str]:
    browser.messages()
    browser.show(page, width, dark)
    found = [f"console: {message}" for message in browser.messages()]
    found += [f"asks for {name}" for name in browser.run(NETWORK)]
    found += [f"a picture is broken: {alt}" for alt in browser.run(BROKEN_PICTURES)]
    over, elements = browser.run(TOO_WIDE)
    if over > 0 or elements:
        found.append(f"{over} pixels wider than the window: {elements}")
    if (contrast := browser.run(CONTRAST)) < 7:
        found.append(f"text has a contrast of {contrast:.1f}, below 7")
    browser.picture(picture)
    if not dark:
        found += browser.run(SORTS)
    return found


def main() -> int:
    folder, *pages = map(Path, sys.argv[1:])
    failed = False
    with Browser() as browser:
        for page in pages:
            for width, device in ((WIDE, "wide"), (PHONE, "phone")):
                for dark, colours in ((False, "light"), (True, "dark")):
                    view = f"{page.stem}-{device}-{colours}"
                    for problem in problems_of(browser, page, width, dark, folder / f"{view}.png"):
                        print(f"{view}: {problem}", file=sys.stderr)
                        failed = True
    return int(failed)


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        sys.exit(0 if len(sys.argv) > 1 and sys.argv[1] in ("-h", "--help") else 2)
    sys.exit(main())
