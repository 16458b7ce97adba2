#!/usr/bin/env python3
"""Nudge's classical belief update written in PyTorch, exported as two TorchScript modules.

    export_model.py DIR        # writes DIR/classical_o.pt and DIR/classical_m.pt

    nudge run SCENE --sigma-o DIR/classical_o.pt --sigma-m DIR/classical_m.pt

They show what a module of your own is given and has to answer (docs/bring-your-own.md), and they agree with
`--belief classical`. Replace what stands in `forward` by your network: the shapes stay. Needs torch alone.
"""

import math
import sys
from pathlib import Path

import torch
from torch import Tensor


def beta(odds: Tensor, total: Tensor) -> Tensor:
    """`[a_occ, a_free]` of voxels with these odds and so much evidence in all."""
    return torch.stack([total * odds / (1 + odds), total / (1 + odds)], -1)


class ClassicalO(torch.nn.Module):
    """sigma_o: log-odds move by 0.85 per hit or passing ray, classes are counted."""

    def __init__(self) -> None:
        super().__init__()
        # What one observation does to the odds, and how far they may be from even.
        self.step, self.limit = math.exp(0.85), math.exp(3.5)

    def forward(self, occupancy: Tensor, semantics: Tensor, seen: Tensor, labels: Tensor) -> tuple[Tensor, Tensor]:
        """`[W, D, H, 2]`, `[W, D, 15]`, `[W, D, H, 2]`, `[W, D, 15]` to `[W, D, H, 2]` and `[W, D, 15]`."""
        is_hit, is_free = seen[..., 0] > 0, seen[..., 1] > 0
        odds = occupancy[..., 0] / occupancy[..., 1]
        odds = odds * torch.where(is_hit, self.step, 1 / self.step)
        odds = odds.clamp(1 / self.limit, self.limit)
        # One more observation, but never so little evidence that one of both numbers is below one.
        total = torch.maximum(occupancy.sum(-1) + 1, 1 + torch.maximum(odds, 1 / odds))
        after = torch.where((is_hit | is_free).unsqueeze(-1), beta(odds, total), occupancy)
        return after, semantics + labels


class ClassicalM(torch.nn.Module):
    """sigma_m: swept columns are free, what the tool meets moves along, and what stands near its way is forgotten."""

    def __init__(self) -> None:
        super().__init__()
        # Metres: the object surely moves up to NEAR from the track, nothing does from FAR on; the track goes on by AHEAD
        # behind its end. Lower than SHORTEST no object is. A voxel is SOLID from this probability on.
        self.near, self.far, self.ahead, self.shortest, self.solid = 0.03, 0.09, 0.06, 0.06, 0.6
        # The odds of what is surely free, and the evidence of it behind an object that has left.
        self.low, self.gone = math.exp(-3.5), 100.0

    def forward(
        self, occupancy: Tensor, semantics: Tensor, swept: Tensor, flow: Tensor, stroke: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """`[W, D, H, 2]`, `[W, D, 15]`, `[W, D, H]`, `[W, D, 3]`, `[6]` to the belief and `[W, D]`."""
        width, depth, height = swept.size(0), swept.size(1), swept.size(2)
        voxel_m = stroke[5]
        p = occupancy[..., 0] / occupancy.sum(-1)
        level = torch.arange(height, device=p.device)
        low = torch.full((), self.low, dtype=p.dtype, device=p.device)
        free, gone = beta(low, 1 / low + 1), beta(low, torch.full_like(low, self.gone))

        # What the sweep meets: per column the largest probability in it and the lowest voxel; and anywhere.
        passes = swept > 0
        met = torch.where(passes, p, -1.0).amax(-1)
        lowest = torch.where(passes, level, height).amin(-1)
        contact = met.amax().clamp(min=0.0)

        # Where something comes from: the cell that moves by so much.
        moves = flow[..., 0] > 0
        x = torch.arange(width, device=p.device).unsqueeze(1) + flow[..., 1].long()
        y = torch.arange(depth, device=p.device).unsqueeze(0) + flow[..., 2].long()
        arrives = moves & (x >= 0) & (x < width) & (y >= 0) & (y < depth)
        source = torch.full((width * depth,), -1, dtype=torch.long, device=p.device)
        cells = torch.arange(width * depth, device=p.device).view(width, depth)
        source[(x * depth + y)[arrives]] = cells[arrives]
        source = source.view(width, depth)
        comes = source >= 0
        from_cell = source.clamp(min=0).flatten()
        coming = occupancy.flatten(0, 1)[from_cell].view(width, depth, height, 2)
        coming_labels = semantics.flatten(0, 1)[from_cell].view(width, depth, -1)

        # 1. Swept columns: free from where the tool passed, or as a whole if it passed low or touched something.
        low_pass = lowest * voxel_m <= self.shortest
        touched = ((p > 0.5) & (level >= lowest.unsqueeze(-1))).any(-1)
        emptied = low_pass | touched
        free_from = torch.where(emptied, 0, lowest).unsqueeze(-1)
        frees = (level >= free_from) & (p > free[0] / free.sum())
        swept_occupancy = torch.where(frees.unsqueeze(-1), free, occupancy)

        # 2. What moves leaves free space, and arrives with half of its log-odds and half of its evidence.
        stays = torch.where((moves.unsqueeze(-1) & (p > 0.5)).unsqueeze(-1), gone, occupancy)
        halved = beta((coming[..., 0] / coming[..., 1]).sqrt(), 0.5 * coming.sum(-1))
        p_halved, p_stays = halved[..., 0] / halved.sum(-1), stays[..., 0] / stays.sum(-1)
        stands = comes.unsqueeze(-1) & (p_halved > 0.5) & (p_halved > p_stays)
        moved = torch.where(stands.unsqueeze(-1), halved, stays)
        moved_occupancy = (1 - contact) * occupancy + contact * moved

        # 3. Objects near the track are forgotten, the more the nearer.
        at_x = (torch.arange(width, device=p.device) + 0.5).unsqueeze(1) - stroke[0]
        at_y = (torch.arange(depth, device=p.device) + 0.5).unsqueeze(0) - stroke[1]
        along = at_x * stroke[2] + at_y * stroke[3]
        on_track = torch.minimum(along, stroke[4] + self.ahead / voxel_m)
        away_m = torch.hypot(at_x - on_track * stroke[2], at_y - on_track * stroke[3]) * voxel_m
        near = ((self.far - away_m) / (self.far - self.near)).clamp(0.0, 1.0)
        near = torch.where((along >= 0) & (p >= self.solid).any(-1), near, torch.zeros_like(near))
        decay = contact * near
        share = decay.unsqueeze(-1).unsqueeze(-1)
        decayed = torch.where((p > 0.5).unsqueeze(-1), (1 - share) * occupancy + share, occupancy)

        is_swept, is_moved = met >= 0, moves | comes
        change = torch.where(is_swept, met, torch.where(is_moved, contact, decay))
        pick = is_swept.unsqueeze(-1).unsqueeze(-1)
        after = torch.where(is_moved.unsqueeze(-1).unsqueeze(-1), moved_occupancy, decayed)
        after = torch.where(pick, swept_occupancy, after)

        ones = torch.ones_like(semantics)
        background = ones.clone()
        background[..., -1] += 1
        labels = torch.where(emptied.unsqueeze(-1), background, semantics)
        arriving = torch.where(comes.unsqueeze(-1), 0.5 * (1 + coming_labels), background)
        labels = torch.where(is_swept.unsqueeze(-1), labels, torch.where(is_moved.unsqueeze(-1), arriving, ones))
        share = change.unsqueeze(-1)
        return after, (1 - share) * semantics + share * labels, change


def main() -> None:
    if len(sys.argv) != 2:
        sys.exit("usage: export_model.py DIR")
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for name, module in [("classical_o", ClassicalO()), ("classical_m", ClassicalM())]:
        path = out / f"{name}.pt"
        torch.jit.script(module.eval()).save(str(path))
        print(path)


if __name__ == "__main__":
    main()
