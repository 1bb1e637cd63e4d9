#!/bin/sh
# Films the experiment and evaluates it: run.sh FOLDER; `chainwave` is on the path, or in $CHAINWAVE.
set -eu
here=$(dirname "$0")
out=${1:?expected a folder for recordings and results}
chainwave=${CHAINWAVE:-chainwave}
"$chainwave" synthesize "$here/experiment.toml" --out "$out/recordings"
"$chainwave" run "$out/recordings/experiment.toml" --out "$out/results"
