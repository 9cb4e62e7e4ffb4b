"""VTK's implicit distance."""

from __future__ import annotations

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_ID_TYPE, vtkDoubleArray, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

from library import Answers, Library, signed
from shapes import Points, Triangles


class Peer(Library):
    name = "VTK, `vtkImplicitPolyDataDistance`"
    package = "vtk"
    update_by = "rebuild"
    inside = "negative by the depth; sign of the pseudonormal"

    def __init__(self, triangles: Triangles, frames: Points) -> None:
        self.cells = vtkCellArray()
        self.cells.SetData(3, numpy_to_vtk(triangles.ravel(), deep=True, array_type=VTK_ID_TYPE))
        self.update(frames[0])

    def update(self, positions: Points) -> None:
        points = vtkPoints()
        points.SetDataTypeToDouble()
        points.SetData(numpy_to_vtk(np.ascontiguousarray(positions), deep=True))
        surface = vtkPolyData()
        surface.SetPoints(points)
        surface.SetPolys(self.cells)
        self.function = vtkImplicitPolyDataDistance()
        self.function.SetInput(surface)
        # It builds its search structure at the first question.
        self.function.FunctionValue(0.0, 0.0, 0.0)

    def batch(self, points: Points) -> Answers:
        found = vtkDoubleArray()
        self.function.FunctionValue(numpy_to_vtk(np.ascontiguousarray(points)), found)
        return signed(vtk_to_numpy(found))

    def one(self, point: Points) -> None:
        self.function.FunctionValue(point)
