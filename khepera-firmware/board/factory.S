/* What the file of a new base holds beside the program: the loader, and room for the image's header. */
    .section .loader, "a"
    .incbin LOADER_BINARY

    .section .image_header, "a"
    .fill 256, 1, 0xFF

    .section .note.GNU-stack, "", @progbits
