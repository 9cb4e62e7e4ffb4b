/* The tree in flash: the unchanged bytes of `dibs build`. */
    .section .rodata.tree, "a"
    .balign 8
    .global tree_bytes
    .global tree_end
tree_bytes:
    .incbin "surface.dibs"
tree_end:
    .balign 4
