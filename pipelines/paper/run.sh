#!/usr/bin/env bash
# The paper from 390 recordings: films them, processes them, simulates rings and chain, draws every figure with all of them, and sets
# the published numbers beside those found. What an earlier start has filmed and tracked is kept, so it may be started again.
#
#   pipelines/paper/run.sh OUT [--quick]
#
# --quick makes the chain 12 bodies long and takes one trial of each view: another experiment, to see the whole way in a minute or two.
# The command is `chainwave`, or what CHAINWAVE_COMMAND names.
set -euo pipefail

if [ $# -lt 1 ] || [ $# -gt 2 ] || [ "${2:---quick}" != --quick ]; then
  sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "$0" >&2
  exit 2
fi
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
quick=${2:-}
chainwave=${CHAINWAVE_COMMAND:-chainwave}
mkdir -p "$1"
out=$(cd "$1" && pwd)
mkdir -p "$out/plan" "$out/models" "$out/laws"
strikes='2.73 1.89 0.83'

n_steps=7 n_done=0
step() { # title, command...
  local start=$SECONDS
  n_done=$((n_done + 1))
  printf '[%d/%d] %s\n' "$n_done" "$n_steps" "$1"
  "${@:2}"
  printf '[%d/%d] %s: %d s\n' "$n_done" "$n_steps" "$1" $((SECONDS - start))
}

# A file of this folder with some of its values changed, put into the plan; an unchanged one keeps its time.
planned() { # name, new name, key = value...
  local change edits=()
  for change in "${@:3}"; do
    edits+=(-e "s|^${change%% =*} = .*|$change|")
  done
  sed "${edits[@]}" -e '' "$here/$1" > "$out/plan/$2.new"
  if cmp -s "$out/plan/$2.new" "$out/plan/$2"; then rm "$out/plan/$2.new"; else mv "$out/plan/$2.new" "$out/plan/$2"; fi
}

short=() film=() study=() until=()
rings_long=('n_bodies = 300' 'duration_s = 0.15')
chain_long=('n_bodies = 300' 'duration_s = 0.18' 'output_interval_s = 1e-3')
if [ -n "$quick" ]; then
  short=('n_bodies = 12')
  film=('n_frames = 250' 'profile_times_s = [2.73e-3, 6.78e-3]')
  study=('energy_gap = 50')
  rings_long=('n_bodies = 60' 'duration_s = 0.03')
  chain_long=('n_bodies = 60' 'duration_s = 0.04' 'output_interval_s = 1e-3')
  until=('duration_s = 0.0081')
fi

plan() {
  planned experiment.toml experiment.toml "${short[@]}" "${film[@]}"
  planned trials.csv trials.csv
  planned paper.toml paper.toml "${study[@]}"
  planned compression.toml compression.toml
  planned long-rings.toml long-rings.toml "${rings_long[@]}"
  if [ -n "$quick" ]; then
    sed -i -E '2,${/_view(0[1-9]|1[0-2])_trial1\./!d}' "$out/plan/trials.csv"
    # Times that the short run reaches, in the section of the long chain.
    sed -i -e '/^\[long_chain\]/,/^$/s|^profile_times_s.*|profile_times_s = [0.005, 0.010, 0.015, 0.020, 0.025]|' \
      -e '/^\[long_chain\]/,/^$/s|^pulse_times_s.*|pulse_times_s = [1.7e-3, 3.9e-3, 15e-3]|' \
      -e '1,/^\[/s|^profile_times_s.*|profile_times_s = [2.73e-3, 6.78e-3]|' "$out/plan/paper.toml"
  fi
}

one_ring() {
  "$chainwave" simulate "$out/plan/compression.toml" --out "$out/models/compression.csv"
  "$chainwave" contact "$out/models/compression.csv" --out "$out/models/contact.toml"
}

short_chains() {
  local strike
  for strike in $strikes; do
    planned rings.toml "rings-$strike.toml" "${short[@]}" "${until[@]}" "velocity_m_per_s = $strike"
    "$chainwave" simulate "$out/plan/rings-$strike.toml" --out "$out/models/rings-$strike.parquet"
    planned chain.toml "chain-$strike.toml" "${short[@]}" "${until[@]}" \
      "file = \"../results/striker-$strike-m-per-s/motion.parquet\""
    "$chainwave" simulate "$out/plan/chain-$strike.toml" --out "$out/models/chain-$strike.parquet"
  done
}

long_rings() {
  "$chainwave" simulate "$out/plan/long-rings.toml" --out "$out/models/long-rings.parquet" \
    --summary "$out/models/long-rings.json"
}

# Each law on the short chain for the group velocity, on the long one for the peak energies, with and without damping.
laws() {
  local folder a delta_0_m p law name
  while IFS=, read -r folder a delta_0_m p; do
    law=("a = $a" "delta_0_m = $delta_0_m" "p = $p")
    name=${folder#laws/}
    mkdir -p "$out/$folder"
    planned struck-chain.toml "scan-$name.toml" "${law[@]}" "${short[@]}"
    "$chainwave" simulate "$out/plan/scan-$name.toml" --out "$out/$folder/scan.parquet" \
      --scan 0.01,0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.83,1,1.2,1.4,1.6,1.89,2.1,2.3,2.5,2.73,3,3.3,3.6
    planned struck-chain.toml "damped-$name.toml" "${law[@]}" "${chain_long[@]}"
    "$chainwave" simulate "$out/plan/damped-$name.toml" --out "$out/$folder/damped.parquet" \
      --summary "$out/$folder/damped.json"
    planned struck-chain.toml "undamped-$name.toml" "${law[@]}" "${chain_long[@]}" 'damping_kg_per_s = 0.0'
    "$chainwave" simulate "$out/plan/undamped-$name.toml" --out "$out/$folder/undamped.parquet" \
      --summary "$out/$folder/undamped.json"
  done < <(tail -n +2 "$here/laws.csv")
}

plan
step 'the contact law of one ring' one_ring
step 'film' "$chainwave" synthesize "$out/plan/experiment.toml" --out "$out/recordings"
step 'process' "$chainwave" run "$out/recordings/experiment.toml" --out "$out/results"
step 'rings and chain, short' short_chains
step 'rings, long' long_rings
step 'laws of the chain' laws
step 'figures and numbers' "$chainwave" compare "$out/plan/paper.toml" --from "$out" --out "$out/paper"
printf 'figures and comparison.md in %s\n' "$out/paper"
