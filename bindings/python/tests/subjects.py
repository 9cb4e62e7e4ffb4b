"""What the tests ask about, and where the program is that they compare with."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

import dibs

ROOT = pathlib.Path(__file__).resolve().parents[3]
PROGRAM = pathlib.Path(os.environ.get("DIBS_PROGRAM", ROOT / "target/release/dibs"))

HEART, BEAT = dibs.generate("heart", 1_000)
TREE = dibs.build(HEART, stretch=1.5)

# A second heart beside it, whose coordinates count from a point of its own.
ASIDE = np.array([130.0, 20.0, -5.0])
OTHER = dibs.build(dibs.Mesh(HEART.vertices + ASIDE, HEART.triangles, origin=ASIDE))


def poses(count, seed=1):
    """Points in and around the heart."""
    random = np.random.default_rng(seed)
    low, high = HEART.vertices.min(axis=0), HEART.vertices.max(axis=0)
    return random.uniform(low - 40, high + 40, (count, 3))


def spheres(count, seed=1):
    return dibs.spheres(poses(count, seed), np.random.default_rng(seed).uniform(0, 5, count))


def capsules(count, seed=2):
    starts = poses(count, seed)
    ways = np.random.default_rng(seed).normal(0, 30, (count, 3))
    return dibs.capsules(starts, starts + ways, 2.5)


def chains(count, tools, seed=4):
    """Capsules in a row, each from the end of the one before."""
    ways = np.random.default_rng(seed).normal(0, 20, (count, tools, 3))
    joints = np.concatenate([poses(count, seed)[:, np.newaxis], ways], axis=1).cumsum(axis=1)
    chain = dibs.capsules(joints[:, :-1].reshape(-1, 3), joints[:, 1:].reshape(-1, 3), 2.5)
    return chain.reshape(count, tools, 7)


class WithProgram(unittest.TestCase):
    """Tests that compare with `dibs`."""

    def setUp(self):
        if not PROGRAM.exists():
            self.skipTest(f"{PROGRAM} is not built: cargo build --release --workspace --bins")
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        TREE.save(self.folder / "heart.dibs")

    def dibs(self, *arguments):
        run = [PROGRAM, *arguments]
        done = subprocess.run(run, cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def lines(self, *arguments):
        return [json.loads(line) for line in self.dibs(*arguments).splitlines()]
