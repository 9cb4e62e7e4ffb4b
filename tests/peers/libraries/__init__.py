"""One file a library."""

NAMES = [
    "dibs",
    "coal",
    "drake",
    "embree",
    "igl_pseudonormal",
    "igl_winding",
    "igl_kept",
    "open3d",
    "trimesh",
    "vtk",
    "planted",
]
"""The modules, in the page's order. The last one is wrong on purpose."""
