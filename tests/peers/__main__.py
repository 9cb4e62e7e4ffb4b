"""Asks other libraries what DIBS is asked, and writes docs/evidence/peers.json and docs/evidence/peers.md.

`cargo xtask peers` runs it in an environment of its own.
"""

from __future__ import annotations

import argparse
import pathlib
from typing import Any

import numpy as np

import cases
import page
import records
import score
import subjects
from libraries import NAMES
from run import run

PLANTED = "planted"
LARGE = 3_000
"""A subject of more triangles gets a tenth of the points: the truth takes all triangles."""
WEIGHED = 6
SIZES = [1_000, 10_272, 50_000]
TIMED_FRAMES, TIMED_POINTS = 25, 200


def main() -> None:
    parser = argparse.ArgumentParser(prog="cargo xtask peers", description=__doc__)
    parser.add_argument("--only", choices=["answers", "times"], help="one part; the records keep the other")
    parser.add_argument("--points", type=int, default=5_000, help="of each frame")
    parser.add_argument("--libraries", help="a list with commas; nothing is recorded")
    parser.add_argument("--folder", type=pathlib.Path, default=records.ROOT / "target/peers/cases")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    names = options.libraries.split(",") if options.libraries else NAMES
    known = records.load()
    if options.only != "times":
        known["answers"] = answers(names, options)
    if options.only != "answers":
        known["times"] = times([name for name in names if name != PLANTED], options)
    if options.libraries:
        print(page.page(known))
        return
    records.save(known)
    page.write(known)


def answers(names: list[str], options: argparse.Namespace) -> dict[str, Any]:
    """Wrong sides and distances, and bytes."""
    here, skipped = subjects.all_of_them()
    libraries = {name: {**records.about(name), "scores": {}} for name in names}
    shown = []
    for subject in here:
        count = options.points if len(subject.triangles) < LARGE else options.points // 10
        path = cases.write(options.folder, subject, count)
        case = cases.judge(path)
        shown.append({"name": subject.name, "says": subject.says, "triangles": len(subject.triangles)})
        shown[-1] |= {"frames": len(subject.frames), "points": case.side.size, "band": case.band}
        found = {name: run("answers", name, path) for name in names}
        for name, each in found.items():
            counts = each if isinstance(each, str) else score.score(case, each)
            libraries[name]["scores"][subject.name] = counts
            print(subject.name, name, flush=True)
        if PLANTED in found and "dibs" in found:
            prove(case, found["dibs"], libraries["dibs"], libraries[PLANTED], subject.name)
    ball = cases.write(options.folder, subjects.ball(WEIGHED), 100)
    for name in names:
        each = run("memory", name, ball)
        libraries[name]["bytes"] = each if isinstance(each, str) else float(each["bytes"])
    command = f"cargo xtask peers --only answers --points {options.points}"
    return {**records.facts(command), "subjects": shown, "skipped": skipped, "libraries": list(libraries.values())}


def prove(case: score.Case, found: Any, dibs: Any, planted: Any, subject: str) -> None:
    """The planted wrong sides are all counted."""
    # Right ones become wrong ones, and the other way round.
    right_less_wrong = (found["side"] * case.side * case.is_clear)[:, ::1_000].sum()
    wrong = [each["scores"][subject]["wrong sides"] for each in (dibs, planted)]
    if wrong[1] != wrong[0] + right_less_wrong:
        planned = wrong[0] + right_less_wrong
        raise AssertionError(f"{subject}: {wrong[1]} of {planned} planted wrong sides were counted")


def times(names: list[str], options: argparse.Namespace) -> dict[str, Any]:
    """Microseconds of updates and questions."""
    timed = [subjects.heart(size, TIMED_FRAMES) for size in SIZES]
    paths = [cases.write(options.folder, subject, TIMED_POINTS) for subject in [subjects.tetrahedron(), *timed]]
    libraries = []
    for name in names:
        found = [run("times", name, path) for path in paths]
        of_sizes = [each if isinstance(each, str) else summary(each) for each in found]
        libraries.append({**records.about(name), "call": of_sizes[0], "sizes": of_sizes[1:]})
        print("times", name, flush=True)
    sizes = [len(subject.triangles) for subject in timed]
    return {**records.facts("cargo xtask peers --only times"), "sizes": sizes, "libraries": libraries}


def summary(found: dict[str, Any]) -> dict[str, Any]:
    """In microseconds."""
    one = found["one"] / 1e3
    return {
        "questions": len(one),
        "update": float(np.median(found["update"]) / 1e3),
        "one": float(np.median(one)),
        "slowest thousandth": float(np.quantile(one, 0.999)) if len(one) >= 1_000 else None,
        "batch": float(np.median(found["batch"]) / 1e3),
    }


if __name__ == "__main__":
    main()
