#!/bin/sh
# Films both chains and evaluates them: run.sh FOLDER; `chainwave` is on the path, or in $CHAINWAVE.
set -eu
here=$(dirname "$0")
out=${1:?expected a folder for recordings and results}
chainwave=${CHAINWAVE:-chainwave}
for chain in stiffer softer; do
  "$chainwave" synthesize "$here/$chain.toml" --out "$out/$chain/recordings"
  "$chainwave" run "$out/$chain/recordings/experiment.toml" --out "$out/$chain/results"
done
