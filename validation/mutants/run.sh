#!/usr/bin/env bash
# Does the soundness suite find defects of the prover? Each defect of crates/lpv/src/mutant.rs is switched on by itself, and the suite runs
# until something disagrees. Last line: "caught n of n"; exit code 1 if one is not.
#
#   validation/mutants/run.sh            # all
#   validation/mutants/run.sh rate-      # those whose name begins so
#   SHARE=1 validation/mutants/run.sh    # with all cases of the suite instead of a share
set -euo pipefail
cd "$(dirname "$0")/../.."

cargo test -q -p lpv --locked --features mutants --test soundness --no-run
suite=$(cargo test -p lpv --locked --features mutants --test soundness --no-run 2>&1 | sed -n 's/.*Executable .*(\(.*\))/\1/p')
names=$("$suite" --mutants)
log=$(mktemp)
trap 'rm -f "$log"' EXIT
started=$SECONDS caught=0 count=0
while IFS=$'\t' read -r name what; do
  [[ $name == "${1:-}"* ]] || continue
  count=$((count + 1))
  LPV_MUTANT=$name SOUNDNESS_SHARE=${SHARE:-0.5} "$suite" >"$log" 2>&1 || true
  # an end of another kind is none
  by=$(sed -n 's/.*SOUNDNESS_REPLAY=\([^ ]*\).*/\1/p' "$log" | head -1)
  if [[ -n $by ]]; then
    caught=$((caught + 1))
    printf 'caught  %-24s %-16s %s\n' "$name" "$by" "$what"
  else
    printf 'MISSED  %-24s %-16s %s\n' "$name" "" "$what"
  fi
done <<<"$names"
echo "caught $caught of $count ($((SECONDS - started)) s)"
[[ $caught == "$count" ]]
