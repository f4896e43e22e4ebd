#!/usr/bin/env bash
# The pictures of man/gallery: the samples, and the papers' figures in the papers' three columns, from the scenes in data-samples/scenes
# with the settings that each one's comment tells. All but splash.png: mechanical mesh, geometric mesh, textured surface.
#   tests/gallery.sh build/release [OUT [NAME...]]     all pictures, or those named
set -eu
cd "$(dirname "$0")/.."
twinmesh=$(realpath "$1")/twinmesh
out=${2:-man/gallery}
[ $# -le 2 ] || only=" ${*:3} "
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
mkdir -p "$out"

wanted() { [ -z "${only:-}" ] || [[ $only == *" $1 "* ]]; }

# The meshes of frames first to last, as $scratch/NAME.
track() { # name, sequence, first-last, options of mesh...
    local name=$1 sequence=$2 frames=$3
    shift 3
    "$twinmesh" mesh "$sequence" --frames "$frames" --format ply --rest -o "$scratch/$name" --quiet "$@" 2>"$scratch/said" || { cat "$scratch/said"; return 1; }
}

columns() { # name, sequence, first-last: the last is pictured, options of mesh...
    local name=$1 last=${3#*-}
    wanted "$name" || return 0
    track "$@"
    "$twinmesh" render "$scratch/$name" --frames "$last-$last" --style papers --size 720x240 --samples 16 -o "$out/$name.png" --quiet
    echo "$out/$name.png"
}

scene() { # name, frame: with the edge and the angle that the scene's comment tells
    local file=data-samples/scenes/$1.json edge angle
    edge=$(grep -oE -m 1 -- '--edge [0-9.]+' "$file" || true)
    angle=$(grep -oE -m 1 -- '--angle [0-9.]+' "$file" || true)
    columns "$1" "$file" "1-$2" $edge $angle --deviation 0
}

if wanted splash; then
    track splash 'data-samples/splash/fluid.####.vdb' 18-26 --velocity velocity
    "$twinmesh" render "$scratch/splash" --frames 26-26 --size 720x360 --samples 16 -o "$out/splash.png" --quiet
    echo "$out/splash.png"
fi
columns splash-columns 'data-samples/splash/fluid.####.vdb' 18-24 --velocity velocity
columns smoke 'data-samples/smoke/density.####.vdb' 20-31
scene gi07-teaser 24
scene gi07-figure1 24
scene gi07-figure6-top 12
scene gi07-figure8 1
scene gi07-figure9b 16
scene gi07-figure9c 16
scene gi07-figure10 16
scene rr6128-figure1 16
scene rr6128-figure13b 24
scene rr6128-figure14-2 24
scene rr6128-figure14-4 24
