"""Reads what `nudge data maps` wrote: `python read_data.py DIR`. Needs NumPy and zstandard."""
import json, sys, tomllib, zlib
from pathlib import Path
import numpy as np, zstandard

def samples(directory):
    """Yields every sample as a NumPy record; bits are unpacked by `grid`."""
    card = tomllib.loads((directory / "card.toml").read_text())
    (w, d, h), v = card["dims"], card["views_per_sample"]
    cells, bits = w * d, (w * d * h + 63) // 64 * 8
    record = np.dtype([("seed", "<u8"), ("views", "<u2", v), ("labels", "u1", (w, d)), ("truth", "u1", bits),
                       ("view_labels", "u1", (v, w, d)), ("free", "u1", (v, bits)), ("occupied", "u1", (v, bits))])
    for file in sorted(directory.glob("shard-*.json")):
        index, shard = json.loads(file.read_text()), file.with_suffix(".zst").read_bytes()
        assert zlib.crc32(shard) == index["crc32"], f"{file}: damaged"
        for s in index["samples"]:
            frame = shard[s["offset"] : s["offset"] + s["length"]]
            yield card, np.frombuffer(zstandard.ZstdDecompressor().decompress(frame, s["record"]), record)[0]

def grid(card, packed):
    """A set of voxels as booleans [W, D, H]."""
    w, d, h = card["dims"]
    return np.unpackbits(packed, bitorder="little")[: w * d * h].reshape(w, d, h).astype(bool)

if __name__ == "__main__":
    for card, sample in samples(Path(sys.argv[1])):
        truth = grid(card, sample["truth"])
        missed = sum((grid(card, free) & truth).sum() for free in sample["free"])
        classes = np.unique(sample["labels"]).size - 1
        print(f"seed {sample['seed']}: {truth.mean():.3f} occupied, {classes} classes, {missed} occupied voxels seen through")
