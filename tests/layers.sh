#!/bin/sh -e
# Holds every include under src/ to the graph in src/LAYERS: a module, then the modules it may include, each of
# which must be listed above it. A header named *_priv.h is its own module's only.
cd "$(dirname "$0")/../src"
find . -name '*.[ch]' -o -name '*.cpp' -o -name '*.def' | sed 's|^\./||' | sort | xargs awk '
    FILENAME == "LAYERS" {
        if (NF == 0) next
        listed[$1] = 1
        may[$1, $1] = 1
        for (i = 2; i <= NF; i++) {
            may[$1, $i] = 1
            if (!($i in listed)) { print "LAYERS:" FNR ": " $i " must stand above " $1; bad = 1 }
        }
        next
    }
    FNR == 1 {
        split(FILENAME, part, "/")
        module = part[1]
        if (!(module in listed)) { print FILENAME ": the module " module " is not in LAYERS"; bad = 1 }
    }
    /^[ \t]*#[ \t]*include[ \t]*"/ {
        split($0, quoted, "\"")
        if (split(quoted[2], to, "/") < 2) { print FILENAME ":" FNR ": \"" quoted[2] "\" is not relative to src"; bad = 1; next }
        if (!((module, to[1]) in may)) { print FILENAME ":" FNR ": " module " may not include " quoted[2]; bad = 1 }
        if (quoted[2] ~ /_priv\.h$/ && to[1] != module) { print FILENAME ":" FNR ": " quoted[2] " is private to " to[1]; bad = 1 }
    }
    END { exit bad }
' LAYERS
