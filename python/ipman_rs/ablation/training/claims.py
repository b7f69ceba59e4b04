"""The paper's claims about its terms on RICH against HMR*, and whether our numbers support them.

Table 1: HMR* 92.4 mm PVE and 62.0 % BoSE; + ground 89.9, 66.5; + stability 90.8, 69.6; both, IPMAN-R, 89.9, 71.2. Table
of push and pull: HMR* 92.3 mm; + push 96.6, + pull 99.4: either alone makes bodies worse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

Verdict = Literal["yes", "no", "not shown"]

BETTER = {"PVE": -1.0, "BoSE": 1.0}  # the sign of a difference that is an improvement
UNITS = {"PVE": "mm", "BoSE": "points"}


@dataclass(frozen=True)
class Claim:
    """row: of the settings. figure: of `BETTER`. printed: the paper's difference against HMR*."""

    row: str
    figure: str
    printed: float

    @property
    def question(self) -> str:
        better = self.printed * BETTER[self.figure] > 0
        return f"{self.row}: {self.figure} {'better' if better else 'worse'}?"

    def verdict(self, interval: Sequence[float]) -> Verdict:
        """ "yes" where the whole interval lies on the claim's side of 0, "no" where it lies on the other."""
        _, low, high = interval
        if low > 0 or high < 0:
            return "yes" if (low > 0) == (self.printed > 0) else "no"
        return "not shown"


CLAIMS = (
    Claim("+ ground", "PVE", -2.5),
    Claim("+ ground", "BoSE", 4.5),
    Claim("+ stability", "PVE", -1.6),
    Claim("+ stability", "BoSE", 7.6),
    Claim("both (IPMAN-R)", "PVE", -2.5),
    Claim("both (IPMAN-R)", "BoSE", 9.2),
    Claim("both, λ of the paper", "PVE", -2.5),
    Claim("both, λ of the paper", "BoSE", 9.2),
    Claim("push only", "PVE", 4.3),
    Claim("pull only", "PVE", 7.1),
)


def judge_claims(blocks: Sequence[dict[str, Any]]) -> list[tuple[Claim, list[tuple[Verdict, Sequence[float]]]]]:
    """Every claim with its verdict and the interval, of each block of the record (each tilt)."""
    return [(claim, [_verdict(claim, block) for block in blocks]) for claim in CLAIMS]


def _verdict(claim: Claim, block: dict[str, Any]) -> tuple[Verdict, Sequence[float]]:
    row = next(row for row in block["rows"] if row["name"] == claim.row)
    interval = row["against baseline"][claim.figure]
    return claim.verdict(interval), interval
