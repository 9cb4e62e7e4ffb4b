/* The tree in flash: the bytes of `dibs build`, as they are. */
    .section .rodata.tree, "a"
    .balign 8
    .global tree_bytes
    .global tree_end
tree_bytes:
    .incbin "surface.dibs"
tree_end:
    .balign 4
