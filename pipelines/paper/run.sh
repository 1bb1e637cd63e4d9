#!/usr/bin/env bash
# The paper from 390 recordings: films them, processes them, simulates rings and chain, draws every figure with all of them, and sets
# the published numbers beside those found. What an earlier start has filmed and tracked is kept, so it may be started again.
#
#   pipelines/paper/run.sh OUT [--quick]
#
# --quick makes the chain 12 bodies long and takes one trial of each view: another experiment, to see the whole way in a minute or two.
# The command is `chainwave`, or what CHAINWAVE_COMMAND names. On a cluster: see workflow/Snakefile.
set -euo pipefail

if [ $# -lt 1 ] || [ $# -gt 2 ] || [ "${2:---quick}" != --quick ]; then
  sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "$0" >&2
  exit 2
fi
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
chainwave=${CHAINWAVE_COMMAND:-chainwave}
mkdir -p "$1"
out=$(cd "$1" && pwd)
mkdir -p "$out/models" "$out/laws"

n_steps=7 n_done=0
step() { # title, command...
  local start=$SECONDS
  n_done=$((n_done + 1))
  printf '[%d/%d] %s\n' "$n_done" "$n_steps" "$1"
  "${@:2}"
  printf '[%d/%d] %s: %d s\n' "$n_done" "$n_steps" "$1" $((SECONDS - start))
}

one_ring() {
  "$chainwave" simulate "$out/plan/compression.toml" --out "$out/models/compression.csv"
  "$chainwave" simulate "$out/plan/modes.toml" --out "$out/models/modes.csv"
  "$chainwave" contact "$out/models/compression.csv" --out "$out/models/contact.toml"
}

short_chains() {
  local strike
  for strike in 2.73 1.89 0.83; do
    "$chainwave" simulate "$out/plan/rings-$strike.toml" --out "$out/models/rings-$strike.parquet"
    "$chainwave" simulate "$out/plan/chain-$strike.toml" --out "$out/models/chain-$strike.parquet"
  done
}

long_rings() {
  "$chainwave" simulate "$out/plan/long-rings.toml" --out "$out/models/long-rings.parquet" \
    --summary "$out/models/long-rings.json"
}

laws() {
  local folder rest name damping
  while IFS=, read -r folder rest; do
    name=${folder#laws/}
    mkdir -p "$out/$folder"
    "$chainwave" simulate "$out/plan/scan-$name.toml" --out "$out/$folder/scan.parquet" \
      --scan "$(cat "$here/scan.txt")"
    for damping in damped undamped; do
      "$chainwave" simulate "$out/plan/$damping-$name.toml" --out "$out/$folder/$damping.parquet" \
        --summary "$out/$folder/$damping.json"
    done
  done < <(tail -n +2 "$here/laws.csv")
}

"$here/plan.sh" "$out" ${2:+"$2"}
step 'the contact law of one ring' one_ring
step 'film' "$chainwave" synthesize "$out/plan/experiment.toml" --out "$out/recordings"
step 'process' "$chainwave" run "$out/recordings/experiment.toml" --out "$out/results" --dataset "$out/results/tracks"
step 'rings and chain, short' short_chains
step 'rings, long' long_rings
step 'laws of the chain' laws
step 'figures and numbers' "$chainwave" compare "$out/plan/paper.toml" --from "$out" --out "$out/paper"
printf 'figures and comparison.md in %s\n' "$out/paper"
