/* The surface: its tree in flash, its buffers and its limits. */
#ifndef SURFACE_H
#define SURFACE_H

#include <dibs.h>

/* Vertices of the tree: `dibs inspect --json`. */
#ifndef SURFACE_VERTICES
#error "-DSURFACE_VERTICES=N: the vertices of surface.dibs"
#endif

/* Validates the tree, and makes the buffers. */
void surface_init(void);

/* The tree. */
dibs_tree *surface_tree(void);

/* The buffers: the bus fills one, and the control tick reads the other two. */
dibs_surface *surface_buffers(void);

/* Limits of the trust in the surface, for both of its ends. */
const dibs_guard_limits *surface_limits(void);

/* Centre of the rest shape's bounding box, in mm. */
dibs_vec3 surface_centre(void);

/* Half the longest side of that box, in mm. */
float surface_reach(void);

#endif
