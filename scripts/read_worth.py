"""Reads what `nudge data worth` wrote: `python read_worth.py DIR`. Needs NumPy and zstandard."""
import json, sys, tomllib, zlib
from pathlib import Path
import numpy as np, zstandard

FAMILIES = "mixed crowded walls rows rings tall-first halves chambers".split()

def states(directory):
    """Yields the card and every state as a dictionary; arrays have the axes that the card's `record` names."""
    card = tomllib.loads((directory / "card.toml").read_text())
    for file in sorted(directory.glob("shard-*.json")):
        index, shard = json.loads(file.read_text()), file.with_suffix(".zst").read_bytes()
        assert zlib.crc32(shard) == index["crc32"], f"{file}: damaged"
        for s in index["samples"]:
            frame = shard[s["offset"] : s["offset"] + s["length"]]
            yield card, state(card["dims"], zstandard.ZstdDecompressor().decompress(frame, s["record"]))

def state(dims, record):
    at = 0
    def take(kind, *shape):
        nonlocal at
        array = np.frombuffer(record, kind, int(np.prod(shape, dtype=int)), at)
        at += array.nbytes
        return array.reshape(shape) if shape else array[0]
    def bits(size, *shape):
        return np.unpackbits(take("u1", size), bitorder="little")[: np.prod(shape)].reshape(shape).astype(bool)
    X, Y, Z = dims
    x, y, z = ((n + 1) // 2 for n in dims)
    u, v = (X + 3) // 4, (Y + 3) // 4
    s = {"seed": take("<u8"), "leg": take("u1"), "family": FAMILIES[take("u1")], "noisy": take("u1"),
         "earlier_pushes": take("u1")}
    s["looks"] = take("<u2", take("<u2"))
    s |= {name: take("<f4") for name in ["igv", "occupancy_iou", "semantic_miou"]} | {"looked_on": take("<f4", 2)}
    s |= {name: take("u1", x, y, z) for name in ["occupancy", "deviation", "seen", "reached"]}
    s |= {name: take("u1", X, Y) for name in ["class", "certainty", "entropy", "vacuity"]}
    s["truth"], s["labels"] = bits((X * Y * Z + 63) // 64 * 8, X, Y, Z), take("u1", X, Y)
    count = take("<u2")
    s["objects"] = take(np.dtype([("id", "<u2"), ("class", "u1"), ("hidden", "u1"), ("shown", "<u4"), ("pose", "<f4", 7)]), count)
    outcome = np.dtype([("flags", "u1"), ("shown", "<u4")])
    s["pushes"] = []
    for _ in range(take("<u2")):
        p = {"start": take("<f4", 3), "direction_deg": take("<f4"), "length_m": take("<f4"), "contact": take("<u2", 3),
             "sampler": take("u1"), "motion_s": take("<f4"), "swept": bits((x * y * z + 7) // 8, x, y, z),
             "gain": take("<f4"), "reg": take("<f4"), "change": take("u1", x, y), "occupancy_change": take("i1", u, v, 8),
             "pushed_m": take("<f4"), "jammed": take("u1"), "displacement_m": take("<f4"), "opened": take("<u4"),
             "opened_nats": take("<f4"), "toppled": take("u1"), "followed": take("<f4", 2), "objects": take(outcome, count)}
        hidden, dropped = p["objects"]["flags"] & 1 == 1, p["objects"]["flags"] & 2 == 2
        before = s["objects"]["hidden"] == 1
        p["won"], p["lost"] = int((before & ~hidden & ~dropped).sum()), int((dropped | ~before & hidden).sum())
        s["pushes"].append(p)
    assert at == len(record), "not a state of this layout"
    return s

if __name__ == "__main__":
    for card, s in states(Path(sys.argv[1])):
        net = [p["won"] - p["lost"] for p in s["pushes"]]
        chosen = net[int(np.argmax([p["gain"] for p in s["pushes"]]))] if net else 0
        print(f"seed {s['seed']} state {s['leg']} {s['family']}: {len(s['looks'])} looks, {s['earlier_pushes']} pushes before, "
              f"{int(s['objects']['hidden'].sum())} of {len(s['objects'])} hidden, {len(net)} pushes, net {net}, chosen {chosen}")
