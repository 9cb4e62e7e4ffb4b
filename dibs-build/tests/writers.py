"""Writes one mesh by every program that is installed, in the dialects that they have, for `own/writers.rs`.

    python writers.py FOLDER

A line of JSON on standard output for each file: its name, the program, its points and triangles as the program had them,
and the labels of the triangles where it wrote some; or the name of a program that is not installed.
"""

import importlib.metadata
import json
import os
import subprocess
import sys

POINTS = [[10.5, 0, 0.25], [-10, 0, 0], [0, 20, -0.125], [0, -20, 0], [0, 0, 30], [0.125, 0, -31]]
TRIANGLES = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
LABELS = [3, 3, 3, 7, 7, 0, 0, 255]
# Four tetrahedra around the axis from point 4 to point 5 have these triangles as their skin.
TETRAHEDRA = [[0, 2, 4, 5], [2, 1, 4, 5], [1, 3, 4, 5], [3, 0, 4, 5]]

# Programs print on standard output, too: what they say goes to standard error.
OUT = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)


def line(value):
    print(json.dumps(value), file=OUT, flush=True)


def say(file, writer, points=POINTS, triangles=TRIANGLES, labels=None):
    points = [[float(x) for x in point] for point in points]
    triangles = [[int(corner) for corner in triangle] for triangle in triangles]
    line({"file": file, "writer": writer, "points": points, "triangles": triangles, "labels": labels})


def by_vtk(vtk):
    points = vtk.vtkPoints()
    for point in POINTS:
        points.InsertNextPoint(point)

    def cells(all):
        array = vtk.vtkCellArray()
        for cell in all:
            array.InsertNextCell(len(cell), cell)
        return array

    def labelled(data, labels, kind):
        name = vtk.vtkStringArray()
        name.SetName("name of the part")
        flag = vtk.vtkBitArray()
        flag.SetName("flag")
        array = kind()
        array.SetName("label")
        for label in labels:
            name.InsertNextValue("part\n%d" % label if label else "")
            flag.InsertNextValue(label % 2)
            array.InsertNextValue(label)
        space = vtk.vtkStringArray()
        space.SetName("SPACE")
        space.InsertNextValue("LPS" + " long" * 50)
        data.GetFieldData().AddArray(space)
        for one in (name, flag, array):
            data.GetCellData().AddArray(one)
        return data

    def poly(kind=vtk.vtkIntArray):
        data = vtk.vtkPolyData()
        data.SetPoints(points)
        data.SetPolys(cells(TRIANGLES))
        return labelled(data, LABELS, kind)

    def grid(types, all, labels):
        data = vtk.vtkUnstructuredGrid()
        data.SetPoints(points)
        data.SetCells(types, cells(all))
        return labelled(data, labels, vtk.vtkIntArray)

    solid = grid([vtk.VTK_TETRA] * 4, TETRAHEDRA, [1, 2, 3, 4])
    both = grid([vtk.VTK_TETRA] * 4 + [vtk.VTK_TRIANGLE] * 8, TETRAHEDRA + TRIANGLES, [9] * 4 + LABELS)
    version = "vtk " + vtk.vtkVersion.GetVTKVersion()

    def write(writer, name, data, labels=LABELS):
        writer.SetFileName(name)
        writer.SetInputData(data)
        writer.Write()
        say(name, version, labels=labels)

    for number in (42, 51):
        for binary in (False, True):
            what = "%d_%s" % (number, "binary" if binary else "ascii")
            for kind, data in (("ints", poly()), ("ids", poly(vtk.vtkIdTypeArray)), ("floats", poly(vtk.vtkFloatArray))):
                writer = vtk.vtkPolyDataWriter()
                writer.SetFileVersion(number)
                writer.SetFileType(vtk.VTK_BINARY if binary else vtk.VTK_ASCII)
                write(writer, "vtk_%s_%s.vtk" % (what, kind), data)
            for kind, data, labels in (("solid", solid, None), ("both", both, LABELS)):
                writer = vtk.vtkUnstructuredGridWriter()
                writer.SetFileVersion(number)
                writer.SetFileType(vtk.VTK_BINARY if binary else vtk.VTK_ASCII)
                write(writer, "vtk_%s_%s.vtk" % (what, kind), data, labels)
    for mode in ("Ascii", "Binary", "Appended"):
        for compressor in ("None", "ZLib"):
            for header in ("UInt32", "UInt64"):
                for order in ("Little", "Big"):
                    what = "_".join(("vtk", mode, compressor, header, order))
                    for kind, new, data, labels in (
                        (".vtp", vtk.vtkXMLPolyDataWriter, poly(), LABELS),
                        ("_solid.vtu", vtk.vtkXMLUnstructuredGridWriter, solid, None),
                        ("_both.vtu", vtk.vtkXMLUnstructuredGridWriter, both, LABELS),
                    ):
                        writer = new()
                        getattr(writer, "SetDataModeTo" + mode)()
                        getattr(writer, "SetCompressorTypeTo" + compressor)()
                        getattr(writer, "SetHeaderTypeTo" + header)()
                        getattr(writer, "SetByteOrderTo" + order + "Endian")()
                        writer.SetEncodeAppendedData(header == "UInt32")
                        write(writer, what + kind, data, labels)
    plain = vtk.vtkPolyData()
    plain.SetPoints(points)
    plain.SetPolys(cells(TRIANGLES))
    stripper = vtk.vtkStripper()
    stripper.SetInputData(plain)
    stripper.Update()
    for name, new in (("vtk_strips.vtk", vtk.vtkPolyDataWriter), ("vtk_strips.vtp", vtk.vtkXMLPolyDataWriter)):
        write(new(), name, stripper.GetOutput(), None)
    for binary in (1, 2):
        for name, new in (("ply", vtk.vtkPLYWriter), ("stl", vtk.vtkSTLWriter)):
            writer = new()
            writer.SetFileType(binary)
            write(writer, "vtk_%d.%s" % (binary, name), plain, None)
    writer = vtk.vtkPLYWriter()
    writer.SetDataByteOrderToBigEndian()
    write(writer, "vtk_big.ply", plain, None)
    write(vtk.vtkOBJWriter(), "vtk.obj", plain, None)


def by_gmsh(gmsh):
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    version = "gmsh " + gmsh.option.getString("General.Version")
    box = gmsh.model.occ.addBox(-1, -2, -3, 2, 4, 6)
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMin", 2)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 2)
    gmsh.model.mesh.generate(3)
    tags, points, _ = gmsh.model.mesh.getNodes()
    place = {tag: points[3 * row : 3 * row + 3].tolist() for row, tag in enumerate(tags)}
    tags = sorted(place)
    row = {tag: number for number, tag in enumerate(tags)}
    _, nodes = gmsh.model.mesh.getElementsByType(2)
    triangles = [[row[node] for node in nodes[3 * n : 3 * n + 3]] for n in range(len(nodes) // 3)]
    everything = ("", [place[tag] for tag in tags], triangles, None)
    for solid in (False, True):
        if solid:
            # Of a file with a physical volume alone, the surface is its skin.
            gmsh.model.addPhysicalGroup(3, [box], 5, "solid")
        name, points, triangles, labels = everything
        labels = [5] * len(triangles) if solid else None
        for number in (1, 2.2, 4.1):
            for binary in (0, 1):
                for parametric in (0, 1):
                    if number == 1 and binary:
                        continue
                    gmsh.option.setNumber("Mesh.MshFileVersion", number)
                    gmsh.option.setNumber("Mesh.Binary", binary)
                    gmsh.option.setNumber("Mesh.SaveParametric", parametric)
                    name = "gmsh_%s_%d%d%d.msh" % (number, solid, binary, parametric)
                    gmsh.write(name)
                    say(name, version, points, triangles, labels)
    for extension in ("vtk", "stl", "off", "ply2", "obj"):
        if extension == "ply2":
            continue
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.option.setNumber("Mesh.SaveParametric", 0)
        for binary in (0, 1):
            gmsh.option.setNumber("Mesh.Binary", binary)
            name = "gmsh_%d.%s" % (binary, extension)
            gmsh.write(name)
            say(name, version, points, triangles)
    gmsh.finalize()


def by_meshio(meshio):
    version = "meshio " + meshio.__version__
    for kind, cells in (("", [("triangle", TRIANGLES)]), ("_solid", [("tetra", TETRAHEDRA)])):
        mesh = meshio.Mesh(POINTS, cells)
        for name, format, options in (
            ("vtk42.vtk", "vtk42", {"binary": True}),
            ("vtk42_ascii.vtk", "vtk42", {"binary": False}),
            ("vtk51.vtk", "vtk51", {"binary": True}),
            ("vtk51_ascii.vtk", "vtk51", {"binary": False}),
            ("zlib.vtu", "vtu", {}),
            ("plain.vtu", "vtu", {"compression": None}),
            ("ascii.vtu", "vtu", {"binary": False}),
            ("22.msh", "gmsh22", {"binary": True}),
            ("22_ascii.msh", "gmsh22", {"binary": False}),
            ("41.msh", "gmsh", {"binary": True}),
            ("41_ascii.msh", "gmsh", {"binary": False}),
            ("binary.ply", "ply", {"binary": True}),
            ("ascii.ply", "ply", {"binary": False}),
            ("binary.stl", "stl", {"binary": True}),
            ("ascii.stl", "stl", {"binary": False}),
            ("a.obj", "obj", {}),
            ("a.off", "off", {}),
        ):
            if kind and not name.endswith(("vtk", "vtu", "msh")):
                continue
            name = "meshio%s_%s" % (kind, name)
            meshio.write(name, mesh, file_format=format, **options)
            say(name, version)


def by_trimesh(trimesh):
    mesh = trimesh.Trimesh(POINTS, TRIANGLES, process=False)
    version = "trimesh " + trimesh.__version__
    for name, options in (
        ("a.glb", {}),
        ("a.ply", {}),
        ("ascii.ply", {"encoding": "ascii"}),
        ("a.stl", {}),
        ("ascii.stl", {"file_type": "stl_ascii"}),
        ("a.obj", {}),
        ("a.off", {}),
        ("a.3mf", {}),
    ):
        name = "trimesh_" + name
        try:
            mesh.export(name, **options)
        except ImportError as error:
            # Raised again without its name.
            missing = error.name or str(error).removeprefix("No module named ").strip("'")
            line({"absent": "%s (for %s)" % (missing, name)})
            continue
        say(name, version)
    scene = trimesh.Scene()
    for at in range(2):
        scene.add_geometry(mesh, transform=trimesh.transformations.translation_matrix([100 * at, 0, 0]))
    os.mkdir("trimesh scene")
    both = POINTS + [[x + 100, y, z] for x, y, z in POINTS]
    triangles = TRIANGLES + [[corner + 6 for corner in triangle] for triangle in TRIANGLES]
    scene.export("trimesh scene/two parts.gltf")
    say("trimesh scene/two parts.gltf", version, both, triangles)
    scene.export("trimesh_two.glb")
    say("trimesh_two.glb", version, both, triangles)


def by_pymeshlab(pymeshlab):
    import numpy

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(numpy.array(POINTS), numpy.array(TRIANGLES)))
    version = "pymeshlab " + importlib.metadata.version("pymeshlab")
    for name, options in (
        ("binary.ply", {"binary": True}),
        ("ascii.ply", {"binary": False}),
        ("binary.stl", {"binary": True}),
        ("ascii.stl", {"binary": False}),
        ("a.obj", {}),
        ("a.off", {}),
        ("a.gltf", {}),
        ("a.glb", {}),
        ("a.3mf", {}),
    ):
        name = "pymeshlab_" + name
        try:
            meshes.save_current_mesh(name, **options)
        except pymeshlab.PyMeshLabException:
            # It has no writer of this format.
            continue
        say(name, version)


def by_bpy(bpy):
    version = "Blender " + bpy.app.version_string
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("left ventricle")
    mesh.from_pydata(POINTS, [], TRIANGLES)
    heart = bpy.data.objects.new("left ventricle", mesh)
    bpy.context.collection.objects.link(heart)
    bpy.context.view_layer.objects.active = heart
    heart.select_set(True)
    axes = {"forward_axis": "Y", "up_axis": "Z"}
    for ascii in (False, True):
        name = "blender_%d.ply" % ascii
        bpy.ops.wm.ply_export(filepath=os.path.abspath(name), ascii_format=ascii, **axes)
        say(name, version)
        name = "blender_%d.stl" % ascii
        bpy.ops.wm.stl_export(filepath=os.path.abspath(name), ascii_format=ascii, **axes)
        say(name, version)
    bpy.ops.wm.obj_export(filepath=os.path.abspath("blender.obj"), **axes)
    say("blender.obj", version)
    gltf = {"export_yup": False, "export_normals": False}

    def export(name, points=POINTS):
        format = "GLB" if name.endswith("glb") else "GLTF_SEPARATE"
        bpy.ops.export_scene.gltf(filepath=os.path.abspath(name), export_format=format, **gltf)
        say(name, version, points)

    export("blender heart.gltf")
    export("blender.glb")
    # A shape that half-way moves the last point down, and an object that is moved, turned over and scaled.
    heart.shape_key_add(name="Basis")
    heart.shape_key_add(name="filled").data[5].co.z -= 4
    mesh.shape_keys.key_blocks["filled"].value = 0.5
    moved = POINTS[:5] + [[0.125, 0, -33]]
    export("blender morphed.gltf", moved)
    heart.location = (100, 0, 0)
    heart.scale = (2, 2, 2)
    export("blender placed.glb", [[2 * x + 100, 2 * y, 2 * z] for x, y, z in moved])
    # An armature whose one bone was moved after binding.
    heart.location = (0, 0, 0)
    heart.scale = (1, 1, 1)
    heart.shape_key_clear()
    bones = bpy.data.objects.new("bones", bpy.data.armatures.new("bones"))
    bpy.context.collection.objects.link(bones)
    bpy.context.view_layer.objects.active = bones
    bpy.ops.object.mode_set(mode="EDIT")
    bone = bones.data.edit_bones.new("bone")
    bone.head, bone.tail = (0, 0, 0), (0, 0, 1)
    bpy.ops.object.mode_set(mode="POSE")
    bones.pose.bones["bone"].location = (0, 8, 0)
    bpy.ops.object.mode_set(mode="OBJECT")
    heart.vertex_groups.new(name="bone").add(range(len(POINTS)), 1, "REPLACE")
    heart.parent = bones
    heart.modifiers.new("bones", "ARMATURE").object = bones
    # Along the bone.
    posed = [[x, y, z + 8] for x, y, z in POINTS]
    gltf["export_rest_position_armature"] = False
    gltf["export_current_frame"] = True
    export("blender posed.glb", posed)


PROGRAMS = {"vtk": by_vtk, "gmsh": by_gmsh, "meshio": by_meshio, "trimesh": by_trimesh, "pymeshlab": by_pymeshlab, "bpy": by_bpy}


def main():
    if len(sys.argv) == 2:
        # Each by itself: their libraries do not stand one another.
        runs = [subprocess.run([sys.executable, __file__, sys.argv[1], name], stdout=OUT) for name in PROGRAMS]
        sys.exit(max(abs(run.returncode) for run in runs))
    os.chdir(sys.argv[1])
    name = sys.argv[2]
    try:
        module = importlib.import_module(name)
    except ImportError:
        line({"absent": name})
    else:
        PROGRAMS[name](module)


main()
