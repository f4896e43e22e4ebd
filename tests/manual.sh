#!/usr/bin/env bash
# The manual pages: no complaint from mandoc, and every option with the default the program really has.
cd "$(dirname "$0")/.." || exit 1
bad=0
mandoc -Tlint -W warning man/*.[157] || bad=1

check_command() { # mesh, field, ...
    local page help command=$1
    page=$(mandoc -Tascii -O width=200 man/twinmesh-$command.1 | sed 's/.\x08//g')
    help=$("${TWINMESH:-build/release/twinmesh}" "$command" --help) || { bad=1; return; }
    # Every --option of the help stands in the manual, with its default, and the other way about.
    while read -r option; do
        grep -qE "(^| )$option([ =,]|\$)" <<<"$page" || { echo "man/twinmesh-$command.1: $option is missing"; bad=1; }
    done < <(grep -oE '^ +(-., )?--[a-z-]+' <<<"$help" | grep -oE -- '--[a-z-]+')
    while read -r option; do
        grep -qE -- "$option( |\$)" <<<"$help" || { echo "man/twinmesh-$command.1: $option is no option of the program"; bad=1; }
    done < <(grep -oE '^ +(-., )?--[a-z-]+' <<<"$page" | grep -oE -- '--[a-z-]+' | sort -u)
    # The paragraph of each option also says its default and its range.
    entry() { sed -n "/^ *\(-., \)\?$1\( \|\$\)/,/^\$/p" <<<"$page" | tr -s ' \n' ' '; }
    while IFS='|' read -r option range default; do
        text=$(entry "$option")
        if [ -n "$default" ]; then
            grep -qiF "default $default" <<<"$text" || { echo "man/twinmesh-$command.1: $option: its default is $default, which the page does not say"; bad=1; }
        fi
        if [[ $range == *" to "* ]]; then
            grep -qF -- "${range//e+/e}" <<<"$text" || { echo "man/twinmesh-$command.1: $option: its range is $range, which the page does not say"; bad=1; }
        fi
    done < <(sed -nE 's/^ +(-., )?(--[a-z-]+).*\(([^();]+)(; default ([^()]+))?\)$/\2|\3|\5/p' <<<"$help")
}
check_command mesh
check_command skin
check_command field
check_command render
check_command info
check_command farm
check_command check
check_command diff
check_command report
# Every figure of check.
page=$(mandoc -Tascii -O width=200 man/twinmesh-check.1 | sed 's/.\x08//g')
while read -r figure; do
    grep -qE "^ +$figure( |\$)" <<<"$page" || { echo "man/twinmesh-check.1: the figure $figure is missing"; bad=1; }
done < <(sed -nE 's/^FIGURE\([A-Z0-9_]+, "([a-z0-9_]+)".*/\1/p' src/check/figures.def)
exit $bad
