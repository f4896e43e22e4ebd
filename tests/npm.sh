# Sourced by tests that need a package of npm's: node, and the packages of HERE/package-lock.json under TOOL, installed once.
#   npm_packages HERE TOOL WHAT   ends the test with 77, saying that WHAT, where npm cannot be reached; with 1 where it fails

npm_skip() { # why, what
    echo "SKIPPED: npm cannot be reached ($1): $2"
    exit 77
}

npm_packages() {
    local here=$1 tool=$2 what=$3
    command -v node >/dev/null || npm_skip 'node is not installed' "$what"
    mkdir -p "$tool"
    if [ -d "$tool/node_modules" ] && cmp -s "$here/package-lock.json" "$tool/package-lock.json"; then return 0; fi
    command -v npm >/dev/null || npm_skip 'npm is not installed' "$what"
    cp "$here/package.json" "$here/package-lock.json" "$tool"
    if (cd "$tool" && timeout 300 npm ci --no-audit --no-fund) >"$tool/npm.log" 2>&1; then return 0; fi
    rm -rf "$tool/node_modules" "$tool/package-lock.json"
    grep -qE 'ENOTFOUND|EAI_AGAIN|ETIMEDOUT|ECONN|ENETUNREACH|EHOSTUNREACH|ERR_SOCKET|E40[37]|E5[0-9][0-9]|ENOTCACHED' \
        "$tool/npm.log" && npm_skip 'its registry does not answer' "$what"
    [ -s "$tool/npm.log" ] || npm_skip 'its registry does not answer in time' "$what"
    cat "$tool/npm.log"
    exit 1
}
