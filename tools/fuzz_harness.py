"""Run numbered cases in child processes with limits of time and memory, and say what went wrong in which.

A case is a function of its number and the seed alone,
so that whatever it finds is found again with `--case`. Children are
forked after all imports, a block of cases each: a crash costs a block's child, and the next goes on behind it.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import select
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

Case = Callable[[int, int], str]  # seed, number -> what happened, in a word; raises Wrong

BLOCK = 250  # cases of a child
CPU_LIMIT = 5.0  # s of a case
WALL_LIMIT = 120.0  # s without a word: a read that waits for ever uses no CPU
ALIKE = 3  # findings that begin alike and are printed
MEMORY = 4 << 30  # bytes beyond what the imports took


class Wrong(Exception):
    """What must not happen: the text says what did."""


class _TimeUp(BaseException):
    """A case used more CPU time than it may."""


@dataclass
class Outcome:
    cases: int = 0
    words: Counter[str] = field(default_factory=Counter)
    wrong: list[tuple[int, str]] = field(default_factory=list)


@dataclass
class _Child:
    pid: int
    pipe: int
    end: int
    case: int
    heard: float
    text: bytes = b""


def run(case: Case, about: str) -> None:
    """The command line of a fuzzer; ends the process with 1 where anything was wrong."""
    words = argparse.ArgumentParser(description=about)
    words.add_argument("--seed", type=int, default=0)
    words.add_argument("-n", "--cases", "--calls", "--files", type=int, default=2**62, help="how many")
    words.add_argument("--seconds", type=float, default=60.0, help="when to stop; 0: not before all cases are done")
    words.add_argument("--first", type=int, default=0, help="number of the first case")
    words.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    words.add_argument("--memory", type=float, default=MEMORY / 2**30, help="GB that a case may ask for")
    words.add_argument("--case", type=int, help="this one alone, in this process, with its traceback")
    asked = words.parse_args()
    if asked.case is not None:
        print(case(asked.seed, asked.case))
        return
    begun = time.monotonic()
    outcome = _all(case, asked, begun)
    spent = time.monotonic() - begun
    listed = ", ".join(f"{count} {word}" for word, count in outcome.words.most_common())
    print(
        f"seed {asked.seed}: {outcome.cases} cases in {spent:.0f} s: {listed or 'nothing'}; {len(outcome.wrong)} wrong"
    )
    alike = Counter[str]()
    for number, what in sorted(outcome.wrong):
        alike[what[:60]] += 1
        if alike[what[:60]] <= ALIKE:
            print(f"  case {number}: {what}")
    sys.exit(1 if outcome.wrong else 0)


def _all(case: Case, asked: argparse.Namespace, begun: float) -> Outcome:
    outcome, children, following = Outcome(), list[_Child](), asked.first
    last = asked.first + asked.cases
    while True:
        late = asked.seconds and time.monotonic() - begun > asked.seconds
        while len(children) < asked.processes and following < last and not late:
            end = min(following + BLOCK, last)
            children.append(_begin(case, asked, following, end))
            following = end
        if not children:
            return outcome
        ready = select.select([child.pipe for child in children], [], [], 1.0)[0]
        for child in list(children):
            if child.pipe in ready:
                again = _hear(child, outcome)
            elif time.monotonic() - child.heard > WALL_LIMIT:
                os.kill(child.pid, signal.SIGKILL)
                outcome.wrong.append((child.case, f"silent for {WALL_LIMIT:.0f} s"))
                again = child.case + 1
            else:
                if late and child.case >= 0:
                    os.kill(child.pid, signal.SIGTERM)
                continue
            if again is None:
                continue
            os.close(child.pipe)
            os.waitpid(child.pid, 0)
            children.remove(child)
            if again < child.end and not late:
                children.append(_begin(case, asked, again, child.end))


def _hear(child: _Child, outcome: Outcome) -> int | None:
    """Takes in what a child says; None while it lives, else the case that a new one goes on with."""
    content = os.read(child.pipe, 1 << 16)
    child.heard = time.monotonic()
    child.text += content
    *lines, child.text = child.text.split(b"\n")
    ended = False
    for line in lines:
        said = json.loads(line)
        if "begin" in said:
            child.case = said["begin"]
        elif "end" in said:
            ended = True
        else:
            outcome.cases += 1
            outcome.words[said["word"]] += 1
            if said["wrong"]:
                outcome.wrong.append((said["case"], said["wrong"]))
    if ended:
        return child.end
    if content:
        return None
    status = os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
    if status is not None and status.si_status == signal.SIGTERM:
        return child.end
    outcome.cases += 1
    outcome.words["crashed"] += 1
    outcome.wrong.append((child.case, f"the process ended: {status.si_status if status else 'unknown'}"))
    return child.case + 1


def _begin(case: Case, asked: argparse.Namespace, first: int, end: int) -> _Child:
    reads, writes = os.pipe()
    pid = os.fork()
    if pid:
        os.close(writes)
        return _Child(pid, reads, end, first, time.monotonic())
    status = 1
    try:
        os.close(reads)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        signal.signal(signal.SIGPROF, _stop)
        limit = _used() + int(asked.memory * 2**30)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        for number in range(first, end):
            _say(writes, {"begin": number})
            _say(writes, {"case": number, **_one(case, asked.seed, number)})
        _say(writes, {"end": end})
        status = 0
    finally:
        os._exit(status)
    raise AssertionError


def _one(case: Case, seed: int, number: int) -> dict[str, Any]:
    signal.setitimer(signal.ITIMER_PROF, CPU_LIMIT)
    try:
        return {"word": case(seed, number), "wrong": None}
    except Wrong as error:
        return {"word": "wrong", "wrong": str(error)[:600]}
    except _TimeUp:
        return {"word": "slow", "wrong": f"more than {CPU_LIMIT:.0f} s of CPU time"}
    except MemoryError:
        return {"word": "MemoryError", "wrong": None}
    except BaseException as error:
        where = "; ".join(line.strip().replace("\n", " ") for line in traceback.format_tb(error.__traceback__)[-2:])
        return {"word": "wrong", "wrong": f"{type(error).__name__}: {str(error)[:200]} ({where})"[:600]}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def _stop(*_: Any) -> None:
    raise _TimeUp


def _say(pipe: int, said: dict[str, Any]) -> None:
    os.write(pipe, json.dumps(said).encode() + b"\n")


def _used() -> int:
    """Bytes of address space that this process has."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[0]) * resource.getpagesize()
