"""Datasets for torch's loaders. Needs torch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from . import checks

try:
    import torch
except ImportError as e:
    raise checks.needs("gripgen.torch", "torch", "train") from e

from torch.utils.data import Dataset as _TorchDataset
from torch.utils.data import IterableDataset as _TorchIterableDataset
from torch.utils.data import get_worker_info

from .dataset import Dataset
from .streams import Stream


class PullDataset(_TorchDataset):
    """Map-style: `(images, label)` of a row, a whole batch fetched in one call.

        loader = torch.utils.data.DataLoader(
            gg.torch.PullDataset(train), batch_size=64, shuffle=True, collate_fn=gg.torch.collate)

    Images are uint8[2, H, W, 3] unless `transform` makes something else of them. Decoding is done in Rust without the
    interpreter's lock: `num_workers=0` with `threads=2` is usually faster than worker processes.
    """

    def __init__(
        self, dataset: Dataset, *, transform: Callable[[torch.Tensor], torch.Tensor] | None = None, threads: int = 1
    ) -> None:
        self.dataset = dataset
        self.transform = transform
        self.threads = threads

    def __len__(self) -> int:
        return len(self.dataset)

    def __getitem__(self, i: int) -> tuple[torch.Tensor, torch.Tensor]:
        return self.__getitems__([i])[0]

    def __getitems__(self, ids: list[int]) -> list[tuple[torch.Tensor, torch.Tensor]]:
        images, labels = self.dataset.batch(ids, threads=self.threads)
        pixels, forces = torch.from_numpy(images), torch.from_numpy(labels)
        if self.transform is not None:
            pixels = self.transform(pixels)
        return list(zip(pixels, forces))


class PullIterableDataset(_TorchIterableDataset):
    """Iterable form: batches, the rows shared out over ranks and worker processes. Give it to a loader with
    `batch_size=None`; `set_epoch` changes the order."""

    def __init__(
        self,
        dataset: Dataset,
        *,
        batch_size: int = 32,
        shuffle: bool = True,
        seed: int = 0,
        rank: int = 0,
        world_size: int = 1,
    ) -> None:
        self.dataset = dataset
        self.options: dict[str, Any] = {"batch_size": batch_size, "shuffle": shuffle, "seed": seed}
        self.rank = rank
        self.world_size = world_size
        self.epoch = 0

    def set_epoch(self, epoch: int) -> None:
        """The order of the rows is a function of seed and epoch."""
        self.epoch = epoch

    def __iter__(self) -> Iterator[tuple[torch.Tensor, torch.Tensor]]:
        worker = get_worker_info()
        workers, own = (worker.num_workers, worker.id) if worker else (1, 0)
        batches = self.dataset.iterate(
            **self.options,
            epoch=self.epoch,
            rank=self.rank * workers + own,
            world_size=self.world_size * workers,
        )
        for images, labels in batches:
            yield torch.from_numpy(images), torch.from_numpy(labels)


class PullStream(_TorchIterableDataset):
    """Batches of `gg.stream` as tensors: `(images, labels)`, or with columns a dictionary of columns as the third; with
    films they are a list of `Film` after it. Give it
    to a loader with `batch_size=None`; the samples are shared out over its worker processes, each with `jobs` threads.
    `num_workers=0` is usually faster: the threads need no interpreter, and nothing is sent between processes."""

    def __init__(self, stream: Stream) -> None:
        self.stream = stream

    def state_dict(self) -> dict[str, Any]:
        """Where the pass of this process is."""
        return self.stream.state_dict()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Continues there."""
        self.stream.load_state_dict(state)

    def __iter__(self) -> Iterator[tuple[Any, ...]]:
        worker = get_worker_info()
        own = self.stream if worker is None else self.stream.share(worker.id, worker.num_workers)
        for images, labels, *columns in own:
            pixels = None if images is None else torch.from_numpy(images)
            yield (pixels, torch.from_numpy(labels), *columns)


def collate(rows: list[tuple[torch.Tensor, torch.Tensor]]) -> tuple[torch.Tensor, torch.Tensor]:
    """A batch of the rows of a `PullDataset`, without a copy where they lie beside each other as it fetched them."""
    first = rows[0][0]
    step = first.numel()
    together = all(
        row[0].untyped_storage().data_ptr() == first.untyped_storage().data_ptr()
        and row[0].storage_offset() == first.storage_offset() + i * step
        for i, row in enumerate(rows)
    )
    labels = torch.stack([row[1] for row in rows])
    if together and first.is_contiguous():
        stride = (step, *first.stride())
        return first.as_strided((len(rows), *first.shape), stride, first.storage_offset()), labels
    return torch.stack([row[0] for row in rows]), labels


def seed_worker(_: int) -> None:
    """For a loader's `worker_init_fn`: numpy draws something else in each worker."""
    np.random.seed(torch.initial_seed() % 2**32)
