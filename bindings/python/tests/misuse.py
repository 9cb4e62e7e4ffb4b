"""Calls that a type checker must refuse. Read by it and never run: where it finds nothing wrong with such a line, it says that
the line's `type: ignore` is not needed, and fails."""

import dibs

mesh = dibs.read("heart.ply")
tree = dibs.build(mesh, stretch=1.5)

dibs.build(mesh, streach=1.5)  # type: ignore[call-arg]
dibs.build("heart.ply", stretch="1.5")  # type: ignore[arg-type]
dibs.read("heart.ply", units="mm")  # type: ignore[call-arg]
dibs.Mesh(mesh.vertices, mesh.triangles, wield=0.1)  # type: ignore[call-arg]
tree.query([0, 0, 150, 5], mesh)  # type: ignore[arg-type]
tree.query([0, 0, 150, 5], budgets=1_000)  # type: ignore[call-arg]
tree.contacts([0, 0, 150, 5])  # type: ignore[call-arg]
dibs.Scene([mesh])  # type: ignore[list-item]
dibs.Guard(tree, speed_mm_per_s=300)  # type: ignore[call-arg]
dibs.Guard(tree, speed_mm_per_s=300, age_ms=80, automatik=True)  # type: ignore[call-arg]
dibs.Tracker(mesh)  # type: ignore[arg-type]
dibs.Filter(tree, 1.0, 300.0, aproach=0.01)  # type: ignore[call-arg]
dibs.ForbiddenRegion(stiffness=1.0, damping=0.002, max_force=5.0)  # type: ignore[call-arg]
dibs.Sender(tree, "udp:localhost:9000", units="m")  # type: ignore[call-arg]
dibs.Proxy(stiffness=1.0, damping=0.002, max_force=5.0)  # type: ignore[call-arg]
dibs.EnergyAccount(1.0, 0.5, stifness=1.0, max_force=5.0, speed=300.0)  # type: ignore[call-arg]
dibs.Uncertainty(100.0, registration=0.5)  # type: ignore[call-arg]
