"""Closest points on a deforming mesh: build a tree once, ask while the surface moves.

    import dibs

    tree = dibs.build("heart.ply", stretch=1.5)
    answers = tree.query([[0, 0, 150, 5]])          # a sphere: x, y, z, radius
    answers = tree.query(capsules, surface=positions)
    answers["separation"], answers["point_on_surface"], answers["triangle"]

Lengths are in millimetres, in the coordinates of the mesh's file. Wrong values raise `ValueError`, wrong types
`TypeError`, each with one sentence; files and lines that fail raise `OSError`.
"""

from ._filter import AdmittedMotion, Filter, RigidMotion, Tracker, TrackerAnswer, Uncertainty
from ._guard import Answer, Guard, State
from ._mesh import Mesh, MeshWarning, Reading, build, generate, read
from ._motion import Motion, MotionStretch, read_motion
from ._stream import Sender, SentFrame, Totals
from ._tools import capsules, spheres
from ._tree import ANSWER, CONTACT, SIDE_REASONS, Contacts, Coverage, Scene, Side, Surface, Tree
from ._wall import EnergyAccount, ForbiddenRegion, Force, ForceState, Proxy, Wrench

__all__ = [
    "ANSWER",
    "CONTACT",
    "SIDE_REASONS",
    "AdmittedMotion",
    "Answer",
    "Contacts",
    "Coverage",
    "EnergyAccount",
    "Filter",
    "ForbiddenRegion",
    "Force",
    "ForceState",
    "Guard",
    "Mesh",
    "MeshWarning",
    "Motion",
    "MotionStretch",
    "Proxy",
    "Reading",
    "RigidMotion",
    "Scene",
    "Sender",
    "SentFrame",
    "Side",
    "State",
    "Surface",
    "Totals",
    "Tracker",
    "TrackerAnswer",
    "Tree",
    "Uncertainty",
    "Wrench",
    "build",
    "capsules",
    "generate",
    "read",
    "read_motion",
    "spheres",
]
