"""What one run records beside its counts."""

from __future__ import annotations

import datetime
import importlib
import json
import os
import pathlib
import platform
import subprocess
from importlib import metadata
from typing import Any

ROOT = pathlib.Path(__file__).resolve().parents[2]
RECORDS = ROOT / "docs/evidence/peers.json"


def facts(command: str) -> dict[str, Any]:
    """Of this run."""
    commit = ["git", "-C", str(ROOT), "rev-parse", "--short=12", "HEAD"]
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "commit": subprocess.run(commit, capture_output=True, text=True, check=False).stdout.strip(),
        "machine": f"{_processor()}, {os.cpu_count()} cores, {platform.system().lower()}",
        "python": platform.python_version(),
        "command": command,
    }


def about(library: str) -> dict[str, Any]:
    """The library's words for the page, and its version. Where it cannot be loaded, its module's name."""
    try:
        peer = importlib.import_module(f"libraries.{library}").Peer
    except ImportError:
        return {"name": library, "version": "not installed", "stated": "", "update": "", "inside": ""}
    words = {"name": peer.name, "stated": peer.stated, "update": peer.update_by, "inside": peer.inside}
    return {**words, "version": _version(peer.package)}


def load() -> dict[str, Any]:
    """The records of earlier runs: one that measures a part keeps the other part."""
    return json.loads(RECORDS.read_text()) if RECORDS.exists() else {}


def save(records: dict[str, Any]) -> None:
    RECORDS.write_text(json.dumps(records, indent=1, sort_keys=True) + "\n")


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "of the commit"


def _processor() -> str:
    lines = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()
