"""Writes the TorchScript modules that the tests use, into a folder: tests/models holds what this wrote.

    write_models.py DIR

The classical update (scripts/export_model.py) as it is, and modules that do not keep the contract.
"""

import importlib.util
import io
import sys
import zipfile
from pathlib import Path

import torch
from torch import Tensor

ROOT = Path(__file__).parents[2]


class Shapes(torch.nn.Module):
    """Forgets the evidence for free space."""

    def forward(self, occupancy: Tensor, semantics: Tensor, seen: Tensor, labels: Tensor) -> tuple[Tensor, Tensor]:
        return occupancy[..., :1], semantics


class Nan(torch.nn.Module):
    """Answers what is no number."""

    def forward(self, occupancy: Tensor, semantics: Tensor, seen: Tensor, labels: Tensor) -> tuple[Tensor, Tensor]:
        return occupancy, semantics * float("nan")


class One(torch.nn.Module):
    """Answers one tensor."""

    def forward(self, occupancy: Tensor, semantics: Tensor, seen: Tensor, labels: Tensor) -> Tensor:
        return occupancy


class Inputs(torch.nn.Module):
    """Takes two tensors."""

    def forward(self, occupancy: Tensor, semantics: Tensor) -> tuple[Tensor, Tensor]:
        return occupancy, semantics


class Fails(torch.nn.Module):
    """Adds what does not fit."""

    def forward(self, occupancy: Tensor, semantics: Tensor, seen: Tensor, labels: Tensor) -> tuple[Tensor, Tensor]:
        return occupancy + torch.ones(7), semantics


class Change(torch.nn.Module):
    """sigma_m that is surer than sure."""

    def forward(
        self, occupancy: Tensor, semantics: Tensor, swept: Tensor, flow: Tensor, stroke: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        return occupancy, semantics, 2 * swept.amax(-1)


def save(module: torch.jit.ScriptModule, path: Path) -> None:
    """Without what names the folders of the machine that wrote it: where which line of the source stood."""
    whole = io.BytesIO()
    torch.jit.save(module, whole)
    with zipfile.ZipFile(whole) as read, zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as written:
        for entry in read.infolist():
            if not entry.filename.endswith(".debug_pkl"):
                written.writestr(zipfile.ZipInfo(entry.filename), read.read(entry))


def main() -> None:
    out = Path(sys.argv[1])
    spec = importlib.util.spec_from_file_location("export_model", ROOT / "scripts/export_model.py")
    export = importlib.util.module_from_spec(spec)
    sys.modules["export_model"] = export
    spec.loader.exec_module(export)

    class Late(export.ClassicalO):
        """The classical update, until a voxel was seen three times."""

        def forward(self, occupancy: Tensor, semantics: Tensor, seen: Tensor, labels: Tensor) -> tuple[Tensor, Tensor]:
            if bool(occupancy.max() > 5.0):
                return occupancy, semantics * float("nan")
            return occupancy + seen * 2.1, semantics + labels

    modules = {
        "classical_o": export.ClassicalO(),
        "classical_m": export.ClassicalM(),
        "shapes": Shapes(),
        "nan": Nan(),
        "one": One(),
        "inputs": Inputs(),
        "fails": Fails(),
        "change": Change(),
        "late": Late(),
    }
    out.mkdir(parents=True, exist_ok=True)
    for name, module in modules.items():
        save(torch.jit.script(module.eval()), out / f"{name}.pt")
    torch.save({"weight": torch.ones(3)}, out / "weights.pt")


if __name__ == "__main__":
    main()
