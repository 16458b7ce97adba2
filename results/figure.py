#!/usr/bin/env python3
"""Draws the figures of RESULTS.md from the tables in these notes: one SVG a set. Needs Python 3 only.

Each figure shows a policy's semantic mIoU after the last action with its 95 % interval, from the first table whose
header has the column "mIoU at 40".
"""

import html
import pathlib
import re

HERE = pathlib.Path(__file__).resolve().parent
SETS = {
    "011-high-occlusion": "High occlusion, 25 scenes",
    "013-stretched-objects": "Stretched objects, 25 scenes",
    "014-low-occlusion": "Low occlusion, the first 62 scenes",
}
NUMBER = re.compile(r"(-?\d\.\d+)\**\s*\[(-?\d\.\d+), (-?\d\.\d+)\]")
LEFT, WIDTH, ROW, TOP = 170, 420, 26, 44


def tables(text):
    """The Markdown tables of a text, each as a list of rows of cells."""
    for block in re.findall(r"(?:^\|.*\n)+", text, re.M):
        yield [[cell.strip() for cell in line.strip("|\n ").split("|")] for line in block.splitlines()]


def policies(note):
    """Name, mean, low and high of every policy: the longest table with means at 40 actions."""
    best = []
    for header, _, *rows in (table for table in tables(note) if "mIoU at 40" in table[0] and table[0][0] == "policy"):
        column = header.index("mIoU at 40")
        found = [(row[0].strip("`"), NUMBER.search(row[column])) for row in rows]
        found = [(name, *map(float, number.groups())) for name, number in found if number]
        best = max(best, found, key=len)
    return best


def figure(title, rows):
    height = TOP + ROW * len(rows) + 34
    x = lambda value: LEFT + WIDTH * value
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{LEFT + WIDTH + 70}" height="{height}" font-family="sans-serif" font-size="13">',
        f'<rect width="100%" height="100%" fill="white"/><text x="12" y="22" font-weight="bold">{html.escape(title)}</text>',
    ]
    bottom = TOP + ROW * len(rows)
    for tick in range(0, 11, 2):
        out.append(f'<line x1="{x(tick / 10)}" y1="{TOP - 8}" x2="{x(tick / 10)}" y2="{bottom}" stroke="#ddd"/>')
        out.append(f'<text x="{x(tick / 10)}" y="{bottom + 16}" text-anchor="middle" fill="#444">{tick / 10:.1f}</text>')
    out.append(f'<text x="{x(0.5)}" y="{bottom + 32}" text-anchor="middle" fill="#444">semantic mIoU after 40 actions</text>')
    for at, (name, mean, low, high) in enumerate(rows):
        y = TOP + ROW * at + 8
        colour = "#b3541e" if name == "mem" else "#2b5c8a"
        out.append(f'<text x="{LEFT - 10}" y="{y + 4}" text-anchor="end">{html.escape(name)}</text>')
        out.append(f'<line x1="{x(low):.1f}" y1="{y}" x2="{x(high):.1f}" y2="{y}" stroke="{colour}" stroke-width="3"/>')
        out.append(f'<circle cx="{x(mean):.1f}" cy="{y}" r="5" fill="{colour}"/>')
        out.append(f'<text x="{x(high) + 8:.1f}" y="{y + 4}" fill="#444">{mean:.3f}</text>')
    return "\n".join([*out, "</svg>"]) + "\n"


for name, title in SETS.items():
    rows = policies((HERE / f"{name}.md").read_text())
    assert len(rows) >= 8, f"{name}.md: a table of policies with \"mIoU at 40\" is missing"
    (HERE / f"{name}.svg").write_text(figure(title, rows))
    print(f"{name}.svg: {len(rows)} policies")
