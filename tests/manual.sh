#!/usr/bin/env bash
# The manual pages: no complaint from mandoc, and every option with the default the program really has.
cd "$(dirname "$0")/.." || exit 1
bad=0
mandoc -Tlint -W warning man/*.[17] || bad=1

# The paragraph of an option on the page at hand.
entry() { sed -n "/^ *\(-., \)\?$1\( \|\$\)/,/^\$/p" <<<"$page" | tr -s ' \n' ' '; }

for command in mesh info; do
    file=man/twinmesh-$command.1
    page=$(mandoc -Tascii -O width=200 $file | sed 's/.\x08//g')
    help=$("${TWINMESH:-build/release/twinmesh}" $command --help) || exit 1
    # Every --option of the help stands in the manual, with its default, and the other way about.
    while read -r option; do
        grep -qE "(^| )$option([ =,]|\$)" <<<"$page" || { echo "$file: $option is missing"; bad=1; }
    done < <(grep -oE '^ +(-., )?--[a-z-]+' <<<"$help" | grep -oE -- '--[a-z-]+')
    while read -r option; do
        grep -qE -- "$option( |\$)" <<<"$help" || { echo "$file: $option is no option of the program"; bad=1; }
    done < <(grep -oE '^ +(-., )?--[a-z-]+' <<<"$page" | grep -oE -- '--[a-z-]+' | sort -u)
    # The paragraph of each option also says its default and its range.
    while IFS='|' read -r option range default; do
        text=$(entry "$option")
        if [ -n "$default" ]; then
            grep -qiF "default $default" <<<"$text" || { echo "$file: $option: its default is $default, which the page does not say"; bad=1; }
        fi
        if [[ $range == *" to "* ]]; then
            grep -qF "${range//e+/e}" <<<"$text" || { echo "$file: $option: its range is $range, which the page does not say"; bad=1; }
        fi
    done < <(sed -nE 's/^ +(-., )?(--[a-z-]+).*\(([^();]+)(; default ([^()]+))?\)$/\2|\3|\5/p' <<<"$help")
done
exit $bad
