"""Runs one library on one case, in a process that may crash or hang."""

from __future__ import annotations

import pathlib
import signal
import subprocess
import sys
from typing import Any

import numpy as np

import child

LIMIT = 1_200
"""Seconds of one library on one case."""


def run(what: str, library: str, case: pathlib.Path, limit: float = LIMIT) -> dict[str, Any] | str:
    """What the library found, or a sentence that says why there is nothing."""
    found = case.with_name(f"{library}-{what}-{case.name}")
    found.unlink(missing_ok=True)
    program = [sys.executable, "-W", "ignore", child.__file__, what, library, str(case), str(found)]
    try:
        done = subprocess.run(program, capture_output=True, text=True, timeout=limit, check=False)
    except subprocess.TimeoutExpired:
        return f"took longer than {limit} s"
    if done.returncode < 0:
        return f"crashed: {signal.Signals(-done.returncode).name}"
    if done.returncode > 0 or not found.exists():
        lines = done.stderr.strip().splitlines()
        return lines[-1] if lines else f"ended with {done.returncode}"
    with np.load(found) as results:
        return {name: results[name] for name in results.files}
