# Is a mesh of these distances no farther from the surface than one of those, and the surface from it? False where either was not measured.
def is_no_farther($from): . as $e
    | $e != null and $from != null
        and all(("to_surface", "from_surface") as $way | ("mean", "p95") as $f | [$e[$way][$f], $from[$way][$f]]; .[0] <= .[1]);
