#!/bin/sh
# Makes the proof records of all shipped designs with lpv, checks them without it, and shows that edited records are refused.
#
#     validation/checker/run.sh [LPV]           the program [default: target/release/lpv]
#     PYTHON=python3.11 OUT=folder …            needs python-flint (requirements.txt)
#     RUNS=folder …                             where scenarios were run with this program already
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
lpv=$(realpath "${1:-$root/target/release/lpv}")
python=${PYTHON:-python3}
out=${OUT:-$root/out/checker}
mkdir -p "$out"
cd "$out"

# Scenarios, unless RUNS is a folder in which they were run.
cat > scenario.sh <<'END'
set -eu
if test -d "$3/$4"; then
    rm -rf "$4" && cp -r "$3/$4" "$4"
else
    "$1" run "$2/scenarios/$4.toml" --out "$4" --force > "$4.txt"
fi
END
scenarios="double-integrator quadrotor quadrotor-governed"
printf '%s\n' $scenarios | xargs -P "$(nproc)" -n 1 sh scenario.sh "$lpv" "$root" "${RUNS:-none}"
for scenario in $scenarios; do
    for design in "$scenario"/design-*.json; do
        name=$(basename "$design" .json)
        # the same design again, for an estimator, is left out
        test "$scenario/$name" = quadrotor/design-high-gain-20-ekf || echo "$scenario-${name#design-} $design"
    done
done > designs.txt
for problem in double-integrator pendulum quadrotor-arc two-masses; do
    "$lpv" design "$root/problems/$problem.toml" --out "problem-$problem.json" --force > "problem-$problem.txt"
    echo "problem-$problem problem-$problem.json"
done >> designs.txt

# One record with its design, on every core. 4: a claim of the design is not proved; those that are, are recorded.
cat > record.sh <<'END'
set -eu
rm -f "$4.jsonl"
"$1" certify "$5" --record "$4.jsonl" > "$4.txt" || test $? -eq 4
test -s "$4.jsonl"
checked=$("$2" "$3/check.py" "$4.jsonl" --design "$5") || { echo "$4: $checked"; exit 1; }
echo "$4: $(wc -c < "$4.jsonl") bytes, $(echo "$checked" | tail -n 1)"
END
xargs -P "$(nproc)" -L 1 sh record.sh "$lpv" "$python" "$here" < designs.txt

# the smaller records, of every kind that there is
"$python" "$here/edits.py" double-integrator-high-gain-60.jsonl=double-integrator/design-high-gain-60.json \
    quadrotor-lpvqr-unbounded.jsonl=quadrotor/design-lpvqr-unbounded.json \
    quadrotor-lpvqr.jsonl=quadrotor/design-lpvqr.json quadrotor-slpvqr-1.jsonl=quadrotor/design-slpvqr-1.json \
    quadrotor-high-gain-20-rate.jsonl=quadrotor/design-high-gain-20-rate.json \
    quadrotor-governed-moving.jsonl=quadrotor-governed/design-moving.json \
    problem-pendulum.jsonl=problem-pendulum.json problem-two-masses.jsonl=problem-two-masses.json
