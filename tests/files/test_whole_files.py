"""Files are there whole or not at all: on failures, after kills, and with two writers at once."""

import contextlib
import os
import resource
import signal
import subprocess
import sys
import textwrap
import time

import pytest

from ipman_rs.files import atomic_write, cell, write_whole


def names(folder):
    return sorted(entry.name for entry in folder.iterdir())


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "report.json"
    write_whole(path, "old")
    with contextlib.suppress(KeyboardInterrupt), atomic_write(path) as file:
        file.write(b"half of the new")
        raise KeyboardInterrupt
    assert path.read_text() == "old"
    assert names(tmp_path) == ["report.json"]


def test_a_full_disk_leaves_whole_files(tmp_path):
    """The largest size that a process may give a file stands for the end of the disk."""
    script = textwrap.dedent("""
        import resource, signal, sys
        from pathlib import Path
        from ipman_rs.files import write_whole
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (5000, 5000))
        try:
            write_whole(Path(sys.argv[1]) / "report.json", "x" * 100_000)
        except OSError as error:
            print(error.strerror)
    """)
    done = subprocess.run([sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True)
    assert done.stdout == "File too large\n", done.stderr
    assert names(tmp_path) == []
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 5000


WRITER = textwrap.dedent("""
    import sys, time
    from pathlib import Path
    from ipman_rs.files import atomic_write
    with atomic_write(Path(sys.argv[1]) / "frames.parquet") as file:
        file.write(b"half")
        file.flush()
        print("begun", flush=True)
        time.sleep(60)
""")


@pytest.mark.slow
def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path):
    writers = [
        subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path)], stdout=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    for writer in writers:
        assert writer.stdout is not None
        assert writer.stdout.readline() == "begun\n"
    killed, living = writers
    os.kill(killed.pid, signal.SIGKILL)
    killed.wait()
    assert len(names(tmp_path)) == 2
    write_whole(tmp_path / "frames.parquet", b"whole")
    left = names(tmp_path)
    living.kill()
    living.wait()
    # The living writer's part stays: it may still become the file.
    assert len(left) == 2
    assert "frames.parquet" in left
    write_whole(tmp_path / "frames.parquet", b"whole")
    assert names(tmp_path) == ["frames.parquet"]


@pytest.mark.slow
def test_two_writers_at_once_both_end_well(tmp_path):
    script = textwrap.dedent("""
        import sys
        from pathlib import Path
        from ipman_rs.files import write_whole
        for number in range(200):
            write_whole(Path(sys.argv[1]) / f"{number % 3}", b"x" * 10_000)
    """)
    writers = [subprocess.Popen([sys.executable, "-c", script, str(tmp_path)]) for _ in range(3)]
    assert [writer.wait() for writer in writers] == [0, 0, 0]
    assert names(tmp_path) == ["0", "1", "2"]
    assert {(tmp_path / name).stat().st_size for name in "012"} == {10_000}


def test_other_hidden_files_stay(tmp_path):
    (tmp_path / ".a.json.part").write_text("of another program")
    (tmp_path / ".b.json.0123456789ab.part").write_text("of another file")
    write_whole(tmp_path / "a.json", "x")
    assert names(tmp_path) == [".a.json.part", ".b.json.0123456789ab.part", "a.json"]


def test_long_names_and_times(tmp_path):
    name = "ä" * 120  # 240 bytes, of 255
    begun = time.monotonic()
    write_whole(tmp_path / name, "x")
    assert names(tmp_path) == [name]
    assert time.monotonic() - begun < 5


@pytest.mark.parametrize("text", ["=1+1", "+1", "-2", "@SUM(A1)", "\t=1", "\r=1", '=HYPERLINK("http://x")'])
def test_cells_that_begin_like_formulas_are_text(text):
    assert cell(text) == f"'{text}"


def test_other_cells_stay():
    assert [cell(text) for text in ("", "a=1", "walk-1", "1", "'x")] == ["", "a=1", "walk-1", "1", "'x"]
