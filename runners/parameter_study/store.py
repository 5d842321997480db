"""The folder of a parameter study: who it belongs to, chunks as they come, and what can be resumed."""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import xarray as xr
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from ...model.errors import AscentwindError, OutputFolderError
from ..case.provenance import provenance
from ..present.files import prepare_folder, write_bytes
from ..study import Study
from .compute import Chunk, ChunkResult, Task, code_of
from .plan import ParameterStudyPlan

log = logging.getLogger(__name__)

IDENTITY_FILE = "identity.json"
CHUNKS = "chunks"
DIMENSIONS = {  # beside the member's
    "mean": ("time", "response"),
    "variance": ("time", "response", "source"),
    "plane_mean": ("time", "resultant", "plane"),
    "plane_covariance": ("time", "resultant", "source", "plane", "other_plane"),
    "level": ("time", "resultant"),
}


class ResumeError(AscentwindError):
    """A folder holds another parameter study, or one that is running."""


def identity_of(study: Study, plan: ParameterStudyPlan, task: Task, values: NDArray[np.float64]) -> dict[str, Any]:
    """Return all that a result depends on, by name."""
    made_by = provenance(study)
    written = plan.model_dump(mode="json", exclude_none=True, exclude={"title", "vehicle"})
    return {
        **{f"plan.{key}": value for key, value in written.items()},
        "end times": list(task.times),
        "values of the members (SHA-256)": hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest(),
        **{key: made_by[key] for key in ("system", "structure", "data_sha256", "ascentwind", "casadi", "numpy")},
        "scipy": scipy.__version__,
        "compiled sweep": code_of(study),
    }


@dataclass(frozen=True)
class ChunkStore:
    """Chunks of one parameter study in a folder; a chunk stands there whole or not at all."""

    folder: Path
    key: str

    def path(self, chunk: Chunk) -> Path:
        return self.folder / CHUNKS / f"{chunk.name}.nc"

    def write(self, chunk: Chunk, result: ChunkResult) -> None:
        """Store a chunk.

        Raises
        ------
        OutputFolderError
        """
        dataset = xr.Dataset(
            {
                **{
                    name: (("member", *dims), result.numbers[name])
                    for name, dims in DIMENSIONS.items()
                    if result.numbers[name].size  # the file format has no empty dimension
                },
                "status": ("member", result.status),
            },
            attrs={"key": self.key, "reason": json.dumps(result.reason), "sha256": _hash(result)},
        )
        write_bytes(self.path(chunk), netcdf_bytes(dataset))

    def read(self, chunk: Chunk) -> ChunkResult | None:
        """Return a stored chunk; None if it is not there, or damaged, which the log says."""
        path = self.path(chunk)
        if not path.exists():
            return None
        try:
            with xr.open_dataset(path, engine="scipy") as stored:
                numbers: dict[str, Any] = {name: _values(stored, name) for name in DIMENSIONS}
                result = ChunkResult(
                    **numbers,
                    status=stored["status"].values.astype(np.int8),
                    reason=tuple(json.loads(stored.attrs["reason"])),
                )
                if stored.attrs["key"] == self.key and stored.attrs["sha256"] == _hash(result):
                    return result
        except (OSError, KeyError, ValueError, TypeError, IndexError):
            pass
        log.warning("%s is damaged or of another study; its members are computed again", path)
        return None


def _values(stored: xr.Dataset, name: str) -> NDArray[np.float64]:
    """Return what is stored under a name; nothing was written of what has no responses or no resultants."""
    if name in stored:
        return stored[name].values
    return np.empty(tuple(stored.sizes.get(dim, 0) for dim in ("member", *DIMENSIONS[name])))


def _hash(result: ChunkResult) -> str:
    digest = hashlib.sha256(json.dumps(result.reason).encode())
    for array in (*result.numbers.values(), result.status):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def netcdf_bytes(dataset: xr.Dataset) -> bytes:
    """Return a dataset as a NetCDF file, the same bytes for the same numbers."""
    return bytes(dataset.to_netcdf(engine="scipy"))


@contextmanager
def open_store(folder: Path, identity: Mapping[str, Any]) -> Iterator[ChunkStore]:
    """Hold a folder for one parameter study.

    Raises
    ------
    OutputFolderError
        It cannot be written.
    ResumeError
        It holds another study, which differs in what the message names, or another process is at work in it.
    """
    prepare_folder(folder)
    prepare_folder(folder / CHUNKS)
    lock = FileLock(folder / ".lock", timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise ResumeError(f"another process is computing in {folder}; wait for it, or take another --out") from None
    try:
        for left in (folder / CHUNKS).glob(".*.nc"):
            left.unlink(missing_ok=True)  # half a chunk of a killed run
        _claim(folder, identity)
        text = json.dumps(identity, sort_keys=True)
        yield ChunkStore(folder, hashlib.sha256(text.encode()).hexdigest()[:32])
    finally:
        lock.release()


def _claim(folder: Path, identity: Mapping[str, Any]) -> None:
    """Write whose folder it is, or compare with who it was."""
    file = folder / IDENTITY_FILE
    wanted = json.loads(json.dumps(identity))
    if not file.exists():
        write_bytes(file, (json.dumps(wanted, indent=1, ensure_ascii=False) + "\n").encode())
        return
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise OutputFolderError(f"{file} cannot be read ({error}); take another --out") from None
    differing = [k for k in [*wanted, *found] if wanted.get(k) != found.get(k)]
    if differing:
        lines = [f"{k}: {_short(found.get(k))} there, {_short(wanted.get(k))} here" for k in dict.fromkeys(differing)]
        raise ResumeError(
            f"{folder} holds another parameter study and cannot be resumed; it differs in {'; '.join(lines)}. Take "
            "another --out, or remove that folder"
        )


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False) if value is not None else "nothing"
    return text if len(text) <= 60 else f"{text[:57]}..."
