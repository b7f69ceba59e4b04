"""Writing images in shards. A shard gets its name only when it is complete and is never rewritten: a killed run
continues after it."""

from __future__ import annotations

import io
import itertools
import json
import multiprocessing
import tarfile
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ipman_rs.files import atomic_write, write_whole
from ipman_rs.processes import end_with_parent

from ...data.rendered.layout import FORMAT, INDEX, SPLITS, Shard, plan, read_index
from .people import keypoint_names
from .samples import RenderSettings, draw_sample, files

AT_ONCE = 8  # images that a worker is asked for at a time


def write(
    folder: Path,
    settings: RenderSettings,
    counts: dict[str, int],
    shard_size: int = 500,
    workers: int = 1,
    progress: Callable[[int], None] = lambda done: None,
) -> int:
    """Draw the images of each split and write them, but for shards that are there; how many images were drawn.

    The bytes depend on `settings`, `counts` and `shard_size` only. `progress` is told how many images there are. Raises
    ValueError for a folder that holds anything else, ImportError without the extra `render`.
    """
    shards = plan(counts, shard_size)
    begin_run(folder, index_of(settings, counts, shards))
    missing = [shard for shard in shards if not (folder / shard.name).exists()]
    done = sum(shard.count for shard in shards) - sum(shard.count for shard in missing)
    progress(done)
    with closing(pack_shards(settings, missing, workers)) as samples:
        for shard in missing:
            with (
                atomic_write(folder / shard.name) as file,
                tarfile.open(fileobj=file, mode="w", format=tarfile.USTAR_FORMAT) as archive,
            ):
                for key, contents in itertools.islice(samples, shard.count):
                    for ending, content in contents.items():
                        add_member(archive, f"{key}.{ending}", content)
                    done += 1
                    progress(done)
    return sum(shard.count for shard in missing)


def index_of(settings: RenderSettings, counts: dict[str, int], shards: list[Shard]) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "settings": asdict(settings),
        "counts": {split: counts.get(split, 0) for split in SPLITS},
        "keypoint_names": list(keypoint_names(settings.body)),
        "shards": [asdict(shard) for shard in shards],
    }


def begin_run(folder: Path, index: dict[str, Any]) -> None:
    """Write the index into a new or empty folder; in a folder with one, check that it is of the same run."""
    path = folder / INDEX
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: expected a folder, got a file")
    if not path.exists():
        entries = folder.iterdir() if folder.exists() else ()
        others = sorted(each.name for each in entries if not each.name.startswith(f".{INDEX}."))  # of a killed run
        if others:
            raise ValueError(
                f"{folder}: expected an empty folder or one of rendered images, got {others[0]}; name another"
            )
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps(index, indent=1))
        return
    begun = read_index(folder)
    for name in index:
        if begun.get(name) != index[name]:
            raise ValueError(
                f"{folder}: holds other images ({name}: {_short(begun.get(name))}, asked for {_short(index[name])}); "
                "repeat the command that began it, or name another folder"
            )


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) < 160 else f"{text[:160]}…"


def pack_shards(
    settings: RenderSettings, shards: Iterable[Shard], workers: int
) -> Generator[tuple[str, dict[str, bytes]]]:
    """The keys and files of all samples of shards, in their order."""
    tasks = [
        (settings, shard.split, range(start, min(start + AT_ONCE, shard.first + shard.count)))
        for shard in shards
        for start in range(shard.first, shard.first + shard.count, AT_ONCE)
    ]
    if workers == 1 or len(tasks) < 2:
        yield from (sample for task in tasks for sample in draw_files(task))
        return
    # Spawned, not forked: the parent has threads (a progress bar's), which a fork would break.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, initializer=end_with_parent)
    try:
        for samples in pool.map(draw_files, tasks):
            yield from samples
    finally:
        pool.shutdown(cancel_futures=True)


def draw_files(task: tuple[RenderSettings, str, range]) -> list[tuple[str, dict[str, bytes]]]:
    settings, split, numbers = task
    samples = [draw_sample(settings, split, number) for number in numbers]
    return [(sample.key, files(sample)) for sample in samples]


def add_member(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    """A member without time, owner or anything else that differs between runs."""
    member = tarfile.TarInfo(name)
    member.size = len(content)
    archive.addfile(member, io.BytesIO(content))
