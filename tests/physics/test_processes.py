"""The engine among processes, threads and signals: fork, Ctrl-C, any number of threads, imports.

What could hang or end the process runs in a child with a time limit, so that a deadlock is a failure."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import textwrap
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import ipman_rs as ip
from tests.helpers import solids

PREAMBLE = """
import hashlib, sys
import numpy as np
import ipman_rs as ip
body = ip.load_body("anny-lite")
template = body.make_template(2000)
bodies = body(np.random.default_rng(0).normal(scale=0.3, size=(64, 24, 3))).vertices
ground = ip.Ground.y_up(-0.9)
def digest(vertices=bodies):
    results = [ip.stability_loss(vertices, template, ground), ip.part_volumes(vertices, template),
               *ip.ground_loss(vertices, template, ground), ip.balance_cost(vertices, template, ground),
               ip.mass_properties(vertices, template).inertia, ip.support_margin(vertices, template, ground),
               ip.base_of_support(vertices, template, ground).area, ip.bose(vertices, template, ground, method="lp")]
    return hashlib.sha256(b"".join(np.ascontiguousarray(r).tobytes() for r in results)).hexdigest()
"""


def child(script, timeout=60, **environment):
    """What the script prints."""
    done = subprocess.run(
        [sys.executable, "-c", PREAMBLE + textwrap.dedent(script)],
        capture_output=True, text=True, timeout=timeout, env={**os.environ, **environment},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_fork_after_use():
    """The pool's threads do not live in a forked child: it must make its own, and its children's children too."""
    first, *others = child(
        """
        import multiprocessing, warnings
        warnings.simplefilter("ignore")
        ip.set_num_threads(4)
        print(digest())
        def work(queue, depth):
            if depth:
                fork(queue, depth - 1)
            queue.put(digest())
        def fork(queue, depth):
            process = multiprocessing.get_context("fork").Process(target=work, args=(queue, depth))
            process.start()
            process.join(40)
            if process.exitcode != 0:
                process.kill()
                sys.exit(f"the forked child ended with {process.exitcode}")
        queue = multiprocessing.get_context("fork").SimpleQueue()
        for depth in (0, 0, 1):
            fork(queue, depth)
        for _ in range(4):
            print(queue.get())
        print(digest())
        """,
        timeout=120,
    )
    assert others == [first] * 5


@pytest.mark.slow
@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_process_pools(method, tmp_path):
    """A template travels by pickle; each worker gives the parent's bits."""
    if sys.platform == "win32" and method != "spawn":
        pytest.skip("this system has spawn only")
    script = PREAMBLE + textwrap.dedent(
        """
        import multiprocessing, warnings
        warnings.simplefilter("ignore")
        def losses(job):
            return ip.stability_loss(job[0], job[1], ip.Ground.y_up(-0.9))
        if __name__ == "__main__":
            here = ip.stability_loss(bodies, template, ground)
            with multiprocessing.get_context(METHOD).Pool(2) as pool:
                there = pool.map_async(losses, [(piece, template) for piece in np.split(bodies, 8)]).get(60)
            assert np.array_equal(np.concatenate(there), here)
            print("equal")
        """
    ).replace("METHOD", repr(method))
    file = tmp_path / "pool.py"  # spawned workers import it
    file.write_text(script)
    done = subprocess.run([sys.executable, str(file)], capture_output=True, text=True, timeout=120)
    assert done.stdout.split() == ["equal"], done.stderr


@pytest.mark.slow
def test_any_number_of_threads_gives_the_same_bits():
    digests = child(
        """
        for threads in (1, 2, 3, 4, 7, 16):
            ip.set_num_threads(threads)
            assert ip.get_num_threads() == threads
            print(digest(), digest(bodies.astype("f4")))
        """
    )
    assert len(set(digests[::2])) == 1
    assert len(set(digests[1::2])) == 1


@pytest.mark.slow
def test_the_environment_sets_the_threads():
    results = [child("print(ip.get_num_threads(), digest())", RAYON_NUM_THREADS=str(n)) for n in (1, 3)]
    assert [result[0] for result in results] == ["1", "3"]
    assert results[0][1] == results[1][1]


@pytest.mark.slow
def test_the_environment_chooses_the_cpu_level():
    """Levels with fused operations give the same bits; the scalar level rounds differently."""
    script = "print(ip._core.simd_level(), digest(bodies.astype('f4')))"
    levels = ip._core.simd_levels()
    results = [child(script, IPMAN_SIMD=level) for level in levels]
    assert [result[0] for result in results] == levels
    assert len({bits for level, bits in results if level != "scalar"}) <= 1


@pytest.mark.parametrize("call", ["ip.load_body('anny-lite')()", "ip.part_volumes(tetrahedron, template)"])
def test_an_unknown_cpu_level_is_refused(call):
    script = f"""
import numpy as np, ipman_rs as ip
tetrahedron = np.vstack([np.zeros(3), np.eye(3)])
template = ip.BodyTemplate(tetrahedron, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], num_samples=9)
{call}
"""
    environment = {**os.environ, "IPMAN_SIMD": "mmx"}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, env=environment)
    last = done.stderr.strip().splitlines()[-1]
    assert re.fullmatch(r'ValueError: IPMAN_SIMD: expected one of .*scalar, got "mmx"', last)


@pytest.mark.slow
def test_threads_follow_torch():
    pytest.importorskip("torch")
    script = """
        import torch, ipman_rs.torch as ipt
        torch.set_num_threads(3)
        vertices = torch.from_numpy(bodies[:2]).requires_grad_()
        loss = ipt.IntuitivePhysicsLoss(template)
        loss.weighted(vertices, ipt.Ground.y_up(-0.9))[0].backward()
        print(ip.get_num_threads())
        ip.set_num_threads(2)
        ipt.part_volumes(vertices, template)
        print(ip.get_num_threads())
        ip.set_num_threads(None)
        print(ip.get_num_threads())
        """
    assert child(script) == ["3", "2", "3"]
    assert child(script, RAYON_NUM_THREADS="5") == ["5", "2", "5"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals differ there")
@pytest.mark.parametrize(
    "call",
    [
        "ip.balance_cost(huge, template, ground)",
        "ip.bose(huge, template, ground, method='lp')",
        "ip.base_of_support(huge, template, ground)",
        "ip.quantities.balance_cost(100.0, 50.0, 0.02, 'log', 'pcom').of(template).value_and_vjp(*grounded, d_out)",
    ],
)
@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c_within_a_second(call, threads):
    """200,000 small bodies of 20,000 samples each, half a minute of work or more in one call, ended by SIGINT."""
    script = f"""
    import time
    ip.set_num_threads({threads})
    octahedron = np.vstack([np.eye(3), -np.eye(3)])
    faces = [[a, b, c] if (a + b + c) % 2 else [a, c, b] for a in (0, 3) for b in (1, 4) for c in (2, 5)]
    template = ip.BodyTemplate(octahedron, faces, np.arange(8) % 2)
    huge = np.tile(octahedron * 0.8, (200_000, 1, 1))
    grounded, d_out = (huge, np.tile([0.0, 1.0, 0.0], (200_000, 1)), np.full(200_000, -0.8)), np.ones((200_000, 1))
    print("ready", flush=True)
    try:
        {call}
        print("finished", flush=True)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
    """
    process = subprocess.Popen(
        [sys.executable, "-c", PREAMBLE + textwrap.dedent(script)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    watchdog = threading.Timer(30, process.kill)
    watchdog.start()
    try:
        assert process.stdout.readline().strip() == "ready"
        time.sleep(0.4)
        assert process.poll() is None
        sent = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline().strip() == "interrupted"
        took = time.monotonic() - sent
        process.wait(10)
    finally:
        watchdog.cancel()
        process.kill()
        process.communicate()
    assert took < 1.0


@pytest.mark.slow
def test_interrupted_once_and_usable_again():
    """An own handler that raises: its exception comes through, and the next call is right."""
    assert child(
        """
        import signal
        before = digest()
        class Enough(Exception):
            pass
        def stop(*_):
            raise Enough
        signal.signal(signal.SIGALRM, stop)
        big = np.ascontiguousarray(np.tile(bodies, (20, 1, 1)))
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.2)
            while True:
                ip.balance_cost(big, template, ground)
        except Enough:
            print("enough")
        print(digest() == before)
        """
    ) == ["enough", "True"]


def test_calls_from_many_threads(blob, bodies):
    """Eight Python threads at once, each with every function: the bits of one alone."""
    expected = {name: function(bodies, blob, ip.Ground()) for name, function in solids.EVERY.items()}

    def work(_):
        for name, function in solids.EVERY.items():
            for got, wanted in zip(function(bodies, blob, ip.Ground()), expected[name], strict=True):
                np.testing.assert_array_equal(got, wanted)
        return True

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(24)))


@pytest.mark.slow
def test_the_lock_is_released(lite):
    """Another Python thread counts on while a long call runs."""
    people = np.ascontiguousarray(np.broadcast_to(lite.v_template, (400, *lite.v_template.shape)))
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    counter = threading.Thread(target=count)
    counter.start()
    try:
        start = time.monotonic()
        while time.monotonic() - start < 0.5:
            ip.balance_cost(people, lite.template, ip.Ground(height=-0.9))
    finally:
        done.set()
        counter.join()
    # Unhindered it reaches several hundred; behind the lock one a call, a handful.
    assert counted[0] > 50


def test_threads_may_be_set_while_calls_run(blob, bodies):
    before = ip.get_num_threads()
    expected = ip.stability_loss(bodies, blob, ip.Ground())
    try:
        with ThreadPoolExecutor(4) as pool:
            jobs = [pool.submit(ip.stability_loss, bodies, blob, ip.Ground()) for _ in range(200)]
            for threads in [1, 2, 3, 4] * 10:
                ip.set_num_threads(threads)
            for job in jobs:
                np.testing.assert_array_equal(job.result(60), expected)
    finally:
        ip.set_num_threads(before)


def test_import_needs_numpy_alone():
    """None of the heavy packages, nor the parts of numpy that numpy itself leaves for later."""
    heavy = ["torch", "scipy", "trimesh", "matplotlib", "click", "rich", "jinja2", "networkx", "numpy.ma"]
    script = f"""if True:
        import sys, numpy
        before = set(sys.modules)
        import ipman_rs
        print((set(sys.modules) - before) & set({heavy}))"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.strip() == "set()"


def test_the_quantities_need_numpy_alone():
    """So do all functions, a body and its template; scipy is for regressor() and the named poses."""
    done = child(
        """
        ip.analyze(bodies, template, ground).to_json()
        digest()
        print([m for m in ("torch", "scipy", "trimesh") if m in sys.modules])
        """
    )
    assert done == ["[]"]
