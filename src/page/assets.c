#include "page/page_priv.h"

/* The Makefile says where the files are; the viewer is empty where it could not be bundled. */
#define ASSET(name, ...)                                                                                     \
    __asm__(".section .rodata\n.global asset_" #name "\n.type asset_" #name ", @object\nasset_" #name ":\n"  \
            __VA_ARGS__ ".byte 0\n.size asset_" #name ", . - asset_" #name "\n.text\n")
#define FILE_BYTES(path) ".incbin \"" path "\"\n"

ASSET(html, FILE_BYTES("src/page/page.html"));
ASSET(css, FILE_BYTES("src/page/page.css"));
ASSET(script, FILE_BYTES("src/page/run.js") FILE_BYTES("src/page/cursor.js") FILE_BYTES("src/page/plots.js")
          FILE_BYTES("src/page/timeline.js") FILE_BYTES("src/page/meshes.js") FILE_BYTES("src/page/player.js")
          FILE_BYTES("src/page/page.js"));
ASSET(viewer, FILE_BYTES(PAGE_VIEWER));
