#!/bin/sh
# Makes the proof records of all shipped designs with lpv, checks them without it, and shows that edited records are refused.
#
#     validation/checker/run.sh [LPV]           the program [default: target/release/lpv]
#     PYTHON=python3.11 OUT=folder …            needs python-flint (requirements.txt)
set -eu
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
lpv=$(realpath "${1:-$root/target/release/lpv}")
python=${PYTHON:-python3}
out=${OUT:-$root/out/checker}
mkdir -p "$out"
cd "$out"

record() { # name, design
    rm -f "$1.jsonl"
    # 4: a claim of the design is not proved; those that are, are recorded
    "$lpv" certify "$2" --record "$1.jsonl" > "$1.txt" || test $? -eq 4
    test -s "$1.jsonl"
    echo "$1: $(wc -c < "$1.jsonl") bytes"
    "$python" "$here/check.py" "$1.jsonl" --design "$2" | tail -n 1
}

for scenario in double-integrator quadrotor quadrotor-governed; do
    "$lpv" run "$root/scenarios/$scenario.toml" --out "$scenario" --force > "$scenario.txt"
    for design in "$scenario"/design-*.json; do
        name=$(basename "$design" .json)
        case "$scenario/$name" in
            # the same design again, for an estimator
            quadrotor/design-high-gain-20-ekf) continue ;;
        esac
        record "$scenario-${name#design-}" "$design"
    done
done
for problem in double-integrator pendulum quadrotor-arc two-masses; do
    "$lpv" design "$root/problems/$problem.toml" --out "problem-$problem.json" --force > "problem-$problem.txt"
    record "problem-$problem" "problem-$problem.json"
done
# the smaller records, of every kind that there is
"$python" "$here/edits.py" double-integrator-high-gain-60.jsonl=double-integrator/design-high-gain-60.json \
    quadrotor-lpvqr-unbounded.jsonl=quadrotor/design-lpvqr-unbounded.json \
    quadrotor-lpvqr.jsonl=quadrotor/design-lpvqr.json quadrotor-slpvqr-1.jsonl=quadrotor/design-slpvqr-1.json \
    quadrotor-high-gain-20-rate.jsonl=quadrotor/design-high-gain-20-rate.json \
    quadrotor-governed-moving.jsonl=quadrotor-governed/design-moving.json \
    problem-pendulum.jsonl=problem-pendulum.json problem-two-masses.jsonl=problem-two-masses.json
