#!/bin/sh
# Each header of the project compiles alone.
cd "$(dirname "$0")/../src" || exit 1
bad=0
for header in */*.h; do
    printf '#include "%s"\n' "$header" |
        ${CC:-cc} -std=c17 -D_POSIX_C_SOURCE=200809L -Wall -Wextra -Werror -I. -fsyntax-only -x c - || bad=1
done
exit $bad
