#!/usr/bin/env bash
# What a stage costs that a scene does not need: instructions of a step of 216 bodies, in stacks or
# flying in line, beside those of a twin that moves alike but makes the stage work. Both are the
# same program; what a run costs up to its fifth step is taken off. Instructions come from
# callgrind, so the figures do not depend on what else the machine does.
#   left_out.sh [STEPS]   default 20. Environment: SODA (default build/release/soda)
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
steps=${1:-20}
settled=5
soda=${SODA:-$root/build/release/soda}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

box='{"type": "box", "size_m": [1, 1, 1]}'
ball='{"type": "sphere", "radius_m": 0.5}'
# A sphere to the eye, but for the program a capsule like any other.
capsule='{"type": "capsule", "radius_m": 0.49995, "length_m": 0.0001}'
sweeps=', "solver": {"direct": false, "rest": false}'
far=', "bodies": [{"id": 9000, "shape": {"type": "sphere", "radius_m": 0.5}, "mass_kg": 1,
    "material": "stuff", "position_m": [500, 0, 50]}]'
joint=', "joints": [{"id": 0, "type": "ball", "body": 9000, "anchor_m": [500, 0, 51]}]'

scene() { # file, shape, gravity, friction, distances along x and z, more keys, velocity
  cat > "$folder/$1.json" <<END
{"format": 1, "gravity_m_s2": [0, 0, $3], "time_step_s": 0.01, "steps": $((steps + settled)),
  "materials": [{"name": "stuff", "friction": $4, "restitution": 0}],
  "generators": [{"type": "grid", "first_id": 0, "shape": $2, "density_kg_m3": 1000,
    "material": "stuff", "count": [6, 6, 6], "spacing_m": [$5, 2, $6], "position_m": [0, 0, 0.5],
    "velocity_m_s": [${8:-0}, 0, 0]}],
  "statics": [{"name": "floor", "shape": {"type": "halfspace"}, "material": "stuff"}]${7:-}}
END
}

instructions() { # file, steps
  valgrind --tool=callgrind --callgrind-out-file=/dev/null "$soda" run "$folder/$1.json" --quiet \
    --executor sequential --worlds 1 --steps "$2" 2>&1 >"$folder/out" |
    sed -n 's/^.*Collected : //p'
}

per_step() { # file
  echo $((($(instructions "$1" $((steps + settled))) - $(instructions "$1" $settled)) / steps))
}

named() { # file, what the plan must say; exit 1 if it does not
  "$soda" plan "$folder/$1.json" | sed 's/  */ /g' | grep -F "$2" >/dev/null ||
    { echo "soda plan does not say: $2" >&2; exit 1; }
}

compare() { # title, scene without, scene with
  local without with
  without=$(per_step "$2")
  with=$(per_step "$3")
  awk -v t="$1" -v a="$without" -v b="$with" \
    'BEGIN { printf "| %s | %d | %d | %.2f |\n", t, a, b, b / a }'
}

# Thirty-six stacks of six boxes, which are at rest from the second step on; in the twin they are
# solved all the same. Then by sweeps (Newton's method has three unknowns a point either way); with
# friction too small to be felt, its rows are there.
scene resting "$box" -9.81 0.5 2 1
scene solved "$box" -9.81 0.5 2 1 ', "solver": {"rest": false}'
scene smooth "$box" -9.81 0 2 1 "$sweeps"
scene rough "$box" -9.81 1e-100 2 1 "$sweeps"
# Boxes in flight; in the twin six in a row, with gaps within the contact margin.
scene apart "$box" 0 0.5 2 2 "" 3
scene side-by-side "$box" 0 0.5 1.005 2 "" 3
# Balls in rows, and the same for the program of capsules.
scene balls "$ball" 0 0.5 1.005 2 "" 3
scene capsules "$capsule" 0 0.5 1.005 2 "" 3
# The stacks and one more body, far away; in the twin it hangs on a joint.
scene free "$box" -9.81 0.5 2 1 "$far"
scene jointed "$box" -9.81 0.5 2 1 "$far$joint"

named resting "contacts of bodies at rest yes"
named solved "contacts of bodies at rest no switched off"
named smooth "friction rows no no pair of materials has friction > 0"
named rough "friction rows yes"
named balls "core kernel no no such pair of shapes"
named balls "box-box kernel no no such pair of shapes"
named free "joint rows no there are no joints"
named jointed "joint rows yes"

echo "| left out | without | with | ratio |"
echo "|---|---|---|---|"
compare "tests and solves of what rests" resting solved
compare "friction rows" smooth rough
compare "contacts (no contact occurs)" apart side-by-side
compare "general shapes (only spheres)" balls capsules
compare "joints" free jointed
