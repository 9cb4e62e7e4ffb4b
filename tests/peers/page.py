"""The page, of the records."""

from __future__ import annotations

from typing import Any

import records
from score import added

PAGE = records.RECORDS.with_suffix(".md")

OPENING = """# Other libraries

Generated from `peers.json` by `cargo xtask peers`; not typed. What DIBS is asked, other libraries are asked too: the
signed distance of points to meshes that deform, the same points and frames for all, on one core, each library in a
process of its own.
"""

TRUTH = """Coordinates are numbers in single precision, so that no library rounds its input. The truth is the distance
to all triangles and the sum of all solid angles in double precision; where these leave a doubt, a ray in whole numbers.
A point on the surface has no side. Points nearer than 2^-22 of the largest coordinate are counted apart: single
precision rounds as much. A quarter of the points lies anywhere in the room, the others 0.0001 mm to 10 mm from faces,
edges and vertices, and a tenth nearer still: rates are of these hard points, not of a use.
"""

COUNTS = """Of a million points outside the band: wrong sides, and how far from the surface the farthest of them is;
points without a side, and of these those farther than 0.001 mm from the surface. Of a million distances: those that are
off by more than the library's accuracy, and the largest error. Lengths are in millimetres. Bytes are what the process
grows by, of a ball of 81,920 triangles.
"""

TIMES = """In microseconds: the median of an update; median and slowest thousandth of a question asked alone; a question
of a batch of 200; and a question about a tetrahedron, which is hardly more than the call. The generated heart beats.
"""

NO_TIMES = """## Times

Not measured in these records: `cargo xtask peers --only times` on an idle computer adds them.
"""

NOT_COMPARABLE = """## What is not comparable

- DIBS refuses to guess: a side is undefined where both are nearer than its accuracy, or where the closest parts of a
  folded surface contradict each other. The others always name one; Drake refuses a whole frame with a knife edge.
- DIBS answers in single precision with an accuracy beside each answer; Open3D is single too, the others are double.
  Where a library states no accuracy, 64 units in the last place of its largest coordinate are taken.
- coal and Embree's rays answer a part of the question. coal has no inside of a mesh; a sphere that cuts a triangle is
  pushed back from that triangle alone.
- Drake and VTK are not made for meshes that deform: they build a new scene or search structure for each frame.
  libigl's `signed_distance` builds one in each call.
- DIBS needs a stretch limit, which was taken from all frames here, and says so when a frame exceeds it. The others
  need none.
- Capsules, several tools, contacts and a tracker's warm start are not asked for: few of the others have them.
- Times are of calls from Python. The time of a call on a tetrahedron says how much of it is the call. Rust peers,
  parry3d and obvhs, are in [benchmarks.md](benchmarks.md), without Python, on other poses: do not compare across pages.
- Embree has no wheel of its own for this Python; embreex has its rays, Open3D its point query.
"""


def write(known: dict[str, Any]) -> None:
    PAGE.write_text(page(known))


def page(known: dict[str, Any]) -> str:
    parts = [OPENING]
    if "answers" in known:
        parts += _answers(known["answers"])
    parts += _times(known["times"]) if "times" in known else [NO_TIMES]
    return "\n".join([*parts, NOT_COMPARABLE])


def _answers(run: dict[str, Any]) -> list[str]:
    subjects, libraries = run["subjects"], run["libraries"]
    meshes = [[*_mesh(each), *_undecided(run, each)] for each in subjects]
    columns = ["mesh", "what it does", "triangles", "frames", "points"]
    columns += ["on the surface", "in the band", "cut by itself"]
    return [
        "## Right and wrong\n",
        _facts(run),
        TRUTH,
        _table(columns, meshes),
        *(f"Skipped: {line}.\n" for line in run["skipped"]),
        COUNTS,
        _table(
            ["library", "version", "wrong sides", "farthest", "no side", "beyond 0.001 mm", "wrong in the band"]
            + ["wrong distances", "largest error", "accuracy stated", "inside", "bytes a triangle"],
            [_total(each) for each in libraries],
        ),
        "Wrong sides of a million, mesh by mesh, and in brackets points without a side, beyond 0.001 mm:\n",
        _table(
            ["library", *(each["name"] for each in subjects)],
            [[each["name"], *(_cell(each["scores"][mesh["name"]]) for mesh in subjects)] for each in libraries],
        ),
        *_refusals(libraries),
    ]


def _mesh(subject: dict[str, Any]) -> list[str]:
    counts = [f"{subject[name]:,}" for name in ("triangles", "frames", "points")]
    return [subject["name"], subject["says"], *counts]


def _undecided(run: dict[str, Any], subject: dict[str, Any]) -> list[str]:
    """Of any library: the truth is the same."""
    scores = [each["scores"][subject["name"]] for each in run["libraries"]]
    counts = next((each for each in scores if isinstance(each, dict)), None)
    return [f"{counts[name]:,}" if counts else "?" for name in ("on the surface", "in band", "cut by itself")]


def _total(library: dict[str, Any]) -> list[str]:
    counted = [each for each in library["scores"].values() if isinstance(each, dict)]
    if not counted:
        reason = next(iter(library["scores"].values()), "not asked")
        return [library["name"], library["version"], str(reason), *[""] * 9]
    total = added(counted)
    has_sides = total["no side"] < total["clear"]
    sides = [
        _rate(total["wrong sides"], total["clear"]),
        _length(total["farthest wrong side"]),
        _rate(total["no side"], total["clear"]),
        _rate(total["no side, not tiny"], total["clear"]),
        f"{total['wrong in band']:,} of {total['in band']:,}",
    ]
    distances = [_rate(total["wrong distances"], total["distances"]), _length(total["largest error"])]
    return [
        library["name"],
        library["version"],
        *(sides if has_sides else ["has no sides", "", "", "", ""]),
        *(distances if total["distances"] else ["has no distances", ""]),
        library["stated"],
        library["inside"],
        f"{library['bytes']:.0f}" if isinstance(library["bytes"], float) else library["bytes"],
    ]


def _cell(counts: Any) -> str:
    if isinstance(counts, str):
        return counts
    if counts["no side"] == counts["clear"]:
        return "–"
    count = counts["no side, not tiny"]
    none = f" ({_rate(count, counts['clear'])})" if count else ""
    return _rate(counts["wrong sides"], counts["clear"]) + none


def _refusals(libraries: list[dict[str, Any]]) -> list[str]:
    lines = []
    for each in libraries:
        for mesh, counts in each["scores"].items():
            refused = [counts] if isinstance(counts, str) else counts["refused"]
            lines += [f"- {each['name']}, {mesh}: {reason}" for reason in refused]
    return ["Refused:\n", "\n".join(lines) + "\n"] if lines else []


def _times(run: dict[str, Any]) -> list[str]:
    parts = [
        "## Times\n",
        _facts(run),
        TIMES,
    ]
    for number, size in enumerate(run["sizes"]):
        rows = [_time(each, each["sizes"][number]) for each in run["libraries"]]
        columns = ["library", "update", "its kind", "one", "slowest thousandth", "in a batch", "the call", "questions"]
        parts += [f"**{size:,} triangles**\n", _table(columns, rows)]
    return parts


def _time(library: dict[str, Any], of: Any) -> list[str]:
    if isinstance(of, str):
        return [library["name"], of, *[""] * 6]
    call = library["call"]
    return [
        library["name"],
        _micros(of["update"]),
        library["update"],
        _micros(of["one"]),
        _micros(of["slowest thousandth"]),
        _micros(of["batch"]),
        _micros(call["one"]) if isinstance(call, dict) else call,
        f"{of['questions']:,}",
    ]


def _facts(run: dict[str, Any]) -> str:
    rows = [[name, str(run[name])] for name in ("date", "commit", "machine", "python", "command")]
    return _table(["", ""], rows)


def _table(columns: list[str], rows: list[list[Any]]) -> str:
    lines = [columns, ["---"] * len(columns), *rows]
    return "".join(f"| {' | '.join(str(cell) for cell in line)} |\n" for line in lines)


def _rate(count: int, of: int) -> str:
    """Of a million, to a whole number; below one, to two digits."""
    rate = 1e6 * count / max(of, 1)
    return "0" if count == 0 else f"{rate:,.0f}" if rate >= 1 else f"{rate:.2g}"


def _length(value: float) -> str:
    return "–" if value == 0 else f"{value:.2g}"


def _micros(value: float | None) -> str:
    return "–" if value is None else f"{value:.3g}" if value < 1_000 else f"{value:,.0f}"
