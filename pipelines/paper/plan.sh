#!/usr/bin/env bash
# Writes what the study's commands read into OUT/plan: the files of this folder, with the values that each strike, law and length asks
# for. A file that stays as it is keeps its time, so nothing is made anew for it.
#
#   pipelines/paper/plan.sh OUT [--quick]
set -euo pipefail

if [ $# -lt 1 ] || [ $# -gt 2 ] || [ "${2:---quick}" != --quick ]; then
  sed -n '2,/^set/{/^#/s/^# \{0,1\}//p}' "$0" >&2
  exit 2
fi
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
quick=${2:-}
mkdir -p "$1/plan"
plan=$(cd "$1/plan" && pwd)

# A file of this folder with some of its values changed, and with edits of its own.
planned() { # name, new name, key = value...
  local change edits=()
  for change in "${@:3}"; do
    edits+=(-e "s|^${change%% =*} = .*|$change|")
  done
  sed -E "${edits[@]}" "${special[@]}" -e '' "$here/$1" > "$plan/$2.new"
  if cmp -s "$plan/$2.new" "$plan/$2"; then rm "$plan/$2.new"; else mv "$plan/$2.new" "$plan/$2"; fi
}

short=() film=() study=() until=() special=() of_trials=() of_study=()
rings_long=('n_bodies = 300' 'duration_s = 0.15')
chain_long=('n_bodies = 300' 'duration_s = 0.18' 'output_interval_s = 1e-3')
if [ -n "$quick" ]; then
  short=('n_bodies = 12')
  film=('n_frames = 250' 'profile_times_s = [2.73e-3, 6.78e-3]')
  study=('energy_gap = 50')
  rings_long=('n_bodies = 60' 'duration_s = 0.03')
  chain_long=('n_bodies = 60' 'duration_s = 0.04' 'output_interval_s = 1e-3')
  until=('duration_s = 0.0081')
  of_trials=(-e '2,${/_view(0[1-9]|1[0-2])_trial1\./!d}')
  # Times that the short runs reach, at the top and in the section of the long chain.
  of_study=(-e '/^\[long_chain\]/,/^$/s|^profile_times_s.*|profile_times_s = [0.005, 0.010, 0.015, 0.020, 0.025]|'
    -e '/^\[long_chain\]/,/^$/s|^pulse_times_s.*|pulse_times_s = [1.7e-3, 3.9e-3, 15e-3]|'
    -e '1,/^\[/s|^profile_times_s.*|profile_times_s = [2.73e-3, 6.78e-3]|')
fi

planned experiment.toml experiment.toml "${short[@]}" "${film[@]}"
special=("${of_trials[@]}")
planned trials.csv trials.csv
special=("${of_study[@]}")
planned paper.toml paper.toml "${study[@]}"
special=()
planned compression.toml compression.toml
planned modes.toml modes.toml
planned long-rings.toml long-rings.toml "${rings_long[@]}"
for strike in 2.73 1.89 0.83; do
  planned rings.toml "rings-$strike.toml" "${short[@]}" "${until[@]}" "velocity_m_per_s = $strike"
  planned chain.toml "chain-$strike.toml" "${short[@]}" "${until[@]}" \
    "file = \"../results/striker-$strike-m-per-s/motion.parquet\""
done
# Each law on the short chain for the group velocity, on the long one for the peak energies, with and without damping.
while IFS=, read -r folder a delta_0_m p; do
  law=("a = $a" "delta_0_m = $delta_0_m" "p = $p")
  name=${folder#laws/}
  planned struck-chain.toml "scan-$name.toml" "${law[@]}" "${short[@]}"
  planned struck-chain.toml "damped-$name.toml" "${law[@]}" "${chain_long[@]}"
  planned struck-chain.toml "undamped-$name.toml" "${law[@]}" "${chain_long[@]}" 'damping_kg_per_s = 0.0'
done < <(tail -n +2 "$here/laws.csv")
