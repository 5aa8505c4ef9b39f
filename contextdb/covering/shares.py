"""Shares as text, and intervals round a share that was sampled."""

from __future__ import annotations

import math

Z_99 = 2.5758293035489004
"""Standard deviations that 99 % of a normal distribution lie within."""


def format_percent(share: float, digits: int = 2) -> str:
    """A share as a percentage that never rounds to 0 or 100 when it is not: "99.999 %", "> 99.9999999999 %", "0.0003 %"."""
    if math.isnan(share):
        return "unknown"
    if share <= 0.0 or share >= 1.0:
        return "0 %" if share <= 0.0 else "100 %"
    if share < 0.5:
        percent = 100.0 * share
        texts = (f"{percent:.{places}f}" for places in range(digits, 11))
        return f"{next((text for text in texts if float(text) > 0.0), f'{percent:.1g}')} %"
    for places in range(digits, 13):
        text = f"{100.0 * share:.{places}f}"
        if float(text) < 100.0:
            return f"{text} %"
    return "> 99.9999999999 %"


def distinct_percents(one: float, other: float) -> tuple[str, str]:
    """Two shares as percentages, with as many digits as it takes to tell them apart."""
    texts = [(format_percent(one, digits), format_percent(other, digits)) for digits in range(2, 9)]
    return next((pair for pair in texts if pair[0] != pair[1]), texts[0])


def wilson(n_hits: int, n_samples: int, z: float = Z_99) -> tuple[float, float]:
    """The interval that a share lies in, after `n_hits` of `n_samples`: E. B. Wilson, JASA 22, 1927. No sample says nothing."""
    if n_samples <= 0:
        return 0.0, 1.0
    share, zz = n_hits / n_samples, z * z
    centre = share + zz / (2 * n_samples)
    spread = z * math.sqrt(share * (1 - share) / n_samples + zz / (4 * n_samples * n_samples))
    low, high = (centre - spread) / (1 + zz / n_samples), (centre + spread) / (1 + zz / n_samples)
    return (0.0 if n_hits == 0 else max(0.0, low)), (1.0 if n_hits == n_samples else min(1.0, high))
